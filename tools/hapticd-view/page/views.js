// SPDX-License-Identifier: Apache-2.0
// The named views of the picture.

import { add, dot, norm, rotate, scale, subtract, unit } from './vectors.js';

const kUp = [0, 1, 0];
const kNoRotation = [1, 0, 0, 0, 1, 0, 0, 0, 1];
/** The overview shows what is at most so much farther away than the nearest points: a far wall would make it small. */
const kDeepest = 2.2;
const kNearest = 0.02;
/** So many of these points are in it: a few stray ones count for nothing. */
const kShown = 0.95;
/** The overview leaves a margin for what stands over the picture's edges. */
const kMargin = 1.12;

/** The least distance from `target`, looking along `forward`, from which `share` of the points are in the view. */
function distanceFor(orbit, target, points, share) {
  const needed = points.map((point) => {
    const offset = subtract(point, target);
    const side = Math.abs(dot(offset, orbit.right)) / (orbit.width / 2);
    const height = Math.abs(dot(offset, orbit.up)) / (orbit.height / 2);
    return kMargin * Math.max(side, height) * orbit.focalPx - dot(offset, orbit.forward);
  });
  needed.sort((a, b) => a - b);
  return needed[Math.min(Math.floor(share * needed.length), needed.length - 1)];
}

/** The middle of what most points span across the line of sight, at their median distance. */
function middleOf(orbit, points) {
  const along = (axis) => points.map((point) => dot(point, axis)).sort((a, b) => a - b);
  const quantile = (sorted, share) => sorted[Math.floor(share * (sorted.length - 1))];
  const centre = (axis) => {
    const sorted = along(axis);
    return (quantile(sorted, 0.03) + quantile(sorted, 0.97)) / 2;
  };
  const ahead = quantile(along(orbit.forward), 0.5);
  return add(scale(orbit.right, centre(orbit.right)), add(scale(orbit.up, centre(orbit.up)), scale(orbit.forward, ahead)));
}

function nearPoints(frame, limitsM) {
  const samples = frame.samples().filter(({ z }) => z >= limitsM[0] && z <= limitsM[1]).sort((a, b) => a.z - b.z);
  const nearestM = samples[Math.floor(kNearest * samples.length)]?.z ?? 0;
  return samples.filter(({ z }) => z <= kDeepest * nearestM).map(({ world }) => world);
}

/** `scene` has the depth frame or null, the HIP or null, the limits of depth, and the distance of what is seen. */
export const kViews = {
  /** As the camera sees it, with all of its image. */
  camera: (orbit, { frame, distanceM }) => {
    if (!frame) return;
    const { width, height, fx, fy, cx, cy } = frame;
    orbit.setLens([Math.max(cx + 0.5, width - 0.5 - cx) / fx, Math.max(cy + 0.5, height - 0.5 - cy) / fy]);
    orbit.lookAlong(frame.position, rotate(frame.rotation, [0, 0, -1]), rotate(frame.rotation, [0, 1, 0]), distanceM);
  },
  hand: (orbit, { frame, hip }) => {
    if (!hip) return;
    orbit.setLens();
    // over the shoulder of somebody who stands beside the camera
    const forward = unit(rotate(frame?.rotation ?? kNoRotation, [-0.55, -0.45, -1]));
    orbit.lookAlong(subtract(hip, scale(forward, 0.5)), forward, kUp, 0.5);
  },
  above: (orbit, { frame, distanceM }) => {
    orbit.setLens();
    const ahead = rotate(frame?.rotation ?? kNoRotation, [0, 0, -1]);
    const middle = add(frame?.position ?? [0, 0, 0], scale(ahead, distanceM));
    const heading = norm([ahead[0], 0, ahead[2]]) > 1e-3 ? [ahead[0], 0, ahead[2]] : [0, 0, -1];
    const heightM = 1.1 * distanceM;
    orbit.lookAlong(add(middle, [0, heightM, 0]), [0, -1, 0], unit(heading), heightM);
  },
  /** What the camera sees near it, and the hand, from beside the camera. */
  overview: (orbit, { frame, hip, limitsM, distanceM }) => {
    orbit.setLens();
    const forward = unit(rotate(frame?.rotation ?? kNoRotation, [-0.42, -0.25, -1]));
    const points = frame ? nearPoints(frame, limitsM) : [];
    orbit.lookAlong([0, 0, 0], forward, kUp, 1);
    const hasPoints = points.length > 0;
    const target = hasPoints ? middleOf(orbit, points) : hip ?? scale(forward, distanceM);
    const forAll = hasPoints ? distanceFor(orbit, target, points, kShown) : distanceM;
    const forHand = hip ? distanceFor(orbit, target, [hip], 1) : 0;
    const fromM = Math.max(forAll, forHand);
    orbit.lookAlong(subtract(target, scale(forward, fromM)), forward, kUp, fromM);
  },
};

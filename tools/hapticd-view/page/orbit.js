// SPDX-License-Identifier: Apache-2.0
// The eye of the view: it looks at a target from a distance, up is the world's +y. Mouse, touch and keyboard move it.

import { add, cross, dot, multiply, norm, perspective, rotate, scale, subtract, unit, viewOf } from './vectors.js';

const kUp = [0, 1, 0];
const kSteepestRad = Math.PI / 2 - 1e-4;
const kNearestM = 0.05;
const kFarthestM = 30;
const kClipNearM = 0.01;
const kClipFarM = 60;
/** The image of a depth camera of this angle fits into the view whatever the window's shape. */
const kVerticalAngleRad = (46 * Math.PI) / 180;
const kHorizontalAngleRad = (59 * Math.PI) / 180;

export class Orbit {
  constructor() {
    this.target = [0, 0, -1];
    this.yawRad = 0.55;
    this.pitchRad = -0.35;
    this.rollRad = 0;
    this.distanceM = 1.6;
    this.resize(1, 1);
  }

  /** Size of the view in CSS pixels. */
  resize(width, height) {
    this.width = Math.max(width, 1);
    this.height = Math.max(height, 1);
    const forWidth = 2 * Math.atan((Math.tan(kHorizontalAngleRad / 2) * this.height) / this.width);
    this.verticalAngleRad = Math.min(Math.max(kVerticalAngleRad, forWidth), 2.4);
    /** Pixels by which something is large that is 1 m large at 1 m. */
    this.focalPx = this.height / 2 / Math.tan(this.verticalAngleRad / 2);
    this.update();
  }

  update() {
    const forward = [
      -Math.sin(this.yawRad) * Math.cos(this.pitchRad),
      Math.sin(this.pitchRad),
      -Math.cos(this.yawRad) * Math.cos(this.pitchRad),
    ];
    const level = [Math.cos(this.yawRad), 0, -Math.sin(this.yawRad)];
    const upright = cross(level, forward);
    const c = Math.cos(this.rollRad);
    const s = Math.sin(this.rollRad);
    this.forward = forward;
    this.right = add(scale(level, c), scale(upright, s));
    this.up = subtract(scale(upright, c), scale(level, s));
    this.eye = subtract(this.target, scale(forward, this.distanceM));
    const view = viewOf(this.eye, this.right, this.up, scale(forward, -1));
    this.worldToClip = multiply(
      perspective(this.verticalAngleRad, this.width / this.height, kClipNearM, kClipFarM), view);
  }

  /** Looks from `eye` along `forward`, at what is `distanceM` away; `up` is what is upwards in the picture. */
  lookAlong(eye, forward, up, distanceM) {
    const ahead = unit(forward, [0, 0, -1]);
    this.distanceM = Math.min(Math.max(distanceM, kNearestM), kFarthestM);
    this.target = add(eye, scale(ahead, this.distanceM));
    this.pitchRad = Math.min(Math.max(Math.asin(ahead[1]), -kSteepestRad), kSteepestRad);
    const level = Math.hypot(ahead[0], ahead[2]) > 1e-3 ? ahead : scale(up, ahead[1] > 0 ? -1 : 1);
    this.yawRad = Math.atan2(-level[0], -level[2]);
    this.rollRad = 0;
    this.update();
    this.rollRad = Math.atan2(-dot(up, this.right), dot(up, this.up));
    this.update();
  }

  turn(yawRad, pitchRad) {
    this.yawRad += yawRad;
    this.pitchRad = Math.min(Math.max(this.pitchRad + pitchRad, -kSteepestRad), kSteepestRad);
    this.rollRad = 0;
    this.update();
  }

  /** Moves what is at the target by so many pixels. */
  pan(xPx, yPx) {
    const metresPerPx = this.distanceM / this.focalPx;
    this.target = add(this.target, add(scale(this.right, -xPx * metresPerPx), scale(this.up, yPx * metresPerPx)));
    this.update();
  }

  zoom(factor) {
    this.distanceM = Math.min(Math.max(this.distanceM / factor, kNearestM), kFarthestM);
    this.update();
  }

  /** Where a point of the world is in the view, CSS pixels from its upper left corner; null behind the eye. */
  project(point) {
    const offset = subtract(point, this.eye);
    const depth = dot(offset, this.forward);
    if (depth < kClipNearM) return null;
    return {
      x: this.width / 2 + (this.focalPx * dot(offset, this.right)) / depth,
      y: this.height / 2 - (this.focalPx * dot(offset, this.up)) / depth,
      depth,
    };
  }

  /** The direction in the world in which a place of the view lies. */
  rayThrough(xPx, yPx) {
    const x = (xPx - this.width / 2) / this.focalPx;
    const y = (this.height / 2 - yPx) / this.focalPx;
    return unit(add(this.forward, add(scale(this.right, x), scale(this.up, y))));
  }
}

/** The named views. `scene` has the depth frame or null, the HIP or null, and the distance of what is seen. */
export const kViews = {
  camera: (orbit, { frame, distanceM }) => {
    if (!frame) return;
    orbit.lookAlong(frame.position, rotate(frame.rotation, [0, 0, -1]), rotate(frame.rotation, [0, 1, 0]), distanceM);
  },
  hand: (orbit, { frame, hip }) => {
    if (!hip) return;
    // over the shoulder of somebody who stands beside the camera
    const axes = frame ? frame.rotation : [1, 0, 0, 0, 1, 0, 0, 0, 1];
    const forward = unit(rotate(axes, [-0.55, -0.45, -1]));
    orbit.lookAlong(subtract(hip, scale(forward, 0.5)), forward, kUp, 0.5);
  },
  above: (orbit, { frame, distanceM }) => {
    const axes = frame ? frame.rotation : [1, 0, 0, 0, 1, 0, 0, 0, 1];
    const ahead = rotate(axes, [0, 0, -1]);
    const origin = frame ? frame.position : [0, 0, 0];
    const middle = add(origin, scale(ahead, distanceM));
    const heading = norm([ahead[0], 0, ahead[2]]) > 1e-3 ? [ahead[0], 0, ahead[2]] : [0, 0, -1];
    const heightM = 1.1 * distanceM;
    orbit.lookAlong(add(middle, [0, heightM, 0]), [0, -1, 0], unit(heading), heightM);
  },
  overview: (orbit, { frame, hip, distanceM }) => {
    const axes = frame ? frame.rotation : [1, 0, 0, 0, 1, 0, 0, 0, 1];
    const origin = frame ? frame.position : [0, 0, 0];
    const middle = add(origin, rotate(axes, [0, 0, -0.92 * distanceM]));
    // between the hand and what the camera sees, so that both are in the picture
    const target = hip ? add(scale(middle, 0.4), scale(hip, 0.6)) : middle;
    const forward = unit(rotate(axes, [-0.8, -0.42, -1]));
    const from = 0.72 * distanceM;
    orbit.lookAlong(subtract(target, scale(forward, from)), forward, kUp, from);
  },
};

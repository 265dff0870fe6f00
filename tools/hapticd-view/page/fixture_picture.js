// SPDX-License-Identifier: Apache-2.0
// How fixtures and tissue regions are drawn: bright in contact, faint while disabled, each with its name.

import { arrowsOn, coneEnd, kPlaneHalfM, middleOf, outlineOf } from './fixtures.js';
import { add, perpendiculars, scale, subtract } from './vectors.js';

const kKnotM = 0.006;
const kPlaneThicknessM = 0.0005;
const kArrows = 6;
const kArrowM = 0.02;
const kPathPx = 4;
/** A line of a preview has so many dashes and gaps; the lines of a circle are the dashes themselves. */
const kDashes = 12;
/** What lies behind the hand on a path is drawn with this share of its opacity. */
const kPassedShare = 0.35;

/** What is there, and what a person is about to add. */
const allOf = ({ additions, preview }) => (preview ? [...additions, preview] : additions);

/** A strip of lines as dashes. */
function addDashes(lines, points, colour) {
  for (let i = 1; i < points.length; i++) {
    const dashes = points.length > kDashes ? 1 : kDashes;
    const at = (share) => add(points[i - 1], scale(subtract(points[i], points[i - 1]), share));
    for (let dash = i % 2 && dashes === 1 ? 1 : 0; dash < dashes; dash += 2) lines.add(at(dash / dashes), at((dash + 1) / dashes), colour);
  }
}

/** Outlines and names. `picture` has scene, orbit, lines and labels. */
export function addOutlines({ scene, orbit, lines, labels }) {
  const { theme } = scene;
  for (const { name, group, shape, enabled, inContact } of allOf(scene)) {
    if (!shape) continue;
    const alpha = inContact ? 1 : enabled ? 0.55 : 0.15;
    for (const line of group === 'preview' ? outlineOf(shape, orbit.eye) : []) addDashes(lines, line, [...theme[group], 0.9]);
    if (group !== 'preview' && shape.kind !== 'path') {
      for (const line of outlineOf(shape, orbit.eye)) lines.addStrip(line, [...theme[group], alpha]);
    }
    const at = middleOf(shape) ?? scene.proxy ?? scene.hip;
    if (at) labels.put(`${group}-${name}`, at, name, `fixture ${group}`);
  }
}

export function drawFixtures(picture) {
  const { scene, solids, orbit } = picture;
  const { fixtureProxy, radii, theme } = scene;
  const all = allOf(scene);
  for (const entry of all) {
    if (entry.shape?.kind === 'standoff') drawStandoff(picture, entry);
  }
  solids.begin(orbit);
  for (const entry of all) {
    if (entry.shape) drawShape(picture, entry);
  }
  if (fixtureProxy) {
    solids.drawSphere(fixtureProxy, radii.proxyM, { colour: theme.forbidden, alpha: 0.55, rim: 0.45, shade: 0.35 });
  }
  for (const entry of scene.additions) {
    if (entry.shape?.kind === 'path') drawPath(picture, entry);
  }
}

function drawStandoff({ scene, surface, orbit, pixelRatio }, { shape, group, enabled, inContact }) {
  const alpha = (inContact ? 0.4 : 0.25) * (enabled ? 1 : 0.3);
  surface.drawShell(orbit, pixelRatio, { clearanceM: shape.clearanceM, colour: scene.theme[group], alpha });
}

function drawShape({ scene, solids }, { shape, group, enabled, inContact }) {
  const colour = scene.theme[group];
  const alpha = (inContact ? 0.3 : 0.16) * (enabled ? 1 : 0.3);
  const look = { colour, alpha, rim: 0.3 * alpha, shade: 0.3, throughCloud: false };
  switch (shape.kind) {
    case 'sphere': solids.drawSphere(shape.at, shape.radiusM, look); break;
    case 'box': solids.drawBox(shape.at, shape.half, shape.axes, look); break;
    case 'capsule': solids.drawCapsule(shape.at, shape.end, shape.radiusM, look); break;
    case 'plane': solids.drawBox(
      shape.at, [kPlaneHalfM, kPlaneHalfM, kPlaneThicknessM], [...perpendiculars(shape.axis), shape.axis], look);
      break;
    case 'cone': {
      const { centre, radiusM } = coneEnd(shape);
      solids.drawCone(shape.at, centre, radiusM, look);
      break;
    }
    // what leads the hand is small: opaque, so that it is seen
    case 'point': solids.drawSphere(shape.at, kKnotM, { colour, alpha: enabled ? 0.9 : 0.3, shade: 0.3 }); break;
    default:
  }
}

/** On top of everything: what lies ahead brightly, what is passed faintly, arrowheads, and where the hand is on it. */
function drawPath({ scene, solids, lines, orbit, pixelRatio }, { shape, group, enabled, progress }) {
  const colour = scene.theme[group];
  const alpha = enabled ? 0.95 : 0.3;
  const { points } = shape;
  const split = progress ? progress.index + 1 : 0;
  const passed = progress ? [...points.slice(0, split), progress.point] : [];
  const ahead = progress ? [progress.point, ...points.slice(split)] : points;
  lines.addStrip(passed, [...colour, kPassedShare * alpha]);
  lines.addStrip(ahead, [...colour, alpha]);
  lines.draw(orbit, pixelRatio, kPathPx, true);
  solids.begin(orbit);
  const look = { colour, alpha, shade: 0.3 };
  for (const { at, along } of arrowsOn(points, kArrows)) {
    solids.drawCone(add(at, scale(along, kArrowM / 2)), add(at, scale(along, -kArrowM / 2)), 0.4 * kArrowM, look);
  }
  if (progress && enabled) solids.drawSphere(progress.point, kKnotM, look);
}

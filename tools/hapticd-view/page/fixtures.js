// SPDX-License-Identifier: Apache-2.0
// What people add to the scene: shapes of virtual fixtures and tissue regions, in the world frame, and how far away
// they are.

import { add, dot, norm, perpendiculars, rotate, rotationOfQuaternion, scale, subtract, unit } from './vectors.js';

const kRadPerDeg = Math.PI / 180;
/** A cone has no end: so much of it is drawn. */
const kConeM = 0.15;

/** Roll, pitch and yaw about the fixed axes, in this order, as a rotation row by row. */
function rotationOf([rollDeg, pitchDeg, yawDeg]) {
  const [cx, cy, cz] = [rollDeg, pitchDeg, yawDeg].map((deg) => Math.cos(deg * kRadPerDeg));
  const [sx, sy, sz] = [rollDeg, pitchDeg, yawDeg].map((deg) => Math.sin(deg * kRadPerDeg));
  return [
    cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx,
    sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx,
    -sy, cy * sx, cy * cx,
  ];
}

export const isGuidance = (kind) => kind === 'path' || kind === 'point';

/** Whether what has this definition moves with a frame whose poses are streamed to the box. */
export const isMoving = ({ frame = 'world' }) => frame !== 'world' && frame !== 'camera';

/** Where the moving frames of a status are: name to {place, turn}. Those without a pose are missing. */
export function framesOf(frames) {
  const placed = new Map();
  for (const { name, state, positionMInWorld, orientationXyzw } of Array.isArray(frames) ? frames : []) {
    const at = positionMInWorld && [positionMInWorld.x, positionMInWorld.y, positionMInWorld.z];
    const isKnown = state !== 'none' && at?.every(Number.isFinite) && orientationXyzw?.length === 4 &&
      orientationXyzw.every(Number.isFinite);
    if (!isKnown) continue;
    const rotation = rotationOfQuaternion(orientationXyzw);
    placed.set(name, { place: (p) => add(rotate(rotation, p), at), turn: (v) => rotate(rotation, v) });
  }
  return placed;
}

/** How places and directions of a definition become those of the world; undefined where that is not known. */
function poseOf(definition, frame, frames) {
  if (isMoving(definition)) return frames?.get(definition.frame);
  if (definition.frame !== 'camera') return { place: (p) => p, turn: (v) => v };
  return frame ? { place: (p) => frame.toWorld(p), turn: (v) => rotate(frame.rotation, v) } : undefined;
}

/** The axes of what `rotation_deg` turns, in the world. */
function axesOf({ rotation_deg }, turn) {
  const r = rotationOf(rotation_deg ?? [0, 0, 0]);
  return [0, 1, 2].map((i) => turn([r[i], r[i + 3], r[i + 6]]));
}

/**
 * The shape of a definition (its members are those of the configuration) in the world: {kind, ...}, or null where it has
 * none that is known: what is fixed to the camera needs a depth frame first, and what moves with a frame a pose of it. A
 * stand-off is wherever the surface is. `frames`: as framesOf() gives them; `solids`: SHA-256 to what GetSolid says of
 * it; `before`: the shape until now, which stays the same object where it is a solid that has not moved.
 */
export function shapeOf(definition, frame, { frames, solids, before } = {}) {
  const pose = poseOf(definition, frame, frames);
  if (!pose) return null;
  const kind = definition.kind ?? definition.shape ?? (definition.label ? 'label' : 'sphere');
  const { place, turn } = pose;
  const at = place(definition.position_m ?? [0, 0, 0]);
  switch (kind) {
    case 'plane': return { kind, at, axis: unit(turn(definition.normal ?? [0, 0, 1])) };
    case 'sphere': return { kind, at, radiusM: definition.radius_m };
    case 'point': return { kind, at };
    case 'standoff': return { kind, clearanceM: definition.clearance_m ?? 0 };
    case 'path': return { kind, points: (definition.points_m ?? []).map(place) };
    case 'capsule': return { kind, at, end: place(definition.end_m ?? [0, 0, 0]), radiusM: definition.radius_m };
    case 'cone': return {
      kind, at, axis: unit(turn(definition.axis ?? [0, 0, 1])), halfAngle: (definition.half_angle_deg ?? 30) * kRadPerDeg,
    };
    case 'box': {
      const half = scale(definition.size_m ?? [0, 0, 0], 0.5);
      return { kind, at, half, axes: axesOf(definition, turn) };
    }
    case 'solid': return solidOf(solids?.[definition.solid]?.outline, at, axesOf(definition, turn), before);
    default: return null;
  }
}

/** A solid with its lines in the world; `outline`: its lines in its own frame, x, y, z, x, ... each. */
function solidOf(outline, at, axes, before) {
  const known = Array.isArray(outline) ? outline : null;
  const pose = [at, ...axes].flat();
  const isSame = before?.kind === 'solid' && before.outline === known && pose.every((value, i) => value === before.pose[i]);
  if (isSame) return before;
  const lines = [];
  const [least, most] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  for (const numbers of known ?? []) {
    const line = [];
    for (let i = 0; i + 2 < numbers.length; i += 3) {
      const point = [0, 1, 2].map((k) => at[k] + numbers[i] * axes[0][k] + numbers[i + 1] * axes[1][k] + numbers[i + 2] * axes[2][k]);
      for (let k = 0; k < 3; k++) {
        least[k] = Math.min(least[k], point[k]);
        most[k] = Math.max(most[k], point[k]);
      }
      line.push(point);
    }
    lines.push(line);
  }
  const middle = lines.length > 0 ? scale(add(least, most), 0.5) : at;
  return { kind: 'solid', at, outline: known, pose, lines, middle };
}

/** Where on the line from `a` to `b` it is nearest to `p`, as a share of it. */
function shareAlong(p, a, b) {
  const along = subtract(b, a);
  const square = dot(along, along);
  return square > 0 ? Math.min(1, Math.max(0, dot(subtract(p, a), along) / square)) : 0;
}

const between = (a, b, share) => add(a, scale(subtract(b, a), share));

const toSegment = (p, a, b) => norm(subtract(p, between(a, b, shareAlong(p, a, b))));

/**
 * How far `p` has come along a path: {lengthM of the path, atM, index of the segment, point on it}. Null for a path of
 * fewer than two points.
 */
export function progressOn(points, p) {
  let best = null;
  let lengthM = 0;
  for (let index = 0; index + 1 < points.length; index++) {
    const [a, b] = [points[index], points[index + 1]];
    const share = shareAlong(p, a, b);
    const point = between(a, b, share);
    const besideM = norm(subtract(p, point));
    const segmentM = norm(subtract(b, a));
    if (!best || besideM < best.besideM) best = { besideM, atM: lengthM + share * segmentM, index, point };
    lengthM += segmentM;
  }
  return best && { lengthM, ...best };
}

/** Places at even distances along a path, with the direction there; none at its ends. */
export function arrowsOn(points, count) {
  const lengths = points.slice(1).map((point, i) => norm(subtract(point, points[i])));
  const stepM = lengths.reduce((sum, value) => sum + value, 0) / (count + 1);
  const arrows = [];
  let passedM = 0;
  for (let i = 0; i < lengths.length; i++) {
    while (arrows.length < count && (arrows.length + 1) * stepM <= passedM + lengths[i]) {
      const share = ((arrows.length + 1) * stepM - passedM) / lengths[i];
      arrows.push({
        at: between(points[i], points[i + 1], share), along: unit(subtract(points[i + 1], points[i])) });
    }
    passedM += lengths[i];
  }
  return arrows;
}

/** Signed distance of `p` from the boundary of a shape, positive outside; of a path or point its distance. Not of solids. */
export function distanceM(shape, p) {
  const offset = shape.at ? subtract(p, shape.at) : null;
  switch (shape.kind) {
    case 'plane': return dot(offset, shape.axis);
    case 'sphere': return norm(offset) - shape.radiusM;
    case 'point': return norm(offset);
    case 'capsule': return toSegment(p, shape.at, shape.end) - shape.radiusM;
    case 'path': return Math.min(...shape.points.slice(1).map((end, i) => toSegment(p, shape.points[i], end)));
    case 'box': {
      const beyond = shape.axes.map((axis, i) => Math.abs(dot(offset, axis)) - shape.half[i]);
      const inside = Math.max(...beyond);
      return inside > 0 ? norm(beyond.map((value) => Math.max(value, 0))) : inside;
    }
    default: {
      const along = dot(offset, shape.axis);
      const beside = norm(subtract(offset, scale(shape.axis, along)));
      const [c, s] = [Math.cos(shape.halfAngle), Math.sin(shape.halfAngle)];
      return along * c + beside * s < 0 ? norm(offset) : beside * c - along * s;
    }
  }
}

/** From the hand to the boundary of a fixture, negative inside the forbidden region; of guidance how far it is away. */
export function distanceToFixture(definition, shape, p) {
  const d = distanceM(shape, p);
  if (isGuidance(shape.kind)) return d;
  const clearance = definition.clearance_m ?? 0;
  if (definition.side === 'in') return -d - clearance;
  return (definition.side === 'both' ? Math.abs(d) : d) - clearance;
}

/** How near the hand is to a forbidden region, from far to deep, as the box calls it. */
const kStages = ['far', 'warning', 'soft', 'contact', 'breach'];
/** The stage moves outwards only when the hand is beyond the limit by this much, as in the box. */
const kStageHysteresisM = 5e-4;
/** breach_m where the definition does not have it, as that of an older box. */
const kBreachM = 0.001;

/** The stage without hysteresis, as a place in kStages. */
function stageAt({ effect, warning_m = 0, soft_m = 0, breach_m = kBreachM }, d) {
  const holds = effect !== 'slow';
  if (holds && d < -breach_m) return 4;
  if (d < 0) return 3;
  if (holds && d < soft_m) return 2;
  return d < warning_m ? 1 : 0;
}

/** The stage of a forbidden region: '' where the distance is not known. `before`: the one until now. */
export function stageOf(definition, d, before = 'far') {
  if (!Number.isFinite(d)) return '';
  const [outmost, inmost] = [stageAt(definition, d), stageAt(definition, d - kStageHysteresisM)];
  return kStages[Math.min(Math.max(kStages.indexOf(before), outmost), inmost)];
}

/** Lines of a shape, as lists of points that belong together. `eye`: where it is seen from. */
export function outlineOf(shape, eye) {
  const circle = (centre, [x, y], radiusM) => Array.from({ length: 49 }, (_, i) => {
    const angle = (2 * Math.PI * i) / 48;
    return add(centre, add(scale(x, radiusM * Math.cos(angle)), scale(y, radiusM * Math.sin(angle))));
  });
  const around = (x, y) => [x, y, scale(x, -1), scale(y, -1)];
  switch (shape.kind) {
    case 'sphere': return [circle(shape.at, perpendiculars(unit(subtract(eye, shape.at))), shape.radiusM)];
    case 'path': return [shape.points];
    case 'solid': return shape.lines;
    case 'plane': return planeLines(shape);
    case 'box': return boxLines(shape);
    case 'capsule': {
      const across = perpendiculars(unit(subtract(shape.end, shape.at)));
      const sides = around(...across).map((way) => [
        add(shape.at, scale(way, shape.radiusM)), add(shape.end, scale(way, shape.radiusM))]);
      return [circle(shape.at, across, shape.radiusM), circle(shape.end, across, shape.radiusM), ...sides];
    }
    case 'cone': {
      const { centre, radiusM } = coneEnd(shape);
      const across = perpendiculars(shape.axis);
      const sides = around(...across).map((way) => [shape.at, add(centre, scale(way, radiusM))]);
      return [circle(centre, across, radiusM), ...sides];
    }
    default: return [];
  }
}

/** Middle and radius of the end of what is drawn of a cone. */
export function coneEnd({ at, axis, halfAngle }) {
  const lengthM = kConeM * Math.cos(halfAngle);
  return { centre: add(at, scale(axis, lengthM)), radiusM: kConeM * Math.sin(halfAngle), lengthM };
}

/** A plane has no end: a square patch around its point is drawn, with a line towards the free side. */
export const kPlaneHalfM = 0.2;
const kPlaneCellM = 0.05;

function planeLines({ at, axis }) {
  const [x, y] = perpendiculars(axis);
  const lines = [[at, add(at, scale(axis, kPlaneCellM))]];
  const corner = (i, j) => add(at, add(scale(x, i), scale(y, j)));
  for (let i = -kPlaneHalfM; i < kPlaneHalfM + 1e-9; i += kPlaneCellM) {
    lines.push([corner(i, -kPlaneHalfM), corner(i, kPlaneHalfM)], [corner(-kPlaneHalfM, i), corner(kPlaneHalfM, i)]);
  }
  return lines;
}

function boxLines({ at, half, axes }) {
  const corner = (i) => [0, 1, 2].reduce(
    (p, axis) => add(p, scale(axes[axis], i & (1 << axis) ? half[axis] : -half[axis])), at);
  const lines = [];
  for (let i = 0; i < 8; i++) {
    for (const bit of [1, 2, 4]) {
      if (!(i & bit)) lines.push([corner(i), corner(i | bit)]);
    }
  }
  return lines;
}

/** Where the name of a shape stands; null: beside the hand, since the shape is all around. */
export const middleOf = (shape) => {
  if (shape.kind === 'standoff') return null;
  if (shape.kind === 'path') return shape.points[Math.floor(shape.points.length / 2)];
  if (shape.kind === 'solid') return shape.middle;
  return shape.kind === 'capsule' ? scale(add(shape.at, shape.end), 0.5) : shape.at;
};

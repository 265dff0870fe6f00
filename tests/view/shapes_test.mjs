// SPDX-License-Identifier: Apache-2.0
// Shapes in moving frames and solids, without a browser: where their points are in the world.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { assertNear, pageFolder } from './browser.mjs';

const { framesOf, outlineOf, shapeOf, middleOf } = await import(pathToFileURL(join(pageFolder, 'fixtures.js')).href);

const kCross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const kPlus = (a, b, factor = 1) => a.map((value, i) => value + factor * b[i]);
/** Turns by a quaternion without its matrix. */
const turned = ([x, y, z, w], v) => {
  const q = [x, y, z];
  return kPlus(v, kCross(q, kPlus(kCross(q, v), v, w)), 2);
};
/** The quaternion of a rotation about an axis of the frame. */
const about = (axis, deg) => {
  const q = [0, 0, 0, Math.cos(deg * Math.PI / 360)];
  q[axis] = Math.sin(deg * Math.PI / 360);
  return q;
};
const assertPoint = (actual, expected, what) =>
  expected.forEach((value, i) => assertNear(actual[i], value, 1e-12, `${what}, ${'xyz'[i]}`));

const kOutline = [[0.01, 0.02, 0.03, -0.04, 0.05, 0.06, 0.01, 0.02, 0.03], [0.1, 0, 0, 0, 0.1, 0, 0.1, 0, 0]];
const kSolids = { abc: { outline: kOutline } };
const kDefinition = { kind: 'solid', solid: 'abc', frame: 'phantom', position_m: [0.3, -0.2, 0.1], rotation_deg: [20, -35, 70] };
const kLength = Math.hypot(0.1, -0.5, 0.7, 0.3);
const kQuaternion = [0.1, -0.5, 0.7, 0.3].map((value) => value / kLength);
const statusOf = (more) => [{
  name: 'phantom', state: 'live', positionMInWorld: { x: 1, y: 2, z: -3 }, orientationXyzw: kQuaternion, ...more }];
const kFrames = framesOf(statusOf());

/** By the definition: turned about the fixed axes x, y, z, moved, turned and moved by the frame. */
function inWorld(point) {
  const [roll, pitch, yaw] = kDefinition.rotation_deg;
  const inFrame = kPlus(turned(about(2, yaw), turned(about(1, pitch), turned(about(0, roll), point))), kDefinition.position_m);
  return kPlus(turned(kQuaternion, inFrame), [1, 2, -3]);
}

test('the lines of a solid are where its definition and the pose of its frame put them', () => {
  const shape = shapeOf(kDefinition, null, { frames: kFrames, solids: kSolids });
  const lines = outlineOf(shape, [0, 0, 0]);
  assert.deepEqual(lines.map((line) => line.length), [3, 3]);
  lines.forEach((line, i) => line.forEach((point, j) => assertPoint(point, inWorld(kOutline[i].slice(3 * j, 3 * j + 3)), `line ${i}, point ${j}`)));
  const [least, most] = [Math.min, Math.max].map((pick) => [0, 1, 2].map((axis) => pick(...lines.flat().map((point) => point[axis]))));
  assertPoint(middleOf(shape), kPlus(least, most).map((value) => value / 2), 'its name');
});

test('other shapes move with their frame too', () => {
  const sphere = shapeOf({ kind: 'sphere', frame: 'phantom', position_m: [0.1, 0, 0], radius_m: 0.02 }, null, { frames: kFrames });
  assertPoint(sphere.at, kPlus(turned(kQuaternion, [0.1, 0, 0]), [1, 2, -3]), 'sphere');
  const plane = shapeOf({ kind: 'plane', frame: 'phantom', position_m: [0, 0, 0], normal: [0, 1, 0] }, null, { frames: kFrames });
  assertPoint(plane.axis, turned(kQuaternion, [0, 1, 0]), 'plane');
});

test('what moves with a frame whose place is not known has no shape', () => {
  const nowhere = [
    undefined, [], statusOf({ state: 'none' }), statusOf({ positionMInWorld: null }), statusOf({ orientationXyzw: null }),
    statusOf({ name: 'other' }), statusOf({ orientationXyzw: [0, 0, 1] }), statusOf({ positionMInWorld: { x: 0, y: null, z: 0 } })];
  for (const status of nowhere) assert.equal(shapeOf(kDefinition, null, { frames: framesOf(status), solids: kSolids }), null);
  assert.equal(shapeOf(kDefinition, null), null);
});

test('a solid whose shape is not known has a place and no lines', () => {
  for (const solids of [undefined, {}, { abc: {} }, { abc: { outline: null } }]) {
    const shape = shapeOf({ ...kDefinition, frame: 'world' }, null, { solids });
    assert.deepEqual(outlineOf(shape, [0, 0, 0]), []);
    assert.deepEqual(middleOf(shape), kDefinition.position_m);
  }
});

test('the lines of a solid are computed again only where something has changed', () => {
  const options = { frames: kFrames, solids: kSolids };
  const before = shapeOf(kDefinition, null, options);
  assert.equal(shapeOf(kDefinition, null, { ...options, before }), before);
  assert.equal(shapeOf(kDefinition, null, { frames: framesOf(statusOf()), solids: kSolids, before }), before);
  const changes = [
    { frames: framesOf(statusOf({ positionMInWorld: { x: 1, y: 2, z: -3.001 } })), solids: kSolids },
    { frames: framesOf(statusOf({ orientationXyzw: [0, 0, 0, 1] })), solids: kSolids },
    { frames: kFrames, solids: { abc: { outline: [...kOutline] } } },
  ];
  for (const change of changes) assert.notEqual(shapeOf(kDefinition, null, { ...change, before }), before);
  assert.notEqual(shapeOf({ ...kDefinition, rotation_deg: [20, -35, 71] }, null, { ...options, before }), before);
});

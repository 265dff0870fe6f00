// SPDX-License-Identifier: Apache-2.0
// The surface that is made of a depth frame: planes are flat under noise, depth edges stay open, the scale is even.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { assertNear, pageFolder } from './browser.mjs';

const load = (name) => import(pathToFileURL(join(pageFolder, name)).href);
const { SurfaceGrid } = await load('surface_grid.js');
const { kRamp } = await load('ramp.js');

const kWidth = 320;
const kHeight = 240;
const kFocalPx = 295;
const kLimitsM = [0.4, 5];
const kNone = 2047;
/** Kinect's law: 1 / Z falls linearly with the raw value, by this much for each step. */
const kStepPerM = 0.003071102;
const kAtZeroPerM = 3.330949516;

/** Repeatable noise of standard deviation 1: sums of twelve numbers in 0..1. */
function noise(seed) {
  let state = seed;
  const next = () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
  return () => Array.from({ length: 12 }, next).reduce((sum, value) => sum + value, -6);
}

/** A frame of Kinect's law; `depthAt(column, row)` in metres, 0: not measured; noise in steps of the raw value. */
function frameOf(depthAt, noiseSteps = 0) {
  const sample = noise(1);
  const raw = new Uint16Array(kWidth * kHeight);
  for (let row = 0; row < kHeight; row++) {
    for (let column = 0; column < kWidth; column++) {
      const z = depthAt(column, row);
      const steps = (kAtZeroPerM - 1 / z) / kStepPerM + noiseSteps * sample();
      raw[row * kWidth + column] = z > 0 ? Math.round(steps) : kNone;
    }
  }
  return {
    width: kWidth, height: kHeight, stride: kWidth, raw, rawNone: kNone, isLinear: false, law: [-kStepPerM, kAtZeroPerM],
    fx: kFocalPx, fy: kFocalPx, cx: kWidth / 2 - 0.5, cy: kHeight / 2 - 0.5,
    depthOf: (value) => (value === kNone ? 0 : 1 / (kAtZeroPerM - kStepPerM * value)),
  };
}

/** Depth of the plane n p = d (camera's frame, n towards the camera) at a pixel. */
const planeDepth = ([nx, ny, nz], atM) => (column, row) => {
  const x = (column - (kWidth / 2 - 0.5)) / kFocalPx;
  const y = -(row - (kHeight / 2 - 0.5)) / kFocalPx;
  return (atM * nz) / (nz - nx * x - ny * y);
};

const unit = (v) => v.map((value) => value / Math.hypot(...v));

function gridOf(frame, every = 2) {
  const grid = new SurfaceGrid();
  grid.take(frame, kLimitsM, every);
  return grid;
}

/** Angles in degrees between the normals of a grid and `normal`, of all corners that were measured. */
function anglesTo(grid, normal) {
  const angles = [];
  for (let at = 0; at < grid.inverse.length; at++) {
    if (grid.inverse[at] === 0) continue;
    const own = unit(Array.from(grid.normals.subarray(4 * at, 4 * at + 3)));
    const cosine = own.reduce((sum, value, i) => sum + value * normal[i], 0);
    angles.push((Math.acos(Math.min(cosine, 1)) * 180) / Math.PI);
  }
  return angles.sort((a, b) => a - b);
}

// Normals are stored in steps of 1/127, half a degree.
const kStoredDeg = 0.7;

test('a plane without noise has its own normal everywhere, to its borders', () => {
  const normal = unit([0.3, 0.4, 1]);
  const angles = anglesTo(gridOf(frameOf(planeDepth(normal, 1))), normal);
  // at a corner of the image a quarter of the window is left: the steps of the raw value show most there
  assertNear(angles.at(-1), 0, kStoredDeg + 1, 'largest angle');
});

for (const distanceM of [0.8, 1.5, 3]) {
  test(`a noisy plane at ${distanceM} m is shaded evenly`, () => {
    const normal = unit([0.25, -0.2, 1]);
    const angles = anglesTo(gridOf(frameOf(planeDepth(normal, distanceM), 0.7)), normal);
    // four degrees change the light by less than a twentieth, which is not seen as a blotch
    assertNear(angles[Math.floor(0.95 * angles.length)], 0, 4, '95 % of the angles');
  });
}

/** The area of each square of the grid that triangles cover: 1 where it is covered once. */
function coverage(grid) {
  const { triangles, triangleCorners } = grid.triangulation;
  const covered = new Float64Array((grid.columns - 1) * (grid.rows - 1));
  const place = (corner) => [corner % grid.columns, Math.floor(corner / grid.columns)];
  // points on no line between corners, four by four in each square, each with its share
  const shares = [0.13, 0.38, 0.61, 0.88];
  for (let at = 0; at < triangleCorners; at += 3) {
    const [a, b, c] = [0, 1, 2].map((i) => place(triangles[at + i]));
    const side = ([px, py], [qx, qy], x, y) => (qx - px) * (y - py) - (qy - py) * (x - px);
    for (let row = Math.min(a[1], b[1], c[1]); row < Math.max(a[1], b[1], c[1]); row++) {
      for (let column = Math.min(a[0], b[0], c[0]); column < Math.max(a[0], b[0], c[0]); column++) {
        for (const [i, dx] of shares.entries()) {
          for (const dy of shares.map((share) => share + 0.017 + 0.011 * i)) {
            const [x, y] = [column + dx, row + dy];
            const sides = [side(a, b, x, y), side(b, c, x, y), side(c, a, x, y)];
            if (sides.every((value) => value > 0) || sides.every((value) => value < 0)) {
              covered[row * (grid.columns - 1) + column] += 1 / 16;
            }
          }
        }
      }
    }
  }
  return covered;
}

for (const every of [2, 3]) {
  test(`all of a surface is covered once, every ${every} pixels, without cracks between large triangles and small ones`, () => {
    // a noisy plane with a sphere on it has both
    const plane = planeDepth(unit([0.25, -0.2, 1]), 1.5);
    const bulge = (column, row) => 0.05 * Math.exp(-((column - 160) ** 2 + (row - 120) ** 2) / 300);
    const grid = gridOf(frameOf((column, row) => plane(column, row) - bulge(column, row), 0.7), every);
    const count = grid.triangulation.triangleCorners / 3;
    assert.ok(count < (grid.columns - 1) * (grid.rows - 1), `${count} triangles: some are large`);
    for (const share of coverage(grid)) assertNear(share, 1, 1e-9, 'covered share of a square');
    assert.equal(grid.triangulation.looseCorners, 0);
  });
}

test('no triangle joins what lies apart', () => {
  const edgeColumn = 160;
  for (const [nearM, farM] of [[0.8, 0.9], [1.5, 1.8], [3, 4]]) {
    const grid = gridOf(frameOf((column) => (column < edgeColumn ? nearM : farM), 0.7));
    const border = (1 / nearM + 1 / farM) / 2;
    for (let at = 0; at < grid.triangulation.triangleCorners; at += 3) {
      const sides = [0, 1, 2].map((i) => grid.inverse[grid.triangulation.triangles[at + i]] > border);
      assert.ok(sides.every((side) => side === sides[0]), `a triangle joins ${nearM} m and ${farM} m`);
    }
  }
});

test('an edge does not bend the normals beside it', () => {
  const grid = gridOf(frameOf((column) => (column < 160 ? 0.8 : 1.6)));
  const angles = anglesTo(grid, [0, 0, 1]);
  assertNear(angles.at(-1), 0, kStoredDeg, 'largest angle');
});

test('a measurement without neighbours is drawn as a point, and holes stay holes', () => {
  const alone = (column, row) => column >= 100 && column < 102 && row >= 100 && row < 102;
  const grid = gridOf(frameOf((column, row) => (alone(column, row) ? 1 : 0)));
  assert.equal(grid.triangulation.triangleCorners, 0);
  assert.deepEqual(Array.from(grid.triangulation.loose.subarray(0, grid.triangulation.looseCorners)), [50 * grid.columns + 50]);
  const holed = gridOf(frameOf((column, row) => (Math.hypot(column - 160, row - 120) < 20 ? 0 : 1)));
  for (let at = 0; at < holed.triangulation.triangleCorners; at++) assert.ok(holed.inverse[holed.triangulation.triangles[at]] > 0);
});

/** CIE L* of an sRGB colour 0..1. */
function lightness(rgb) {
  const [r, g, b] = rgb.map((value) => (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4));
  const y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
  return y > 216 / 24389 ? 116 * Math.cbrt(y) - 16 : (24389 / 27) * y;
}

test('the lightness of the scale rises evenly', () => {
  const values = kRamp.map(lightness);
  const step = (values.at(-1) - values[0]) / (values.length - 1);
  // the published map is even to about a fifth of a tenth of its range
  for (let i = 1; i < values.length; i++) assertNear(values[i] - values[i - 1], step, 0.2 * step, `step ${i}`);
});

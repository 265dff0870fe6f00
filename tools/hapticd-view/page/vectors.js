// SPDX-License-Identifier: Apache-2.0
// Vectors as arrays of three numbers, rotations as nine numbers row by row, and 4x4 matrices as WebGL takes them
// (sixteen numbers, column by column).

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const norm = (a) => Math.hypot(a[0], a[1], a[2]);
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

/** The direction of `a`, or `otherwise` where it has none. */
export function unit(a, otherwise = [0, 0, 1]) {
  const length = norm(a);
  return length > 1e-12 ? scale(a, 1 / length) : otherwise;
}

/** Whether `a` is a vector of three finite numbers, as the bridge sends it; unknown vectors come as null. */
export const isVector = (a) => Array.isArray(a) && a.length === 3 && a.every(Number.isFinite);

/** Whether `a` is a quaternion x, y, z, w of finite numbers; an orientation that is not measured comes as null. */
export const isQuaternion = (a) => Array.isArray(a) && a.length === 4 && a.every(Number.isFinite);

/** R v, for a rotation row by row. */
export const rotate = (r, v) => [
  r[0] * v[0] + r[1] * v[1] + r[2] * v[2],
  r[3] * v[0] + r[4] * v[1] + r[5] * v[2],
  r[6] * v[0] + r[7] * v[1] + r[8] * v[2],
];

/** R^T v, the inverse of rotate(). */
export const rotateBack = (r, v) => [
  r[0] * v[0] + r[3] * v[1] + r[6] * v[2],
  r[1] * v[0] + r[4] * v[1] + r[7] * v[2],
  r[2] * v[0] + r[5] * v[1] + r[8] * v[2],
];

/** The rotation of a unit quaternion x, y, z, w. */
export const rotationOfQuaternion = ([x, y, z, w]) => [
  1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
  2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
  2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
];

/** The product of two 4x4 matrices. */
export function multiply(a, b) {
  const product = new Float32Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[k * 4 + row] * b[column * 4 + k];
      product[column * 4 + row] = sum;
    }
  }
  return product;
}

/** From the eye's frame (x right, y up, looking along -z) to clip coordinates. */
export function perspective(verticalAngleRad, aspect, near, far) {
  const f = 1 / Math.tan(verticalAngleRad / 2);
  return new Float32Array([
    f / aspect, 0, 0, 0,
    0, f, 0, 0,
    0, 0, (far + near) / (near - far), -1,
    0, 0, (2 * far * near) / (near - far), 0,
  ]);
}

/** From the world to the frame of an eye whose axes are `right`, `up` and `back`. */
export function viewOf(eye, right, up, back) {
  return new Float32Array([
    right[0], up[0], back[0], 0,
    right[1], up[1], back[1], 0,
    right[2], up[2], back[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(back, eye), 1,
  ]);
}

/** Moves, turns and stretches a mesh: its x, y and z axes become `x`, `y` and `z`. */
export const placed = (position, x, y, z) => new Float32Array([
  x[0], x[1], x[2], 0, y[0], y[1], y[2], 0, z[0], z[1], z[2], 0, position[0], position[1], position[2], 1,
]);

/** Two directions that are perpendicular to the unit vector `axis` and to one another. */
export function perpendiculars(axis) {
  const helper = Math.abs(axis[1]) < 0.9 ? [0, 1, 0] : [1, 0, 0];
  const first = unit(cross(helper, axis));
  return [first, cross(axis, first)];
}

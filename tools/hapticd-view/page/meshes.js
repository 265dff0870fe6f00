// SPDX-License-Identifier: Apache-2.0
// The solids that the picture is made of: {corners, indices}. Each corner: position and normal, six numbers; three indices
// make a triangle.

const kTurns = 32;
const kRings = 16;

/** A surface of revolution about y, as a grid of `rings` by kTurns corners; `at(share)` is {y, r, ny, nr}. */
function revolved(rings, at) {
  const corners = [];
  for (let ring = 0; ring <= rings; ring++) {
    const { y, r, ny, nr } = at(ring / rings);
    for (let turn = 0; turn <= kTurns; turn++) {
      const angle = (2 * Math.PI * turn) / kTurns;
      const c = Math.cos(angle);
      const s = Math.sin(angle);
      corners.push([r * c, y, r * s, nr * c, ny, nr * s]);
    }
  }
  const indices = [];
  const row = kTurns + 1;
  for (let ring = 0; ring < rings; ring++) {
    for (let turn = 0; turn < kTurns; turn++) {
      const a = ring * row + turn;
      indices.push(a, a + row, a + 1, a + 1, a + row, a + row + 1);
    }
  }
  return { corners: new Float32Array(corners.flat()), indices: new Uint16Array(indices) };
}

/** Radius 1 around the origin. */
export const sphere = () => revolved(kRings, (share) => {
  const angle = Math.PI * share;
  return { y: Math.cos(angle), r: Math.sin(angle), ny: Math.cos(angle), nr: Math.sin(angle) };
});

/** Radius 1, from y = 0 to y = 1. */
export const cylinder = () => revolved(1, (share) => ({ y: share, r: 1, ny: 0, nr: 1 }));

/** Radius 1 at y = 0, its tip at y = 1. */
export const cone = () => revolved(1, (share) => ({ y: share, r: 1 - share, ny: Math.SQRT1_2, nr: Math.SQRT1_2 }));

/** From -1 to 1 along each axis. */
export const cube = () => {
  const corners = [];
  const indices = [];
  for (const axis of [0, 1, 2]) {
    for (const side of [-1, 1]) {
      const at = (u, v) => {
        const place = [0, 0, 0];
        place[axis] = side;
        place[(axis + 1) % 3] = u;
        place[(axis + 2) % 3] = v;
        const normal = [0, 0, 0];
        normal[axis] = side;
        return [...place, ...normal];
      };
      indices.push(...[0, 1, 2, 0, 2, 3].map((corner) => corners.length + corner));
      corners.push(at(-1, -1), at(1, -1), at(1, 1), at(-1, 1));
    }
  }
  return { corners: new Float32Array(corners.flat()), indices: new Uint16Array(indices) };
};

// SPDX-License-Identifier: Apache-2.0
// The triangles of a grid of corners: two for each square of neighbours, none across depth edges. Where four squares are as
// good as flat, two large triangles stand for eight: without a graphics card each triangle counts.

/** Corners are left out where the surface without them is within this of them: 2 standard deviations of 1 / Z. */
const kFlatPerM = 0.006;
/** The same for their normals, in steps of 1/127: about 5 degrees. */
const kFlatNormal = 11;

export class Triangulation {
  /** `grid` has columns, rows, inverse, normals, joinsRight and joinsBelow, see surface_grid.js. */
  constructor(grid) {
    this.grid = grid;
    const count = grid.columns * grid.rows;
    /** Corners of the triangles, and corners that belong to none; of each only the first so many. */
    this.triangles = new Uint32Array(6 * count);
    this.triangleCorners = 0;
    this.loose = new Uint32Array(count);
    this.looseCorners = 0;
    this.covered = new Uint8Array(count);
    /** Blocks are two by two squares. */
    this.blockColumns = Math.floor((grid.columns - 1) / 2);
    this.blockRows = Math.floor((grid.rows - 1) / 2);
    this.flat = new Uint8Array(this.blockColumns * this.blockRows);
  }

  update() {
    const { grid, covered, blockColumns, blockRows } = this;
    this.triangleCorners = 0;
    covered.fill(0);
    for (let row = 0; row < blockRows; row++) {
      for (let column = 0; column < blockColumns; column++) {
        this.flat[row * blockColumns + column] = this.isFlat(2 * (row * grid.columns + column)) ? 1 : 0;
      }
    }
    for (let row = 0; row < blockRows; row++) {
      for (let column = 0; column < blockColumns; column++) this.fillBlock(row, column);
    }
    this.fillRest();
    this.findLoose();
  }

  /** Whether the five inner corners of a block lie on one surface with the outer four, and in between them. */
  isFlat(a) {
    const { columns, joinsRight: right, joinsBelow: below } = this.grid;
    const d = a + columns;
    const g = d + columns;
    const joined = right[a] & right[a + 1] & right[d] & right[d + 1] & right[g] & right[g + 1] &
      below[a] & below[a + 1] & below[a + 2] & below[d] & below[d + 1] & below[d + 2];
    return joined === 1 && this.isBetween(a, a + 1, a + 2) && this.isBetween(a, d, g) &&
      this.isBetween(a + 2, d + 2, g + 2) && this.isBetween(g, g + 1, g + 2) &&
      this.isBetween(a, d + 1, g + 2) && this.isBetween(a + 2, d + 1, g);
  }

  isBetween(from, at, to) {
    const { inverse, normals } = this.grid;
    if (Math.abs(inverse[from] + inverse[to] - 2 * inverse[at]) > 2 * kFlatPerM) return false;
    for (let i = 0; i < 3; i++) {
      if (Math.abs(normals[4 * from + i] + normals[4 * to + i] - 2 * normals[4 * at + i]) > 2 * kFlatNormal) return false;
    }
    return true;
  }

  /** A block beyond the border asks for no corner on the edge that it would share. */
  isFlatAt(row, column) {
    const outside = row < 0 || column < 0 || row >= this.blockRows || column >= this.blockColumns;
    return outside ? this.isBorder(row, column) : this.flat[row * this.blockColumns + column] === 1;
  }

  /** Whether nothing is drawn there: an even grid has squares beyond its last block. */
  isBorder(row, column) {
    const { grid, blockColumns, blockRows } = this;
    return row < 0 || column < 0 || (column >= blockColumns && 2 * blockColumns + 1 === grid.columns) ||
      (row >= blockRows && 2 * blockRows + 1 === grid.rows);
  }

  fillBlock(row, column) {
    const { columns } = this.grid;
    const a = 2 * (row * columns + column);
    const d = a + columns;
    const g = d + columns;
    if (!this.flat[row * this.blockColumns + column]) {
      for (const corner of [a, a + 1, d, d + 1]) this.fillSquare(corner);
      return;
    }
    const above = this.isFlatAt(row - 1, column);
    const left = this.isFlatAt(row, column - 1);
    const under = this.isFlatAt(row + 1, column);
    const right = this.isFlatAt(row, column + 1);
    if (above && left && under && right) {
      this.addTriangle(a, g, a + 2);
      this.addTriangle(a + 2, g, g + 2);
    } else {
      this.addEdge(d + 1, a, d, g, left);
      this.addEdge(d + 1, g, g + 1, g + 2, under);
      this.addEdge(d + 1, g + 2, d + 2, a + 2, right);
      this.addEdge(d + 1, a + 2, a + 1, a, above);
    }
    for (let at = a; at <= g; at += columns) this.covered[at] = this.covered[at + 1] = this.covered[at + 2] = 1;
  }

  /** The part of a block between its centre and an edge, whose middle is a corner unless the neighbour leaves it out. */
  addEdge(centre, from, middle, to, isWhole) {
    if (isWhole) {
      this.addTriangle(centre, from, to);
    } else {
      this.addTriangle(centre, from, middle);
      this.addTriangle(centre, middle, to);
    }
  }

  /** What an even number of columns or rows leaves beyond the last block. */
  fillRest() {
    const { columns, rows } = this.grid;
    for (let row = 0; row + 1 < rows; row++) {
      const first = row < 2 * this.blockRows ? 2 * this.blockColumns : 0;
      for (let column = first; column + 1 < columns; column++) this.fillSquare(row * columns + column);
    }
  }

  /** Up to two triangles between a corner and its neighbours to the right and below, along the flatter diagonal. */
  fillSquare(a) {
    const { inverse, columns, joinsRight, joinsBelow } = this.grid;
    const b = a + 1;
    const c = a + columns;
    const d = c + 1;
    const falling = inverse[a] > 0 && inverse[d] > 0 ? Math.abs(inverse[a] - inverse[d]) : Infinity;
    const rising = inverse[b] > 0 && inverse[c] > 0 ? Math.abs(inverse[b] - inverse[c]) : Infinity;
    if (falling < rising) {
      if (joinsRight[a] && joinsBelow[b]) this.addTriangle(a, d, b);
      if (joinsBelow[a] && joinsRight[c]) this.addTriangle(a, c, d);
    } else {
      if (joinsRight[a] && joinsBelow[a]) this.addTriangle(a, c, b);
      if (joinsRight[c] && joinsBelow[b]) this.addTriangle(b, c, d);
    }
  }

  addTriangle(a, b, c) {
    const { triangles, covered } = this;
    let at = this.triangleCorners;
    triangles[at++] = a;
    triangles[at++] = b;
    triangles[at++] = c;
    this.triangleCorners = at;
    covered[a] = covered[b] = covered[c] = 1;
  }

  findLoose() {
    const { inverse } = this.grid;
    this.looseCorners = 0;
    for (let at = 0; at < inverse.length; at++) {
      if (inverse[at] > 0 && !this.covered[at]) this.loose[this.looseCorners++] = at;
    }
  }
}

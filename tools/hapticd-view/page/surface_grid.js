// SPDX-License-Identifier: Apache-2.0
// A depth frame as a surface: corners on a grid of pixels, which of them lie on one surface, and their normals.
//
// All of it is computed from the inverse depth 1 / Z. There a plane is a linear function of the pixel, and the noise of
// a camera that triangulates is the same everywhere (in depth it grows with Z^2), so one number describes it.

import { Triangulation } from './triangulation.js';

/** Standard deviation of 1 / Z, in 1/m: 3 mm at 1 m, 48 mm at 4 m; as Kinect's and others' with its baseline. */
const kNoisePerM = 0.003;
/** Neighbours on one surface differ by less than so much noise ... */
const kEdgeNoise = 4;
/** ... and by what a surface has that rises so much for each length across the line of sight (79 degrees). */
const kSteepest = 5;
/** Pixels over which a slope is averaged at 1 m; as many times more as it is metres away. */
const kReachPx = 4;
/** Averaging along rows and columns in turn makes the window round. */
const kRounds = 2;
const kRawValues = 65536;

/** Inverse depth of each raw value, 0 where it is no measurement within the limits. */
class InverseDepths {
  constructor() {
    this.table = new Float32Array(kRawValues);
    this.key = '';
  }

  of(frame, limitsM) {
    const key = [frame.rawNone, frame.isLinear, ...frame.law, ...limitsM].join();
    if (key === this.key) return this.table;
    this.key = key;
    for (let raw = 0; raw < kRawValues; raw++) {
      const z = frame.depthOf(raw);
      this.table[raw] = z > 0 && z >= limitsM[0] && z <= limitsM[1] ? 1 / z : 0;
    }
    return this.table;
  }
}

export class SurfaceGrid {
  constructor() {
    this.inverseDepths = new InverseDepths();
    this.columns = 0;
    this.rows = 0;
  }

  /** Takes over a frame; a corner stands for `every` by `every` pixels. */
  take(frame, limitsM, every) {
    this.resize(Math.floor(frame.width / every), Math.floor(frame.height / every));
    this.every = every;
    this.slopePerPx = (kSteepest * every) / frame.fx;
    this.sample(frame, this.inverseDepths.of(frame, limitsM));
    this.findSlopes();
    for (let round = 0; round < kRounds; round++) {
      this.average(this.columns, this.rows, 1, this.columns, this.joinsRight);
      this.average(this.rows, this.columns, this.columns, 1, this.joinsBelow);
    }
    this.findNormals(frame);
    this.triangulation.update();
  }

  resize(columns, rows) {
    if (columns === this.columns && rows === this.rows) return;
    Object.assign(this, { columns, rows });
    const count = columns * rows;
    /** 1 / Z of each corner, 0 where nothing was measured. */
    this.inverse = new Float32Array(count);
    /** Whether a corner lies on one surface with the next one in its row, in its column. */
    this.joinsRight = new Uint8Array(count);
    this.joinsBelow = new Uint8Array(count);
    /** Change of 1 / Z to the next corner in the row and in the column, and how much was measured of each. */
    this.right = new Float32Array(count);
    this.below = new Float32Array(count);
    this.rightShare = new Float32Array(count);
    this.belowShare = new Float32Array(count);
    this.decay = new Float32Array(count);
    this.scratch = Array.from({ length: 4 }, () => new Float32Array(Math.max(columns, rows)));
    /** Normals in the camera's frame, towards it: 127 times x, y and z, and a number that only fills four bytes. */
    this.normals = new Int8Array(4 * count);
    this.triangulation = new Triangulation(this);
  }

  /** By how much two inverse depths on one surface may differ. */
  limitBetween(a, b) {
    return kEdgeNoise * kNoisePerM + 0.5 * this.slopePerPx * (a + b);
  }

  /** The mean of the pixels of each corner; the middle one where an edge runs through them. */
  sample(frame, table) {
    const { inverse, columns, rows, every } = this;
    const { raw, stride } = frame;
    const middle = (every >> 1) * (stride + 1);
    for (let row = 0; row < rows; row++) {
      for (let column = 0; column < columns; column++) {
        const first = (row * stride + column) * every;
        let sum = 0;
        let count = 0;
        let least = Infinity;
        let most = 0;
        for (let y = 0; y < every; y++) {
          for (let at = first + y * stride, end = at + every; at < end; at++) {
            const value = table[raw[at]];
            if (value === 0) continue;
            sum += value;
            count++;
            if (value < least) least = value;
            if (value > most) most = value;
          }
        }
        let value = 0;
        if (2 * count >= every * every) {
          value = most - least <= this.limitBetween(least, most) ? sum / count : table[raw[first + middle]] || most;
        }
        inverse[row * columns + column] = value;
      }
    }
  }

  findSlopes() {
    const { inverse, columns, rows } = this;
    for (let row = 0; row < rows; row++) {
      for (let column = 0; column < columns; column++) {
        const at = row * columns + column;
        this.slopeTo(at, column + 1 < columns ? at + 1 : at, this.right, this.rightShare, this.joinsRight);
        this.slopeTo(at, row + 1 < rows ? at + columns : at, this.below, this.belowShare, this.joinsBelow);
        this.decay[at] = inverse[at] > 0 ? Math.exp((-inverse[at] * this.every) / kReachPx) : 0;
      }
    }
  }

  slopeTo(at, next, slopes, shares, joins) {
    const from = this.inverse[at];
    const to = this.inverse[next];
    const joined = next !== at && from > 0 && to > 0 && Math.abs(to - from) <= this.limitBetween(from, to);
    joins[at] = joined ? 1 : 0;
    shares[at] = joined ? 1 : 0;
    slopes[at] = joined ? to - from : 0;
  }

  /**
   * Averages the slopes along lines of the grid, with weights that fall off exponentially on both sides and end at depth
   * edges: a forward sum, and a backward sum that is added to it.
   */
  average(length, lines, step, lineStep, joins) {
    for (let line = 0; line < lines; line++) {
      this.averageLine(line * lineStep, length, step, joins, this.right, this.rightShare);
      this.averageLine(line * lineStep, length, step, joins, this.below, this.belowShare);
    }
  }

  averageLine(first, length, step, joins, sums, shares) {
    const { decay } = this;
    const [forwardSum, forwardShare] = this.scratch;
    let sum = 0;
    let share = 0;
    let joined = 0;
    for (let i = 0, at = first; i < length; i++, at += step) {
      const keep = joined ? decay[at] : 0;
      sum = sums[at] + keep * sum;
      share = shares[at] + keep * share;
      forwardSum[i] = sum;
      forwardShare[i] = share;
      joined = joins[at];
    }
    sum = 0;
    share = 0;
    for (let i = length - 1, at = first + i * step; i >= 0; i--, at -= step) {
      const keep = joins[at] ? decay[at] : 0;
      const ownSum = sums[at];
      const ownShare = shares[at];
      sums[at] = forwardSum[i] + keep * sum;
      shares[at] = forwardShare[i] + keep * share;
      sum = ownSum + keep * sum;
      share = ownShare + keep * share;
    }
  }

  /** Where 1 / Z = a + right * column + below * row, the surface is the plane with the normal found here. */
  findNormals(frame) {
    const { inverse, columns, rows, every, normals } = this;
    const offset = (every - 1) / 2;
    for (let row = 0, at = 0; row < rows; row++) {
      const y = row * every + offset - frame.cy;
      for (let column = 0; column < columns; column++, at++) {
        if (inverse[at] === 0) continue;
        const right = this.rightShare[at] > 0 ? this.right[at] / this.rightShare[at] / every : 0;
        const below = this.belowShare[at] > 0 ? this.below[at] / this.belowShare[at] / every : 0;
        const x = column * every + offset - frame.cx;
        const nx = -right * frame.fx;
        const ny = below * frame.fy;
        const nz = inverse[at] - right * x - below * y;
        const scale = 127 / (Math.sqrt(nx * nx + ny * ny + nz * nz) || 1);
        normals[4 * at] = nx * scale;
        normals[4 * at + 1] = ny * scale;
        normals[4 * at + 2] = nz * scale;
      }
    }
  }
}

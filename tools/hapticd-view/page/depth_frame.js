// SPDX-License-Identifier: Apache-2.0
// A depth frame as the bridge sends it: rt::DepthFrameHeader (rt/depth/depth_frame_header.h) and the raw image.

import { add, rotate } from './vectors.js';

const kHeaderBytes = 280;
const kVersion = 2;
const kMagic = 0x50454448; // "HDEP", little-endian
const kMaxPixelsPerSide = 4096;

const numbers = (view, offset, count) =>
  Array.from({ length: count }, (_, i) => view.getFloat64(offset + 8 * i, true));

/** One depth frame; throws an Error that says why the bytes are not one. */
export class DepthFrame {
  /** `buffer` holds the header at `offset`, the image behind it. */
  constructor(buffer, offset) {
    const view = new DataView(buffer, offset);
    if (view.byteLength < kHeaderBytes || view.getUint32(0, true) !== kMagic) {
      throw new Error('a message of the bridge is not a depth frame');
    }
    if (view.getUint16(4, true) !== kVersion || view.getUint16(6, true) !== kHeaderBytes) {
      throw new Error('the bridge sends another version of depth frames than this page reads: reload the page');
    }
    this.width = view.getUint32(8, true);
    this.height = view.getUint32(12, true);
    const strideBytes = view.getUint32(16, true);
    const possible = this.width > 0 && this.width <= kMaxPixelsPerSide && this.height > 0 &&
      this.height <= kMaxPixelsPerSide && strideBytes % 2 === 0 && strideBytes >= 2 * this.width &&
      view.byteLength >= kHeaderBytes + strideBytes * this.height;
    if (!possible || view.getUint8(20) !== 0 || view.getUint8(21) > 1) {
      throw new Error('the header of a depth frame is invalid');
    }
    /** Pixels from one row to the next. */
    this.stride = strideBytes / 2;
    this.isLinear = view.getUint8(21) === 1;
    this.rawNone = view.getUint32(24, true);
    /** Z = c0 raw + c1 where isLinear, otherwise 1 / Z. */
    this.law = numbers(view, 32, 2);
    [this.fx, this.fy, this.cx, this.cy] = numbers(view, 48, 4);
    /** T_world_camera: rotation row by row, and the camera's position in the world in metres. */
    this.rotation = numbers(view, 80, 9);
    this.position = numbers(view, 152, 3);
    this.arrivalNs = Number(view.getBigInt64(208, true));
    this.number = Number(view.getBigUint64(216, true));
    this.raw = new Uint16Array(buffer, offset + kHeaderBytes, this.stride * this.height);
  }

  rawAt(column, row) {
    return this.raw[row * this.stride + column];
  }

  /** Depth along the optical axis in metres; 0 without a measurement. */
  depthOf(raw) {
    if (raw === this.rawNone) return 0;
    const value = this.law[0] * raw + this.law[1];
    if (!(value > 0)) return 0;
    return this.isLinear ? value : 1 / value;
  }

  /** In the camera's frame (x right, y up, looking along -z); the pixel must have been measured. */
  pointInCamera(column, row) {
    const z = this.depthOf(this.rawAt(column, row));
    return [((column - this.cx) * z) / this.fx, (-(row - this.cy) * z) / this.fy, -z];
  }

  pointInWorld(column, row) {
    return this.toWorld(this.pointInCamera(column, row));
  }

  toWorld(pointInCamera) {
    return add(rotate(this.rotation, pointInCamera), this.position);
  }

  /** {z, world} of every 16th pixel both ways that was measured. */
  samples() {
    const found = [];
    for (let row = 8; row < this.height; row += 16) {
      for (let column = 8; column < this.width; column += 16) {
        const z = this.depthOf(this.rawAt(column, row));
        if (z > 0) found.push({ z, world: this.pointInWorld(column, row) });
      }
    }
    return found;
  }

  /** What most of the points span: depths and heights in metres. Null where too little was measured. */
  extent() {
    const samples = this.samples();
    if (samples.length < 8) return null;
    const depths = samples.map(({ z }) => z).sort((a, b) => a - b);
    const heights = samples.map(({ world }) => world[1]).sort((a, b) => a - b);
    const quantile = (sorted, share) => sorted[Math.floor(share * sorted.length)];
    return {
      nearM: quantile(depths, 0.02),
      medianM: quantile(depths, 0.5),
      farM: quantile(depths, 0.98),
      lowestM: quantile(heights, 0.02),
      highestM: quantile(heights, 0.98),
    };
  }
}

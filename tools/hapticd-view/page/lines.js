// SPDX-License-Identifier: Apache-2.0
// Collects line segments and draws them with a width in pixels.

import { lineProgram } from './shaders.js';

const kNumbers = 14; // two positions, two colours with opacity
const kCorners = 4;
const kIndices = [0, 1, 2, 2, 1, 3];

export class Lines {
  constructor(gl) {
    this.gl = gl;
    this.program = lineProgram(gl);
    this.buffer = gl.createBuffer();
    this.indices = gl.createBuffer();
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    let offset = 0;
    [3, 3, 4, 4].forEach((count, place) => {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, count, gl.FLOAT, false, kNumbers * Float32Array.BYTES_PER_ELEMENT,
        offset * Float32Array.BYTES_PER_ELEMENT);
      offset += count;
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.indices);
    gl.bindVertexArray(null);
    this.count = 0;
    this.room = 0;
    this.makeRoom(512);
  }

  /** Room for so many segments; what was added stays. */
  makeRoom(segments) {
    const { gl } = this;
    const corners = new Float32Array(segments * kCorners * kNumbers);
    if (this.corners) corners.set(this.corners);
    this.corners = corners;
    this.room = segments;
    const indices = new Uint32Array(segments * kIndices.length);
    for (let i = 0; i < indices.length; i++) {
      indices[i] = kCorners * Math.floor(i / kIndices.length) + kIndices[i % kIndices.length];
    }
    gl.bindVertexArray(this.array);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
  }

  /** `colour`: red, green, blue and opacity, 0..1. */
  add(from, to, colour, toColour = colour) {
    if (this.count === this.room) this.makeRoom(2 * this.room);
    // not as instances of one quad: without a graphics card each of them costs as much as a draw
    const { corners } = this;
    const first = this.count * kCorners * kNumbers;
    corners.set(from, first);
    corners.set(to, first + 3);
    corners.set(colour, first + 6);
    corners.set(toColour, first + 10);
    for (let corner = 1; corner < kCorners; corner++) {
      corners.copyWithin(first + corner * kNumbers, first, first + kNumbers);
    }
    this.count++;
  }

  addStrip(points, colour) {
    for (let i = 1; i < points.length; i++) this.add(points[i - 1], points[i], colour);
  }

  /** Draws what was added since the last time, and forgets it. `onTop`: whatever is in front of it. */
  draw(orbit, pixelRatio, widthPx, onTop = false) {
    if (this.count === 0) return;
    const { gl } = this;
    const { program, uniforms } = this.program;
    gl.useProgram(program);
    gl.uniformMatrix4fv(uniforms.worldToClip, false, orbit.worldToClip);
    gl.uniform2f(uniforms.viewPx, orbit.width * pixelRatio, orbit.height * pixelRatio);
    gl.uniform1f(uniforms.widthPx, widthPx * pixelRatio);
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, this.corners, gl.STREAM_DRAW, 0, this.count * kCorners * kNumbers);
    if (onTop) gl.disable(gl.DEPTH_TEST);
    gl.drawElements(gl.TRIANGLES, this.count * kIndices.length, gl.UNSIGNED_INT, 0);
    gl.enable(gl.DEPTH_TEST);
    gl.bindVertexArray(null);
    this.count = 0;
  }
}

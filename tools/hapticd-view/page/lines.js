// SPDX-License-Identifier: Apache-2.0
// Collects line segments and draws them with a width in pixels.

import { lineProgram } from './shaders.js';

const kNumbersPerSegment = 14; // two positions, two colours with opacity
const kBytes = 4;

export class Lines {
  constructor(gl) {
    this.gl = gl;
    this.program = lineProgram(gl);
    this.buffer = gl.createBuffer();
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    let offset = 0;
    [3, 3, 4, 4].forEach((count, place) => {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, count, gl.FLOAT, false, kNumbersPerSegment * kBytes, offset * kBytes);
      gl.vertexAttribDivisor(place, 1);
      offset += count;
    });
    gl.bindVertexArray(null);
    this.segments = [];
  }

  /** `colour`: red, green, blue and opacity, 0..1. */
  add(from, to, colour, toColour = colour) {
    this.segments.push(...from, ...to, ...colour, ...toColour);
  }

  addStrip(points, colour) {
    for (let i = 1; i < points.length; i++) this.add(points[i - 1], points[i], colour);
  }

  /** Draws what was added since the last time, and forgets it. `onTop`: whatever is in front of it. */
  draw(orbit, pixelRatio, widthPx, onTop = false) {
    if (this.segments.length === 0) return;
    const { gl } = this;
    const { program, uniforms } = this.program;
    gl.useProgram(program);
    gl.uniformMatrix4fv(uniforms.worldToClip, false, orbit.worldToClip);
    gl.uniform2f(uniforms.viewPx, orbit.width * pixelRatio, orbit.height * pixelRatio);
    gl.uniform1f(uniforms.widthPx, widthPx * pixelRatio);
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(this.segments), gl.STREAM_DRAW);
    if (onTop) gl.disable(gl.DEPTH_TEST);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.segments.length / kNumbersPerSegment);
    gl.enable(gl.DEPTH_TEST);
    gl.bindVertexArray(null);
    this.segments = [];
  }
}

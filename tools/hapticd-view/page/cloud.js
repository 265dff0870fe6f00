// SPDX-License-Identifier: Apache-2.0
// The depth frame on the graphics card: an integer texture of raw values, drawn as points.

import { cloudProgram } from './shaders.js';

/** How the cloud is coloured; the index is what the shader takes. */
export const kColourings = ['depth', 'height', 'modelled'];

export class Cloud {
  constructor(gl) {
    this.gl = gl;
    this.program = cloudProgram(gl);
    this.texture = gl.createTexture();
    this.points = gl.createVertexArray();
    this.frame = null;
    this.largestPx = gl.getParameter(gl.ALIASED_POINT_SIZE_RANGE)?.[1] ?? 1;
  }

  /** Takes over a frame; the texture is made anew only where the size changes. */
  upload(frame) {
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 2);
    gl.pixelStorei(gl.UNPACK_ROW_LENGTH, frame.stride);
    if (this.frame?.width !== frame.width || this.frame?.height !== frame.height) {
      gl.texImage2D(
        gl.TEXTURE_2D, 0, gl.R16UI, frame.width, frame.height, 0, gl.RED_INTEGER, gl.UNSIGNED_SHORT, frame.raw);
      for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
        gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
      }
      for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) {
        gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
      }
    } else {
      gl.texSubImage2D(
        gl.TEXTURE_2D, 0, 0, 0, frame.width, frame.height, gl.RED_INTEGER, gl.UNSIGNED_SHORT, frame.raw);
    }
    gl.pixelStorei(gl.UNPACK_ROW_LENGTH, 0);
    this.frame = frame;
  }

  /** `look`: every (1: each pixel), colouring (index), rangeM (nearest, farthest, lowest, highest), ramp, accent, ball, limitsM. */
  draw(orbit, pixelRatio, look) {
    const { gl, frame } = this;
    if (!frame) return;
    const { program, uniforms } = this.program;
    const r = frame.rotation;
    gl.useProgram(program);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.uniform1i(uniforms.image, 0);
    gl.uniform2i(uniforms.size, frame.width, frame.height);
    gl.uniform1i(uniforms.every, look.every);
    gl.uniform1ui(uniforms.rawNone, frame.rawNone);
    gl.uniform1i(uniforms.isLinear, frame.isLinear ? 1 : 0);
    gl.uniform2f(uniforms.law, ...frame.law);
    gl.uniform2f(uniforms.limitsM, ...look.limitsM);
    gl.uniform4f(uniforms.intrinsics, frame.fx, frame.fy, frame.cx, frame.cy);
    gl.uniformMatrix3fv(uniforms.rotation, false, [r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]]);
    gl.uniform3f(uniforms.position, ...frame.position);
    gl.uniformMatrix4fv(uniforms.worldToClip, false, orbit.worldToClip);
    gl.uniform1f(uniforms.focalPx, orbit.focalPx * pixelRatio);
    gl.uniform1f(uniforms.largestPx, Math.min(this.largestPx, 24));
    gl.uniform1i(uniforms.colouring, look.colouring);
    gl.uniform4f(uniforms.rangeM, ...look.rangeM);
    gl.uniform3fv(uniforms.ramp, look.ramp.flat());
    gl.uniform3f(uniforms.accent, ...look.accent);
    gl.uniform4f(uniforms.ball, ...(look.ball ? [...look.ball.centre, look.ball.radiusM] : [0, 0, 0, 0]));
    gl.bindVertexArray(this.points);
    gl.drawArrays(gl.POINTS, 0, Math.floor(frame.width / look.every) * Math.floor(frame.height / look.every));
    gl.bindVertexArray(null);
  }
}

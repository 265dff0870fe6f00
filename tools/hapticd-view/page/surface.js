// SPDX-License-Identifier: Apache-2.0
// The depth frame on the graphics card: the triangles of its surface, and points where no triangle is.

import { kRamp } from './ramp.js';
import { surfaceProgram } from './shaders.js';
import { SurfaceGrid } from './surface_grid.js';

/** How the surface is coloured; the index is what the shader takes. */
export const kColourings = ['depth', 'height', 'modelled'];
const kLargestPointPx = 24;

export class Surface {
  constructor(gl) {
    this.gl = gl;
    this.program = surfaceProgram(gl);
    this.grid = new SurfaceGrid();
    this.array = gl.createVertexArray();
    this.corners = gl.createBuffer();
    this.normals = gl.createBuffer();
    this.triangles = gl.createBuffer();
    this.loose = gl.createBuffer();
    gl.bindVertexArray(this.array);
    gl.enableVertexAttribArray(0);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.corners);
    gl.vertexAttribPointer(0, 1, gl.FLOAT, false, 0, 0);
    gl.enableVertexAttribArray(1);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.normals);
    // four of them: three would be converted by the driver for each frame
    gl.vertexAttribPointer(1, 4, gl.BYTE, true, 4, 0);
    gl.bindVertexArray(null);
    this.frame = null;
    this.made = '';
    this.largestPx = Math.min(gl.getParameter(gl.ALIASED_POINT_SIZE_RANGE)?.[1] ?? 1, kLargestPointPx);
  }

  /** Makes the surface of a frame, if it is not that which is there already. */
  take(frame, limitsM, every) {
    const made = [every, ...limitsM].join();
    if (frame === this.frame && made === this.made) return;
    this.frame = frame;
    this.made = made;
    const { gl, grid } = this;
    grid.take(frame, limitsM, every);
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.corners);
    gl.bufferData(gl.ARRAY_BUFFER, grid.inverse, gl.STREAM_DRAW);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.normals);
    gl.bufferData(gl.ARRAY_BUFFER, grid.normals, gl.STREAM_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.loose);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, grid.triangulation.loose, gl.STREAM_DRAW, 0, grid.triangulation.looseCorners);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.triangles);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, grid.triangulation.triangles, gl.STREAM_DRAW, 0, grid.triangulation.triangleCorners);
    gl.bindVertexArray(null);
  }

  /** Sets what the colour pass and a shell have in common. `offsetM`: so far in front of the surface, along its normals. */
  begin(orbit, pixelRatio, offsetM) {
    const { gl, frame, grid } = this;
    const { program, uniforms } = this.program;
    const r = frame.rotation;
    gl.useProgram(program);
    gl.uniform1i(uniforms.columns, grid.columns);
    gl.uniform1f(uniforms.every, grid.every);
    gl.uniform4f(uniforms.intrinsics, frame.fx, frame.fy, frame.cx, frame.cy);
    gl.uniformMatrix3fv(uniforms.rotation, false, [r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]]);
    gl.uniform3f(uniforms.position, ...frame.position);
    gl.uniformMatrix4fv(uniforms.worldToClip, false, orbit.worldToClip);
    gl.uniform1f(uniforms.pointPx, orbit.focalPx * pixelRatio);
    gl.uniform1f(uniforms.largestPx, this.largestPx);
    gl.uniform1f(uniforms.offsetM, offsetM);
    gl.bindVertexArray(this.array);
  }

  /** `look`: colouring (index), rangeM (nearest, farthest, lowest, highest), reversed, plain, accent, ball. */
  draw(orbit, pixelRatio, look) {
    if (!this.frame) return;
    const { gl, grid } = this;
    const { uniforms } = this.program;
    this.begin(orbit, pixelRatio, 0);
    gl.uniform1i(uniforms.colouring, look.colouring);
    gl.uniform4f(uniforms.rangeM, ...look.rangeM);
    gl.uniform3fv(uniforms.ramp, (look.reversed ? [...kRamp].reverse() : kRamp).flat());
    gl.uniform3f(uniforms.plain, ...look.plain);
    gl.uniform3f(uniforms.accent, ...look.accent);
    gl.uniform4f(uniforms.ball, ...(look.ball ? [...look.ball.centre, look.ball.radiusM] : [0, 0, 0, 0]));
    gl.uniform1f(uniforms.alpha, 1);
    // without a graphics card blending would cost as much as the rest
    gl.disable(gl.BLEND);
    gl.drawElements(gl.TRIANGLES, grid.triangulation.triangleCorners, gl.UNSIGNED_INT, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.loose);
    gl.drawElements(gl.POINTS, grid.triangulation.looseCorners, gl.UNSIGNED_INT, 0);
    gl.enable(gl.BLEND);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.triangles);
    gl.bindVertexArray(null);
  }

  /** A translucent skin so far in front of the surface. */
  drawShell(orbit, pixelRatio, { clearanceM, colour, alpha }) {
    if (!this.frame) return;
    const { gl, grid } = this;
    const { uniforms } = this.program;
    this.begin(orbit, pixelRatio, clearanceM);
    gl.uniform1i(uniforms.colouring, kColourings.indexOf('modelled'));
    gl.uniform3f(uniforms.plain, ...colour);
    gl.uniform4f(uniforms.ball, 0, 0, 0, 0);
    gl.uniform1f(uniforms.alpha, alpha);
    gl.depthMask(false);
    gl.drawElements(gl.TRIANGLES, grid.triangulation.triangleCorners, gl.UNSIGNED_INT, 0);
    gl.depthMask(true);
    gl.bindVertexArray(null);
  }
}

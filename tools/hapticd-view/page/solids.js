// SPDX-License-Identifier: Apache-2.0
// Draws spheres, arrows and the shapes of fixtures, opaque or translucent; what the cloud hides of them shows through faintly.

import { cone, cube, cylinder, sphere } from './meshes.js';
import { solidProgram } from './shaders.js';
import { add, norm, perpendiculars, placed, scale, subtract, unit } from './vectors.js';

/** Opacity of what lies behind the cloud: a hand inside a surface must stay visible. */
const kHiddenShare = 0.55;

export class Solids {
  constructor(gl) {
    this.gl = gl;
    this.program = solidProgram(gl);
    this.sphere = this.mesh(sphere());
    this.cylinder = this.mesh(cylinder());
    this.cone = this.mesh(cone());
    this.cube = this.mesh(cube());
  }

  mesh({ corners, indices }) {
    const { gl } = this;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    for (const place of [0, 1]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 24, 12 * place);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return { array, count: indices.length };
  }

  begin(orbit) {
    const { gl } = this;
    gl.useProgram(this.program.program);
    gl.uniformMatrix4fv(this.program.uniforms.worldToClip, false, orbit.worldToClip);
    gl.uniform3f(this.program.uniforms.eye, ...orbit.eye);
  }

  draw(mesh, place, { colour, alpha = 1, rim = 0, shade = 0.45, throughCloud = true }) {
    const { gl } = this;
    const { uniforms } = this.program;
    gl.uniformMatrix4fv(uniforms.place, false, place);
    gl.uniform1f(uniforms.shade, shade);
    gl.bindVertexArray(mesh.array);
    if (throughCloud) {
      gl.depthFunc(gl.GREATER);
      gl.depthMask(false);
      gl.uniform1f(uniforms.rim, rim * kHiddenShare);
      gl.uniform4f(uniforms.colour, ...colour, alpha * kHiddenShare);
      gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_SHORT, 0);
      gl.depthFunc(gl.LEQUAL);
    }
    gl.depthMask(alpha === 1);
    gl.uniform1f(uniforms.rim, rim);
    gl.uniform4f(uniforms.colour, ...colour, alpha);
    gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_SHORT, 0);
    gl.depthMask(true);
    gl.bindVertexArray(null);
  }

  drawSphere(centre, radiusM, look) {
    this.draw(this.sphere, placed(centre, [radiusM, 0, 0], [0, radiusM, 0], [0, 0, radiusM]), look);
  }

  /** `half`: half its edges along `axes`. */
  drawBox(centre, half, axes, look) {
    this.draw(this.cube, placed(centre, ...axes.map((axis, i) => scale(axis, half[i]))), look);
  }

  drawCapsule(from, to, radiusM, look) {
    const along = subtract(to, from);
    const [x, z] = perpendiculars(unit(along));
    this.draw(this.cylinder, placed(from, scale(x, radiusM), along, scale(z, radiusM)), look);
    this.drawSphere(from, radiusM, look);
    this.drawSphere(to, radiusM, look);
  }

  /** `end`: the middle of its wide end. */
  drawCone(tip, end, radiusM, look) {
    const along = subtract(tip, end);
    const [x, z] = perpendiculars(unit(along));
    this.draw(this.cone, placed(end, scale(x, radiusM), along, scale(z, radiusM)), look);
  }

  /** From `tail` along `vector` (metres), with a head. */
  drawArrow(tail, vector, thicknessM, look) {
    const length = norm(vector);
    if (length < 1e-6) return;
    const axis = unit(vector);
    const [x, z] = perpendiculars(axis);
    const headM = Math.min(0.45 * length, 5 * thicknessM);
    const shaftM = length - headM;
    const sized = (at, width, height) => placed(at, scale(x, width), scale(axis, height), scale(z, width));
    this.draw(this.cylinder, sized(tail, thicknessM, shaftM), look);
    this.draw(this.cone, sized(add(tail, scale(axis, shaftM)), 2.4 * thicknessM, headM), look);
  }
}

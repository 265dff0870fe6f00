// SPDX-License-Identifier: Apache-2.0
// How much of the cloud is drawn: all of it, or every n-th pixel both ways where the machine cannot keep up.

/** A picture that takes longer than this makes the next ones coarser. */
const kSlowMs = 50;
const kCoarsest = 4;
/** Pictures that must be slow one after the other: the first ones compile shaders. */
const kSlowPictures = 4;

/** Whether this browser draws WebGL on the CPU. */
export function isSoftware() {
  const gl = document.createElement('canvas').getContext('webgl2');
  const names = gl?.getExtension('WEBGL_debug_renderer_info');
  const name = names ? gl.getParameter(names.UNMASKED_RENDERER_WEBGL) : '';
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}

export class Detail {
  /** Begins with each `every`-th pixel; `onChange()` when the picture has to be drawn again. */
  constructor(gl, every, onChange) {
    this.gl = gl;
    this.onChange = onChange;
    this.every = every;
    this.forced = false;
    this.slow = 0;
    this.fence = null;
  }

  /** Draws every pixel whatever it costs. */
  force(wanted) {
    this.forced = wanted;
    this.slow = 0;
    if (wanted) this.every = 1;
    this.onChange();
  }

  /** To be called when all of a picture has been given to the graphics card. */
  measure() {
    if (this.forced || this.fence || this.every >= kCoarsest) return;
    const { gl } = this;
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    const begunMs = performance.now();
    const look = () => {
      const done = !this.fence || gl.isContextLost() ||
        gl.getSyncParameter(this.fence, gl.SYNC_STATUS) === gl.SIGNALED;
      if (!done && performance.now() - begunMs <= kSlowMs) return setTimeout(look, 5);
      if (this.fence && !gl.isContextLost()) gl.deleteSync(this.fence);
      this.fence = null;
      this.slow = done ? 0 : this.slow + 1;
      if (this.forced || this.slow < kSlowPictures) return undefined;
      this.slow = 0;
      this.every++;
      return this.onChange();
    };
    setTimeout(look, 5);
  }
}

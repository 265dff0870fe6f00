// SPDX-License-Identifier: Apache-2.0
// How much of the cloud is drawn: all of it, or every n-th pixel both ways where the machine cannot keep up.

/** A picture that takes longer than this makes the next ones coarser. */
const kSlowMs = 70;
const kCoarsest = 4;
/** Pictures that must be slow one after the other: the first ones compile shaders. */
const kSlowPictures = 6;

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
  constructor(every, onChange) {
    this.onChange = onChange;
    this.every = every;
    this.forced = false;
    this.slow = 0;
    this.measures = false;
  }

  /** Draws every pixel whatever it costs. */
  force(wanted) {
    this.forced = wanted;
    this.slow = 0;
    if (wanted) this.every = 1;
    this.onChange();
  }

  /** To be called before a picture is drawn: the screen takes the next one when this one is done. */
  measure() {
    if (this.forced || this.measures || this.every >= kCoarsest || document.hidden) return;
    this.measures = true;
    const begunMs = performance.now();
    requestAnimationFrame(() => {
      this.measures = false;
      this.slow = performance.now() - begunMs > kSlowMs ? this.slow + 1 : 0;
      if (this.forced || this.slow < kSlowPictures) return;
      this.slow = 0;
      this.every++;
      this.onChange();
    });
  }
}

// SPDX-License-Identifier: Apache-2.0
// What the page may cost: it draws coarser and less often where pictures take long, and where the box suffers from it.

/** From the finest to the cheapest: pixels per corner of the surface both ways, canvas pixels per pixel, pictures/s. */
const kLevels = [
  { every: 2, pixels: 2, hz: 60 },
  { every: 2, pixels: 1, hz: 30 },
  { every: 3, pixels: 1, hz: 30 },
  { every: 4, pixels: 1, hz: 30 },
  { every: 4, pixels: 0.75, hz: 30 },
  { every: 4, pixels: 0.75, hz: 15 },
  { every: 5, pixels: 0.5, hz: 10 },
  { every: 6, pixels: 0.5, hz: 5 },
];
/** Where the CPU draws, it is likely to be the box's own: it begins here and never gets finer. */
const kSoftwareLevel = 3;
const kMostDepthHz = 30;
/** A picture is slow that takes longer than this, or than its turn where that is longer. */
const kSlowMs = 60;
/** So many slow pictures in succession lower the level: the first ones compile shaders. */
const kSlowPictures = 6;
/** So long all must have been well before a finer level is tried, and twice as long after each time that failed. */
const kCalmMs = 20_000;
/** Below this share of its best rate the camera loses frames. */
const kCameraShare = 0.8;
const kCameraPauseMs = 3000;

/** Whether this browser draws WebGL on the CPU. */
export function isSoftware() {
  const gl = document.createElement('canvas').getContext('webgl2');
  const names = gl?.getExtension('WEBGL_debug_renderer_info');
  const name = names ? gl.getParameter(names.UNMASKED_RENDERER_WEBGL) : '';
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}

export class Budget {
  /** `onChange()` after each change of what may be drawn. */
  constructor(software, onChange) {
    this.software = software;
    this.onChange = onChange;
    this.finest = software ? kSoftwareLevel : 0;
    this.level = this.finest;
    this.full = false;
    this.slow = 0;
    this.measures = false;
    this.calmMs = kCalmMs;
    this.raised = false;
    this.changedMs = performance.now();
    this.bestCameraHz = 0;
  }

  /** Each `every`-th pixel both ways is a corner of the surface. */
  get every() {
    return this.full ? 1 : kLevels[this.level].every;
  }

  /** Canvas pixels for each pixel of the page, at most. */
  get pixels() {
    return this.full ? kLevels[0].pixels : kLevels[this.level].pixels;
  }

  /** Pictures a second, at most. */
  get hz() {
    return kLevels[this.level].hz;
  }

  get depthHz() {
    return Math.min(this.hz, kMostDepthHz);
  }

  /** What is spared, for people; '' where nothing is. */
  get note() {
    if (this.full || (!this.software && this.level === 0)) return '';
    const why = this.software ? 'No graphics card' : 'Slow graphics';
    const size = this.pixels < 1 ? ` at ${100 * this.pixels} % size` : '';
    return `${why}: 1 of ${this.every ** 2} depth pixels, up to ${this.hz} pictures/s${size}`;
  }

  /** Draws every pixel whatever it costs. */
  setFull(wanted) {
    this.full = wanted;
    this.slow = 0;
    this.onChange();
  }

  /** To be called before a picture is drawn: the screen takes the next one when this one is done. */
  measure() {
    if (this.full || this.measures || document.hidden) return;
    this.measures = true;
    const begunMs = performance.now();
    requestAnimationFrame(() => {
      this.measures = false;
      const tookMs = performance.now() - begunMs;
      this.slow = tookMs > Math.max(kSlowMs, 1000 / this.hz) ? this.slow + 1 : 0;
      if (this.slow >= kSlowPictures) this.lower();
      else if (this.slow === 0) this.raiseWhenCalm();
    });
  }

  /** The rate of the box's camera: a page that shares the box's CPUs must not take frames from it. */
  hearCamera(rateHz) {
    if (!this.software || !(rateHz > 0)) return;
    this.bestCameraHz = Math.max(this.bestCameraHz, rateHz);
    const suffers = rateHz < kCameraShare * this.bestCameraHz;
    if (suffers && performance.now() - this.changedMs > kCameraPauseMs) this.lower();
  }

  lower() {
    this.slow = 0;
    if (this.raised) this.calmMs *= 2;
    this.raised = false;
    this.change(Math.min(this.level + 1, kLevels.length - 1));
  }

  raiseWhenCalm() {
    if (this.level === this.finest || performance.now() - this.changedMs < this.calmMs) return;
    this.raised = true;
    this.change(this.level - 1);
  }

  change(level) {
    this.changedMs = performance.now();
    if (level === this.level) return;
    this.level = level;
    this.onChange();
  }
}

// SPDX-License-Identifier: Apache-2.0
// The eye of the view: it looks at a target from a distance, up is the world's +y. Mouse, touch and keyboard move it;
// views.js has the named views.

import { add, cross, dot, multiply, perspective, scale, subtract, unit, viewOf } from './vectors.js';

const kUp = [0, 1, 0];
const kSteepestRad = Math.PI / 2 - 1e-4;
const kNearestM = 0.05;
const kFarthestM = 30;
const kClipNearM = 0.01;
const kClipFarM = 60;
/** Half the width and half the height at a distance of 1 that always fit into the view: of most depth cameras. */
const kUsualLens = [Math.tan((29.5 * Math.PI) / 180), Math.tan((23 * Math.PI) / 180)];
const kWidestRad = 2.4;
/** A focused point is looked at from no farther than this. */
const kFocusM = 0.6;

export class Orbit {
  constructor() {
    this.target = [0, 0, -1];
    this.yawRad = 0.55;
    this.pitchRad = -0.35;
    this.rollRad = 0;
    this.distanceM = 1.6;
    this.lens = kUsualLens;
    this.resize(1, 1);
  }

  /** Size of the view in CSS pixels. */
  resize(width, height) {
    this.width = Math.max(width, 1);
    this.height = Math.max(height, 1);
    const half = Math.max(this.lens[1], (this.lens[0] * this.height) / this.width);
    this.verticalAngleRad = Math.min(2 * Math.atan(half), kWidestRad);
    /** Pixels by which something is large that is 1 m large at 1 m. */
    this.focalPx = this.height / 2 / Math.tan(this.verticalAngleRad / 2);
    this.update();
  }

  /** Half the width and half the height at a distance of 1 that are to fit into the view; what is usual without. */
  setLens(lens = kUsualLens) {
    this.lens = lens;
    this.resize(this.width, this.height);
  }

  update() {
    const forward = [
      -Math.sin(this.yawRad) * Math.cos(this.pitchRad),
      Math.sin(this.pitchRad),
      -Math.cos(this.yawRad) * Math.cos(this.pitchRad),
    ];
    const level = [Math.cos(this.yawRad), 0, -Math.sin(this.yawRad)];
    const upright = cross(level, forward);
    const c = Math.cos(this.rollRad);
    const s = Math.sin(this.rollRad);
    this.forward = forward;
    this.right = add(scale(level, c), scale(upright, s));
    this.up = subtract(scale(upright, c), scale(level, s));
    this.eye = subtract(this.target, scale(forward, this.distanceM));
    const view = viewOf(this.eye, this.right, this.up, scale(forward, -1));
    this.worldToClip = multiply(
      perspective(this.verticalAngleRad, this.width / this.height, kClipNearM, kClipFarM), view);
  }

  /** Looks from `eye` along `forward`, at what is `distanceM` away; `up` is what is upwards in the picture. */
  lookAlong(eye, forward, up, distanceM) {
    const ahead = unit(forward, [0, 0, -1]);
    this.distanceM = Math.min(Math.max(distanceM, kNearestM), kFarthestM);
    this.target = add(eye, scale(ahead, this.distanceM));
    this.pitchRad = Math.min(Math.max(Math.asin(ahead[1]), -kSteepestRad), kSteepestRad);
    const level = Math.hypot(ahead[0], ahead[2]) > 1e-3 ? ahead : scale(up, ahead[1] > 0 ? -1 : 1);
    this.yawRad = Math.atan2(-level[0], -level[2]);
    this.rollRad = 0;
    this.update();
    this.rollRad = Math.atan2(-dot(up, this.right), dot(up, this.up));
    this.update();
  }

  turn(yawRad, pitchRad) {
    this.yawRad += yawRad;
    this.pitchRad = Math.min(Math.max(this.pitchRad + pitchRad, -kSteepestRad), kSteepestRad);
    this.rollRad = 0;
    this.update();
  }

  /** Moves what is at the target by so many pixels. */
  pan(xPx, yPx) {
    const metresPerPx = this.distanceM / this.focalPx;
    this.target = add(this.target, add(scale(this.right, -xPx * metresPerPx), scale(this.up, yPx * metresPerPx)));
    this.update();
  }

  /** Towards a place of the view, its middle where none is given: what is there at the target's distance stays there. */
  zoom(factor, xPx = this.width / 2, yPx = this.height / 2) {
    const distanceM = Math.min(Math.max(this.distanceM / factor, kNearestM), kFarthestM);
    const metres = (this.distanceM - distanceM) / this.focalPx;
    const right = scale(this.right, (xPx - this.width / 2) * metres);
    const up = scale(this.up, (this.height / 2 - yPx) * metres);
    this.target = add(this.target, add(right, up));
    this.distanceM = distanceM;
    this.update();
  }

  /** Brings a point to the middle, from the same side, and closer where it is far. */
  focus(point) {
    this.target = point;
    this.distanceM = Math.min(this.distanceM, kFocusM);
    this.update();
  }

  /** Where a point of the world is in the view, CSS pixels from its upper left corner; null behind the eye. */
  project(point) {
    const offset = subtract(point, this.eye);
    const depth = dot(offset, this.forward);
    if (depth < kClipNearM) return null;
    return {
      x: this.width / 2 + (this.focalPx * dot(offset, this.right)) / depth,
      y: this.height / 2 - (this.focalPx * dot(offset, this.up)) / depth,
      depth,
    };
  }

  /** The direction in the world in which a place of the view lies. */
  rayThrough(xPx, yPx) {
    const x = (xPx - this.width / 2) / this.focalPx;
    const y = (this.height / 2 - yPx) / this.focalPx;
    return unit(add(this.forward, add(scale(this.right, x), scale(this.up, y))));
  }
}

// SPDX-License-Identifier: Apache-2.0
// Draws the picture: cloud, hand, force, fixtures, camera, grid. Draws only when something has changed.

import { Budget, isSoftware } from './budget.js';
import { addOutlines, drawFixtures } from './fixture_picture.js';
import { Labels } from './labels.js';
import { Legend } from './legend.js';
import { Lines } from './lines.js';
import { Solids } from './solids.js';
import { kColourings, Surface } from './surface.js';
import { add, perpendiculars, rotate, scale, subtract, unit } from './vectors.js';

/** The screen's own rhythm is not exact: a picture that is due this much later is drawn now. */
const kEarlyMs = 6;
const kCircleCorners = 72;
/** The largest permitted force is an arrow of this length. */
const kLongestArrowM = 0.4;
const kCoreM = 0.006;
const kTargetM = 0.004;
const kToolM = 0.08; // from the interaction point to the end of the tool that the hand holds
const kToolRadiusM = 0.0025;
const kThicknessM = 0.005;
const kCameraM = 0.12;
const kFrustumM = 4;
const kAxisM = 0.15;
const kGridHalfM = 3;
/** The tip of an arrow is at least so far from the picture's edge, and from the controls above it. */
const kEdgePx = 28;

export class Picture {
  /** `scene` is what is drawn, see main.js; `labelFolder` the element that holds the labels. */
  constructor(canvas, labelFolder, orbit, scene) {
    this.canvas = canvas;
    this.orbit = orbit;
    this.scene = scene;
    this.labels = new Labels(labelFolder);
    this.legend = new Legend();
    this.renders = 0;
    this.contextsLost = 0;
    this.scheduled = false;
    this.drawnMs = 0;
    /** Called with each depth frame when its picture is about to be drawn. */
    this.onDrawing = () => {};
    // without a graphics card smooth edges cost more than everything else together
    const software = isSoftware();
    const antialias = !software;
    this.gl = canvas.getContext('webgl2', { antialias, alpha: false, powerPreference: 'low-power' });
    if (!this.gl) throw new Error('This browser does not support WebGL2, so the 3D view cannot be drawn.');
    this.budget = new Budget(software, () => {
      this.resize();
      this.onBudget();
    });
    this.onBudget = () => {};
    this.create();
    canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault(); // asks the browser to restore it
      this.contextsLost++;
      this.ready = false;
    });
    canvas.addEventListener('webglcontextrestored', () => {
      this.create();
      this.request();
    });
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
  }

  create() {
    const { gl } = this;
    this.surface = new Surface(gl);
    this.lines = new Lines(gl);
    this.solids = new Solids(gl);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    this.ready = true;
  }

  resize() {
    this.pixelRatio = Math.min(window.devicePixelRatio || 1, this.budget.pixels);
    const { clientWidth, clientHeight } = this.canvas;
    this.canvas.width = Math.max(1, Math.round(clientWidth * this.pixelRatio));
    this.canvas.height = Math.max(1, Math.round(clientHeight * this.pixelRatio));
    this.orbit.resize(clientWidth, clientHeight);
    this.topPx = Math.max(0, ...[...this.canvas.parentElement.querySelectorAll('.controls')]
      .map(({ offsetTop, offsetHeight }) => offsetTop + offsetHeight));
    this.request();
  }

  /** Draws with the next picture of the screen that the budget allows. */
  request() {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame(() => this.drawWhenDue());
  }

  drawWhenDue() {
    const nowMs = performance.now();
    if (nowMs - this.drawnMs < 1000 / this.budget.hz - kEarlyMs) {
      requestAnimationFrame(() => this.drawWhenDue());
      return;
    }
    this.scheduled = false;
    this.drawnMs = nowMs;
    this.budget.measure();
    const { frame } = this.scene;
    // before the work, so that the next frame is on its way meanwhile
    if (frame && frame !== this.reported) this.onDrawing(frame);
    this.reported = frame;
    this.render();
  }

  render() {
    if (!this.ready || this.gl.isContextLost()) return;
    const { gl, orbit, pixelRatio, scene, surface } = this;
    if (scene.frame) surface.take(scene.frame, scene.limitsM, this.budget.every);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(...scene.theme.background, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.labels.begin(orbit);
    if (scene.layers.grid) this.addGrid();
    if (scene.layers.camera) this.addCamera();
    this.lines.draw(orbit, pixelRatio, 1);
    if (scene.layers.cloud) {
      surface.draw(orbit, pixelRatio, {
        colouring: kColourings.indexOf(scene.colouring),
        reversed: this.reversed,
        rangeM: scene.rangeM,
        plain: scene.theme.plain,
        accent: scene.theme.accent,
        ball: scene.layers.model ? scene.ball : null,
      });
    }
    if (scene.layers.axes) this.addAxes();
    if (scene.layers.model && scene.ball) this.addBall();
    if (scene.layers.trail) this.addTrail();
    this.addPicks();
    if (scene.layers.fixtures) addOutlines(this);
    this.lines.draw(orbit, pixelRatio, 2);
    if (scene.layers.fixtures) drawFixtures(this);
    if (scene.layers.hand) this.drawHand();
    this.labels.end();
    this.legend.show(orbit, { colouring: scene.colouring, rangeM: scene.rangeM, reversed: this.reversed });
    this.renders++;
  }

  /** What is near stands out from the background, and so does what is high. */
  get reversed() {
    return (this.scene.colouring === 'depth') === this.scene.theme.isDark;
  }

  addGrid() {
    const { grid } = this.scene.theme;
    const { floorM, centre } = this.scene;
    const middle = [Math.round(centre[0]), floorM, Math.round(centre[2])];
    const clear = [...grid, 0];
    // each line fades from its middle to its ends
    const line = (from, to, alpha) => {
      const half = scale(add(from, to), 0.5);
      this.lines.add(from, half, clear, [...grid, alpha]);
      this.lines.add(half, to, [...grid, alpha], clear);
    };
    for (let i = -10 * kGridHalfM; i <= 10 * kGridHalfM; i++) {
      const metre = i % 10 === 0;
      if (!metre && Math.abs(i) > 10) continue;
      const at = i / 10;
      const reachM = metre ? kGridHalfM : 1;
      const alpha = metre ? 0.9 * (1 - Math.abs(at) / (kGridHalfM + 0.5)) : 0.3;
      line(add(middle, [at, 0, -reachM]), add(middle, [at, 0, reachM]), alpha);
      line(add(middle, [-reachM, 0, at]), add(middle, [reachM, 0, at]), alpha);
    }
  }

  addAxes() {
    const { axes } = this.scene.theme;
    ['x', 'y', 'z'].forEach((name, i) => {
      const end = [0, 0, 0];
      end[i] = kAxisM;
      this.lines.add([0, 0, 0], end, [...axes[i], 1]);
      this.labels.put(`axis-${name}`, scale(end, 1.18), name, `axis axis-${name}`);
    });
  }

  /** The camera as a small pyramid, and the edges of what it sees. */
  addCamera() {
    const { frame, limitsM, theme } = this.scene;
    if (!frame) return;
    const corner = (column, row, z) => frame.toWorld([
      ((column - frame.cx) * z) / frame.fx, (-(row - frame.cy) * z) / frame.fy, -z]);
    const at = (z) => [
      corner(-0.5, -0.5, z), corner(frame.width - 0.5, -0.5, z),
      corner(frame.width - 0.5, frame.height - 0.5, z), corner(-0.5, frame.height - 0.5, z)];
    const near = at(kCameraM);
    const far = at(Math.min(limitsM[1], kFrustumM));
    for (let i = 0; i < 4; i++) {
      this.lines.add(frame.position, near[i], [...theme.frustum, 0.9]);
      this.lines.add(near[i], near[(i + 1) % 4], [...theme.frustum, 0.9]);
      this.lines.add(near[i], far[i], [...theme.frustum, 0.45], [...theme.frustum, 0]);
    }
    this.labels.put('camera', frame.position, 'camera', 'place');
  }

  /** The outline of the modelled ball, as seen from the eye. */
  addBall() {
    const { ball, theme } = this.scene;
    const [x, y] = perpendiculars(unit(subtract(this.orbit.eye, ball.centre)));
    const points = [];
    for (let i = 0; i <= kCircleCorners; i++) {
      const angle = (2 * Math.PI * i) / kCircleCorners;
      const offset = add(scale(x, Math.cos(angle)), scale(y, Math.sin(angle)));
      points.push(add(ball.centre, scale(offset, ball.radiusM)));
    }
    this.lines.addStrip(points, [...theme.accent, 0.45]);
  }

  addTrail() {
    const { trail, theme } = this.scene;
    for (let i = 1; i < trail.length; i++) {
      const alpha = 0.8 * (i / trail.length);
      this.lines.add(trail[i - 1].at, trail[i].at, [...theme.trail, alpha]);
    }
  }

  addPicks() {
    const { picks, theme } = this.scene;
    for (const pick of picks) this.labels.put(`pick-${pick.name}`, pick.world, pick.name, 'pick');
    if (picks.length < 2) return;
    const [a, b] = picks.slice(-2);
    this.lines.add(a.world, b.world, [...theme.ink, 0.9]);
  }

  drawHand() {
    const { hip, held, target, proxy, force, guidance, radii, theme, layers, arrowMPerN, forceText, guidanceText } = this.scene;
    if (!hip) return;
    this.solids.begin(this.orbit);
    this.solids.drawSphere(hip, Math.min(kCoreM, radii.hipM), { colour: theme.accent, shade: 0.25 });
    if (held) {
      const end = add(hip, rotate(held, [0, 0, kToolM]));
      this.solids.drawCapsule(hip, end, kToolRadiusM, { colour: theme.ink, shade: 0.35 });
    }
    if (target) this.solids.drawSphere(target, kTargetM, { colour: theme.ink, shade: 0.25 });
    if (force && layers.force) {
      const vector = this.insidePicture(hip, scale(force, arrowMPerN));
      this.solids.drawArrow(hip, vector, kThicknessM, { colour: theme.force, shade: 0.3 });
      if (forceText) this.labels.put('force', add(hip, vector), forceText, 'force');
    }
    if (guidanceText && layers.force) {
      const vector = this.insidePicture(hip, scale(guidance, arrowMPerN));
      this.solids.drawArrow(hip, vector, kThicknessM, { colour: theme.guidance, shade: 0.3 });
      this.labels.put('guidance-force', add(hip, vector), guidanceText, 'force guidance');
    }
    if (proxy) {
      this.solids.drawSphere(proxy, radii.proxyM, { colour: theme.ink, alpha: 0.55, rim: 0.45, shade: 0.35 });
    }
    this.solids.drawSphere(hip, radii.hipM, { colour: theme.accent, alpha: 0.22, rim: 0.75, shade: 0.1 });
  }

  /** The longest part of a vector from `tail` whose tip is in the picture; all of it where its tail is not. */
  insidePicture(tail, vector) {
    const { orbit } = this;
    const shows = (point) => {
      const place = orbit.project(point);
      return place && place.x >= kEdgePx && place.x <= orbit.width - kEdgePx &&
        place.y >= this.topPx + kEdgePx && place.y <= orbit.height - kEdgePx;
    };
    if (!shows(tail) || shows(add(tail, vector))) return vector;
    let [inside, outside] = [0, 1];
    for (let step = 0; step < 12; step++) {
      const share = (inside + outside) / 2;
      if (shows(add(tail, scale(vector, share)))) inside = share;
      else outside = share;
    }
    return scale(vector, inside);
  }

  /** The picture as PNG; null where the context is lost. */
  async png() {
    this.render(); // the drawing buffer holds a picture only until it has been shown
    return new Promise((resolve) => this.canvas.toBlob(resolve, 'image/png'));
  }

  /** Red, green, blue and opacity, 0..255, of a rectangle in device pixels from the lower left corner. */
  readPixels(x, y, width, height) {
    this.render();
    const pixels = new Uint8Array(4 * width * height);
    this.gl.readPixels(x, y, width, height, this.gl.RGBA, this.gl.UNSIGNED_BYTE, pixels);
    return pixels;
  }
}

/** Metres per newton of the arrow, so that the largest permitted force still fits into the picture. */
export const arrowScale = (largestForceN) => kLongestArrowM / (largestForceN > 0 ? largestForceN : 4);

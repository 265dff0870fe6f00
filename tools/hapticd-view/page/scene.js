// SPDX-License-Identifier: Apache-2.0
// Draws the picture: cloud, hand, force, fixtures, camera, grid. Draws only when something has changed.

import { Detail, isSoftware } from './detail.js';
import { coneEnd, kPlaneHalfM, middleOf, outlineOf } from './fixtures.js';
import { Labels } from './labels.js';
import { Lines } from './lines.js';
import { Solids } from './solids.js';
import { kColourings, Surface } from './surface.js';
import { add, perpendiculars, scale, subtract, unit } from './vectors.js';

/** A phone with three times the pixels would draw nine times as much, and nobody would see it. */
const kMostPixelRatio = 2;
const kCircleCorners = 72;
/** The largest permitted force is an arrow of this length. */
const kLongestArrowM = 0.4;
const kCoreM = 0.006;
const kThicknessM = 0.005;
const kCameraM = 0.12;
const kFrustumM = 4;
const kAxisM = 0.15;
const kGridHalfM = 3;
const kGuidanceKnotM = 0.006;
const kPlaneThicknessM = 0.0005;

export class Picture {
  /** `scene` is what is drawn, see main.js; `labelFolder` the element that holds the labels. */
  constructor(canvas, labelFolder, orbit, scene) {
    this.canvas = canvas;
    this.orbit = orbit;
    this.scene = scene;
    this.labels = new Labels(labelFolder);
    this.renders = 0;
    this.contextsLost = 0;
    this.scheduled = false;
    // without a graphics card smooth edges cost more than everything else together
    const software = isSoftware();
    const antialias = !software;
    this.gl = canvas.getContext('webgl2', { antialias, alpha: false, powerPreference: 'low-power' });
    if (!this.gl) throw new Error('This browser has no WebGL2: the picture cannot be drawn.');
    this.detail = new Detail(software ? 2 : 1, () => this.request());
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
    this.pixelRatio = Math.min(window.devicePixelRatio || 1, kMostPixelRatio);
    const { clientWidth, clientHeight } = this.canvas;
    this.canvas.width = Math.max(1, Math.round(clientWidth * this.pixelRatio));
    this.canvas.height = Math.max(1, Math.round(clientHeight * this.pixelRatio));
    this.orbit.resize(clientWidth, clientHeight);
    this.request();
  }

  /** Draws with the next picture of the screen. */
  request() {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame(() => {
      this.scheduled = false;
      this.detail.measure();
      this.render();
    });
  }

  render() {
    if (!this.ready || this.gl.isContextLost()) return;
    const { gl, orbit, pixelRatio, scene, surface } = this;
    if (scene.frame) surface.take(scene.frame, scene.limitsM, this.detail.every);
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
        // near is what stands out from the background, as high is
        reversed: (scene.colouring === 'depth') === scene.theme.isDark,
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
    if (scene.layers.fixtures) this.addOutlines();
    this.lines.draw(orbit, pixelRatio, 2);
    if (scene.layers.fixtures) this.drawFixtures();
    if (scene.layers.hand) this.drawHand();
    this.labels.end();
    this.renders++;
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

  /** Outlines and names of fixtures and tissue regions: bright in contact, faint while disabled. */
  addOutlines() {
    const { theme } = this.scene;
    for (const { name, group, shape, enabled, inContact } of this.scene.additions) {
      if (!shape) continue;
      const alpha = inContact ? 1 : enabled ? 0.55 : 0.15;
      for (const line of outlineOf(shape, this.orbit.eye)) this.lines.addStrip(line, [...theme[group], alpha]);
      this.labels.put(`${group}-${name}`, middleOf(shape), name, `fixture ${group}`);
    }
  }

  drawFixtures() {
    const { additions, fixtureProxy, radii, theme } = this.scene;
    this.solids.begin(this.orbit);
    for (const { group, shape, enabled, inContact } of additions) {
      if (!shape) continue;
      const alpha = (inContact ? 0.3 : 0.16) * (enabled ? 1 : 0.3);
      const look = { colour: theme[group], alpha, rim: 0.3 * alpha, shade: 0.3, throughCloud: false };
      switch (shape.kind) {
        case 'sphere': this.solids.drawSphere(shape.at, shape.radiusM, look); break;
        case 'box': this.solids.drawBox(shape.at, shape.half, shape.axes, look); break;
        case 'capsule': this.solids.drawCapsule(shape.at, shape.end, shape.radiusM, look); break;
        case 'plane': this.solids.drawBox(
          shape.at, [kPlaneHalfM, kPlaneHalfM, kPlaneThicknessM], [...perpendiculars(shape.axis), shape.axis], look);
          break;
        case 'cone': {
          const { centre, radiusM } = coneEnd(shape);
          this.solids.drawCone(shape.at, centre, radiusM, look);
          break;
        }
        // what leads the hand is small: opaque, so that it is seen
        default:
          for (const knot of shape.points ?? [shape.at]) {
            this.solids.drawSphere(knot, kGuidanceKnotM, { colour: theme[group], alpha: enabled ? 0.9 : 0.3, shade: 0.3 });
          }
      }
    }
    if (fixtureProxy) {
      this.solids.drawSphere(fixtureProxy, radii.proxyM, { colour: theme.forbidden, alpha: 0.55, rim: 0.45, shade: 0.35 });
    }
  }

  drawHand() {
    const { hip, proxy, force, guidance, radii, theme, layers, arrowMPerN, forceText, guidanceText } = this.scene;
    if (!hip) return;
    this.solids.begin(this.orbit);
    this.solids.drawSphere(hip, Math.min(kCoreM, radii.hipM), { colour: theme.accent, shade: 0.25 });
    if (force && layers.force) {
      const vector = scale(force, arrowMPerN);
      this.solids.drawArrow(hip, vector, kThicknessM, { colour: theme.force, shade: 0.3 });
      if (forceText) this.labels.put('force', add(hip, vector), forceText, 'force');
    }
    if (guidanceText && layers.force) {
      const vector = scale(guidance, arrowMPerN);
      this.solids.drawArrow(hip, vector, kThicknessM, { colour: theme.guidance, shade: 0.3 });
      this.labels.put('guidance-force', add(hip, vector), guidanceText, 'force guidance');
    }
    if (proxy) {
      this.solids.drawSphere(proxy, radii.proxyM, { colour: theme.ink, alpha: 0.55, rim: 0.45, shade: 0.35 });
    }
    this.solids.drawSphere(hip, radii.hipM, { colour: theme.accent, alpha: 0.22, rim: 0.75, shade: 0.1 });
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

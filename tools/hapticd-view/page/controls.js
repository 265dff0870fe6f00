// SPDX-License-Identifier: Apache-2.0
// Mouse, touch and keyboard on the picture: turn, move sideways, zoom, focus, pick.

const kRadPerPx = 0.006;
const kRadPerKey = 0.06;
const kPxPerKey = 24;
const kZoomPerKey = 1.15;
/** A press that moved no farther is a click. */
const kClickPx = 5;
/** Two clicks within this time and distance focus; the second one picks nothing. */
const kDoubleMs = 350;
const kDoublePx = 12;

export class Controls {
  /**
   * `onMove()` after each change of the orbit; `onPick(xPx, yPx)` and `onFocus(xPx, yPx, {isDoubleClick})` in CSS
   * pixels of the canvas. `hand`: moved in place of the eye while a person leads it; panning stays.
   */
  constructor(canvas, orbit, { onMove, onPick, onFocus, hand }) {
    Object.assign(this, { canvas, orbit, onMove, onPick, onFocus, hand });
    this.pointers = new Map();
    this.movedPx = 0;
    canvas.addEventListener('pointerdown', (event) => this.down(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    canvas.addEventListener('pointerup', (event) => this.up(event, true));
    canvas.addEventListener('pointercancel', (event) => this.up(event, false));
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('wheel', (event) => this.wheel(event), { passive: false });
    canvas.addEventListener('keydown', (event) => this.key(event));
  }

  down(event) {
    if (this.pointers.size === 0) this.movedPx = 0;
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    this.canvas.setPointerCapture(event.pointerId);
  }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = { x: event.clientX, y: event.clientY };
    const x = now.x - before.x;
    const y = now.y - before.y;
    this.movedPx += Math.hypot(x, y);
    const other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1];
    this.pointers.set(event.pointerId, now);
    if (this.movedPx < kClickPx) return;
    const distance = (p) => Math.max(Math.hypot(p.x - other.x, p.y - other.y), 1);
    const pans = event.buttons & 2 || event.buttons & 4 || event.shiftKey;
    if (this.hand.isOn && (other || !pans)) {
      if (other) this.hand.pinch(distance(now) / distance(before));
      this.hand.moveInPicture(other ? x / 2 : x, other ? y / 2 : y);
      return;
    }
    if (other) {
      // each of two fingers reports on its own, so that half of its displacement is that of their middle
      const place = this.placeOf((now.x + other.x) / 2, (now.y + other.y) / 2);
      this.orbit.zoom(distance(now) / distance(before), place.x, place.y);
      this.orbit.pan(x / 2, y / 2);
    } else if (pans) {
      this.orbit.pan(x, y);
    } else {
      this.orbit.turn(-x * kRadPerPx, -y * kRadPerPx);
    }
    this.onMove();
  }

  up(event, clicked) {
    if (!this.pointers.delete(event.pointerId) || !clicked) return;
    if (this.pointers.size > 0 || this.movedPx >= kClickPx || event.button !== 0) return;
    const { x, y } = this.placeOf(event.clientX, event.clientY);
    const nowMs = performance.now();
    const { last } = this;
    const second = last && nowMs - last.ms < kDoubleMs && Math.hypot(x - last.x, y - last.y) < kDoublePx;
    this.last = second ? null : { x, y, ms: nowMs };
    if (second) this.onFocus(x, y, { isDoubleClick: true });
    else this.onPick(x, y);
  }

  /** A place of the window as one of the canvas. */
  placeOf(clientX, clientY) {
    const box = this.canvas.getBoundingClientRect();
    return { x: clientX - box.left, y: clientY - box.top };
  }

  wheel(event) {
    event.preventDefault();
    const px = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 30 : 1);
    if (this.hand.isOn) {
      this.hand.wheel(px);
      return;
    }
    const { x, y } = this.placeOf(event.clientX, event.clientY);
    this.orbit.zoom(Math.exp(-px * 0.0015), x, y);
    this.onMove();
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const { orbit } = this;
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const arrow = arrows[event.key];
    const ahead = { '+': 1, '=': 1, '-': -1 }[event.key];
    if (this.hand.isOn && ((arrow && !event.shiftKey) || ahead)) {
      this.hand.step(arrow?.[0] ?? 0, -(arrow?.[1] ?? 0), ahead ?? 0);
      event.preventDefault();
      return;
    }
    if (arrow && event.shiftKey) orbit.pan(-arrow[0] * kPxPerKey, -arrow[1] * kPxPerKey);
    else if (arrow) orbit.turn(arrow[0] * kRadPerKey, -arrow[1] * kRadPerKey);
    else if (event.key === '+' || event.key === '=') orbit.zoom(kZoomPerKey);
    else if (event.key === '-') orbit.zoom(1 / kZoomPerKey);
    else if (event.key === 'Enter') this.onPick(orbit.width / 2, orbit.height / 2);
    else if (event.key === 'f') this.onFocus(orbit.width / 2, orbit.height / 2, { isDoubleClick: false });
    else return;
    event.preventDefault();
    this.onMove();
  }
}

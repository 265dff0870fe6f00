// SPDX-License-Identifier: Apache-2.0
// Short texts at points of the world, as elements above the canvas: sharp, in the page's font, and selectable by tests.
// Where two would overlap, the later one moves aside.

/** From the point to the middle of the text, in pixels; what must be read first comes first. */
const kKinds = { force: [0, -24], pick: [0, -16], fixture: [0, 0], place: [0, 0], axis: [0, 0] };
const kOrder = Object.keys(kKinds);
const kStepPx = 6;
/** So far a text may move; beyond it would belong to something else. */
const kFarthestPx = 60;
const kEdgePx = 4;

export class Labels {
  constructor(folder) {
    this.folder = folder;
    this.elements = new Map();
  }

  begin(orbit) {
    this.orbit = orbit;
    this.wanted = [];
  }

  /** Puts `text` at `point`; `kind` are its classes, the first one of kKinds. Nothing where the point is out of the view. */
  put(name, point, text, kind) {
    const place = this.orbit.project(point);
    if (!place || place.x < 0 || place.y < 0 || place.x > this.orbit.width || place.y > this.orbit.height) return;
    this.wanted.push({ name, place, kind, main: kind.split(' ')[0], element: this.elementOf(name, text, kind) });
  }

  elementOf(name, text, kind) {
    let label = this.elements.get(name);
    if (!label) {
      const element = document.createElement('span');
      element.className = `label ${kind}`;
      this.folder.append(element);
      label = { element, text: null, width: 0, height: 0 };
      this.elements.set(name, label);
    }
    if (label.text === text) return label;
    // a text of the same length is as wide as the last one: measuring again would lay out the page
    const same = label.text?.length === text.length;
    label.text = text;
    label.element.textContent = text;
    if (!same) Object.assign(label, { width: label.element.offsetWidth, height: label.element.offsetHeight });
    return label;
  }

  end() {
    this.wanted.sort((a, b) => kOrder.indexOf(a.main) - kOrder.indexOf(b.main));
    const taken = [];
    for (const { place, main, element: label } of this.wanted) {
      const [x, y] = this.freePlace(place, kKinds[main], label, taken);
      taken.push({ x, y, width: label.width, height: label.height });
      label.element.style.transform = `translate(${(x - label.width / 2).toFixed(1)}px, ${(y - label.height / 2).toFixed(1)}px)`;
    }
    const used = new Set(this.wanted.map(({ name }) => name));
    for (const [name, { element }] of this.elements) {
      if (used.has(name)) continue;
      element.remove();
      this.elements.delete(name);
    }
  }

  /** The middle of a text: as near above or below its place as nothing else is, inside the picture. */
  freePlace(place, [offsetX, offsetY], { width, height }, taken) {
    const clamp = (value, size, most) => Math.min(Math.max(value, size / 2 + kEdgePx), most - size / 2 - kEdgePx);
    const at = (shiftPx) => [
      clamp(place.x + offsetX, width, this.orbit.width), clamp(place.y + offsetY + shiftPx, height, this.orbit.height)];
    const isFree = ([x, y]) => taken.every((other) => Math.abs(x - other.x) >= (width + other.width) / 2 ||
      Math.abs(y - other.y) >= (height + other.height) / 2);
    for (let shiftPx = 0; shiftPx <= kFarthestPx; shiftPx += kStepPx) {
      for (const candidate of [at(-shiftPx), at(shiftPx)]) {
        if (isFree(candidate)) return candidate;
      }
    }
    return at(0);
  }
}

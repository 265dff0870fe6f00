// SPDX-License-Identifier: Apache-2.0
// Short texts at points of the world, as elements above the canvas: sharp, in the page's font, and selectable by tests.

export class Labels {
  constructor(folder) {
    this.folder = folder;
    this.elements = new Map();
  }

  begin(orbit) {
    this.orbit = orbit;
    this.used = new Set();
  }

  /** Puts `text` at `point`; `kind` are its classes. Nothing where the point is out of the view. */
  put(name, point, text, kind) {
    const place = this.orbit.project(point);
    if (!place || place.x < 0 || place.y < 0 || place.x > this.orbit.width || place.y > this.orbit.height) return;
    let element = this.elements.get(name);
    if (!element) {
      element = document.createElement('span');
      element.className = `label ${kind}`;
      this.folder.append(element);
      this.elements.set(name, element);
    }
    if (element.textContent !== text) element.textContent = text;
    element.style.transform = `translate(${place.x.toFixed(1)}px, ${place.y.toFixed(1)}px)`;
    element.hidden = false;
    this.used.add(name);
  }

  end() {
    for (const [name, element] of this.elements) {
      if (this.used.has(name)) continue;
      element.remove();
      this.elements.delete(name);
    }
  }
}

// SPDX-License-Identifier: Apache-2.0
// Reads points off the depth frame: which pixel lies nearest to a place of the view, and where it is.

import { norm, subtract } from './vectors.js';
import { coordinates, counted, fixed } from './words.js';

/** So far beside the place that was chosen a pixel may be, in CSS pixels. */
const kReachPx = 12;
/** Of pixels as near to the place as that, or as one of them is large, the one nearest to the eye is meant. */
const kSamePlacePx = 1.5;
const kLandmarksHeader = 'name,column_px,row_px';
const kFewestLandmarks = 3;

/** The pixel of `frame` that is seen at a place of the view: {column, row, raw, camera, world}, or null. */
export function pick(frame, orbit, limitsM, xPx, yPx) {
  let best = null;
  for (let row = 0; row < frame.height; row++) {
    for (let column = 0; column < frame.width; column++) {
      const z = frame.depthOf(frame.rawAt(column, row));
      if (z < limitsM[0] || z > limitsM[1]) continue;
      const place = orbit.project(frame.pointInWorld(column, row));
      if (!place) continue;
      const besidePx = Math.hypot(place.x - xPx, place.y - yPx);
      if (besidePx > kReachPx) continue;
      const sizePx = (orbit.focalPx * z) / (frame.fx * place.depth);
      const merit = besidePx <= Math.max(kSamePlacePx, 0.7 * sizePx) ? 0 : besidePx;
      if (best && (merit > best.merit || (merit === best.merit && place.depth >= best.depth))) continue;
      best = { column, row, merit, depth: place.depth };
    }
  }
  if (!best) return null;
  const { column, row } = best;
  return {
    column,
    row,
    raw: frame.rawAt(column, row),
    camera: frame.pointInCamera(column, row),
    world: frame.pointInWorld(column, row),
  };
}

/** A shell command that registers the camera by these picks (docs/cameras.md). */
export function registerCommand(picks) {
  const lines = picks.map(({ name, column, row }) => `${name},${column},${row}`);
  return [
    "cat >landmarks.csv <<'END'", kLandmarksHeader, ...lines, 'END', 'hapticctl register --landmarks landmarks.csv',
  ].join('\n');
}

/** The list of picks in the panel. */
export class PickList {
  /**
   * `elements`: list, distance, use, command, note, copy, clear. `makeForm(onChange)`: the form that makes fixtures of picks;
   * `onChange(picks, preview)` after each change.
   */
  constructor(elements, makeForm, onChange) {
    this.elements = elements;
    this.form = makeForm(() => this.show());
    this.onChange = onChange;
    this.picks = [];
    this.made = 0;
    elements.clear.addEventListener('click', () => {
      this.picks = [];
      this.show();
    });
    elements.copy.addEventListener('click', () => this.copy());
    elements.use.addEventListener('change', () => this.show());
    this.show();
  }

  /** Returns the name of the new pick. */
  add(found) {
    const name = `p${++this.made}`;
    this.picks.push({ name, ...found });
    this.show();
    return name;
  }

  remove(name) {
    this.picks = this.picks.filter((one) => one.name !== name);
    this.show();
  }

  show() {
    const { list, distance, use, useField, command, note, copy, clear } = this.elements;
    list.replaceChildren(...this.picks.map((one) => this.row(one)));
    const [a, b] = this.picks.slice(-2);
    const both = this.picks.length >= 2;
    distance.textContent = both ? `${a.name} to ${b.name}: ${fixed(norm(subtract(a.world, b.world)), 3)} m` : '';
    const any = this.picks.length > 0;
    const made = any && use.value === 'fixture' ? this.form.show(this.picks.map(({ world }) => world)) : null;
    command.textContent = made ? made.command : any ? registerCommand(this.picks) : '';
    useField.hidden = !any;
    this.form.form.hidden = !made;
    command.hidden = !command.textContent;
    copy.hidden = command.hidden;
    clear.hidden = !any;
    note.textContent = any ? this.noteFor(made) : 'Click or tap a point of the surface, or press Enter for the point at the crosshair.';
    this.onChange(this.picks, made?.preview || null);
  }

  noteFor(made) {
    if (made) return 'The picture shows what would be added; nothing acts before it has been added to the box.';
    const missing = kFewestLandmarks - this.picks.length;
    return missing > 0 ? `To register the camera, pick ${counted(missing, 'more point')}.` : 'Run this on the box and touch each point with the handle when asked:';
  }

  row(one) {
    const item = document.createElement('li');
    const name = document.createElement('strong');
    name.textContent = one.name;
    const text = document.createElement('span');
    text.className = 'coordinates';
    for (const line of [
      `world (${coordinates(one.world)}) m`, `camera (${coordinates(one.camera)}) m`,
      `pixel ${one.column}, ${one.row}; raw ${one.raw}`,
    ]) {
      const part = document.createElement('span');
      part.textContent = line;
      text.append(part);
    }
    const remove = document.createElement('button');
    remove.type = 'button';
    remove.className = 'quiet';
    remove.textContent = '×';
    remove.setAttribute('aria-label', `Remove ${one.name}`);
    remove.addEventListener('click', () => this.remove(one.name));
    item.append(name, text, remove);
    return item;
  }

  async copy() {
    const { command, copy } = this.elements;
    try {
      await navigator.clipboard.writeText(command.textContent);
      copy.textContent = 'Copied';
    } catch {
      // Browsers lend the clipboard to secure pages only: with the text selected, Ctrl-C does it.
      getSelection().selectAllChildren(command);
      copy.textContent = 'Selected: press Ctrl-C';
    }
    setTimeout(() => { copy.textContent = 'Copy'; }, 2000);
  }
}

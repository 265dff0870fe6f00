// SPDX-License-Identifier: Apache-2.0
// What explains the picture at its lower edge: the scale of the colours, a scale bar, and the directions of the axes.

import { gradient } from './ramp.js';

const kLongestBarPx = 120;
const kTriadPx = 24;
const kAxes = ['x', 'y', 'z'];

const metres = (m) => m.toFixed(Math.abs(m) < 9.95 ? 1 : 0).replace('-', '−');

/** The largest of 1, 2 and 5 times a power of ten that is at most `value`. */
export function roundDown(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [5, 2, 1].map((step) => step * power).find((step) => step <= value * 1.0001);
}

/** "50 mm", "2 m" */
export const lengthOfBar = (m) => (m < 0.9995 ? `${Math.round(1000 * m)} mm` : `${Math.round(m)} m`);

function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export class Legend {
  constructor() {
    const element = (id) => document.getElementById(id);
    this.scale = element('scale');
    this.title = element('scale-title');
    this.ramp = element('scale-ramp');
    this.numbers = ['scale-low', 'scale-middle', 'scale-high'].map(element);
    this.bar = element('bar');
    this.barText = element('bar-text');
    this.axes = kAxes.map((name) => ({ line: element(`triad-${name}`), text: element(`triad-${name}-text`) }));
    this.triad = element('triad');
    this.shown = '';
  }

  /** `colouring`: depth, height or modelled; `rangeM`: nearest, farthest, lowest, highest; `reversed`: bright is low. */
  show(orbit, { colouring, rangeM, reversed }) {
    this.showScale(colouring, rangeM, reversed);
    const barM = roundDown((kLongestBarPx * orbit.distanceM) / orbit.focalPx);
    this.bar.style.width = `${((barM * orbit.focalPx) / orbit.distanceM).toFixed(1)}px`;
    setText(this.barText, lengthOfBar(barM));
    this.showTriad(orbit);
  }

  showScale(colouring, rangeM, reversed) {
    const [low, high] = colouring === 'depth' ? rangeM : rangeM.slice(2);
    // the colours of depth are even in its inverse
    const middle = colouring === 'depth' ? 2 / (1 / low + 1 / high) : (low + high) / 2;
    const numbers = [low, middle, high].map(metres);
    const key = [colouring, reversed, ...numbers].join();
    if (key === this.shown) return;
    this.shown = key;
    this.scale.hidden = colouring === 'modelled';
    setText(this.title, colouring === 'depth' ? 'Depth from the camera (m)' : 'Height, world y (m)');
    this.ramp.style.backgroundImage = gradient('to right', reversed);
    numbers.forEach((text, i) => setText(this.numbers[i], text));
  }

  /** The axes of the world as the eye sees them; what points away from it is drawn first. */
  showTriad(orbit) {
    const ends = this.axes.map((axis, i) => ({
      ...axis, x: kTriadPx * orbit.right[i], y: -kTriadPx * orbit.up[i], away: orbit.forward[i] }));
    const order = [...ends].sort((a, b) => b.away - a.away);
    if (order.some(({ line }, i) => this.triad.children[2 * i] !== line)) {
      this.triad.append(...order.flatMap(({ line, text }) => [line, text]));
    }
    for (const { line, text, x, y } of ends) {
      line.setAttribute('x2', x.toFixed(1));
      line.setAttribute('y2', y.toFixed(1));
      text.setAttribute('x', (1.3 * x).toFixed(1));
      text.setAttribute('y', (1.3 * y).toFixed(1));
    }
  }
}

// SPDX-License-Identifier: Apache-2.0
// The time line of a recorded session: position, marks, and the buttons that wind it.

import { playTime } from './words.js';

const kMarkColours = { mode: '--edge', fault: '--wrong', contact: '--accent', event: '--ink-quiet', mark: '--doubtful' };
/** Contact fills its time; what is most important is painted last. */
const kOrder = ['contact', 'event', 'mode', 'mark', 'fault'];

export class TimeLine {
  /** `send(message)` takes requests to the bridge. */
  constructor(folder, send) {
    this.folder = folder;
    this.send = send;
    this.playing = false;
    this.marks = [];
    this.durationS = 0;
    this.largestForceS = 0;
    const element = (id) => folder.querySelector(`#${id}`);
    this.play = element('play');
    this.seek = element('seek');
    this.position = element('position');
    this.canvas = element('marks');
    this.list = element('mark-list');
    this.largest = element('largest');
    this.factor = element('factor');
    this.play.addEventListener('click', () => this.toggle());
    element('step-back').addEventListener('click', () => this.step(-1));
    element('step-on').addEventListener('click', () => this.step(1));
    this.largest.addEventListener('click', () => this.goTo(this.largestForceS));
    this.seek.addEventListener('input', () => this.goTo(Number(this.seek.value)));
    this.factor.addEventListener('change', () => send({ type: 'factor', factor: Number(this.factor.value) }));
    new ResizeObserver(() => this.paint()).observe(this.canvas);
  }

  toggle() {
    this.send({ type: this.playing ? 'pause' : 'play' });
  }

  step(frames) {
    this.send({ type: 'step', frames });
  }

  goTo(s) {
    this.send({ type: 'seek', s });
    this.show(s);
  }

  /** Message `timeline`. */
  describe({ durationS, largestForceS, largestForceN, marks }) {
    this.folder.hidden = false;
    document.body.classList.add('has-timeline');
    Object.assign(this, { durationS, largestForceS });
    this.marks = [...marks].sort((a, b) => a.s - b.s);
    this.seek.max = durationS;
    this.largest.textContent = Number.isFinite(largestForceN)
      ? `Largest force (${largestForceN.toFixed(2)} N)` : 'Largest force';
    this.list.replaceChildren(...this.marks.map((mark) => this.item(mark)));
    this.paint();
  }

  item(mark) {
    const item = document.createElement('li');
    const button = document.createElement('button');
    button.type = 'button';
    button.className = 'quiet';
    button.textContent = `${playTime(mark.s)}  ${mark.text || mark.kind}`;
    button.addEventListener('click', () => this.goTo(mark.s));
    item.append(button);
    return item;
  }

  /** Message `playback`. */
  follow({ s, playing, factor }) {
    this.playing = playing;
    this.play.textContent = playing ? 'Pause' : 'Play';
    if (document.activeElement !== this.factor) this.factor.value = String(factor);
    this.show(s);
  }

  show(s) {
    this.seek.value = s;
    const text = `${playTime(s)} of ${playTime(this.durationS)}`;
    this.position.textContent = text;
    this.seek.setAttribute('aria-valuetext', text);
  }

  paint() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = this.canvas.clientWidth;
    const height = this.canvas.clientHeight;
    this.canvas.width = width * ratio;
    this.canvas.height = height * ratio;
    const context = this.canvas.getContext('2d');
    context.scale(ratio, ratio);
    const style = getComputedStyle(document.documentElement);
    // the thumb's middle is as far from the ends as it is wide
    const kEndPx = 8;
    const xOf = (s) => kEndPx + (s / Math.max(this.durationS, 1e-9)) * (width - 2 * kEndPx);
    for (const kind of kOrder) {
      context.fillStyle = style.getPropertyValue(kMarkColours[kind]).trim();
      for (const mark of this.marks.filter((one) => one.kind === kind)) {
        const x = xOf(mark.s);
        const wide = Math.max((mark.endS === null ? x : xOf(mark.endS)) - x, 2);
        const inset = kind === 'contact' ? 10 : 2;
        context.fillRect(x, inset, wide, height - inset);
      }
    }
  }
}

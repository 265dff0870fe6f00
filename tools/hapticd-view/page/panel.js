// SPDX-License-Identifier: Apache-2.0
// The state of the box for people: what is wrong first, then mode, force, health and events.

import { isVector, norm } from './vectors.js';
import {
  causeInWords, contactInWords, counted, duration, fixed, frameInWords, lawInWords, modeInWords, upTime,
} from './words.js';

const kMostEvents = 200;
/** A frame that lags by more is catching up, as the box calls it. */
const kNotableLagM = 0.001;

/** What is at "camera.state" in a status; undefined where the box does not report it. */
const at = (status, path) => path.split('.').reduce((value, name) => value?.[name], status);

function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Rows of a definition list, kept from one call to the next, so that a selection or a screen reader is not disturbed. */
class Facts {
  constructor(list) {
    this.list = list;
    this.rows = new Map();
  }

  /** `level`: '', `doubtful` or `wrong`; `detail` stands below in quiet letters. */
  set(title, text, { level = '', detail = '' } = {}) {
    let row = this.rows.get(title);
    if (!row) {
      const term = document.createElement('dt');
      term.textContent = title;
      const value = document.createElement('dd');
      const main = document.createTextNode('');
      const more = document.createElement('span');
      value.append(main, more);
      this.list.append(term, value);
      row = { value, main, more };
      this.rows.set(title, row);
    }
    if (row.main.data !== text) row.main.data = text;
    setText(row.more, detail);
    row.more.hidden = !detail;
    row.value.dataset.level = level;
  }

  /** Removes the rows of all other titles. */
  keep(titles) {
    for (const [title, { value }] of this.rows) {
      if (titles.includes(title)) continue;
      value.previousElementSibling.remove();
      value.remove();
      this.rows.delete(title);
    }
  }
}

export class Panel {
  constructor() {
    const element = (id) => document.getElementById(id);
    this.elements = {
      warnings: element('warnings'), mode: element('mode'), cause: element('cause'), remedy: element('remedy'),
      force: element('force-number'), events: element('events'), announce: element('announce'),
    };
    this.force = new Facts(element('force-facts'));
    this.health = new Facts(element('health'));
    this.frames = new Facts(element('frames'));
    this.announced = '';
    this.numbers = new Set();
  }

  /** The `status` of a message `state`; everything in it may be missing. */
  show(status) {
    this.showMode(at(status, 'mode') ?? '', at(status, 'cause') ?? '');
    this.showWarnings(at(status, 'warnings') ?? []);
    this.showLaw(status);
    this.showCamera(status);
    this.showHandle(status);
    this.showLoop(status);
    this.showFrames(at(status, 'frames') ?? []);
  }

  /** While nothing is heard from the box: the last mode says nothing about what acts on the hand now. */
  forgetMode() {
    this.showMode('unheard', '');
    setText(this.elements.force, fixed(NaN, 2));
  }

  showMode(mode, cause) {
    const words = modeInWords(mode);
    const why = causeInWords(mode, cause);
    const { elements } = this;
    setText(elements.mode, words.title);
    elements.mode.dataset.mode = mode;
    setText(elements.cause, why.text || words.text);
    // idle for a reason: not as requested, but because engaging was refused or has ended
    elements.cause.dataset.level = mode === 'idle' && why.text ? 'doubtful' : '';
    setText(elements.remedy, why.remedy);
    const text = [`Mode: ${words.title}.`, why.text, why.remedy].filter(Boolean).join(' ');
    if (text === this.announced) return;
    this.announced = text;
    elements.announce.textContent = text;
  }

  /** The daemon's list, which 'hapticctl status' shows too. */
  showWarnings(lines) {
    const list = this.elements.warnings;
    const key = lines.join('\n');
    if (list.dataset.key === key) return;
    list.dataset.key = key;
    list.hidden = lines.length === 0;
    list.replaceChildren(...lines.map((line) => {
      const item = document.createElement('li');
      item.textContent = line;
      return item;
    }));
  }

  showLaw(status) {
    const law = at(status, 'law.chosen');
    if (law) {
      const filtered = at(status, 'law.filtered') ? ', depth filtered' : '';
      this.force.set('Law', lawInWords(law) + filtered, { detail: at(status, 'law.reason') ?? '' });
    }
    const stiffness = at(status, 'law.handStiffnessNPerM');
    if (stiffness !== undefined) this.force.set('Stiffness', `${fixed(stiffness, 0)} N/m at the hand`);
  }

  showCamera(status) {
    const state = at(status, 'camera.state');
    if (state) {
      const damaged = at(status, 'camera.damagedFrames');
      const text = [`${state}, ${fixed(at(status, 'scene.frameRateHz'), 1)} frames/s`];
      if (damaged > 0) text.push(`${counted(damaged, 'frame')} damaged`);
      this.health.set('Camera', text.join(', '), {
        level: state === 'streaming' ? '' : 'wrong',
        detail: [at(status, 'camera.identity'), at(status, 'camera.advice')].filter(Boolean).join('. '),
      });
    }
    const models = at(status, 'scene.models');
    if (models === undefined) return;
    const points = at(status, 'law.chosen') === 'surface' ? 'all pixels' : counted(at(status, 'scene.points'), 'point');
    const full = at(status, 'scene.pointsOverCapacity');
    const skipped = at(status, 'scene.skippedFrames');
    this.health.set('Scene', `${points}, modelled in ${duration(at(status, 'scene.lastModelNs'))}`, {
      detail: [
        full > 0 ? `${counted(full, 'point')} beyond grid.point_capacity` : '', skipped > 0 ? `${counted(skipped, 'frame')} skipped` : '',
      ].filter(Boolean).join(', '),
    });
  }

  showHandle(status) {
    const state = at(status, 'handle.state');
    if (!state) return;
    const text = [state];
    if (at(status, 'handle.exertsForce') === false) text.push('exerts no force');
    const rejected = at(status, 'handle.rejected');
    if (rejected > 0) text.push(`${counted(rejected, 'measurement')} rejected`);
    this.health.set('Handle', text.join(', '), {
      level: state === 'present' ? '' : 'wrong',
      detail: [at(status, 'handle.identity'), at(status, 'handle.advice')].filter(Boolean).join('. '),
    });
  }

  showLoop(status) {
    const loop = at(status, 'loop');
    if (loop) {
      const counters = loop.counters ?? {};
      const realtime = loop.realtimeScheduling ? 'real-time scheduling' : 'no real-time scheduling';
      this.health.set('Force loop', `${fixed(loop.rateHz, 0)} Hz, ${realtime}`, {
        detail: `${counters.overruns ?? 0} of ${counters.ticks ?? 0} ticks late; wake-up latency p99.9 ` +
          `${duration(loop.wakeupLatency?.p999Ns)}, max ${duration(loop.wakeupLatency?.maxNs)}`,
      });
    }
    const trace = at(status, 'trace.state');
    if (trace) {
      const written = trace === 'writing' ? `${at(status, 'trace.name')}, ${upTime(at(status, 'trace.durationS'))}` : '';
      this.health.set('Trace', trace, { level: trace === 'waiting' ? 'doubtful' : '', detail: written });
    }
    const version = at(status, 'version');
    if (version) this.health.set('hapticd', `${version}, up ${upTime(at(status, 'uptimeS'))}`);
  }

  /** The moving frames, each with the age of its newest pose. */
  showFrames(frames) {
    document.getElementById('frames-card').hidden = frames.length === 0;
    this.frames.keep(frames.map(({ name }) => name));
    for (const { name, state, used, ageS, lagM, tracking } of frames) {
      const { text, level } = frameInWords(state, used);
      const age = Number.isFinite(ageS) ? `, pose ${duration(1e9 * ageS)} old` : '';
      this.frames.set(name, text + age, {
        level,
        detail: [
          tracking ? `camera: ${tracking.replaceAll('_', ' ')}` : '',
          lagM >= kNotableLagM ? `${fixed(1000 * lagM, 1)} mm behind its poses` : '', used === false ? 'not used by an enabled fixture' : '',
        ].filter(Boolean).join(', '),
      });
    }
  }

  /** The newest window of ticks. */
  showWindow(window_, forceN) {
    setText(this.elements.force, fixed(forceN, 2));
    const share = window_.ticks > 0 ? ` (${Math.round((100 * window_.contactTicks) / window_.ticks)} % of ticks)` : '';
    const contact = window_.contact ? contactInWords(window_.contact) : window_.contactTicks > 0 ? 'in contact' : 'free';
    this.force.set('Contact', contact + (window_.contactTicks > 0 ? share : ''));
    this.force.set('Gain', fixed(window_.gain, 2));
    this.showPart('From fixtures', window_.fixtureForce);
    this.showPart('From guidance', window_.guidanceForce);
  }

  /** A part of the force on its own; shown from the first time on that it is there. */
  showPart(title, vector) {
    if (!isVector(vector)) return;
    const partN = norm(vector);
    if (partN > 0 || this.force.rows.has(title)) this.force.set(title, `${fixed(partN, 2)} N`);
  }

  clearEvents() {
    this.numbers.clear();
    this.elements.events.replaceChildren();
  }

  /** The newest event stands first. */
  addEvent(event) {
    if (this.numbers.has(event.number)) return;
    this.numbers.add(event.number);
    const item = document.createElement('li');
    item.dataset.priority = event.priority;
    const time = document.createElement('time');
    const when = new Date(event.timeNs / 1e6);
    time.dateTime = when.toISOString();
    time.textContent = when.toLocaleTimeString([], { hour12: false });
    const text = document.createElement('span');
    text.textContent = event.text;
    item.append(time, text);
    const list = this.elements.events;
    list.prepend(item);
    if (list.childElementCount > kMostEvents) list.lastElementChild.remove();
  }
}

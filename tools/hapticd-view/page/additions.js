// SPDX-License-Identifier: Apache-2.0
// The fixtures and tissue regions of the box: what is drawn of them, and their list in the panel.

import { distanceToFixture, framesOf, isGuidance, isMoving, progressOn, shapeOf, stageOf } from './fixtures.js';
import { isVector } from './vectors.js';

/** What a kind is called where its name is not a word. */
const kKinds = { standoff: 'stand-off' };
/** The stages before the boundary. */
const kNearStages = ['warning', 'soft'];

/** Kinds whose distance only the box computes. */
const kOfTheBox = ['solid', 'standoff'];

/** "12.3 mm", "0.42 m" */
function lengthText(m) {
  if (!Number.isFinite(m)) return '–';
  return Math.abs(m) < 0.1 ? `${(1000 * m).toFixed(1)} mm` : `${m.toFixed(2)} m`;
}

/** The margins of a forbidden region: "warns at 20.0 mm, softer from 10.0 mm"; empty: it has none. */
function marginsText({ warning_m, soft_m }) {
  return [
    warning_m > 0 ? `warns at ${lengthText(warning_m)}` : '', soft_m > 0 ? `softer from ${lengthText(soft_m)}` : '',
  ].filter(Boolean).join(', ');
}

export class Additions {
  /** `list` gets an item for each; `card` is hidden while there are none. */
  constructor(list, card) {
    this.list = list;
    this.card = card;
    this.forget();
  }

  /** Nothing is known any longer: another bridge, or a box that has started again. */
  forget() {
    this.solids = {};
    this.frames = new Map();
    this.conducts = new Map();
    this.take({});
  }

  /** A message `solids` of the bridge. */
  takeSolids({ solids }) {
    this.solids = solids ?? {};
  }

  /** The `status` of a message `state`: where moving frames are, and what only the box knows of fixtures. */
  takeStatus(status) {
    this.frames = framesOf(status.frames);
    const each = status.fixtures?.each;
    this.conducts = new Map((Array.isArray(each) ? each : []).map((conduct) => [conduct.name, conduct]));
  }

  /** A message `additions` of the bridge. */
  take({ fixtures, regions }) {
    const known = (entries, group) => (Array.isArray(entries) ? entries : [])
      .filter((entry) => entry?.definition)
      .map(({ name, definition, enabled = true }, place) => ({
        name: String(name ?? definition.name), definition, enabled, place, inContact: false,
        group: group ?? (isGuidance(definition.kind) ? 'guidance' : 'forbidden'),
      }));
    this.entries = [...known(fixtures), ...known(regions, 'tissue')];
    this.card.hidden = this.entries.length === 0;
    this.list.replaceChildren(...this.entries.map((entry) => this.rowOf(entry)));
  }

  /** Returns what is to be drawn after a window of ticks. `frame`: the newest depth frame or null. */
  follow(window_, frame) {
    for (const entry of this.entries) {
      const { frames, solids } = this;
      entry.shape = shapeOf(entry.definition, frame, { frames, solids, before: entry.shape });
      entry.inContact = entry.group === 'tissue'
        ? window_.tissueRegion === entry.place
        : ((window_.fixtureContacts ?? 0) & (1 << entry.place)) !== 0;
      entry.progress = entry.shape?.kind === 'path' && isVector(window_.hip)
        ? progressOn(entry.shape.points, window_.hip) : null;
    }
    return this.entries;
  }

  /** Brings the list up to date with a window of ticks. */
  show(window_, warningM) {
    for (const entry of this.entries) {
      const distanceM = this.distanceOf(entry, window_);
      entry.stage = entry.group === 'forbidden' ? stageOf(entry.definition, distanceM, entry.stage || 'far') : '';
      this.showEntry(entry, distanceM, warningM);
    }
  }

  /**
   * A window has the distance to the nearest forbidden region; the others follow from their shapes. Where they do not, or
   * where the shape moves, so that its place here is a moment old, the status has them.
   */
  distanceOf(entry, window_) {
    if (entry.group === 'forbidden' && entry.place === window_.nearestFixture) return window_.fixtureDistanceM;
    if (entry.group === 'tissue') return NaN;
    if (kOfTheBox.includes(entry.definition.kind) || isMoving(entry.definition)) return this.conducts.get(entry.name)?.distanceM ?? NaN;
    if (!entry.shape || !isVector(window_.hip)) return NaN;
    return distanceToFixture(entry.definition, entry.shape, window_.hip);
  }

  rowOf(entry) {
    const { name, definition, enabled, group } = entry;
    const item = document.createElement('li');
    item.dataset.group = group;
    const title = document.createElement('strong');
    title.textContent = name;
    const kind = document.createElement('span');
    kind.textContent = group === 'tissue' ? definition.model ?? 'linear' : kKinds[definition.kind] ?? definition.kind;
    const state = document.createElement('span');
    state.className = 'number';
    state.textContent = enabled ? '' : 'disabled';
    item.append(title, kind, state);
    const margins = group === 'forbidden' ? marginsText(definition) : '';
    if (margins) {
      const quiet = document.createElement('span');
      quiet.className = 'margins';
      quiet.textContent = margins;
      item.append(quiet);
    }
    Object.assign(entry, { item, state });
    return item;
  }

  showEntry({ item, state, enabled, inContact, group, progress, stage, definition }, distanceM, warningM) {
    const slows = definition.effect === 'slow';
    const near = group === 'forbidden' && ((!slows && distanceM < warningM) || kNearStages.includes(stage));
    item.dataset.level = inContact ? 'contact' : enabled && near ? 'near' : '';
    let text = 'disabled';
    if (enabled) {
      const done = progress ? `${Math.round((100 * progress.atM) / progress.lengthM)} %` : '';
      const level = [...kNearStages, 'breach'].includes(stage) ? stage : '';
      const acts = slows ? stage === 'contact' && 'slows the hand' : inContact && 'in contact';
      text = [acts, level, group === 'tissue' ? '' : lengthText(distanceM), done].filter(Boolean).join(', ');
    }
    if (state.textContent !== text) state.textContent = text;
  }
}

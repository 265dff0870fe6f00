// SPDX-License-Identifier: Apache-2.0
// Makes a virtual fixture of picked points: what it is, its name and sizes, the command that adds it, and its preview.

import { shapeOf } from './fixtures.js';
import { cross, dot, norm, scale, subtract, unit } from './vectors.js';
import { counted } from './words.js';

/** As the box takes it, but for a hyphen at the beginning, which a command line takes for an option. */
const kName = /^[A-Za-z0-9_][A-Za-z0-9_-]{0,31}$/;
/** Of coordinates, which a camera does not measure more exactly, and of lengths that a person types, in metres. */
const kPlaceDecimals = 4;
const kLengthDecimals = 6;
/** The bridge ends the connection of who sends a longer message. */
const kLongestRequestBytes = 4096;

/** A button that is disabled would lose the keyboard's focus, so it is only marked and ignores clicks. */
const setDisabled = (button, disabled) => button.setAttribute('aria-disabled', String(disabled));
const isDisabled = (button) => button.getAttribute('aria-disabled') === 'true';

/** Free side of the plane through the last three points; null where they lie on a line. */
function normalOf([a, b, c], eye) {
  const across = cross(subtract(b, a), subtract(c, a));
  if (norm(across) < 1e-9) return null;
  return unit(dot(across, subtract(eye, a)) < 0 ? scale(across, -1) : across);
}

/**
 * What points can become: how many the kind needs at least, and the members that they determine, or null where these points
 * do not. `fields`: what has to be said besides.
 */
const kKinds = {
  sphere: { points: 1, fields: ['radius', 'clearance', 'side'], of: (p) => ({ position_m: p.at(-1) }) },
  capsule: { points: 2, fields: ['radius', 'clearance', 'side'], of: (p) => ({ position_m: p.at(-2), end_m: p.at(-1) }) },
  plane: {
    points: 3, fields: ['clearance'],
    of: (p, eye) => {
      const normal = normalOf(p.slice(-3), eye);
      return normal && { position_m: p.at(-3), normal };
    },
  },
  standoff: { points: 1, fields: ['clearance'], of: () => ({}) },
  path: { points: 2, fields: [], of: (p) => ({ points_m: p }) },
  point: { points: 1, fields: [], of: (p) => ({ position_m: p.at(-1) }) },
};

/** Fields in millimetres: the member of the definition, the allowed range, and what they begin with. */
const kLengths = {
  radius: { member: 'radius_m', lowMm: 0.5, highMm: 10_000, usualMm: 20 },
  clearance: { member: 'clearance_m', lowMm: 0, highMm: 50, usualMm: 0 },
};
const kStandoffMm = 10;

/** What is wrong with a length; empty: nothing. */
function lengthProblem(kind, field, mm) {
  const { lowMm, highMm } = kLengths[field];
  if (Number.isFinite(mm) && mm >= lowMm && mm <= highMm && !(kind === 'standoff' && mm <= 0)) return '';
  const low = kind === 'standoff' ? `above ${lowMm}` : `from ${lowMm}`;
  return `The ${field} is a number ${low} to ${highMm} mm.`;
}

/**
 * A fixture of points in the world: {definition, problem}, the members as in the configuration. `wish`: kind, name,
 * radiusMm, clearanceMm, side; `taken`: names that there are already.
 */
function fixtureOf(points, wish, eye, taken = []) {
  const kind = kKinds[wish.kind];
  if (points.length < kind.points) {
    return { definition: null, problem: `Pick ${counted(kind.points - points.length, 'more point')} for this kind.` };
  }
  const made = kind.of(points, eye);
  if (!made) return { definition: null, problem: 'The last three points lie on a line: pick another one.' };
  const definition = { name: wish.name, kind: wish.kind, ...made };
  let problem = '';
  for (const field of kind.fields) {
    if (field === 'side') {
      if (wish.side !== 'out') definition.side = wish.side;
      continue;
    }
    const mm = wish[`${field}Mm`];
    problem ||= lengthProblem(wish.kind, field, mm);
    if (mm !== 0) definition[kLengths[field].member] = mm / 1000;
  }
  if (definition.side === 'in' && definition.clearance_m >= definition.radius_m) {
    problem ||= 'The clearance leaves no room inside: make it smaller than the radius.';
  }
  if (!kName.test(wish.name)) problem ||= 'The name has 1 to 32 letters, digits, _ and -, and does not begin with -.';
  else if (taken.includes(wish.name)) problem ||= `There is a fixture ${wish.name} already: choose another name.`;
  return { definition: Object.values(definition).some(Number.isNaN) ? null : definition, problem };
}

/** A definition with its numbers as the command has them, so that command and button add the same. */
function rounded(value, decimals = kLengthDecimals) {
  if (typeof value === 'number') return Number(value.toFixed(decimals)) + 0;
  if (Array.isArray(value)) return value.map((one) => rounded(one, kPlaceDecimals));
  if (typeof value !== 'object') return value;
  return Object.fromEntries(Object.entries(value).map(([member, one]) => [member, rounded(one)]));
}

/** The shell command that adds a fixture; its name needs no quotes. */
function commandOf({ name, kind, ...members }) {
  const text = (value) => (Array.isArray(value?.[0]) ? `"${value.map(String).join(' ')}"` : String(value));
  const options = Object.entries(rounded(members)).map(([member, value]) => `--${member.replaceAll('_', '-')} ${text(value)}`);
  return [`hapticctl fixture add ${name} --kind ${kind}`, ...options].join(' ');
}

/** The form below the picked points. */
export class FixtureForm {
  /**
   * `form`: the element with the fields; `orbit`: the eye; `namesTaken()`; `send(message)` to the bridge; `onChange()` after
   * each change by a person.
   */
  constructor(form, orbit, namesTaken, send, onChange) {
    this.form = form;
    this.orbit = orbit;
    this.namesTaken = namesTaken;
    this.kindOfClearance = '';
    /** Whether the bridge may add fixtures for this page, and what it is to add or remove. */
    this.mayAdd = false;
    this.connected = false;
    this.definition = null;
    /** Names of what this page has added, the oldest first, and the request that has not been answered. */
    this.added = [];
    this.asked = null;
    this.points = '';
    this.send = send;
    this.onChange = onChange;
    this.say('');
    this.addButton.addEventListener('click', () => this.add());
    this.removeButton.addEventListener('click', () => this.remove());
    form.addEventListener('input', () => {
      this.say('');
      onChange();
    });
    form.addEventListener('submit', (event) => event.preventDefault());
  }

  get addButton() {
    return this.form.querySelector('#fixture-add');
  }

  get removeButton() {
    return this.form.querySelector('#fixture-remove');
  }

  /** What became of a request, until something else is shown. */
  say(text, isProblem = false) {
    this.answer = text;
    this.answerIsProblem = isProblem;
  }

  add() {
    if (isDisabled(this.addButton)) return;
    const add = rounded(this.definition);
    if (new TextEncoder().encode(JSON.stringify({ type: 'fixture', add })).length > kLongestRequestBytes) {
      this.say('There are too many points to add it from here: run the command on the box.', true);
      this.onChange();
      return;
    }
    this.ask({ add });
  }

  remove() {
    if (!isDisabled(this.removeButton)) this.ask({ remove: this.added.at(-1) });
  }

  /** Sends a request, and another one only when the answer has come. */
  ask(request) {
    this.asked = request;
    this.say('Asking the box.');
    this.send({ type: 'fixture', ...request });
    this.onChange();
  }

  /** A message `hello` of the bridge, for which this page is a new one. */
  takeHello({ addsFixtures = false }) {
    this.mayAdd = addsFixtures;
    this.connected = true;
    this.added = [];
    this.onChange();
  }

  takeLoss() {
    if (this.asked) this.say('The connection was lost before the box answered: the list of fixtures says whether it was done.', true);
    this.connected = false;
    this.asked = null;
    this.onChange();
  }

  /** A message `fixture` of the bridge: the answer to a request. */
  takeAnswer({ name, problem }) {
    if (!this.asked || name !== (this.asked.add?.name ?? this.asked.remove)) return;
    const adds = Boolean(this.asked.add);
    this.asked = null;
    // what somebody else has removed meanwhile is not offered again
    if (!adds && (!problem || !this.namesTaken().includes(name))) this.added = this.added.filter((one) => one !== name);
    if (adds && !problem) this.added.push(name);
    const done = adds ? `${name} acts now.` : `${name} is removed.`;
    this.say(problem ? `${problem[0].toUpperCase()}${problem.slice(1)}` : done, Boolean(problem));
    this.onChange();
  }

  field(name) {
    return this.form.elements.namedItem(name);
  }

  /** Brings the form up to date with the points; returns {command, preview}. */
  show(points) {
    const kind = this.offerKinds(points.length);
    const { fields } = kKinds[kind];
    for (const field of ['radius', 'clearance', 'side']) this.field(field).closest('label').hidden = !fields.includes(field);
    if (this.kindOfClearance !== kind) {
      this.field('clearance').value = kind === 'standoff' ? kStandoffMm : kLengths.clearance.usualMm;
      this.kindOfClearance = kind;
    }
    const wish = {
      kind, name: this.field('name').value.trim(), side: this.field('side').value,
      radiusMm: this.field('radius').valueAsNumber, clearanceMm: this.field('clearance').valueAsNumber,
    };
    const { definition, problem } = fixtureOf(points, wish, this.orbit.eye, this.namesTaken());
    this.definition = problem ? null : definition;
    const key = JSON.stringify(points);
    if (key !== this.points && !this.asked) this.say('');
    this.points = key;
    this.showButtons();
    // that the name is taken follows from what was just added, and is no news
    const text = this.answer || problem;
    const status = this.form.querySelector('[role=status]');
    if (status.textContent !== text) status.textContent = text;
    status.classList.toggle('problem', !this.answer || this.answerIsProblem);
    return {
      command: definition && !problem ? commandOf(definition) : '',
      // what was added is drawn as the box has it
      preview: definition && !this.added.includes(wish.name) && { name: `${wish.name || kind} (preview)`, group: 'preview', enabled: true, shape: shapeOf(definition) },
    };
  }

  showButtons() {
    const { addButton, removeButton } = this;
    const waits = !this.connected || Boolean(this.asked);
    const last = this.added.at(-1);
    addButton.hidden = !this.mayAdd;
    setDisabled(addButton, waits || !this.definition);
    if (!last && document.activeElement === removeButton) addButton.focus();
    removeButton.hidden = !this.mayAdd || !last;
    setDisabled(removeButton, waits);
    if (last) removeButton.textContent = `Remove ${last}`;
  }

  /** Enables the kinds that so many points determine; returns the chosen one. */
  offerKinds(count) {
    const select = this.field('kind');
    for (const option of select.options) option.disabled = kKinds[option.value].points > count;
    if (select.selectedOptions[0].disabled) select.value = [...select.options].find((option) => !option.disabled).value;
    return select.value;
  }
}

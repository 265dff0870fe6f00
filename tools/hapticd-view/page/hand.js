// SPDX-License-Identifier: Apache-2.0
// A person moves the hand of a simulated handle: mouse, touch, wheel, keys and gamepad make its target, which the page sends.

import { ForceFeedback } from './force_feedback.js';
import { add, dot, isVector, norm, scale, subtract } from './vectors.js';

/** How often the gamepad is read and a target that has changed is sent; a bridge takes 100 messages a second, of all kinds. */
const kSendMs = 25;
/** A target that stays is sent so often, within the 0.2 s after which the box lets it rest; and after a refusal. */
const kKeepMs = 60;
const kRetryMs = 500;
/** The target is no farther from the hand than this: what a surface holds back must not be dragged back all the way. */
const kLongestLeadM = 0.1;
/** A notch of a wheel is about 100 px. */
const kDepthMPerPx = 5e-5;
/** For a pinch that doubles the distance of two fingers. */
const kPinchM = 0.1;
const kKeyM = 0.004;
const kStickMPerS = 0.15;
const kStickRest = 0.15;

const kHelp = 'Drag moves the hand, wheel or pinch pushes it in; h lets it go.';

/** A stick of a gamepad, which never rests at exactly 0. */
const deflection = (value = 0) => (Math.abs(value) < kStickRest ? 0 : value);

export class Hand {
  /**
   * `elements`: tool, button, feel and note; `orbit`: the eye; `send(message)` to the bridge; `onChange()` after each change of
   * `target`: where the person leads the hand, in metres in the world; null: nobody leads it.
   */
  constructor(elements, orbit, send, onChange) {
    Object.assign(this, { elements, orbit, send, onChange });
    this.isOn = false;
    this.target = null;
    this.hip = null;
    this.mayMove = false;
    /** Whether the handle is one that may follow a person; the box says where it does not. */
    this.isSimulated = false;
    this.problem = '';
    this.changed = false;
    this.sentMs = -Infinity;
    this.tickMs = performance.now();
    this.mostN = 4;
    this.feedback = new ForceFeedback();
    elements.button.addEventListener('click', () => this.toggle());
    elements.feel.addEventListener('change', () => this.feedback.choose(elements.feel.value));
    setInterval(() => this.tick(), kSendMs);
  }

  /** A message `hello` of the bridge, for which this page is a new one. */
  takeHello({ movesHand = false }) {
    this.mayMove = movesHand;
    this.showTool();
  }

  takeParameters(parameters) {
    this.isSimulated = parameters['handle.driver'] === 'simulated';
    this.mostN = parameters['safety.max_force_n'] ?? this.mostN;
    this.showTool();
  }

  /** A message `hand` of the bridge: why the hand does not follow; empty: it does. */
  takeAnswer({ problem }) {
    // meanwhile somebody else may have moved it
    if (this.problem && !problem) this.begin();
    this.problem = problem;
    this.showNote();
  }

  takeWindow(hip, forceN) {
    this.hip = hip;
    if (this.isOn && !this.target) this.begin();
    this.feedback.show(this.isOn && forceN > 0 ? Math.min(forceN / this.mostN, 1) : 0);
  }

  takeLoss() {
    this.mayMove = false;
    this.showTool();
  }

  toggle() {
    this.set(!this.isOn);
  }

  /** Takes the hand where it is, or lets it go. */
  set(wanted) {
    this.isOn = wanted && this.mayMove && this.isSimulated;
    this.problem = '';
    this.target = null;
    if (this.isOn) {
      this.begin();
    } else {
      this.feedback.show(0);
      this.onChange();
    }
    this.elements.button.setAttribute('aria-pressed', String(this.isOn));
    this.showNote();
  }

  begin() {
    this.target = isVector(this.hip) ? this.hip : null;
    this.changed = true;
    this.onChange();
  }

  showTool() {
    const may = this.mayMove && this.isSimulated;
    this.elements.tool.hidden = !may;
    if (!may && this.isOn) this.set(false);
  }

  showNote() {
    const { note } = this.elements;
    const text = this.problem ? `${this.problem[0].toUpperCase()}${this.problem.slice(1)}` : kHelp;
    if (note.textContent !== text) note.textContent = text;
    note.hidden = !this.isOn;
  }

  /** Moves the target with the pointer, by so many CSS pixels in the plane of the picture. */
  moveInPicture(xPx, yPx) {
    if (!this.target) return;
    const { orbit } = this;
    const depthM = Math.max(dot(subtract(this.target, orbit.eye), orbit.forward), 0.05);
    this.move(add(scale(orbit.right, (xPx * depthM) / orbit.focalPx), scale(orbit.up, (-yPx * depthM) / orbit.focalPx)));
  }

  /** Moves it away from the eye. */
  moveInDepth(metres) {
    this.move(scale(this.orbit.forward, metres));
  }

  wheel(px) {
    this.moveInDepth(-px * kDepthMPerPx);
  }

  /** Two fingers whose distance has changed by this factor. */
  pinch(factor) {
    this.moveInDepth(kPinchM * Math.log2(factor));
  }

  /** Moves by keys: steps to the right, upwards and away from the eye. */
  step(right, up, ahead) {
    const { orbit } = this;
    const across = add(scale(orbit.right, right), scale(orbit.up, up));
    this.move(scale(add(across, scale(orbit.forward, ahead)), kKeyM));
  }

  move(metres) {
    if (!this.target || !this.hip) return;
    const lead = subtract(add(this.target, metres), this.hip);
    this.target = add(this.hip, scale(lead, Math.min(1, kLongestLeadM / Math.max(norm(lead), 1e-9))));
    this.changed = true;
    this.onChange();
  }

  tick() {
    const nowMs = performance.now();
    const seconds = Math.min((nowMs - this.tickMs) / 1000, 0.1);
    this.tickMs = nowMs;
    if (!this.isOn) return;
    this.readGamepad(seconds);
    if (!this.target) return;
    const waitMs = this.problem ? kRetryMs : this.changed ? 0 : kKeepMs;
    if (nowMs - this.sentMs < waitMs) return;
    this.sentMs = nowMs;
    this.changed = false;
    this.send({ type: 'hand', target: this.target });
  }

  /** The left stick moves in the plane of the picture, the other one in depth. */
  readGamepad(seconds) {
    const pad = [...(navigator.getGamepads?.() ?? [])].find((one) => one?.connected);
    this.feedback.pad = pad ?? null;
    if (!pad) return;
    const [right, down, , back] = [0, 1, 2, 3].map((axis) => deflection(pad.axes[axis]));
    if (right === 0 && down === 0 && back === 0) return;
    const steps = (kStickMPerS * seconds) / kKeyM;
    this.step(right * steps, -down * steps, -back * steps);
  }
}

// SPDX-License-Identifier: Apache-2.0
// The force as a tone, as vibration of a phone, and as rumble of a gamepad.

const kLowestHz = 140;
const kHighestHz = 560;
const kLoudest = 0.15;
/** The tone follows so fast, without clicks. */
const kFollowS = 0.02;
const kPulseMs = 100;
const kLeastShare = 0.02;

export class ForceFeedback {
  constructor() {
    /** '', 'tone', 'vibration' or 'both'. */
    this.choice = '';
    /** The gamepad in use; null: none. */
    this.pad = null;
    this.tone = null;
    this.pulseMs = 0;
    this.vibrates = false;
  }

  /** To be called by a click: browsers start no sound before one. */
  choose(choice) {
    this.choice = choice;
    if (this.hasTone && !this.tone) this.tone = this.makeTone();
    this.show(0);
  }

  get hasTone() {
    return this.choice === 'tone' || this.choice === 'both';
  }

  get hasVibration() {
    return this.choice === 'vibration' || this.choice === 'both';
  }

  makeTone() {
    const context = new AudioContext();
    const oscillator = context.createOscillator();
    const gain = context.createGain();
    gain.gain.value = 0;
    oscillator.connect(gain).connect(context.destination);
    oscillator.start();
    return { context, oscillator, gain };
  }

  /** `share`: of the largest force that the box exerts, 0..1. */
  show(share) {
    const felt = share < kLeastShare ? 0 : share;
    if (this.tone) {
      const { context, oscillator, gain } = this.tone;
      gain.gain.setTargetAtTime(this.hasTone ? kLoudest * Math.sqrt(felt) : 0, context.currentTime, kFollowS);
      oscillator.frequency.setTargetAtTime(kLowestHz + (kHighestHz - kLowestHz) * felt, context.currentTime, kFollowS);
    }
    this.vibrate(this.hasVibration ? felt : 0);
  }

  /** Pulses that fill a larger part of their time the larger the force is: phones know no strength. */
  vibrate(share) {
    const nowMs = performance.now();
    if (share === 0 && !this.vibrates) return;
    if (share > 0 && nowMs - this.pulseMs < kPulseMs) return;
    this.pulseMs = nowMs;
    this.vibrates = share > 0;
    navigator.vibrate?.(Math.round(kPulseMs * share));
    this.pad?.vibrationActuator?.playEffect?.('dual-rumble', {
      duration: share > 0 ? 2 * kPulseMs : 0, strongMagnitude: share, weakMagnitude: share / 2,
    })?.catch?.(() => {});
  }
}

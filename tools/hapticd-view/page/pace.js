// SPDX-License-Identifier: Apache-2.0
// How many depth frames a second the page asks for: as many as it can draw. A browser takes every message in, however
// busy the page is, so that frames beyond that would only wait in its memory and grow old.

const kCheckMs = 100;
const kMostHz = 30;
const kFewestHz = 2;
/** The page is busy when its timers come this late on average, and has time to spare below the other. */
const kBusyMs = 120;
const kSpareMs = 25;
const kShare = 0.2;
/** After a change its effect shows first. */
const kSettleChecks = 15;
const kRiseChecks = 80;

export class Pace {
  /** `onChange(hz)` when another number of frames is to be asked for. */
  constructor(onChange) {
    this.onChange = onChange;
    this.hz = kMostHz;
    this.lateMs = 0;
    this.checks = 0;
    this.dueMs = performance.now() + kCheckMs;
    setInterval(() => this.check(), kCheckMs);
  }

  check() {
    const nowMs = performance.now();
    // timers of a page that nobody sees are late because the browser wants it so
    if (!document.hidden) this.lateMs += kShare * (Math.max(nowMs - this.dueMs, 0) - this.lateMs);
    this.dueMs = nowMs + kCheckMs;
    this.checks++;
    if (this.lateMs > kBusyMs && this.hz > kFewestHz && this.checks > kSettleChecks) this.set(this.hz / 2);
    if (this.lateMs < kSpareMs && this.hz < kMostHz && this.checks > kRiseChecks) this.set(this.hz * 2);
  }

  set(hz) {
    this.hz = Math.min(Math.max(hz, kFewestHz), kMostHz);
    this.checks = 0;
    this.onChange(this.hz);
  }
}

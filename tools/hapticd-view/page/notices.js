// SPDX-License-Identifier: Apache-2.0
// What stands over the picture when it does not show the box as it is now: no connection, no data, no depth, paused.

/** Without a message for longer than this the data counts as stale; the bridge sends at least five a second. */
const kStaleMs = 1500;
/** A page that was kept from running has messages waiting: so much of that time does not make them old. */
const kMostCreditMs = 10_000;

export class Notices {
  constructor() {
    const element = (id) => document.getElementById(id);
    this.notice = element('notice');
    this.title = element('notice-title');
    this.text = element('notice-text');
    this.chip = element('connection');
    this.connection = { state: 'connecting', reason: '' };
    this.box = { reachable: true, reason: '' };
    this.depth = { available: true, reason: '' };
    this.paused = false;
    this.fault = '';
    this.dataMs = null;
    this.frameMs = null;
    this.openMs = performance.now();
    this.shownMs = this.openMs;
  }

  /** Called for each message with data, and for each depth frame. */
  gotData(ageMs = 0) {
    this.dataMs = Math.max(this.dataMs ?? 0, performance.now() - ageMs);
  }

  gotFrame() {
    this.frameMs = performance.now();
  }

  /** Seconds since the newest data; null where there was none. */
  ageS(sinceMs) {
    return sinceMs === null ? null : (performance.now() - sinceMs) / 1000;
  }

  get stale() {
    return this.dataMs !== null && performance.now() - this.dataMs > kStaleMs;
  }

  /** Whether what the page knows of the box is of this moment. */
  get hearsBox() {
    const opening = this.dataMs === null && performance.now() - this.openMs < kStaleMs;
    return opening || (this.connection.state === 'open' && this.box.reachable && !this.stale);
  }

  /** {level, chip, title, text}: what matters most. */
  current() {
    const ageS = this.ageS(this.dataMs);
    const noData = ageS === null ? 'No data yet' : `No data for ${ageS.toFixed(1)} s`;
    if (this.fault) return { level: 'wrong', chip: 'Page error', title: 'Page error', text: this.fault };
    if (this.connection.state === 'unauthorised') {
      return {
        level: 'wrong', chip: 'Not authorised', title: 'Not authorised',
        text: "Run 'hapticctl view' on the box and open the address it prints.",
      };
    }
    if (this.connection.state !== 'open') {
      const waits = this.dataMs === null && performance.now() - this.openMs < kStaleMs;
      return {
        level: waits ? 'quiet' : 'wrong', chip: waits ? 'Connecting' : 'No connection', title: waits ? '' : noData,
        text: "Retrying. Check the SSH tunnel and hapticd-view.",
      };
    }
    if (!this.box.reachable) {
      return { level: 'wrong', chip: 'Box not reachable', title: noData, text: this.box.reason };
    }
    if (this.stale) {
      return { level: 'wrong', chip: 'Stale', title: noData, text: 'The data shown is old. The page resumes automatically.' };
    }
    return this.lesser();
  }

  lesser() {
    if (this.paused) return { level: 'doubtful', chip: 'Paused', title: '', text: '' };
    if (!this.depth.available) {
      return { level: 'doubtful', chip: 'Live', title: 'No depth', text: this.depth.reason };
    }
    const ageS = this.ageS(this.frameMs);
    if (ageS !== null && ageS * 1000 > kStaleMs) {
      return { level: 'doubtful', chip: 'Live', title: `No depth frame for ${ageS.toFixed(1)} s`, text: '' };
    }
    return { level: 'good', chip: 'Live', title: '', text: '' };
  }

  /** To be called ten times a second, and whenever something has changed. */
  show() {
    const nowMs = performance.now();
    const keptMs = nowMs - this.shownMs - kStaleMs / 3;
    this.shownMs = nowMs;
    if (keptMs > 0 && this.dataMs !== null) this.dataMs = Math.min(this.dataMs + Math.min(keptMs, kMostCreditMs), nowMs);
    const { level, chip, title, text } = this.current();
    this.chip.dataset.level = level;
    if (this.chip.textContent !== chip) this.chip.textContent = chip;
    this.notice.hidden = !title;
    this.notice.dataset.level = level;
    if (this.title.textContent !== title) this.title.textContent = title;
    if (this.text.textContent !== text) this.text.textContent = text;
    document.body.classList.toggle('stale', level === 'wrong' && this.dataMs !== null);
  }
}

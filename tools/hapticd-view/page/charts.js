// SPDX-License-Identifier: Apache-2.0
// Strip charts of the last half minute. Of all windows that fall into one column of pixels the largest value is kept: a
// peak of a single tick is never lost. A rare peak does not set the range of a linear scale; it is marked at its top.

const kLongestS = 30;
/** A chart is at least so long: seconds later there is something in all of it. */
const kShortestS = 5;
const kHoleS = 2;
const kMostSamples = 4096;
const kAxisPx = 14;
/** The range of a linear scale follows this share of the columns ... */
const kUsualShare = 0.97;
/** ... and whatever goes beyond it by less. */
const kHeadroom = 4;
const kNothingShare = 0.02;

/** A round number that is at least `value`: 1, 2 or 5 times a power of ten. */
function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((step) => step * power).find((step) => step >= value * 0.9999);
}

/** Top of a linear scale for these values, of which NaN are left out. */
export function robustTop(columns, least) {
  const values = Array.from(columns).filter(Number.isFinite).sort((a, b) => a - b);
  if (values.length === 0) return roundUp(least);
  const largest = values.at(-1) * 1.05;
  // without what is as good as zero: half a minute of no contact says nothing about the range of contacts
  const acting = values.filter((value) => value > kNothingShare * largest);
  const usual = Math.max(least, (acting[Math.floor(kUsualShare * (acting.length - 1))] ?? 0) * 1.05);
  return roundUp(largest <= kHeadroom * usual ? Math.max(largest, usual) : usual);
}

export class Chart {
  /**
   * `canvas` has data-unit, data-digits, data-least, the smallest range, and for a logarithmic scale data-floor, its
   * lowest value; `value` is the element that shows the newest number, or the one under the pointer.
   */
  constructor(canvas, value) {
    this.canvas = canvas;
    this.value = value;
    this.unit = canvas.dataset.unit;
    this.least = Number(canvas.dataset.least);
    this.floor = Number(canvas.dataset.floor ?? 0);
    this.digits = Number(canvas.dataset.digits);
    this.samples = [];
    this.pointerX = null;
    const hover = (x) => {
      this.pointerX = x;
      this.draw();
    };
    canvas.addEventListener('pointermove', (event) => hover(event.offsetX));
    canvas.addEventListener('pointerleave', () => hover(null));
  }

  add(timeS, value) {
    const last = this.samples.at(-1);
    // the box has started again
    if (last && (timeS < last.timeS || timeS - last.timeS > kLongestS)) this.samples = [];
    this.samples.push({ timeS, value });
    if (this.samples.length > kMostSamples) this.samples.shift();
  }

  /** Seconds from the left edge to the right one. */
  get spanS() {
    if (this.samples.length === 0) return kLongestS;
    const seenS = this.samples.at(-1).timeS - this.samples[0].timeS;
    return Math.min(Math.max(seenS, kShortestS), kLongestS);
  }

  /** The largest value of each column, or NaN; the newest column is the last one. */
  columns(count) {
    const columns = new Float64Array(count).fill(NaN);
    const newest = this.samples.at(-1)?.timeS ?? 0;
    const { spanS } = this;
    for (const { timeS, value } of this.samples) {
      if (!Number.isFinite(value)) continue;
      const column = Math.min(count - 1 - Math.floor(((newest - timeS) / spanS) * count), count - 1);
      if (column >= 0 && !(columns[column] >= value)) columns[column] = value;
    }
    return columns;
  }

  draw(colours = this.colours) {
    this.colours = colours;
    const { canvas } = this;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * ratio);
    const height = Math.round(canvas.clientHeight * ratio);
    if (!colours || width === 0 || height === 0) return;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const context = canvas.getContext('2d');
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.paint(context, canvas.clientWidth, canvas.clientHeight);
  }

  paint(context, width, height) {
    const { colours } = this;
    const columns = this.columns(Math.floor(width));
    const scale = this.scaleOf(columns, height - kAxisPx);
    context.clearRect(0, 0, width, height);
    context.strokeStyle = colours.rule;
    context.lineWidth = 1;
    for (const value of scale.rules) {
      const y = Math.round(scale.yOf(value)) + 0.5;
      context.beginPath();
      context.moveTo(0, y);
      context.lineTo(width, y);
      context.stroke();
    }
    context.fillStyle = colours.fill;
    context.strokeStyle = colours.accent;
    context.lineWidth = 1.5;
    this.curve(context, columns, scale.yOf, height - kAxisPx);
    this.markPeaks(context, columns, scale);
    this.write(context, scale, width, height);
    this.showValue(context, columns, scale, height - kAxisPx);
  }

  /** {top, bottom, rules, yOf}: values at the edges and the lines, and the place of a value. */
  scaleOf(columns, bottomPx) {
    const rangePx = bottomPx - 4;
    if (this.floor > 0) {
      const largest = columns.reduce((most, value) => (value > most ? value : most), this.least);
      const top = 10 ** Math.ceil(Math.log10(largest * 0.9999));
      const decades = Math.log10(top / this.floor);
      const share = (value) => Math.log10(Math.max(value, this.floor) / this.floor) / decades;
      const rules = Array.from({ length: Math.round(decades) + 1 }, (_, i) => this.floor * 10 ** i);
      return { top, bottom: this.floor, rules, yOf: (value) => bottomPx - share(value) * rangePx };
    }
    const top = robustTop(columns, this.least);
    const yOf = (value) => bottomPx - (Math.min(value, top) / top) * rangePx;
    return { top, bottom: 0, rules: [0, top / 2, top], yOf };
  }

  /** A triangle at the top edge for each peak beyond the scale. */
  markPeaks(context, columns, { top }) {
    context.fillStyle = this.colours.accent;
    columns.forEach((value, x) => {
      if (!(value > top) || columns[x - 1] > value || columns[x + 1] >= value) return;
      context.beginPath();
      context.moveTo(x, 0);
      context.lineTo(x - 4, 6);
      context.lineTo(x + 4, 6);
      context.fill();
    });
  }

  write(context, { top, bottom }, width, height) {
    context.fillStyle = this.colours.ink;
    context.font = '11px system-ui, sans-serif';
    context.textBaseline = 'bottom';
    context.textAlign = 'left';
    context.fillText(`${Math.round(this.spanS)} s ago`, 0, height);
    context.textAlign = 'right';
    context.fillText('now', width, height);
    context.textBaseline = 'top';
    context.fillText(`${top} ${this.unit}`, width, 5);
    if (bottom > 0) {
      context.textBaseline = 'bottom';
      context.fillText(`${bottom} ${this.unit}`, width, height - kAxisPx);
    }
  }

  /** Beside the title: the newest value, or under the pointer the largest of that column, and when it was. */
  showValue(context, columns, { yOf }, bottomPx) {
    const number = (value) => (Number.isFinite(value) ? value.toFixed(this.digits) : '–');
    if (this.pointerX === null) {
      this.value.textContent = `${number(this.samples.at(-1)?.value)} ${this.unit}`;
      return;
    }
    const x = Math.min(Math.max(Math.floor(this.pointerX), 0), columns.length - 1);
    const agoS = ((columns.length - 1 - x) / columns.length) * this.spanS;
    this.value.textContent = `${number(columns[x])} ${this.unit}, ${agoS.toFixed(1)} s ago`;
    context.strokeStyle = this.colours.ink;
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(x + 0.5, 0);
    context.lineTo(x + 0.5, bottomPx);
    context.stroke();
    if (!Number.isFinite(columns[x])) return;
    context.fillStyle = this.colours.accent;
    context.beginPath();
    context.arc(x + 0.5, yOf(columns[x]), 3, 0, 2 * Math.PI);
    context.fill();
  }

  /** Joins the columns; where there was no window for longer than kHoleS, and for unknown values, there is a hole. */
  curve(context, columns, yOf, bottomPx) {
    const mostGap = Math.max(2, (kHoleS / this.spanS) * columns.length);
    const line = new Path2D();
    const area = new Path2D();
    let begun = -1;
    let last = 0;
    let gap = 0;
    const close = (x) => {
      if (begun < 0) return;
      area.lineTo(x, bottomPx);
      area.lineTo(begun, bottomPx);
      begun = -1;
    };
    columns.forEach((value, x) => {
      if (Number.isNaN(value)) {
        if (++gap > mostGap) close(last);
        return;
      }
      gap = 0;
      const y = yOf(value);
      if (begun < 0) {
        begun = x;
        line.moveTo(x, y);
        area.moveTo(x, y);
      } else {
        line.lineTo(x, y);
        area.lineTo(x, y);
      }
      last = x;
    });
    close(last);
    context.fill(area);
    context.stroke(line);
  }
}

export class Charts {
  constructor(folder) {
    this.charts = {};
    for (const canvas of folder.querySelectorAll('canvas[data-chart]')) {
      const value = folder.querySelector(`[data-chart-value="${canvas.dataset.chart}"]`);
      this.charts[canvas.dataset.chart] = new Chart(canvas, value);
    }
  }

  /** Takes over one window of ticks. */
  add(window_) {
    const timeS = window_.timeNs / 1e9;
    this.charts.force.add(timeS, window_.forceMaxN);
    this.charts.penetration.add(timeS, window_.penetrationMaxM === null ? NaN : window_.penetrationMaxM * 1e3);
    this.charts.age.add(timeS, window_.sceneAgeMaxNs / 1e6);
    this.charts.latency.add(timeS, window_.wakeupLatencyMaxNs / 1e3);
  }

  draw() {
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => style.getPropertyValue(name).trim();
    const colours = {
      accent: colour('--accent'), fill: colour('--accent-faint'), rule: colour('--rule'), ink: colour('--ink-quiet'),
    };
    for (const chart of Object.values(this.charts)) chart.draw(colours);
  }
}

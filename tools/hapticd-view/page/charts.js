// SPDX-License-Identifier: Apache-2.0
// Strip charts of the last half minute. Of all windows that fall into one column of pixels the largest value is drawn:
// a peak of a single tick is never lost.

const kSpanS = 30;
const kHoleS = 2;
const kMostSamples = 4096;
const kAxisPx = 14;

/** A round number that is at least `value`: 1, 2 or 5 times a power of ten. */
function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((step) => step * power).find((step) => step >= value * 0.9999);
}

class Chart {
  /** `canvas` has data-unit and data-least, the smallest range; `value` the element that shows the newest number. */
  constructor(canvas, value) {
    this.canvas = canvas;
    this.value = value;
    this.unit = canvas.dataset.unit;
    this.least = Number(canvas.dataset.least);
    this.digits = Number(canvas.dataset.digits);
    this.samples = [];
  }

  add(timeS, value) {
    const last = this.samples.at(-1);
    // the box has started again
    if (last && (timeS < last.timeS || timeS - last.timeS > kSpanS)) this.samples = [];
    this.samples.push({ timeS, value });
    if (this.samples.length > kMostSamples) this.samples.shift();
  }

  /** The largest value of each column, or NaN; the newest column is the last one. */
  columns(count) {
    const columns = new Float64Array(count).fill(NaN);
    const newest = this.samples.at(-1)?.timeS ?? 0;
    for (const { timeS, value } of this.samples) {
      if (!Number.isFinite(value)) continue;
      const column = count - 1 - Math.floor(((newest - timeS) / kSpanS) * count);
      if (column >= 0 && !(columns[column] >= value)) columns[column] = value;
    }
    return columns;
  }

  draw(colours) {
    const { canvas } = this;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * ratio);
    const height = Math.round(canvas.clientHeight * ratio);
    if (width === 0 || height === 0) return;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const context = canvas.getContext('2d');
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.paint(context, colours, canvas.clientWidth, canvas.clientHeight);
  }

  paint(context, colours, width, height) {
    const columns = this.columns(Math.floor(width));
    let largest = NaN;
    for (const value of columns) if (!(largest >= value) && Number.isFinite(value)) largest = value;
    const top = roundUp(Math.max(this.least, Number.isFinite(largest) ? largest * 1.05 : 0));
    const bottomPx = height - kAxisPx;
    const yOf = (value) => bottomPx - (Math.min(value, top) / top) * (bottomPx - 4);
    context.clearRect(0, 0, width, height);
    context.strokeStyle = colours.rule;
    context.lineWidth = 1;
    for (const share of [0, 0.5, 1]) {
      const y = Math.round(yOf(share * top)) + 0.5;
      context.beginPath();
      context.moveTo(0, y);
      context.lineTo(width, y);
      context.stroke();
    }
    context.fillStyle = colours.fill;
    context.strokeStyle = colours.accent;
    context.lineWidth = 1.5;
    this.curve(context, columns, yOf, bottomPx);
    context.fillStyle = colours.ink;
    context.font = '11px system-ui, sans-serif';
    context.textBaseline = 'bottom';
    context.fillText(`${kSpanS} s`, 0, height);
    context.textAlign = 'right';
    context.fillText('now', width, height);
    context.textBaseline = 'top';
    context.fillText(`${top} ${this.unit}`, width, 5);
    context.textAlign = 'left';
    const newest = this.samples.at(-1)?.value;
    this.value.textContent = Number.isFinite(newest) ? newest.toFixed(this.digits) : '–';
  }

  /** Joins the columns; where there was no window for longer than kHoleS, and for unknown values, there is a hole. */
  curve(context, columns, yOf, bottomPx) {
    const mostGap = Math.max(2, (kHoleS / kSpanS) * columns.length);
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

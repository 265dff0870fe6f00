// SPDX-License-Identifier: Apache-2.0
// A real Chromium without a screen, for the tests of the page. Everything that it complains about is collected.
import assert from 'node:assert/strict';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

/** Reached only by a test that fails: a machine may be slow. */
export const kLimitMs = 120_000;

const here = dirname(fileURLToPath(import.meta.url));
export const pageFolder = process.env.HAPTICD_VIEW_PAGE ?? join(here, '../../tools/hapticd-view/page');

/** A driver's advice about speed is no fault of the page. */
const isAdvice = (text) => text.includes('GL Driver Message') && text.includes('Performance');

export class Browser {
  static async start() {
    const browser = new Browser();
    browser.chromium = await chromium.launch({
      executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
      // WebGL without a graphics card; the sandbox needs rights that a container does not have
      args: ['--enable-unsafe-swiftshader', '--no-sandbox'],
      timeout: kLimitMs,
    });
    return browser;
  }

  /**
   * Opens the page; `options` as those of a context of Playwright, and `first`, a function that runs in it before its own
   * scripts. `complaints` of the result: what it must not say.
   */
  async open(url, { first, ...options } = {}) {
    const context = await this.chromium.newContext({ viewport: { width: 1100, height: 700 }, ...options });
    context.setDefaultTimeout(kLimitMs);
    const page = await context.newPage();
    if (first) await page.addInitScript(first);
    page.complaints = [];
    page.on('pageerror', (error) => page.complaints.push(error.message));
    page.on('console', (message) => {
      const text = message.text();
      if (['error', 'warning'].includes(message.type()) && !isAdvice(text)) page.complaints.push(text);
    });
    page.on('request', (request) => {
      const { host, protocol } = new URL(request.url());
      const own = host === new URL(url).host || protocol === 'blob:' || protocol === 'data:';
      if (!own) page.complaints.push(`a request left the host: ${request.url()}`);
    });
    await page.goto(url, { timeout: kLimitMs });
    return page;
  }

  stop() {
    return this.chromium.close();
  }
}

/** Waits until `condition`, evaluated in the page with `argument`, is true. */
export const until = (page, condition, argument) => page.waitForFunction(condition, argument, { timeout: kLimitMs });

export const hasFrames = (page, count) =>
  until(page, (wanted) => window.hapticdView?.counters.depthFrames >= wanted, count);

/** Shows only these parts of the picture, each pixel of the cloud. */
export async function showOnly(page, layers) {
  await page.evaluate((wanted) => {
    for (const box of document.querySelectorAll('[data-layer], #full-detail')) {
      box.checked = wanted.includes(box.dataset.layer) || box.id === 'full-detail';
      box.dispatchEvent(new Event('change'));
    }
  }, layers);
}

/** Rectangle and centroid, in CSS pixels, of what is drawn over the background; a pixel's middle is at its half. */
export function drawnIn(page) {
  return page.evaluate(() => {
    const canvas = document.querySelector('#view');
    const { width, height } = canvas;
    const pixels = window.hapticdView.readPixels(0, 0, width, height);
    const ratio = window.hapticdView.pixelRatio;
    const background = pixels.slice(0, 3);
    const found = { left: Infinity, right: -Infinity, top: Infinity, bottom: -Infinity, count: 0, x: 0, y: 0 };
    for (let row = 0; row < height; row++) {
      for (let column = 0; column < width; column++) {
        const at = 4 * (row * width + column);
        if ([0, 1, 2].every((i) => Math.abs(pixels[at + i] - background[i]) < 6)) continue;
        const x = (column + 0.5) / ratio;
        const y = (height - row - 0.5) / ratio;
        found.left = Math.min(found.left, x);
        found.right = Math.max(found.right, x);
        found.top = Math.min(found.top, y);
        found.bottom = Math.max(found.bottom, y);
        found.count++;
        found.x += x;
        found.y += y;
      }
    }
    found.x /= found.count;
    found.y /= found.count;
    return found;
  });
}

/** The rectangle around these points of the world in the view, by the page's own projection. */
export function rectangleOf(page, points) {
  return page.evaluate((all) => {
    const found = { left: Infinity, right: -Infinity, top: Infinity, bottom: -Infinity };
    for (const point of all) {
      const { x, y } = window.hapticdView.project(...point);
      found.left = Math.min(found.left, x);
      found.right = Math.max(found.right, x);
      found.top = Math.min(found.top, y);
      found.bottom = Math.max(found.bottom, y);
    }
    return found;
  }, points);
}

export function assertNear(actual, expected, tolerance, what) {
  assert.ok(Math.abs(actual - expected) <= tolerance,
    `${what}: ${actual} is not within ${tolerance} of ${expected}`);
}

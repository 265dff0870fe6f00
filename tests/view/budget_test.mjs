// SPDX-License-Identifier: Apache-2.0
// The page gives way: it asks for less and draws less where pictures are slow, where nobody looks, and where the box suffers.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { setTimeout } from 'node:timers/promises';
import { kLimitMs, until } from './browser.mjs';
import { withFakeBridge } from './fake_bridge.mjs';

let fake;
let page;

withFakeBridge((opened) => { ({ fake, page } = opened); });

test('without a graphics card the page says what it spares', async () => {
  const { note, shown } = await page.evaluate(() => ({
    note: window.hapticdView.budget.note, shown: document.querySelector('#cost').textContent }));
  assert.match(note, /^No graphics card: 1 of \d+ depth pixels, up to \d+ pictures\/s/);
  assert.equal(shown, note);
});

test('a camera that loses frames makes the page cheaper, and the bridge is asked for fewer frames', async () => {
  const cheapest = 5;
  fake.status.scene.frameRateHz = 30;
  await until(page, () => document.querySelector('#health').textContent.includes('30.0 frames/s'));
  fake.status.scene.frameRateHz = 14;
  await until(page, (hz) => Number(document.querySelector('#cost').textContent.match(/up to (\d+)/)[1]) <= hz, cheapest);
  assert.equal(fake.depthHz, cheapest);
  fake.status.scene.frameRateHz = 30;
});

/** Waits until the page asks for a rate of depth frames of which `condition` holds. */
async function isAsked(condition) {
  const begunMs = performance.now();
  while (!condition(fake.depthHz)) {
    assert(performance.now() - begunMs < kLimitMs, `still asked for ${fake.depthHz} frames/s`);
    await setTimeout(10);
  }
}

test('a page that nobody sees takes no depth, and takes it again when it is seen', async () => {
  const show = (hidden) => page.evaluate((value) => {
    Object.defineProperty(document, 'hidden', { configurable: true, value });
    document.dispatchEvent(new Event('visibilitychange'));
  }, hidden);
  await show(true);
  await until(page, () => document.hidden);
  await isAsked((hz) => hz === 0);
  await show(false);
  await isAsked((hz) => hz > 0);
});

test('slow pictures in succession make the next ones cheaper, a single one does not; after calm it tries again', async () => {
  const levels = await page.evaluate(async () => {
    const { Budget } = await import('/budget.js');
    const now = performance.now.bind(performance);
    const next = window.requestAnimationFrame;
    let offsetMs = 0;
    let pending = null;
    performance.now = () => now() + offsetMs;
    window.requestAnimationFrame = (call) => { pending = call; };
    const budget = new Budget(false, () => {});
    const picture = (tookMs) => {
      budget.measure();
      offsetMs += tookMs;
      pending();
    };
    const found = [budget.level];
    for (let i = 0; i < 20; i++) picture(i % 5 === 0 ? 300 : 5);
    found.push(budget.level);
    for (let i = 0; i < 6; i++) picture(300);
    found.push(budget.level);
    offsetMs += 60_000;
    picture(5);
    found.push(budget.level);
    performance.now = now;
    window.requestAnimationFrame = next;
    return found;
  });
  assert.deepEqual(levels, [0, 0, 1, 0]);
});

test('full resolution is what the page says: every pixel, whatever it costs', async () => {
  await page.evaluate(() => document.querySelector('#full-detail').click());
  assert.equal(await page.evaluate(() => window.hapticdView.every), 1);
  assert.equal(await page.locator('#cost').textContent(), '');
  assert.deepEqual(page.complaints, []);
});

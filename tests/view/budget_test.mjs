// SPDX-License-Identifier: Apache-2.0
// The page gives way: it asks for less and draws less where pictures are slow, where nobody looks, and where the box suffers.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { Browser, hasFrames, kLimitMs, pageFolder, until } from './browser.mjs';
import { FakeBridge } from './fake_bridge.mjs';

let fake;
let browser;
let page;

before(async () => {
  fake = new FakeBridge(pageFolder);
  browser = await Browser.start();
  page = await browser.open(await fake.start());
  await hasFrames(page, 1);
}, { timeout: kLimitMs });

after(async () => {
  await browser?.stop();
  await fake?.stop();
});

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

test('a page that nobody sees takes no depth, and takes it again when it is seen', async () => {
  const { depthHz } = fake;
  const show = (hidden) => page.evaluate((value) => {
    Object.defineProperty(document, 'hidden', { configurable: true, value });
    document.dispatchEvent(new Event('visibilitychange'));
  }, hidden);
  await show(true);
  await until(page, () => document.hidden);
  while (fake.depthHz !== 0) await page.evaluate(() => new Promise((resolve) => { setTimeout(resolve, 10); }));
  await show(false);
  while (fake.depthHz !== depthHz) await page.evaluate(() => new Promise((resolve) => { setTimeout(resolve, 10); }));
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

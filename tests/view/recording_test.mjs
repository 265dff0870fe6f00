// SPDX-License-Identifier: Apache-2.0
// A session recorded by the real daemon, shown by the real bridge without one.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { Browser, hasFrames, kLimitMs, until } from './browser.mjs';
import { RealBox } from './real_box.mjs';
import { assertRimInThreeViews } from './rim.mjs';

const kFrames = 20;

let box;
let browser;
let page;
let firstFrame;

before(async () => {
  box = new RealBox();
  await box.start();
  const url = await box.showRecording(kFrames);
  browser = await Browser.start();
  page = await browser.open(url, { viewport: { width: 1024, height: 640 }, colorScheme: 'dark' });
  await hasFrames(page, 1);
  firstFrame = await page.evaluate(() => window.hapticdView.frameNumber);
}, { timeout: 2 * kLimitMs });

after(async () => {
  await browser?.stop();
  await box?.stop();
}, { timeout: kLimitMs });

test('the page says that it shows a recording, and stands at its begin', async () => {
  await until(page, () => document.querySelector('#connection').textContent === 'Recording');
  assert.match(await page.locator('#source').textContent(), /^recording \d{4}-\d\d-\d\dT/);
  assert.match(await page.locator('#position').textContent(), /^0:00\.0 of /);
});

test("the sphere's rim is drawn where it belongs, in three views", () => assertRimInThreeViews(page));

test('a step leads to the next depth frame, and one back to that before', async () => {
  const number = () => page.evaluate(() => window.hapticdView.frameNumber);
  const first = await number();
  await page.click('#step-on');
  await until(page, (before) => window.hapticdView.frameNumber === before + 1, first);
  await page.click('#step-back');
  await until(page, (before) => window.hapticdView.frameNumber === before, first);
});

test('the moment of the largest force shows that force', async () => {
  await page.click('#largest');
  const largest = Number((await page.locator('#largest').textContent()).match(/[\d.]+/)[0]);
  await until(page, (force) => Number(document.querySelector('#force-number').textContent) === force, largest);
});

test('it plays to its end, and stands still there', async () => {
  await page.focus('#seek');
  await page.keyboard.press('Home');
  await until(page, () => document.querySelector('#position').textContent.startsWith('0:00.0'));
  await page.click('#play');
  await until(page, () => {
    const [now, , end] = document.querySelector('#position').textContent.split(' ');
    return now === end && document.querySelector('#play').textContent === 'Play';
  });
  // a slow machine draws few frames of them, but the last one in any case; some may lie before the first tick
  await until(page, (least) => window.hapticdView.frameNumber >= least, firstFrame + kFrames / 2);
  assert.deepEqual(page.complaints, []);
});

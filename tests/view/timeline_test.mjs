// SPDX-License-Identifier: Apache-2.0
// The time line of a recorded session: what the page asks of the bridge, and how it follows.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { Browser, hasFrames, kLimitMs, pageFolder, until } from './browser.mjs';
import { FakeBridge } from './fake_bridge.mjs';

const kTimeLine = {
  durationS: 95,
  largestForceS: 42.5,
  largestForceN: 2.31,
  marks: [
    { s: 10, endS: 14, kind: 'contact', text: 'contact' },
    { s: 60, endS: null, kind: 'fault', text: 'holding: depth_stale' },
    { s: 3, endS: null, kind: 'mode', text: 'idle to engaged' },
  ],
};

let fake;
let browser;
let page;

before(async () => {
  fake = new FakeBridge(pageFolder, { timeline: kTimeLine });
  browser = await Browser.start();
  page = await browser.open(await fake.start());
  await hasFrames(page, 1);
}, { timeout: kLimitMs });

after(async () => {
  await browser?.stop();
  await fake?.stop();
});

/** Waits until the page has asked for `expected`, apart from depth. */
async function asked(expected) {
  const begin = Date.now();
  while (Date.now() - begin < kLimitMs) {
    const last = fake.received.filter(({ type }) => type !== 'depth').at(-1);
    try {
      return assert.deepEqual(last, expected);
    } catch {
      await page.evaluate(() => new Promise((resolve) => { requestAnimationFrame(resolve); }));
    }
  }
  return assert.deepEqual(fake.received.at(-1), expected);
}

test('the time line is shown for a recording, and the page says that it is one', async () => {
  assert.ok(await page.locator('#timeline').isVisible());
  assert.equal(await page.locator('#source').textContent(), 'recording session');
  await until(page, () => document.querySelector('#connection').textContent === 'Recording');
  assert.equal(await page.locator('#largest').textContent(), 'Largest force (2.31 N)');
});

test('its buttons and keys ask the bridge for what they say', async () => {
  await page.click('#play');
  await asked({ type: 'pause' });
  fake.send({ type: 'playback', s: 12, playing: false, factor: 1 });
  await until(page, () => document.querySelector('#position').textContent === '0:12.0 of 1:35.0');
  await page.click('#play');
  await asked({ type: 'play' });
  await page.click('#step-on');
  await asked({ type: 'step', frames: 1 });
  await page.click('#step-back');
  await asked({ type: 'step', frames: -1 });
  await page.click('#largest');
  await asked({ type: 'seek', s: 42.5 });
  await page.selectOption('#factor', '0.25');
  await asked({ type: 'factor', factor: 0.25 });
  await page.focus('#view');
  await page.keyboard.press('.');
  await asked({ type: 'step', frames: 1 });
  await page.keyboard.press(',');
  await asked({ type: 'step', frames: -1 });
  await page.focus('#seek');
  await page.keyboard.press('End');
  await asked({ type: 'seek', s: 95 });
});

test('marks lead to their time, in order', async () => {
  await page.click('.mark-list summary');
  assert.deepEqual(await page.locator('#mark-list button').allTextContents(), [
    '0:03.0  idle to engaged', '0:10.0  contact', '1:00.0  holding: depth_stale']);
  await page.locator('#mark-list button').last().click();
  await asked({ type: 'seek', s: 60 });
});

test('a recording that stands still is not stale', async () => {
  fake.send({ type: 'playback', s: 60, playing: false, factor: 1 });
  await until(page, () => document.querySelector('#play').textContent === 'Play');
  fake.silent = true;
  // longer than what counts as stale: five turns of the page's own check
  await page.evaluate(() => new Promise((resolve) => { setTimeout(resolve, 2000); }));
  assert.equal(await page.locator('#connection').textContent(), 'Recording');
  assert.equal(await page.evaluate(() => document.body.classList.contains('stale')), false);
  assert.deepEqual(page.complaints, []);
});

// SPDX-License-Identifier: Apache-2.0
// The page against the real bridge and the real daemon: a synthetic sphere, a simulated hand.
import assert from 'node:assert/strict';
import { writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { assertNear, Browser, drawnIn, hasFrames, kLimitMs, rectangleOf, showOnly, until } from './browser.mjs';
import { spherePoints } from './fake_bridge.mjs';
import { kBoxSphere, RealBox } from './real_box.mjs';

// A point is drawn as a square of the size of its pixel.
const kTolerancePx = 2;
// Half a step of the raw value at 1 m is 1.6 mm of depth, seen from the side at 500 px/m.
const kDepthStepPx = 1;

let box;
let browser;
let page;

before(async () => {
  box = new RealBox();
  const url = await box.start();
  browser = await Browser.start();
  page = await browser.open(url, { viewport: { width: 1024, height: 560 }, colorScheme: 'dark' });
  await hasFrames(page, 3);
}, { timeout: kLimitMs });

after(async () => {
  await browser?.stop();
  await box?.stop();
}, { timeout: kLimitMs });

test('state, ticks, parameters and events of the box arrive', async () => {
  await until(page, () => document.querySelector('#mode').dataset.mode === 'engaged');
  await until(page, () => {
    const { windows, states, events } = window.hapticdView.counters;
    return windows > 10 && states > 2 && events > 0;
  });
  await until(page, () => Number.isFinite(Number(document.querySelector('#force-number').textContent)));
  await until(page, () => document.querySelector('#health').textContent.includes('streaming'));
  await until(page, () => document.querySelector('#connection').textContent === 'Live');
});

test('depth frames arrive in the order of the camera', async () => {
  const begin = await page.evaluate(() => window.hapticdView.frameNumber);
  const received = await page.evaluate(() => window.hapticdView.counters.depthFrames);
  await hasFrames(page, received + 10);
  const { number, frames } = await page.evaluate(() => ({
    number: window.hapticdView.frameNumber, frames: window.hapticdView.counters.depthFrames }));
  assert.ok(number - begin >= frames - received - 1, `${frames - received} messages, ${number - begin} frames`);
});

test("the sphere's rim is drawn where it belongs, in three views", async () => {
  await page.click('#pause');
  await showOnly(page, ['cloud']);
  const points = spherePoints(kBoxSphere);
  for (const key of ['1', '2', '3']) {
    await page.keyboard.press(key);
    const drawn = await drawnIn(page);
    const expected = await rectangleOf(page, points);
    for (const side of ['left', 'right', 'top', 'bottom']) {
      assertNear(drawn[side], expected[side], kTolerancePx + (key === '1' ? 0 : kDepthStepPx), `view ${key}, ${side}`);
    }
  }
});

test('the HIP is drawn at its place, in three views', async () => {
  await showOnly(page, ['hand']);
  for (const key of ['1', '2', '3']) {
    await page.keyboard.press(key);
    const colour = await page.evaluate(() => {
      const { x, y } = window.hapticdView.project(...window.hapticdView.hip);
      const ratio = window.hapticdView.pixelRatio;
      const canvas = document.querySelector('#view');
      return window.hapticdView.readPixels(Math.round(x * ratio), canvas.height - Math.round(y * ratio), 1, 1);
    });
    assert.ok(colour[2] > colour[0] + 20, `view ${key}: not the accent: ${colour}`);
  }
  await page.click('#pause');
});

/** A cube around the origin in millimetres, as STL, and its corners around a place in metres. */
const kHalfM = 0.03;
const corner = (i) => [1, 2, 4].map((bit) => (i & bit ? kHalfM : -kHalfM));
const cornersAt = (place) => Array.from({ length: 8 }, (_, i) => corner(i).map((value, axis) => value + place[axis]));
function cubeStl() {
  const faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
  const facets = faces.flatMap(([a, b, c, d]) => [[a, b, c], [a, c, d]]);
  const vertex = (i) => `vertex ${corner(i).map((value) => 1000 * value).join(' ')}`;
  return `solid cube\n${facets.map((facet) => `facet normal 0 0 0\nouter loop\n${facet.map(vertex).join('\n')}\nendloop\nendfacet`).join('\n')}\nendsolid cube\n`;
}

test('a solid that the box gets is drawn by its lines, where it is', async () => {
  const place = [0.3, 0.15, -1];
  const file = join(box.folder, 'cube.stl');
  await writeFile(file, cubeStl());
  await box.control('fixture', 'add', 'cube', '--mesh', file, '--axes', 'LPS', '--centre-m', place.join(','));
  // a square in each of ten planes across each axis
  await until(page, () => window.hapticdView.solidLines === 30);
  await showOnly(page, ['fixtures']);
  await page.keyboard.press('1');
  const drawn = await drawnIn(page);
  const expected = await rectangleOf(page, cornersAt(place));
  // lines are 2 px wide, and cells of 1.6 mm cut the corners of the squares
  for (const side of ['left', 'right', 'top', 'bottom']) assertNear(drawn[side], expected[side], 3, side);
  await box.control('fixture', 'remove', 'cube');
  await until(page, () => window.hapticdView.solidLines === 0);
});

test('the page comes back by itself when the box starts again', async () => {
  await box.stopDaemon();
  await until(page, () => document.querySelector('#connection').textContent === 'Box not reachable');
  assert.notEqual(await page.locator('#notice-text').textContent(), '');
  const frames = await page.evaluate(() => window.hapticdView.counters.depthFrames);
  box.startDaemon();
  await until(page, () => document.querySelector('#connection').textContent === 'Live');
  await hasFrames(page, frames + 2);
  assert.deepEqual(page.complaints, []);
});

test('a visitor with the token sees the box, and the address does not keep it; one without is told how to get one', async () => {
  const guarded = new RealBox();
  try {
    const url = await guarded.start({ everybody: false });
    const refused = await fetch(url);
    assert.equal(refused.status, 401);
    assert.match(await refused.text(), /hapticctl view/);
    const visitor = await browser.open(`${url}?token=${await guarded.token()}`);
    await hasFrames(visitor, 1);
    assert.equal(visitor.url(), url);
    assert.deepEqual(visitor.complaints, []);
    await visitor.context().close();
  } finally {
    await guarded.stop();
  }
});

// SPDX-License-Identifier: Apache-2.0
// The projection of the picture and what is drawn by it, to the pixel; box_test.mjs has the cloud of a real box.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { assertNear, Browser, drawnIn, hasFrames, kLimitMs, pageFolder, showOnly, until } from './browser.mjs';
import { FakeBridge, kHip, kSphere } from './fake_bridge.mjs';

// A point is drawn as a square of the size of its pixel, and a depth is rounded to a millimetre.
const kTolerancePx = 2;
const kViews = ['1', '2', '3'];
const kHipRadiusM = 0.008; // contact.proxy_radius_m of the fake bridge, whose law is `surface`

let fake;
let browser;
let page;

before(async () => {
  fake = new FakeBridge(pageFolder);
  fake.proxy = null;
  browser = await Browser.start();
  page = await browser.open(await fake.start(), { viewport: { width: 1024, height: 560 }, colorScheme: 'dark' });
  await hasFrames(page, 2);
  // a picture that stands still, however slowly it is drawn
  fake.silent = true;
  await until(page, () => {
    const before_ = window.seenFrames;
    window.seenFrames = window.hapticdView.counters.depthFrames;
    return before_ === window.seenFrames;
  });
}, { timeout: kLimitMs });

after(async () => {
  await browser?.stop();
  await fake?.stop();
});

const look = (key) => page.keyboard.press(key);

/** The page's projection against one of the test's own, from where the camera of the depth frame stands. */
test('the view from the camera projects as the camera does', async () => {
  await look('1');
  const { centre, focalPx } = await page.evaluate(() => {
    const ahead = window.hapticdView.project(0, 0, -1);
    return { centre: ahead, focalPx: window.hapticdView.project(1, 0, -1).x - ahead.x };
  });
  const canvas = await page.locator('#view').boundingBox();
  assertNear(centre.x, canvas.width / 2, 1e-6, 'x of the optical axis');
  assertNear(centre.y, canvas.height / 2, 1e-6, 'y of the optical axis');
  for (const [x, y, z] of [kHip, kSphere.centre, [0.3, -0.2, -1.5]]) {
    const place = await page.evaluate((p) => window.hapticdView.project(...p), [x, y, z]);
    assertNear(place.x, centre.x - (focalPx * x) / z, 1e-6, 'x');
    assertNear(place.y, centre.y + (focalPx * y) / z, 1e-6, 'y');
    assertNear(place.depth, -z, 1e-9, 'depth');
  }
});

test('the HIP is drawn at its place and in its true size, in three views', async () => {
  await showOnly(page, ['hand']);
  for (const key of kViews) {
    await look(key);
    const drawn = await drawnIn(page);
    const place = await page.evaluate((p) => window.hapticdView.project(...p), kHip);
    assertNear(drawn.x, place.x, kTolerancePx, `view ${key}, x`);
    assertNear(drawn.y, place.y, kTolerancePx, `view ${key}, y`);
    const focalPx = await page.evaluate((p) => {
      // how far apart two points are that are a millimetre apart across the line of sight
      const here = window.hapticdView.project(...p);
      const offsets = [[1e-3, 0, 0], [0, 1e-3, 0], [0, 0, 1e-3]].map((o) => {
        const there = window.hapticdView.project(p[0] + o[0], p[1] + o[1], p[2] + o[2]);
        return [there.x - here.x, there.y - here.y];
      });
      // the squares of the three displacements along one axis of the view sum up to that of the displacement itself
      return Math.hypot(...offsets.map(([x]) => x)) * 1e3 * here.depth;
    }, kHip);
    const radiusPx = (focalPx * kHipRadiusM) / place.depth;
    assertNear((drawn.right - drawn.left + 1) / 2, radiusPx, kTolerancePx, `view ${key}, radius`);
  }
});

test('the picture comes back after a lost context', async () => {
  await showOnly(page, ['cloud']);
  const before_ = await drawnIn(page);
  await page.evaluate(() => {
    const gl = document.querySelector('#view').getContext('webgl2');
    window.loser = gl.getExtension('WEBGL_lose_context');
    window.loser.loseContext();
  });
  await until(page, () => window.hapticdView.counters.contextsLost === 1 && !window.hapticdView.contextAlive);
  await page.evaluate(() => window.loser.restoreContext());
  await until(page, () => window.hapticdView.contextAlive);
  const after_ = await drawnIn(page);
  assert.deepEqual(after_, before_);
  assert.deepEqual(page.complaints.filter((text) => !text.includes('CONTEXT_LOST_WEBGL')), []);
});

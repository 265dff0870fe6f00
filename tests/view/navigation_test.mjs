// SPDX-License-Identifier: Apache-2.0
// Finding one's way in the picture: zoom to the pointer, centre a point, come back; what explains and labels it.
import assert from 'node:assert/strict';
import { readdir } from 'node:fs/promises';
import { test } from 'node:test';
import { assertNear, pageFolder, until } from './browser.mjs';
import { kHip, kSphere, withFakeBridge } from './fake_bridge.mjs';

const kPole = [kSphere.centre[0], kSphere.centre[1], kSphere.centre[2] + kSphere.radiusM];
/** The corners of the image of the fake camera, as directions at 1 m: fx, fy, cx and cy of its 640 by 480 pixels. */
const kCorners = [[-0.5, -0.5], [639.5, -0.5], [639.5, 479.5], [-0.5, 479.5]].map(([column, row]) => [
  (column - 339.30781) / 594.214342, -(row - 242.739138) / 591.040537, -1]);
// a point is picked to half a pixel of the depth frame, which is 1 px of the view or less
const kTolerancePx = 2;

let fake;
let page;
let canvas;

withFakeBridge(async (opened) => {
  ({ fake, page } = opened);
  canvas = await page.locator('#view').boundingBox();
}, { viewport: { width: 1280, height: 800 } });

const project = (point) => page.evaluate((p) => window.hapticdView.project(...p), point);
const isInside = ({ x, y }) => x >= 0 && y >= 0 && x <= canvas.width && y <= canvas.height;

test('the wheel zooms to the pointer: what is there stays there', async () => {
  await page.keyboard.press('1');
  // a point at the distance that the view turns about
  const centre = await page.evaluate(() => window.hapticdView.target);
  const point = [centre[0] + 0.2, centre[1] + 0.1, centre[2]];
  const before_ = await project(point);
  await page.mouse.move(canvas.x + before_.x, canvas.y + before_.y);
  await page.mouse.wheel(0, -300);
  await until(page, ([p, depth]) => window.hapticdView.project(...p).depth < 0.9 * depth, [point, before_.depth]);
  const after_ = await project(point);
  assertNear(after_.x, before_.x, 1, 'x');
  assertNear(after_.y, before_.y, 1, 'y');
});

test('a double click centres the point and picks nothing', async () => {
  await page.keyboard.press('1');
  const place = await project(kPole);
  await page.mouse.dblclick(canvas.x + place.x, canvas.y + place.y);
  await until(page, ([p, x, y]) => {
    const now = window.hapticdView.project(...p);
    return Math.hypot(now.x - x, now.y - y) < 6;
  }, [kPole, canvas.width / 2, canvas.height / 2]);
  assert.equal(await page.locator('#picks li').count(), 0);
});

test('the overview brings everything back, by key and by button', async () => {
  const lost = async () => {
    for (let i = 0; i < 12; i++) await page.mouse.wheel(0, -800);
    await page.focus('#view');
    for (let i = 0; i < 30; i++) await page.keyboard.press('Shift+ArrowLeft');
    assert.ok(!isInside(await project(kHip) ?? { x: -1 }), 'the hand is out of the picture');
  };
  const back = async () => {
    for (const point of [kHip, kPole]) assert.ok(isInside(await project(point)), 'in the picture');
  };
  for (const come of [() => page.keyboard.press('0'), () => page.keyboard.press('Home'), () => page.click('[data-view=overview]')]) {
    await lost();
    await come();
    await back();
  }
});

test("the camera's view shows all of the camera's image, and not much more", async () => {
  await page.keyboard.press('1');
  const places = await Promise.all(kCorners.map(project));
  for (const place of places) assert.ok(place.x >= -1 && place.y >= -1 && place.x <= canvas.width + 1 && place.y <= canvas.height + 1);
  // one of its sides reaches the edge of the view
  const gap = Math.min(...places.flatMap(({ x, y }) => [x, y, canvas.width - x, canvas.height - y]));
  assertNear(gap, 0, kTolerancePx, 'gap');
});

test('a missed pick says so where it was', async () => {
  await page.keyboard.press('3');
  await page.mouse.click(canvas.x + canvas.width - 90, canvas.y + canvas.height - 30);
  await until(page, () => document.querySelector('#missed').textContent === 'No measured point here' &&
    document.querySelector('#missed').checkVisibility());
  const box = await page.locator('#missed').boundingBox();
  assertNear(box.x + box.width / 2, canvas.x + canvas.width - 90, 1, 'x');
  await until(page, () => !document.querySelector('#missed').checkVisibility());
});

test('the scale bar is as long as it says, and the scale tells the range', async () => {
  await page.keyboard.press('1');
  await page.evaluate(() => window.hapticdView.readPixels(0, 0, 1, 1));
  const { text, widthPx, target } = await page.evaluate(() => ({
    text: document.querySelector('#bar-text').textContent,
    widthPx: parseFloat(document.querySelector('#bar').style.width), target: window.hapticdView.target }));
  const [, number, unit] = text.match(/^(\d+) (mm|m)$/);
  const lengthM = Number(number) / (unit === 'mm' ? 1000 : 1);
  const [a, b] = [await project(target), await project([target[0] + lengthM, target[1], target[2]])];
  assertNear(widthPx, b.x - a.x, 1, text);
  const [low, high] = await page.evaluate(() => ['low', 'high'].map((name) => Number(document.querySelector(`#scale-${name}`).textContent)));
  // the sphere begins at 0.85 m, the wall is at 1.15 m; shown to 0.1 m
  assertNear(low, 0.9, 0.11, 'nearest');
  assertNear(high, 1.15, 0.06, 'farthest');
  assert.match(await page.locator('#scale-title').textContent(), /\(m\)/);
});

test('labels do not cover one another', async () => {
  const at = (name, x) => ({ name, enabled: true, definition: { name, kind: 'sphere', position_m: [x, 0, -0.9], radius_m: 0.02 } });
  fake.sendAdditions({ fixtures: ['left lung', 'right lung', 'artery', 'nerve'].map((name, i) => at(name, 0.004 * i)), regions: [] });
  await until(page, () => document.querySelectorAll('.label.fixture').length === 4);
  await page.evaluate(() => window.hapticdView.readPixels(0, 0, 1, 1));
  const boxes = await page.evaluate(() => [...document.querySelectorAll('.label')].map((label) => {
    const { left, right, top, bottom } = label.getBoundingClientRect();
    return { text: label.textContent, left, right, top, bottom };
  }));
  for (const a of boxes) {
    for (const b of boxes) {
      const apart = a === b || a.right <= b.left + 1 || b.right <= a.left + 1 || a.bottom <= b.top + 1 || b.bottom <= a.top + 1;
      assert.ok(apart, `${a.text} and ${b.text}`);
    }
  }
});

test("the force's number stays in the picture however near the eye is", async () => {
  await page.keyboard.press('2');
  await page.focus('#view');
  for (let i = 0; i < 12; i++) await page.keyboard.press('+');
  await page.evaluate(() => window.hapticdView.readPixels(0, 0, 1, 1));
  const box = await page.locator('.label.force').boundingBox();
  assert.ok(box.x >= canvas.x && box.x + box.width <= canvas.x + canvas.width, 'across');
  assert.ok(box.y >= canvas.y && box.y + box.height <= canvas.y + canvas.height, 'upright');
});

test('the value under the pointer is shown beside the title of a chart', async () => {
  const chart = await page.locator('[data-chart=force]').boundingBox();
  await page.mouse.move(chart.x + chart.width - 20, chart.y + 20);
  await until(page, () => /^\d\.\d\d N, \d+\.\d s ago$/.test(document.querySelector('[data-chart-value=force]').textContent));
  await page.mouse.move(10, 10);
  await until(page, () => /^\d\.\d\d N$/.test(document.querySelector('[data-chart-value=force]').textContent));
});

test('one spike does not flatten a chart, and seconds without data take no place', async () => {
  const { top, plain, spanS } = await page.evaluate(async () => {
    const { Chart, robustTop } = await import('/charts.js');
    const values = Float64Array.from({ length: 150 }, (_, i) => (i === 70 ? 400 : 8 + (i % 3)));
    const chart = new Chart(document.querySelector('[data-chart=age]'), document.createElement('span'));
    for (let i = 0; i < 500; i++) chart.add(i * 0.016, 30);
    return { top: robustTop(values, 5), plain: robustTop(values.map((value) => Math.min(value, 30)), 5), spanS: chart.spanS };
  });
  assert.equal(top, 20);
  // what is not far beyond the others sets the range
  assert.equal(plain, 50);
  assertNear(spanS, 499 * 0.016, 1e-9, 'span');
});

test('all modules are asked for at once, not one after another', async () => {
  const modules = (await readdir(pageFolder)).filter((name) => name.endsWith('.js') && name !== 'main.js').sort();
  const listed = await page.evaluate(() => [...document.querySelectorAll('link[rel=modulepreload]')].map((link) => link.getAttribute('href')));
  assert.deepEqual(listed.sort(), modules);
  assert.deepEqual(page.complaints, []);
});

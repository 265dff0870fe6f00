// SPDX-License-Identifier: Apache-2.0
// Picked points are where the sphere of the test is; what is to be pasted into a shell is what hapticctl takes.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { assertNear, kLimitMs, until } from './browser.mjs';
import { kSphere, sphereDepth, withFakeBridge } from './fake_bridge.mjs';

// depths are whole millimetres, coordinates are shown to the millimetre, and a pixel at 1 m is 1.7 mm wide
const kToleranceM = 0.003;
const kOnSlopeM = 0.006;

let page;

withFakeBridge((opened) => { ({ page } = opened); });

/** Clicks where a point of the world is seen; returns what the list then says of it. */
async function pickAt(point) {
  const count = await page.locator('#picks li').count();
  const canvas = await page.locator('#view').boundingBox();
  const place = await page.evaluate((p) => window.hapticdView.project(...p), point);
  await page.mouse.click(canvas.x + place.x, canvas.y + place.y);
  await until(page, (n) => document.querySelectorAll('#picks li').length === n, count + 1);
  const text = await page.locator('#picks li').last().textContent();
  const numbers = (name) => text.match(new RegExp(`${name} \\(([^)]*)\\)`))[1].split(',').map(Number);
  const [column, row] = text.match(/pixel (\d+), (\d+)/).slice(1).map(Number);
  return { world: numbers('world'), camera: numbers('camera'), column, row };
}

test('a click on the sphere gives the point of the sphere, in the world and in the camera', async () => {
  await page.keyboard.press('1');
  const pole = [kSphere.centre[0], kSphere.centre[1], kSphere.centre[2] + kSphere.radiusM];
  const found = await pickAt(pole);
  found.world.forEach((value, i) => assertNear(value, pole[i], kToleranceM, 'xyz'[i]));
  assert.deepEqual(found.camera, found.world);
  assertNear(-found.world[2], sphereDepth(found.column, found.row), 0.001, 'depth of that pixel');
});

test('of what lies behind one another the nearer is meant', async () => {
  await page.keyboard.press('3');
  // seen from above, a place of the upper half; the camera sees the one straight below it as well
  const place = [kSphere.centre[0], kSphere.centre[1] + 0.6 * kSphere.radiusM, kSphere.centre[2] + 0.8 * kSphere.radiusM];
  const found = await pickAt(place);
  found.world.forEach((value, i) => assertNear(value, place[i], kOnSlopeM, 'xyz'[i]));
});

test('the distance between the last two picks and the command for hapticctl register are shown', async () => {
  await page.keyboard.press('1');
  await page.click('#pick-clear');
  assert.equal(await page.locator('#pick-command').isVisible(), false);
  const found = [await pickAt([-0.3, 0.2, -1.15]), await pickAt([0.3, 0.2, -1.15]), await pickAt([0.3, -0.3, -1.15])];
  const between = Math.hypot(...found[1].world.map((value, i) => value - found[2].world[i]));
  const text = await page.locator('#pick-distance').textContent();
  assertNear(Number(text.match(/: ([\d.]+) m/)[1]), between, 0.002, text);
  const lines = (await page.locator('#pick-command').textContent()).split('\n');
  assert.equal(lines[0], "cat >landmarks.csv <<'END'");
  assert.equal(lines[1], 'name,column_px,row_px');
  found.forEach(({ column, row }, i) => assert.match(lines[2 + i], new RegExp(`^p\\d+,${column},${row}$`)));
  assert.deepEqual(lines.slice(5), ['END', 'hapticctl register --landmarks landmarks.csv']);
});

test('where nothing was measured nothing is picked, and that is said', async () => {
  const count = await page.locator('#picks li').count();
  await page.keyboard.press('3');
  const canvas = await page.locator('#view').boundingBox();
  await page.mouse.click(canvas.x + canvas.width - 8, canvas.y + canvas.height - 8);
  await until(page, () => document.querySelector('#announce').textContent === 'No measured point there.');
  assert.equal(await page.locator('#picks li').count(), count);
});

test('a drag turns the view and picks nothing', async () => {
  const count = await page.locator('#picks li').count();
  const canvas = await page.locator('#view').boundingBox();
  const before_ = await page.evaluate(() => window.hapticdView.project(0, 0, -1).x);
  await page.mouse.move(canvas.x + 200, canvas.y + 200);
  await page.mouse.down();
  await page.mouse.move(canvas.x + 280, canvas.y + 220, { steps: 4 });
  await page.mouse.up();
  assert.notEqual(await page.evaluate(() => window.hapticdView.project(0, 0, -1).x), before_);
  assert.equal(await page.locator('#picks li').count(), count);
});

test('the picture is saved as a PNG', async () => {
  const download = page.waitForEvent('download', { timeout: kLimitMs });
  await page.click('#png');
  const file = await download;
  assert.match(file.suggestedFilename(), /^hapticd-view-.*\.png$/);
  const chunks = [];
  for await (const chunk of await file.createReadStream()) chunks.push(chunk);
  assert.equal(Buffer.concat(chunks).subarray(1, 4).toString(), 'PNG');
  assert.deepEqual(page.complaints, []);
});

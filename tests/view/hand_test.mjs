// SPDX-License-Identifier: Apache-2.0
// A person moves the simulated hand with mouse, keys and gamepad, and touches the surface with it.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { assertNear, Browser, hasFrames, kLimitMs, until } from './browser.mjs';
import { kHip, withFakeBridge } from './fake_bridge.mjs';
import { kBoxSphere, kSphereAlone, RealBox } from './real_box.mjs';

let fake;
let page;
let canvas;

withFakeBridge(async (opened) => {
  ({ fake, page } = opened);
  canvas = await page.locator('#view').boundingBox();
}, { first: () => {
  window.pads = [];
  navigator.getGamepads = () => window.pads;
  window.pulses = [];
  navigator.vibrate = (ms) => window.pulses.push(ms);
} });

const target = () => page.evaluate(() => window.hapticdView.handTarget);
const project = (point) => page.evaluate((p) => window.hapticdView.project(...p), point);
const isPressed = (opened = page) => opened.locator('#hand-move').getAttribute('aria-pressed');

/** Waits until the bridge has got a target for which `wanted` is true. */
async function sends(wanted) {
  for (const lastMs = Date.now() + kLimitMs; ;) {
    if (fake.targets.some(wanted)) return;
    assert.ok(Date.now() < lastMs, `the page has sent ${JSON.stringify(fake.targets.at(-1))}`);
    await new Promise((resolve) => { setTimeout(resolve, 20); });
  }
}

test('without the right there is no tool, and its key does nothing', async () => {
  await page.keyboard.press('h');
  assert.equal(await page.locator('#hand-tool').isVisible(), false);
  assert.equal(await target(), null);
  const connections = await page.evaluate(() => window.hapticdView.counters.connections);
  fake.movesHand = true;
  fake.sockets.clients.forEach((client) => client.terminate());
  await until(page, (n) => window.hapticdView.counters.connections > n, connections);
  await page.locator('#hand-tool').waitFor();
  assert.deepEqual(fake.targets, []);
});

test('it is taken where it is, and a drag moves it with the pointer in the plane of the picture', async () => {
  await page.keyboard.press('1');
  await page.click('#hand-move');
  assert.equal(await isPressed(), 'true');
  await sends(([x, y, z]) => x === kHip[0] && y === kHip[1] && z === kHip[2]);
  const before_ = await project(kHip);
  const eye = await page.evaluate(() => window.hapticdView.target);
  const [x, y] = [canvas.x + canvas.width / 2, canvas.y + canvas.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 20, y - 12);
  await page.mouse.up();
  const place = await project(await target());
  assertNear(place.x, before_.x + 20, 0.5, 'x');
  assertNear(place.y, before_.y - 12, 0.5, 'y');
  assertNear(place.depth, before_.depth, 1e-6, 'depth');
  assert.deepEqual(await page.evaluate(() => window.hapticdView.target), eye, 'the eye stays');
  await sends((sent) => Math.hypot(sent[0] - kHip[0], sent[1] - kHip[1]) > 0.005);
});

test('the wheel and keys move it in depth, and it never leads far ahead of the hand', async () => {
  const depth = async () => (await project(await target())).depth;
  const first = await depth();
  await page.mouse.wheel(0, -200);
  await until(page, ([d]) => window.hapticdView.project(...window.hapticdView.handTarget).depth > d + 0.005, [first]);
  const second = await depth();
  await page.focus('#view');
  await page.keyboard.press('-');
  assert.ok(await depth() < second - 0.003);
  const [x] = await target();
  await page.keyboard.press('ArrowRight');
  assert.ok((await target())[0] > x + 0.003);
  for (let i = 0; i < 30; i++) await page.keyboard.press('+');
  const [tx, ty, tz] = await target();
  assertNear(Math.hypot(tx - kHip[0], ty - kHip[1], tz - kHip[2]), 0.1, 1e-6, 'lead');
});

test('a gamepad moves it', async () => {
  const [x] = await target();
  await page.evaluate(() => { window.pads = [{ connected: true, axes: [-1, 0.05, 0, 0] }]; });
  await until(page, ([from]) => window.hapticdView.handTarget[0] < from - 0.02, [x]);
  await page.evaluate(() => { window.pads = []; });
});

test('the force can be heard and felt', async () => {
  await page.selectOption('#hand-feel', 'both');
  await until(page, () => window.pulses.some((ms) => ms > 5 && ms <= 100));
  await page.selectOption('#hand-feel', '');
  await until(page, () => window.pulses.at(-1) === 0);
});

test('what is refused is said, and it follows again from where it is', async () => {
  fake.handProblem = 'another page moves the hand (wait)';
  await until(page, () => document.querySelector('#hand-note').textContent === 'Another page moves the hand (wait)');
  fake.handProblem = '';
  await until(page, () => document.querySelector('#hand-note').textContent.startsWith('Drag'));
  assert.deepEqual(await target(), kHip);
  fake.handProblem = null;
});

test('it is let go by its key, by a pause and with the connection', async () => {
  await page.keyboard.press('h');
  assert.equal(await isPressed(), 'false');
  assert.equal(await target(), null);
  assert.equal(await page.locator('#hand-note').isVisible(), false);
  await page.keyboard.press('h');
  assert.notEqual(await target(), null);
  await page.click('#pause');
  assert.equal(await isPressed(), 'false');
  await page.click('#pause');
  await page.keyboard.press('h');
  fake.sockets.clients.forEach((client) => client.terminate());
  await until(page, () => window.hapticdView.handTarget === null);
  assert.deepEqual(page.complaints, []);
});

/** The forces that the box exerts, in newtons. */
async function forceIn(box) {
  const { tick } = JSON.parse((await box.control('--json', 'status')).stdout).status;
  const { x, y, z } = tick.commandForceNInWorld;
  return Math.hypot(x, y, z);
}

test('a person with a mouse touches a surface', async (t) => {
  const box = new RealBox();
  let browser;
  try {
    const begin = Date.now();
    // its script never reaches the sphere
    const url = await box.start({ hand: true, settings: [...kSphereAlone, 'simulated_handle.travel_m=0.01'] });
    browser = await Browser.start();
    const real = await browser.open(`${url}?token=${await box.token()}`);
    await hasFrames(real, 3);
    await real.keyboard.press('1');
    await real.click('#hand-move');
    const place = await real.locator('#view').boundingBox();
    await real.mouse.move(place.x + place.width / 2, place.y + place.height / 2);
    const feels = (least) => real.evaluate((n) => Number(document.querySelector('#force-number').textContent) > n, least);
    for (let notch = 0; notch < 200 && !await feels(0.3); notch++) {
      await real.mouse.wheel(0, -60);
      await real.waitForTimeout(100);
    }
    assert.ok(await feels(0.3), 'the hand feels the sphere');
    t.diagnostic(`from the start of the daemon to the first touch: ${((Date.now() - begin) / 1000).toFixed(1)} s`);
    assert.ok(await forceIn(box) > 0.1);
    // with a loaded machine the last notches are still on their way: it stays outside, about where the surface is
    const [x, y, z] = await real.evaluate(() => window.hapticdView.hip);
    const depthM = kBoxSphere.radiusM - Math.hypot(x - kBoxSphere.centre[0], y - kBoxSphere.centre[1], z - kBoxSphere.centre[2]);
    assert.ok(Math.abs(depthM) < 0.05, `${depthM} m below the surface`);

    const other = await browser.open(`${url}?token=${await box.token()}`);
    await hasFrames(other, 1);
    await other.locator('#hand-tool').waitFor();
    await until(other, () => window.hapticdView.hip !== null);
    await other.click('#hand-move');
    await until(other, () => document.querySelector('#hand-note').textContent.startsWith('Another page moves the hand'));
    await other.context().close();

    for (let notch = 0; notch < 200 && await feels(0.02); notch++) {
      await real.mouse.wheel(0, 60);
      await real.waitForTimeout(100);
    }
    assert.equal(await feels(0.02), false, 'the hand comes off again');
    assert.deepEqual(real.complaints, []);
  } finally {
    await browser?.stop();
    await box.stop();
  }
}, { timeout: 4 * kLimitMs });

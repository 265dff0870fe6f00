// SPDX-License-Identifier: Apache-2.0
// Buttons add what the form shows to the box and remove it again, by keyboard and for screen readers too.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Browser, hasFrames, kLimitMs, until } from './browser.mjs';
import { withFakeBridge } from './fake_bridge.mjs';
import { kBoxSphere, RealBox } from './real_box.mjs';

let fake;
let page;
/** Requests of the page that the fake bridge has not answered. */
const waiting = [];

withFakeBridge((opened) => { ({ fake, page } = opened); });

const field = (name) => page.locator(`#fixture-form [name=${name}]`);
const isReady = async (id) => (await page.locator(id).getAttribute('aria-disabled')) !== 'true';
const isVisible = (id) => page.locator(id).isVisible();
const focused = () => page.evaluate(() => document.activeElement.id);
const says = (text, opened = page) => until(opened, (wanted) => document.querySelector('#fixture-form [role=status]').textContent === wanted, text);

async function pickAt(point, opened = page) {
  const count = await opened.locator('#picks li').count();
  const canvas = await opened.locator('#view').boundingBox();
  const place = await opened.evaluate((p) => window.hapticdView.project(...p), point);
  await opened.mouse.click(canvas.x + place.x, canvas.y + place.y);
  await until(opened, (n) => document.querySelectorAll('#picks li').length === n, count + 1);
}

/** The page connects anew, to a bridge with or without the right. */
async function reconnect(adds) {
  const connections = await page.evaluate(() => window.hapticdView.counters.connections);
  fake.change = adds ? (request) => new Promise((answer) => { waiting.push({ request, answer }); }) : null;
  fake.sockets.clients.forEach((client) => client.terminate());
  await until(page, (n) => window.hapticdView.counters.connections > n, connections);
  const frames = await page.evaluate(() => window.hapticdView.counters.depthFrames);
  await hasFrames(page, frames + 1);
}

/** Waits for the page's next request to the bridge; its `answer(problem)` answers. */
async function nextRequest() {
  for (const lastMs = Date.now() + kLimitMs; waiting.length === 0;) {
    assert.ok(Date.now() < lastMs, 'the page has sent no request');
    await new Promise((resolve) => { setTimeout(resolve, 20); });
  }
  return waiting.shift();
}

test('without the right there is no button, whatever is picked', async () => {
  await page.keyboard.press('1');
  await pickAt([-0.3, 0.2, -1.15]);
  await page.selectOption('#pick-use', 'fixture');
  await field('name').fill('nerve');
  assert.equal(await isVisible('#pick-command'), true);
  assert.equal(await isVisible('#fixture-add'), false);
  assert.equal(await isVisible('#fixture-remove'), false);
});

test('the button adds exactly what the command would add', async () => {
  await reconnect(true);
  assert.equal(await isVisible('#fixture-add'), true);
  assert.equal(await isVisible('#fixture-remove'), false);
  const command = await page.locator('#pick-command').textContent();
  await page.focus('#fixture-add');
  await page.keyboard.press('Enter');
  const { request: { type, add }, answer } = await nextRequest();
  assert.equal(type, 'fixture');
  assert.equal(command, `hapticctl fixture add nerve --kind sphere --position-m ${add.position_m.join(',')} --radius-m 0.02`);
  assert.deepEqual(add, { name: 'nerve', kind: 'sphere', position_m: add.position_m, radius_m: 0.02 });

  await says('Asking the box.');
  assert.equal(await isReady('#fixture-add'), false);
  await page.keyboard.press('Enter');
  answer('nothing was changed: radius_m is too small (make it larger)');
  await says('Nothing was changed: radius_m is too small (make it larger)');
  assert.deepEqual(waiting, [], 'one request at a time');
  assert.equal(await focused(), 'fixture-add', 'the focus stays');
  assert.equal(await isVisible('#fixture-remove'), false);
});

test('what was added is no preview any longer; all of it can be removed again, the last one first', async () => {
  for (const name of ['nerve', 'vein']) {
    await field('name').fill(name);
    await page.focus('#fixture-add');
    await page.keyboard.press('Enter');
    (await nextRequest()).answer('');
    await says(`${name} acts now.`);
    assert.equal(await page.evaluate(() => window.hapticdView.preview), null);
  }
  for (const name of ['vein', 'nerve']) {
    assert.equal(await page.locator('#fixture-remove').textContent(), `Remove ${name}`);
    await page.focus('#fixture-remove');
    await page.keyboard.press('Enter');
    const { request, answer } = await nextRequest();
    assert.deepEqual(request, { type: 'fixture', remove: name });
    answer('');
    await says(`${name} is removed.`);
  }
  assert.equal(await isVisible('#fixture-remove'), false);
  assert.equal(await focused(), 'fixture-add', 'the focus goes on to what is left');
  assert.notEqual(await page.evaluate(() => window.hapticdView.preview), null);
});

test('an answer makes way for what is wrong with the next points', async () => {
  await field('name').fill('two words');
  await page.click('#pick-clear');
  await pickAt([-0.3, 0.2, -1.15]);
  await says('The name has 1 to 32 letters, digits, _ and -, and does not begin with -.');
  assert.equal(await isReady('#fixture-add'), false);
  await field('name').fill('nerve');
  assert.equal(await isReady('#fixture-add'), true);
});

test('a path of more points than a request holds is left to the command', async () => {
  await page.click('#pick-clear');
  // each point takes at least 20 characters of a request of at most 4096
  await page.focus('#view');
  for (let i = 0; i < 205; i++) await page.keyboard.press('Enter');
  await until(page, () => document.querySelectorAll('#picks li').length === 205);
  await field('kind').selectOption('path');
  await page.click('#fixture-add');
  await says('There are too many points to add it from here: run the command on the box.');
  assert.deepEqual(waiting, []);
  await page.click('#pick-clear');
});

test('a lost connection ends what waits, and takes the right until the bridge gives it again', async () => {
  await pickAt([-0.3, 0.2, -1.15]);
  await field('kind').selectOption('sphere');
  await page.click('#fixture-add');
  await nextRequest();
  await reconnect(false);
  await says('The connection was lost before the box answered: the list of fixtures says whether it was done.');
  assert.equal(await isVisible('#fixture-add'), false);
});

test('a fixture that is made on the page acts in the box, until it is removed again', async () => {
  const box = new RealBox();
  let browser;
  try {
    const url = await box.start({ fixtures: true });
    browser = await Browser.start();
    const real = await browser.open(`${url}?token=${await box.token()}`);
    const names = async () => JSON.parse((await box.control('--json', 'fixture', 'list')).stdout).fixtures.map(({ name }) => name);
    await hasFrames(real, 3);
    await real.keyboard.press('1');
    await pickAt([0, 0, kBoxSphere.centre[2] + kBoxSphere.radiusM], real);
    await real.selectOption('#pick-use', 'fixture');
    await real.locator('#fixture-form [name=name]').fill('nerve');
    await real.click('#fixture-add');
    await says('nerve acts now.', real);
    assert.deepEqual(await names(), ['nerve']);
    await until(real, () => document.querySelector('#fixtures li')?.textContent.includes('nerve'));
    // the bridge takes two requests in a second
    const kAnswer = /^(nerve is removed|Nothing was changed: .*try again)/;
    for (let tries = 0; tries < 20 && await real.locator('#fixture-remove').isVisible(); tries++) {
      await real.click('#fixture-remove');
      await until(real, (wanted) => new RegExp(wanted).test(document.querySelector('#fixture-form [role=status]').textContent), kAnswer.source);
    }
    await says('nerve is removed.', real);
    assert.deepEqual(await names(), []);
    assert.deepEqual(real.complaints, []);
  } finally {
    await browser?.stop();
    await box.stop();
  }
}, { timeout: 4 * kLimitMs });

// SPDX-License-Identifier: Apache-2.0
// What the page says when something is not as it should be, and that it comes back by itself.
import assert from 'node:assert/strict';
import { after, afterEach, before, beforeEach, test } from 'node:test';
import { Browser, hasFrames, kLimitMs, pageFolder, until } from './browser.mjs';
import { FakeBridge } from './fake_bridge.mjs';

let browser;
let fake;
let page;

before(async () => { browser = await Browser.start(); }, { timeout: kLimitMs });
after(() => browser?.stop());
beforeEach(async () => {
  fake = new FakeBridge(pageFolder);
  page = await browser.open(await fake.start());
  await hasFrames(page, 1);
}, { timeout: kLimitMs });
afterEach(async () => {
  await page?.context().close();
  await fake?.stop();
});

const shows = (selector, text) =>
  until(page, ([s, t]) => document.querySelector(s).textContent.includes(t), [selector, text]);

test('data that ends is shown as stale, with its age, and as live again when it goes on', async () => {
  fake.silent = true;
  // all at one moment: on a slow machine messages that were under way may come in between
  await until(page, () => /^No data for \d+\.\d s$/.test(document.querySelector('#notice-title').textContent) &&
    document.querySelector('#connection').textContent === 'Stale' && document.body.classList.contains('stale'));
  fake.silent = false;
  await until(page, () => document.querySelector('#connection').textContent === 'Live' &&
    !document.body.classList.contains('stale'));
});

test('the page comes back by itself when the bridge was away', async () => {
  const { port } = fake;
  await fake.stop();
  await shows('#connection', 'No connection');
  const frames = await page.evaluate(() => window.hapticdView.counters.depthFrames);
  fake = new FakeBridge(pageFolder);
  await fake.start(port);
  await shows('#connection', 'Live');
  await hasFrames(page, frames + 1);
  assert.equal(await page.evaluate(() => window.hapticdView.counters.connections), 2);
});

test('no longer says that forces act, or that none do, when nothing is heard from the box', async () => {
  await shows('#cause', 'Forces act on the hand.');
  const unknown = async () => {
    await shows('#mode', 'Unknown');
    await shows('#cause', 'forces may still act on the hand');
    await shows('#force-number', '–');
  };
  fake.send({ type: 'box', reachable: false, reason: 'hapticd does not run' });
  await unknown();
  fake.send({ type: 'box', reachable: true, reason: '' });
  await shows('#mode', 'Engaged');
  fake.silent = true;
  await unknown();
  fake.silent = false;
  await shows('#mode', 'Engaged');
  await fake.stop();
  await unknown();
});

test('a visitor without a token is told how to get one', async () => {
  fake.refuses = true;
  fake.sockets.clients.forEach((client) => client.terminate());
  await shows('#connection', 'Not authorised');
  await shows('#notice-text', "Run 'hapticctl view'");
});

test('depth that is missing is shown with its reason', async () => {
  fake.depthHz = 0;
  fake.send({ type: 'depth', available: false, reason: 'the user is not in the group haptic-view' });
  await shows('#notice-text', 'haptic-view');
});

test('what is wrong stands first, and a change of mode is announced with cause and remedy', async () => {
  fake.status.mode = 'faulted';
  fake.status.cause = 'force_not_finite';
  fake.status.camera = { state: 'lost', detail: 'no frame for 5 s; check the cable', identity: 'Kinect' };
  // the daemon's list alone: a sentence of the page's own would be missing in the status and in the metrics
  fake.status.warnings = ['camera lost: no frame for 5 s; check the cable', 'the disk of the traces is nearly full: delete some'];
  await shows('#mode', 'Faulted');
  await shows('#cause', 'not finite');
  await shows('#remedy', 'hapticctl clear-fault');
  await shows('#announce', 'Mode: Faulted.');
  const first = await page.evaluate(() => document.querySelector('#panel .card').firstElementChild.id);
  assert.equal(first, 'warnings');
  assert.deepEqual(await page.locator('#warnings li').allTextContents(), [
    'camera lost: no frame for 5 s; check the cable', 'the disk of the traces is nearly full: delete some']);
});

test('every mode and cause of the interface has words, and every cause that holds the force a remedy', async () => {
  const words = await page.evaluate(async () => {
    const { modeInWords, causeInWords } = await import('/words.js');
    const causes = ['no_scene', 'depth_stale', 'handle_stale', 'handle_invalid', 'force_not_finite', 'handle_too_fast',
      'handle_clutched', 'handle_not_calibrated', 'handle_replaced', 'outside_workspace', 'inside_surface',
      'overrun_burst', 'surface_too_near', 'handle_inconsistent', 'energy_debt'];
    return {
      modes: ['starting', 'idle', 'engaged', 'holding', 'faulted'].map((mode) => modeInWords(mode).text),
      causes: causes.map((cause) => causeInWords('holding', cause)),
      engaged: ['depth_stale', 'surface_too_near'].map((cause) => causeInWords('engaged', cause)),
    };
  });
  for (const text of words.modes) assert.ok(text.endsWith('.'), text);
  for (const { text, remedy } of words.causes) assert.ok(text.endsWith('.') && remedy.length > 10, text);
  for (const { text } of words.engaged) assert.ok(text.endsWith('only fixtures that work without depth are active.'), text);
});

test('paused, the picture stands still while mode and warnings go on', async () => {
  await page.click('#pause');
  await shows('#connection', 'Paused');
  const number = await page.evaluate(() => window.hapticdView.frameNumber);
  fake.status.mode = 'idle';
  await shows('#mode', 'Idle');
  await hasFrames(page, (await page.evaluate(() => window.hapticdView.counters.depthFrames)) + 3);
  assert.equal(await page.evaluate(() => window.hapticdView.frameNumber), number);
  await page.click('#pause');
  await until(page, (n) => window.hapticdView.frameNumber > n, number);
});

test('events are listed once, the newest first', async () => {
  const event = { number: 3, timeNs: Date.now() * 1e6, kind: 'mark', text: 'a mark', priority: 'info', fields: {} };
  fake.send({ type: 'event', event });
  fake.send({ type: 'event', event });
  fake.send({ type: 'event', event: { ...event, number: 4, text: 'another' } });
  await shows('#events', 'another');
  const texts = await page.locator('#events li span').allTextContents();
  assert.deepEqual(texts.slice(0, 2), ['another', 'a mark']);
  assert.equal(texts.length, 4);
});

test('a peak of a single window stays in the strip chart, however narrow its column', async () => {
  const largest = await page.evaluate(async () => {
    const { Charts } = await import('/charts.js');
    const charts = new Charts(document.querySelector('#charts'));
    for (let i = 0; i < 1800; i++) {
      charts.add({ timeNs: i * 16e6, forceMaxN: i === 700 ? 3.7 : 0.5, penetrationMaxM: null, sceneAgeMaxNs: 3e7,
        wakeupLatencyMaxNs: 1e4 });
    }
    return Math.max(...charts.charts.force.columns(60).filter((value) => !Number.isNaN(value)));
  });
  assert.equal(largest, 3.7);
});

// SPDX-License-Identifier: Apache-2.0
// axe-core finds nothing against WCAG 2 A and AA in the page, in both themes and on two screens, in what it can be seen in.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import axe from 'axe-core';
import { Browser, hasFrames, kLimitMs, pageFolder, until } from './browser.mjs';
import { FakeBridge, kHip } from './fake_bridge.mjs';

const kTags = ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22a', 'wcag22aa'];
const kViewports = [{ width: 1280, height: 800 }, { width: 390, height: 844 }];
const kAdditions = {
  fixtures: [
    { name: 'nerve', enabled: true, definition: { name: 'nerve', kind: 'sphere', side: 'out', position_m: [-0.2, 0.15, -0.9], radius_m: 0.06, warning_m: 0.02 } },
    { name: 'plate', enabled: false, definition: { name: 'plate', kind: 'plane', position_m: [0, -0.3, -0.9], normal: [0, 1, 0] } },
    { name: 'way', enabled: true, definition: { name: 'way', kind: 'path', points_m: [[0, 0.2, -0.8], [0.2, 0.2, -0.8]] } },
  ],
  regions: [{ name: 'liver', definition: { name: 'liver', shape: 'sphere', position_m: kHip, radius_m: 0.05, model: 'layered' } }],
};
const kSomeContacts = {
  fixtureContacts: 1, nearestFixture: 0, fixtureDistanceM: -0.001, tissueRegion: 0, fixtureProxy: kHip,
  fixtureForce: [0, 0, 0.5], guidanceForce: [0.25, 0, 0],
};

let browser;
before(async () => { browser = await Browser.start(); }, { timeout: kLimitMs });
after(() => browser?.stop());

/** What axe has against the page, one line each. */
async function violations(page) {
  // a source that the driver evaluates: the page's Content-Security-Policy lets no script in
  if (!await page.evaluate(() => Boolean(window.axe))) await page.evaluate(axe.source);
  const { found, passes } = await page.evaluate(async (tags) => {
    const result = await window.axe.run(document, { runOnly: { type: 'tag', values: tags } });
    return {
      passes: result.passes.map(({ id }) => id),
      found: result.violations.flatMap(({ id, nodes }) => nodes.map(({ html, failureSummary }) =>
        `${id}: ${html.slice(0, 100)}: ${failureSummary.replaceAll('\n', ' ')}`)),
    };
  }, kTags);
  for (const rule of ['button-name', 'color-contrast']) assert.ok(passes.includes(rule), `${rule} had nothing to look at`);
  return found;
}

/** One after the other, each with what the ones before have brought: what is to be seen, and how it comes about. */
const kStates = {
  'in contact': () => {},
  'with the menu of layers': (page) => page.click('summary'),
  'with warnings': async (page, fake) => {
    await page.click('summary');
    fake.status.warnings = ['the handle is not calibrated: follow its instructions', '3 frames lost'];
    await until(page, () => document.querySelectorAll('#warnings li').length === 2);
  },
  'with fixtures': async (page, fake) => {
    fake.ofFixtures = kSomeContacts;
    fake.status.frames = ['live', 'held', 'lost'].map((state) => ({ name: `frame ${state}`, state, used: true, ageS: 0.1, lagM: 0.002 }));
    fake.sendAdditions(kAdditions);
    await until(page, () => document.querySelectorAll('#fixtures li').length === 4 &&
      document.querySelector('#fixtures').textContent.includes('in contact') && document.querySelectorAll('#frames dt').length === 3);
  },
  'with picked points': async (page) => {
    await page.focus('#view');
    await page.keyboard.press('1');
    for (const count of [1, 2, 3]) {
      await page.keyboard.press('ArrowLeft');
      await page.keyboard.press('Enter');
      await until(page, (n) => document.querySelectorAll('#picks li').length === n, count);
    }
  },
  'with picked points as fixtures': (page) => page.selectOption('#pick-use', 'fixture'),
  'with an answer of the box': async (page) => {
    await page.click('#fixture-add');
    await until(page, () => document.querySelector('#fixture-form [role=status]').textContent.includes('busy'));
  },
  'after a refusal': async (page, fake) => {
    Object.assign(fake.status, { mode: 'idle', cause: 'inside_surface' });
    await until(page, () => document.querySelector('#cause').textContent.includes('refused'));
  },
  'faulted': async (page, fake) => {
    Object.assign(fake.status, { mode: 'faulted', cause: 'force_not_finite' });
    await until(page, () => document.querySelector('#mode').dataset.mode === 'faulted');
  },
  'with the list of keys': async (page) => {
    await page.click('#help');
    await until(page, () => document.querySelector('#keys').open);
  },
  'stale': async (page, fake) => {
    await page.keyboard.press('Escape');
    fake.silent = true;
    await until(page, () => document.body.classList.contains('stale'));
  },
};

for (const colorScheme of ['dark', 'light']) {
  for (const viewport of kViewports) {
    test(`axe finds nothing in the ${colorScheme} theme at ${viewport.width}x${viewport.height}`, async () => {
      const fake = new FakeBridge(pageFolder);
      fake.change = () => 'the box is busy (try again)';
      try {
        const page = await browser.open(await fake.start(), { viewport, colorScheme });
        await hasFrames(page, 1);
        await until(page, () => document.querySelector('#mode').dataset.mode === 'engaged');
        const found = [];
        for (const [state, bringAbout] of Object.entries(kStates)) {
          await bringAbout(page, fake);
          found.push(...(await violations(page)).map((text) => `${state}: ${text}`));
        }
        assert.deepEqual(found, []);
        assert.deepEqual(page.complaints, []);
        await page.context().close();
      } finally {
        await fake.stop();
      }
    });
  }
}

// SPDX-License-Identifier: Apache-2.0
// The page can be used by keyboard, on a phone, and by people who see little: rules of WCAG 2.2 AA that can be computed.
import assert from 'node:assert/strict';
import { after, afterEach, before, beforeEach, test } from 'node:test';
import { Browser, hasFrames, kLimitMs, pageFolder, until } from './browser.mjs';
import { FakeBridge } from './fake_bridge.mjs';

const kContrast = 4.5;
const kPhones = [{ width: 360, height: 740 }, { width: 390, height: 844 }];

let browser;
let fake;
let url;
let page;

before(async () => { browser = await Browser.start(); }, { timeout: kLimitMs });
after(() => browser?.stop());
beforeEach(async () => {
  fake = new FakeBridge(pageFolder);
  fake.status.warnings = ['the handle is not calibrated: follow its instructions'];
  url = await fake.start();
}, { timeout: kLimitMs });
afterEach(async () => {
  assert.deepEqual(page.complaints, []);
  await page.context().close();
  await fake.stop();
});

async function open(options) {
  page = await browser.open(url, options);
  await hasFrames(page, 1);
  await until(page, () => document.querySelectorAll('#warnings li').length === 1);
}

/** Texts whose contrast to what lies behind them is too small, as "text: contrast". */
const faintTexts = (least) => {
  const numbers = (colour) => {
    const found = colour.match(/[\d.]+/g).map(Number);
    return { rgb: found.slice(0, 3), alpha: found.length > 3 ? found[3] : 1 };
  };
  const over = (top, below) => top.rgb.map((value, i) => value * top.alpha + below[i] * (1 - top.alpha));
  const backgroundOf = (element) => {
    const layers = [];
    for (let at = element; at; at = at.parentElement) layers.push(numbers(getComputedStyle(at).backgroundColor));
    return layers.reverse().reduce((below, layer) => over(layer, below), [255, 255, 255]);
  };
  const luminance = (rgb) => {
    const [r, g, b] = rgb.map((value) => {
      const share = value / 255;
      return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
    });
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const faint = [];
  let seen = 0;
  for (const element of document.querySelectorAll('body *')) {
    const own = [...element.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && node.data.trim());
    if (!own || !element.checkVisibility() || element.closest('.hidden, noscript')) continue;
    seen++;
    const background = backgroundOf(element);
    const colour = over(numbers(getComputedStyle(element).color), background);
    const [bright, dark] = [luminance(colour), luminance(background)].sort((a, b) => b - a);
    const contrast = (bright + 0.05) / (dark + 0.05);
    if (contrast < least) faint.push(`${element.textContent.trim().slice(0, 30)}: ${contrast.toFixed(2)}`);
  }
  return { faint, seen };
};

for (const colorScheme of ['dark', 'light']) {
  test(`all text is legible in the ${colorScheme} theme, in every mode and when stale`, async () => {
    await open({ colorScheme });
    assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), colorScheme);
    await page.evaluate(() => document.querySelectorAll('details').forEach((details) => { details.open = true; }));
    for (const mode of ['starting', 'idle', 'engaged', 'holding', 'faulted']) {
      fake.status.mode = mode;
      await until(page, (wanted) => document.querySelector('#mode').dataset.mode === wanted, mode);
      const { faint, seen } = await page.evaluate(faintTexts, kContrast);
      assert.deepEqual(faint, [], mode);
      assert.ok(seen > 40, `${seen} texts`);
    }
    fake.silent = true;
    await until(page, () => document.body.classList.contains('stale'));
    assert.deepEqual((await page.evaluate(faintTexts, kContrast)).faint, [], 'stale');
  });
}

test('the theme follows the button, and the choice outlives the page', async () => {
  await open({ colorScheme: 'dark' });
  await page.click('#theme');
  assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), 'light');
  await page.reload();
  await hasFrames(page, 1);
  assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), 'light');
});

for (const viewport of kPhones) {
  test(`nothing is cut off on a phone ${viewport.width} px wide`, async () => {
    await open({ viewport, deviceScaleFactor: 3, isMobile: true, hasTouch: true });
    const wide = await page.evaluate(() => ({
      page: document.documentElement.scrollWidth,
      window: innerWidth,
      beyond: [...document.querySelectorAll('body *')].filter((element) => element.checkVisibility() &&
        !element.closest('.labels, .skip, .hidden, pre') && element.getBoundingClientRect().right > innerWidth + 0.5)
        .map((element) => element.outerHTML.slice(0, 60)),
    }));
    assert.equal(wide.window, viewport.width);
    assert.equal(wide.page, viewport.width);
    assert.deepEqual(wide.beyond, []);
    assert.ok(await page.evaluate(() => window.hapticdView.pixelRatio) <= 2);
    // what a finger has to hit: WCAG 2.5.8
    const small = await page.evaluate(() => [...document.querySelectorAll('button, select, summary, input')]
      .filter((element) => element.checkVisibility())
      .filter((element) => {
        const { width, height } = (element.closest('label') ?? element).getBoundingClientRect();
        return width < 24 || height < 24;
      }).map((element) => element.outerHTML.slice(0, 60)));
    assert.deepEqual(small, []);
  });
}

test('every control has a name', async () => {
  await open();
  const nameless = await page.evaluate(() => [...document.querySelectorAll('button, select, input, canvas, [tabindex]')]
    .filter((element) => !(element.getAttribute('aria-label') || element.getAttribute('aria-labelledby') ||
      element.getAttribute('aria-hidden') || element.closest('label') || element.textContent.trim()))
    .map((element) => element.outerHTML.slice(0, 80)));
  assert.deepEqual(nameless, []);
});

test('all of it works by keyboard, with a visible focus', async () => {
  await open();
  const expected = await page.evaluate(() => [...document.querySelectorAll(
    'a[href], button, select, input, summary, canvas[tabindex="0"], [tabindex="0"]')]
    .filter((element) => element.checkVisibility()).length);
  const visited = new Set();
  for (let i = 0; i < expected + 2; i++) {
    await page.keyboard.press('Tab');
    const focus = await page.evaluate(() => {
      const element = document.activeElement;
      const { outlineStyle, outlineWidth } = getComputedStyle(element);
      element.dataset.visited ??= String(document.querySelectorAll('[data-visited]').length);
      return { key: element.dataset.visited, body: element === document.body,
        visible: outlineStyle !== 'none' && parseFloat(outlineWidth) >= 2, html: element.outerHTML.slice(0, 80) };
    });
    if (focus.body) continue;
    assert.ok(focus.visible, `no focus ring: ${focus.html}`);
    visited.add(focus.key);
  }
  assert.equal(visited.size, expected);
});

test('turning, moving, zooming, views, colours and picking work by keyboard', async () => {
  await open();
  await page.focus('#view');
  const place = () => page.evaluate(() => JSON.stringify(window.hapticdView.project(0.05, -0.04, -0.9)));
  let last = await place();
  for (const key of ['ArrowLeft', 'ArrowUp', 'Shift+ArrowRight', '+', '-', '1', '2', '3', '0']) {
    await page.keyboard.press(key);
    const now = await place();
    assert.notEqual(now, last, key);
    last = now;
  }
  await page.keyboard.press('c');
  assert.equal(await page.locator('#colouring').inputValue(), 'height');
  await page.keyboard.press('1');
  await page.keyboard.press('Enter');
  await until(page, () => document.querySelectorAll('#picks li').length === 1);
  await page.keyboard.press('?');
  await until(page, () => document.querySelector('#keys').open);
  await page.keyboard.press('Escape');
  await until(page, () => !document.querySelector('#keys').open);
});

// SPDX-License-Identifier: Apache-2.0
// Virtual fixtures and tissue regions are drawn where they are and listed; picked points become commands that add some.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { assertNear, drawnIn, rectangleOf, showOnly, until } from './browser.mjs';
import { kHip, withFakeBridge } from './fake_bridge.mjs';

const kBall = [-0.2, 0.15, -0.9];
const kAdditions = {
  fixtures: [
    { name: 'nerve', enabled: true, definition: { name: 'nerve', kind: 'sphere', side: 'out', position_m: kBall, radius_m: 0.06 } },
    { name: 'plate', enabled: false, definition: { name: 'plate', kind: 'plane', position_m: [0, -0.3, -0.9], normal: [0, 1, 0] } },
    { name: 'way', enabled: true, definition: { name: 'way', kind: 'path', points_m: [[0, 0.2, -0.8], [0.1, 0.25, -0.8], [0.2, 0.2, -0.8]] } },
    { name: 'cage', enabled: true, definition: { name: 'cage', kind: 'box', side: 'in', position_m: kHip, size_m: [0.2, 0.2, 0.2], rotation_deg: [0, 0, 0] } },
    { name: 'rod', enabled: true, definition: { name: 'rod', kind: 'capsule', frame: 'camera', position_m: [0.3, 0, -1], end_m: [0.3, 0.2, -1], radius_m: 0.02 } },
    { name: 'funnel', enabled: true, definition: { name: 'funnel', kind: 'cone', side: 'in', position_m: [0.25, -0.2, -0.8], axis: [0, 1, 0], half_angle_deg: 30 } },
    { name: 'skin', enabled: true, definition: { name: 'skin', kind: 'standoff', clearance_m: 0.005 } },
  ],
  regions: [
    { name: 'liver', definition: { name: 'liver', shape: 'sphere', position_m: [0.05, -0.04, -0.85], radius_m: 0.05, model: 'layered' } },
  ],
};

let fake;
let page;

withFakeBridge((opened) => { ({ fake, page } = opened); });

/** Mean colour of a few pixels where a point of the world is seen. */
const colourAt = (point) => page.evaluate((p) => {
  const view = window.hapticdView;
  const canvas = document.querySelector('#view');
  const { x, y } = view.project(...p);
  const ratio = view.pixelRatio;
  const pixels = view.readPixels(Math.round(x * ratio) - 2, Math.round((canvas.clientHeight - y) * ratio) - 2, 4, 4);
  return [0, 1, 2].map((i) => pixels.filter((_, at) => at % 4 === i).reduce((sum, value) => sum + value, 0) / 16);
}, point);

const row = (name) => page.locator('#fixtures li', { hasText: name }).textContent();

test('a box without fixtures has no list of them', async () => {
  assert.equal(await page.locator('#fixtures-card').isVisible(), false);
});

test('fixtures and regions are listed, named in the picture and drawn', async () => {
  await page.keyboard.press('1');
  for (const layer of ['cloud', 'grid']) await page.evaluate((name) => document.querySelector(`[data-layer=${name}]`).click(), layer);
  const without = await colourAt(kBall);
  fake.ofFixtures = { fixtureContacts: 0, nearestFixture: 0, fixtureDistanceM: 0.0123, tissueRegion: -1 };
  fake.sendAdditions(kAdditions);
  await until(page, () => document.querySelectorAll('#fixtures li').length === 8);
  await until(page, () => document.querySelector('.label.fixture.forbidden')?.textContent);
  const labels = await page.locator('.label.fixture').allTextContents();
  for (const name of ['nerve', 'way', 'cage', 'rod', 'liver', 'skin']) assert.ok(labels.includes(name), `${name} in ${labels}`);
  await until(page, () => document.querySelector('#fixtures li').textContent.includes('12.3 mm'));
  const [red, green, blue] = (await colourAt(kBall)).map((value, i) => value - without[i]);
  // dark red over a light background takes away least of the red
  assert.ok(red > green + 10 && red > blue + 10, `changed by ${[red, green, blue]}`);
});

test('the list tells distances, what is disabled and what is in contact', async () => {
  assert.match(await row('nerve'), /sphere.*12\.3 mm/);
  assert.equal(await page.locator('#fixtures li').first().getAttribute('data-level'), '');
  fake.ofFixtures.fixtureDistanceM = 0.0099; // below proximity.warning_m
  await until(page, () => document.querySelector('#fixtures li').dataset.level === 'near');
  assert.match(await row('plate'), /disabled/);
  assert.match(await row('skin'), /stand-off–/);
  // the hand is in the middle of a cage with walls 0.1 m away
  assert.match(await row('cage'), /0\.10 m/);
  fake.ofFixtures = {
    fixtureContacts: 0b1001, nearestFixture: 0, fixtureDistanceM: -0.001, tissueRegion: 0, fixtureProxy: kBall,
    fixtureForce: [0, 0, 0.5], guidanceForce: [0.25, 0, 0],
  };
  await until(page, () => document.querySelector('#fixtures li').textContent.includes('in contact, -1.0 mm'));
  assert.match(await row('cage'), /in contact/);
  assert.match(await row('liver'), /layered.*in contact/);
  assert.doesNotMatch(await row('way'), /in contact/);
});

test('the list tells the stage before and behind the boundary', async () => {
  const { fixtureContacts, ...before } = fake.ofFixtures;
  const margins = {
    fixtures: [
      { name: 'nerve', definition: { name: 'nerve', kind: 'sphere', position_m: kBall, radius_m: 0.02, warning_m: 0.02, soft_m: 0.01, breach_m: 0.002 } },
      { name: 'honey', definition: { name: 'honey', kind: 'box', effect: 'slow', position_m: [0, 0, -1], size_m: [4, 4, 4] } },
    ],
  };
  fake.sendAdditions(margins);
  const at = async (distanceM, wanted, level) => {
    fake.ofFixtures = { ...before, fixtureContacts: distanceM < 0.01 ? 1 : 0, fixtureDistanceM: distanceM };
    await until(page, (text) => document.querySelector('#fixtures li .number').textContent === text, wanted);
    assert.equal(await page.locator('#fixtures li').first().getAttribute('data-level'), level);
  };
  await at(0.03, '30.0 mm', '');
  assert.equal(await page.locator('#fixtures li .margins').textContent(), 'warns at 20.0 mm, softer from 10.0 mm');
  assert.equal(await page.locator('#fixtures .margins').count(), 1, 'only where there are margins');
  await at(0.0195, 'warning, 19.5 mm', 'near');
  await at(0.0204, 'warning, 20.4 mm', 'near');  // within the hysteresis
  await at(0.0206, '20.6 mm', '');
  await at(0.006, 'in contact, soft, 6.0 mm', 'contact');
  await at(-0.001, 'in contact, -1.0 mm', 'contact');
  await at(-0.003, 'in contact, breach, -3.0 mm', 'contact');
  assert.match(await row('honey'), /slows the hand/);
  fake.ofFixtures = { ...before, fixtureContacts };
  fake.sendAdditions(kAdditions);
  await until(page, () => document.querySelectorAll('#fixtures li').length === 8);
});

const kLayers = ['model', 'hand', 'force', 'fixtures', 'trail', 'camera', 'axes'];
/** A wire cube around the origin: four closed lines, as GetSolid gives them. */
const kHalfM = 0.05;
const kWires = [-1, 1].flatMap((side) => [[0, 1, 2], [2, 0, 1]].map((axes) => [[1, 1], [1, -1], [-1, -1], [-1, 1], [1, 1]].flatMap(
  ([u, v]) => { const p = []; [side, u, v].forEach((value, i) => { p[axes[i]] = value * kHalfM; }); return p; })));
/** Turns x to y, y to z and z to x. */
const kTurnXyzw = [0.5, 0.5, 0.5, 0.5];
const solidAt = (name, more) => ({
  name, enabled: true, definition: { name, kind: 'solid', solid: 'abc', position_m: [0, 0, 0], ...more },
});

/** The rectangle of what is drawn of fixtures alone, in the view of the camera, against that of these points. */
async function assertDrawnAt(points, what) {
  // outlines are 2 px wide, so their edges are up to 1 px beyond a point, and the circle of names is not on the canvas
  const kTolerancePx = 2;
  const drawn = await drawnIn(page);
  const expected = await rectangleOf(page, points);
  for (const side of ['left', 'right', 'top', 'bottom']) assertNear(drawn[side], expected[side], kTolerancePx, `${what}, ${side}`);
}
const cornersAt = ([x, y, z]) => [-1, 1].flatMap((i) => [-1, 1].flatMap((j) => [-1, 1].map((k) => [x + i * kHalfM, y + j * kHalfM, z + k * kHalfM])));

test('a solid is drawn by its lines, where its definition and its moving frame put it', async () => {
  const { frames, fixtures } = fake.status;
  const before = fake.ofFixtures;
  await showOnly(page, ['fixtures']);
  await page.keyboard.press('1');
  fake.ofFixtures = { fixtureContacts: 0, nearestFixture: -1, fixtureDistanceM: null, tissueRegion: -1 };
  fake.sendAdditions({ fixtures: [solidAt('organ', { position_m: [0.1, 0.05, -0.9] })] });
  await until(page, () => document.querySelectorAll('#fixtures li').length === 1);
  const shapesDrawn = (drawn) => until(page, (wanted) => window.hapticdView.solidLines === wanted, drawn);
  await shapesDrawn(0); // without its shape
  fake.send({ type: 'solids', solids: { abc: { source: 'organ.stl', outline: kWires } } });
  await shapesDrawn(kWires.length);
  await assertDrawnAt(cornersAt([0.1, 0.05, -0.9]), 'in the world');

  // In a frame without a pose it is nowhere. rotation_deg turns y to z within the frame, the frame's pose x to y.
  fake.sendAdditions({ fixtures: [solidAt('organ', { frame: 'phantom', position_m: [0.1, 0, 0], rotation_deg: [90, 0, 0] })] });
  fake.status.frames = [{ name: 'phantom', state: 'none', used: true, ageS: null, lagM: 0, positionMInWorld: null, orientationXyzw: null }];
  await shapesDrawn(0);
  fake.status.frames[0] = {
    name: 'phantom', state: 'live', used: true, ageS: 0.012, lagM: 0, positionMInWorld: { x: -0.1, y: -0.1, z: -0.9 }, orientationXyzw: kTurnXyzw };
  fake.status.fixtures = { each: [{ name: 'organ', distanceM: 0.034 }] };
  await shapesDrawn(kWires.length);
  await assertDrawnAt(cornersAt([-0.1, 0, -0.9]), 'in its frame');
  await until(page, () => document.querySelector('#fixtures .number').textContent === '34.0 mm');
  Object.assign(fake.status, { frames, fixtures });
  fake.ofFixtures = before;
  await showOnly(page, kLayers);
  await page.evaluate(() => document.querySelector('#full-detail').click());
  fake.sendAdditions(kAdditions);
  await until(page, () => document.querySelectorAll('#fixtures li').length === 8);
});

test('moving frames are listed with their state and the age of their poses', async () => {
  const { frames } = fake.status;
  await until(page, () => document.querySelector('#frames-card').hidden);
  const frame = (name, state, ageS, more) => ({
    name, state, used: true, ageS, lagM: 0, positionMInWorld: { x: 0, y: 0, z: 0 }, orientationXyzw: [0, 0, 0, 1], ...more });
  const shows = async (name, text, level) => {
    const value = page.locator(`#frames dt:text-is("${name}") + dd`);
    await until(page, ([title, wanted]) => [...document.querySelectorAll('#frames dt')].some(
      (term) => term.textContent === title && term.nextElementSibling.textContent === wanted), [name, text]);
    assert.equal(await value.getAttribute('data-level'), level);
  };
  fake.status.frames = [
    frame('head', 'live', 0.012), frame('arm', 'held', 0.15), frame('leg', 'lost', 2.5), frame('probe', 'catching_up', 0.01, { lagM: 0.0123 }),
    frame('table', 'none', null, { used: false, positionMInWorld: null, orientationXyzw: null })];
  await shows('head', 'live, pose 12.0 ms old', '');
  await shows('arm', 'poses late, held in place, pose 150.0 ms old', 'doubtful');
  await shows('leg', 'lost, pose 2.5 s old', 'wrong');
  await shows('probe', 'catching up, pose 10.0 ms old12.3 mm behind its poses', 'doubtful');
  await shows('table', 'no pose yetnot used by an enabled fixture', '');
  fake.status.frames = [frame('head', 'lost', 1)];
  await until(page, () => document.querySelectorAll('#frames dt').length === 1);
  await shows('head', 'lost, pose 1.0 s old', 'wrong');
  fake.status.frames = frames;
  await until(page, () => document.querySelector('#frames-card').hidden);
});

test('the forces of fixtures and of guidance stand apart', async () => {
  await until(page, () => document.querySelector('#force-facts').textContent.includes('From guidance0.25 N'));
  assert.match(await page.locator('#force-facts').textContent(), /From fixtures0\.50 N/);
  assert.equal(await page.locator('.label.guidance.force').textContent(), '0.25 N guidance');
});

test('picked points become commands that add fixtures', async () => {
  await page.evaluate(() => document.querySelector('[data-layer=cloud]').click());
  const canvas = await page.locator('#view').boundingBox();
  const pickAt = async (point) => {
    const count = await page.locator('#picks li').count();
    const place = await page.evaluate((p) => window.hapticdView.project(...p), point);
    await page.mouse.click(canvas.x + place.x, canvas.y + place.y);
    await until(page, (n) => document.querySelectorAll('#picks li').length === n, count + 1);
  };
  const command = async () => page.locator('#pick-command').textContent();
  const vectorIn = (text, option) => text.match(new RegExp(`--${option} ([-\\d.,]+)`))[1].split(',').map(Number);
  const kWall = [[-0.3, 0.2, -1.15], [0.3, 0.2, -1.15], [0.3, -0.3, -1.15]];

  const field = (name) => page.locator(`#fixture-form [name=${name}]`);
  const problem = async () => page.locator('#fixture-form [role=status]').textContent();
  const preview = async () => page.evaluate(() => window.hapticdView.preview);

  await pickAt(kWall[0]);
  assert.equal(await preview(), null);
  await page.selectOption('#pick-use', 'fixture');
  await field('name').fill('vessel');
  const sphere = await command();
  assert.match(sphere, /^hapticctl fixture add vessel --kind sphere --position-m \S+ --radius-m 0\.02$/);
  vectorIn(sphere, 'position-m').forEach((value, i) => assertNear(value, kWall[0][i], 0.003, 'xyz'[i]));
  assert.deepEqual((({ name, kind, radiusM }) => [name, kind, radiusM])(await preview()), ['vessel (preview)', 'sphere', 0.02]);

  await field('radius').fill('35');
  await field('clearance').fill('0.04');
  await field('side').selectOption('in');
  assert.match(await command(), /--radius-m 0\.035 --clearance-m 0\.00004 --side in$/);
  assert.equal((await preview()).radiusM, 0.035);
  for (const [name, value, wrong] of [
    ['radius', '0.1', /radius is a number from 0\.5 to 10000 mm/], ['radius', '', /radius is a number/],
    ['clearance', '40', /leaves no room inside/], ['clearance', '51', /from 0 to 50 mm/],
    ['name', 'two words', /letters, digits/], ['name', '-x', /does not begin with -/], ['name', 'nerve', /already/],
  ]) {
    const before = await field(name).inputValue();
    await field(name).fill(value);
    assert.match(await problem(), wrong, `${name} ${value}`);
    assert.equal(await page.locator('#pick-command').isVisible(), false);
    assert.equal(await page.locator('#pick-copy').isVisible(), false);
    await field(name).fill(before);
    assert.equal(await problem(), '');
  }
  assert.equal(await field('kind').locator('option[value=capsule]').evaluate((option) => option.disabled), true);

  await pickAt(kWall[1]);
  await field('kind').selectOption('capsule');
  await field('side').selectOption('out');
  await field('clearance').fill('0');
  const capsule = await command();
  assert.match(capsule, /--kind capsule --position-m \S+ --end-m \S+ --radius-m 0\.035$/);
  vectorIn(capsule, 'end-m').forEach((value, i) => assertNear(value, kWall[1][i], 0.003, 'xyz'[i]));
  await field('kind').selectOption('path');
  assert.match(await command(), /--kind path --points-m "\S+ \S+"$/);
  assert.equal(await field('radius').isVisible(), false);

  await pickAt(kWall[2]);
  await field('kind').selectOption('plane');
  // the wall is perpendicular to the camera's axis; its free side is where the eye is
  vectorIn(await command(), 'normal').forEach((value, i) => assertNear(value, [0, 0, 1][i], 0.01, 'xyz'[i]));
  await field('kind').selectOption('standoff');
  assert.match(await command(), /^hapticctl fixture add vessel --kind standoff --clearance-m 0\.01$/);
  await field('clearance').fill('0');
  assert.match(await problem(), /above 0 to 50 mm/);

  await page.click('#pick-clear');
  assert.equal(await preview(), null);
  assert.equal(await page.locator('#fixture-form').isVisible(), false);
  assert.deepEqual(page.complaints, []);
});

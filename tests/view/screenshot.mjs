// SPDX-License-Identifier: Apache-2.0
// screenshot.mjs FILE SCENE [THEME [WIDTH HEIGHT]]: a picture of the page in one of the scenes below; where FILE is a folder
// and SCENE is `all`, of each of them in all sizes; where SCENE is `animation`, as many as the page shows of the scene
// `contact` in some seconds, each with the milliseconds in its name for which it was to be seen. tools/screenshot calls it; HAPTICD_SETTINGS holds what the box is
// told in the scene `contact`, one parameter a line.
import { writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { setTimeout } from 'node:timers/promises';
import { Browser, hasFrames, until } from './browser.mjs';
import { palettePng } from './palette_png.mjs';
import { RealBox } from './real_box.mjs';

const kSizes = [[1280, 800], [1920, 1080], [390, 844]];
/** Least force of a picture with contact; the hand presses with up to 1.5 N. */
const kForceN = 0.5;
const kRecording = (process.env.HAPTICD_SETTINGS ?? '').split('\n').filter(Boolean);

/** So long a scene may take to show what it is about, without a notice over the picture. */
const kPatienceMs = 90_000;
const kAsks = 20;
const kAnimationMs = 6000;

/** What must hold in the page, and its argument. A warning that this machine is busy is waited for to go, for a minute. */
const presses = [(least) => document.querySelector('#notice').hidden &&
  (document.querySelector('#warnings').hidden || performance.now() > 60_000) && document.querySelector('#mode').dataset.mode === 'engaged' &&
  Number(document.querySelector('#force-number').textContent) >= least, kForceN];
const isInMode = (mode) => [(wanted) => document.querySelector('#mode').dataset.mode === wanted, mode];
const touches = (name) => [(wanted) => document.querySelector('#notice').hidden && [...document.querySelectorAll('#fixtures li')]
  .some((row) => row.textContent.startsWith(wanted) && row.textContent.includes('in contact')), name];

/** Asks to engage until the handle is in contact and the box refuses to. */
async function beRefused(box) {
  for (let i = 0; i < kAsks; i++) {
    await setTimeout(1000);
    const mode = await box.tell('engage').then(() => 'engaged', ({ stderr }) => stderr);
    if (mode.includes('in contact')) return;
    await box.tell('disengage');
  }
  throw new Error(`the box engaged ${kAsks} times`);
}

/** `box`: how it is started; `prepare`: what is done to it; `ready`: when the picture can be taken; `view`. */
const kScenes = {
  contact: { box: { settings: kRecording }, ready: presses, view: 'overview', seconds: 30 },
  standoff: {
    box: { configuration: 'demo-fixtures.yaml', settings: [] }, view: 'hand', ready: touches('keep-off'),
    prepare: (box) => box.control('fixture', 'add', 'keep-off', '--kind', 'standoff', '--clearance-m', '0.02', '--max-force-n', '3'),
  },
  path: {
    box: { configuration: 'demo-fixtures.yaml', settings: [] }, view: 'hand', ready: touches('incision'),
    prepare: (box) => box.control('fixture', 'add', 'incision', '--kind', 'path', '--max-force-n', '1', '--points-m',
      '-0.04,0,-0.856 -0.015,0.02,-0.852 0.015,-0.02,-0.852 0.04,0,-0.856'),
  },
  nodule: {
    box: { configuration: 'demo-fixtures.yaml', settings: [] }, view: 'hand', ready: touches('nodule'),
    prepare: async (box) => {
      await box.control('region', 'add', 'tissue', '--shape', 'sphere', '--position-m', '0,0,-1', '--radius-m', '0.17',
        '--stiffness-n-per-m', '300');
      await box.control('region', 'add', 'nodule', '--shape', 'sphere', '--position-m', '0.015,0,-0.852', '--radius-m', '0.01',
        '--model', 'layered', '--stiffness-n-per-m', '300', '--lower-stiffness-n-per-m', '1200', '--layer-m', '0.002');
    },
  },
  refused: {
    // the hand sinks into the ball while no force acts, slowly enough to stay in contact for all pictures
    box: {
      configuration: 'demo-fixtures.yaml',
      settings: ['control.engage_at_start=false', 'simulated_handle.start_z_m=-0.849', 'simulated_handle.speed_m_per_s=0.001'],
    },
    view: 'hand', prepare: beRefused,
    ready: [(wanted) => document.querySelector('#cause').textContent.includes(wanted), 'Engaging was refused'],
  },
  idle: { box: { settings: ['control.engage_at_start=false'] }, view: 'overview', ready: isInMode('idle') },
  gone: {
    box: { settings: [] }, view: 'overview',
    ready: [() => document.querySelector('#connection').textContent === 'Box not reachable'],
    leave: (box) => box.stopDaemon(),
  },
};

/** In the page, before its own scripts: while `window.frozen` holds nothing arrives and no text changes. */
function letFreeze() {
  const every = window.setInterval;
  window.setInterval = (call, ms) => every(() => { if (!window.frozen) call(); }, ms);
  const Socket = window.WebSocket;
  window.WebSocket = class extends Socket {
    set onmessage(call) {
      super.onmessage = (event) => { if (!window.frozen) call(event); };
    }
  };
}

/** A moment for which `ready` holds with every pixel of the depth frame, in at most 256 colours. */
async function take(page, ready, file, isTall) {
  // one turn of the page from the condition to the picture: what is pressed now may be free in the next
  const holds = await page.evaluate(`new Promise((resolve) => {
    const lastMs = performance.now() + ${kPatienceMs};
    const look = () => {
      const holds = (${ready[0]})(${JSON.stringify(ready[1])});
      if (!holds && performance.now() < lastMs) return requestAnimationFrame(look);
      window.frozen = true;
      document.querySelector('#full-detail').click();
      window.hapticdView.readPixels(0, 0, 1, 1);
      resolve(holds);
    };
    look();
  })`);
  await writeFile(file, await palettePng(page, await page.screenshot({ fullPage: isTall })));
  await page.evaluate(() => {
    document.querySelector('#full-detail').click();
    window.frozen = false;
  });
  if (!holds) throw new Error(`${file}: within ${kPatienceMs / 1000} s nothing was to be seen of what the scene is about`);
}

async function picture(browser, name, file, colorScheme, sizes) {
  const scene = kScenes[name];
  const box = new RealBox();
  try {
    const url = await box.start(scene.box);
    await box.control('status');  // the bridge asks the daemon whether visitors need a token
    await scene.prepare?.(box);
    for (const [width, height] of sizes) {
      const page = await browser.open(url, { viewport: { width, height }, colorScheme, first: letFreeze });
      await hasFrames(page, 5);
      await until(page, (ms) => performance.now() > ms, 1000 * (sizes.length > 1 ? 4 : scene.seconds ?? 4));
      await scene.leave?.(box);
      await page.click(`[data-view=${scene.view}]`);
      await take(page, scene.ready, file(width, height), width < 861);
      if (page.complaints.length > 0) throw new Error(`${name}: ${page.complaints.join('\n')}`);
      await page.context().close();
      if (scene.leave) box.startDaemon();
    }
  } finally {
    await box.stop();
  }
}

/** Pictures of the scene `contact` from the first press on, as fast as the browser takes them. */
async function animation(browser, folder, colorScheme, width, height) {
  const scene = kScenes.contact;
  const box = new RealBox();
  try {
    const url = await box.start(scene.box);
    await box.control('status');
    const page = await browser.open(url, { viewport: { width, height }, colorScheme });
    await hasFrames(page, 5);
    await until(page, (ms) => performance.now() > ms, 1000 * scene.seconds);
    await page.click(`[data-view=${scene.view}]`);
    await until(page, ...presses);
    const endMs = performance.now() + kAnimationMs;
    for (let number = 100, beginMs = performance.now(); beginMs < endMs; number++) {
      const picture = await page.screenshot();
      const nextMs = performance.now();
      await writeFile(join(folder, `${number}-${Math.round(nextMs - beginMs)}.png`), picture);
      beginMs = nextMs;
    }
  } finally {
    await box.stop();
  }
}

const [file, wanted = 'contact', theme = 'dark', width = '1200', height = '750'] = process.argv.slice(2);
const browser = await Browser.start();
try {
  if (wanted === 'all') {
    for (const name of Object.keys(kScenes)) {
      await picture(browser, name, (w, h) => join(file, `${name}-${w}x${h}.png`), theme, kSizes);
      console.log(name);
    }
  } else if (wanted === 'animation') {
    await animation(browser, file, theme, Number(width), Number(height));
  } else {
    await picture(browser, wanted, () => file, theme, [[Number(width), Number(height)]]);
  }
} finally {
  await browser.stop();
}

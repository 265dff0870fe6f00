// SPDX-License-Identifier: Apache-2.0
// measure_page.mjs [SECONDS [WIDTH HEIGHT]]: what the page costs a box whose browser draws by software on the same CPUs:
// pictures and bytes a second, the time to the first picture with depth, and what hapticd loses by it. Not a test.
// HAPTICD_SETTINGS holds what the box is told besides the demonstration's configuration, one parameter a line.
import { readdir, readFile } from 'node:fs/promises';
import { cpus, loadavg } from 'node:os';
import { setTimeout } from 'node:timers/promises';
import { Browser, hasFrames, until } from './browser.mjs';
import { RealBox } from './real_box.mjs';

const [seconds = 20, width = 1280, height = 800] = process.argv.slice(2).map(Number);
const kOpenings = 5;
/** The browser's CPU is slowed down so much to see what the page does where pictures are slow. */
const kThrottle = 8;
const kTicksPerS = 100; // USER_HZ, the unit of /proc/PID/stat on all architectures of Linux

/** In the page, before its own scripts: counts what the WebSocket brings, and notes when depth was first shown. */
function observe() {
  window.observed = { bytes: 0, firstDepthMs: null };
  const Socket = window.WebSocket;
  window.WebSocket = class extends Socket {
    constructor(...words) {
      super(...words);
      this.addEventListener('message', ({ data }) => { window.observed.bytes += data.byteLength ?? data.length; });
    }
  };
  const look = () => {
    const { renders, depthFrames } = window.hapticdView?.counters ?? {};
    // the screen takes a picture when it asks for the next one
    if (depthFrames > 0 && renders > 0 && window.hapticdView.frameNumber > 0 && window.observed.seen < renders) {
      window.observed.firstDepthMs = performance.now();
      return;
    }
    if (depthFrames > 0) window.observed.seen ??= renders;
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}

/** {parent, cpuS} of a process; null where it has ended. */
async function process_(pid) {
  const text = await readFile(`/proc/${pid}/stat`, 'utf8').catch(() => null);
  if (!text) return null;
  const fields = text.slice(text.lastIndexOf(') ') + 2).split(' ');
  return { parent: Number(fields[1]), cpuS: (Number(fields[11]) + Number(fields[12])) / kTicksPerS };
}

const cpuSeconds = async (child) => (await process_(child.pid)).cpuS;

/** CPU time of the browser, as {draws, rest}: of the process that stands in for a graphics card, and of all others. */
async function browserSeconds(others) {
  const found = new Map();
  for (const name of await readdir('/proc')) {
    if (!/^\d+$/.test(name)) continue;
    const known = await process_(name);
    if (known) found.set(Number(name), known);
  }
  const isOurs = (pid) => pid === process.pid || (found.has(pid) && isOurs(found.get(pid).parent));
  const sum = { draws: 0, rest: 0 };
  for (const [pid, { cpuS }] of found) {
    if (pid === process.pid || others.includes(pid) || !isOurs(pid)) continue;
    const command = await readFile(`/proc/${pid}/cmdline`, 'utf8').catch(() => '');
    sum[command.includes('--type=gpu-process') ? 'draws' : 'rest'] += cpuS;
  }
  return sum;
}

const cpuOfAll = () => cpus().reduce((sum, { times }) => ({
  busy: sum.busy + times.user + times.nice + times.sys + times.irq, all: sum.all + Object.values(times).reduce((a, b) => a + b),
}), { busy: 0, all: 0 });

async function sample(box, page) {
  const { status } = JSON.parse((await box.control('--json', 'status')).stdout);
  return {
    s: performance.now() / 1000, daemon: await cpuSeconds(box.daemon), view: await cpuSeconds(box.view), machine: cpuOfAll(),
    browser: await browserSeconds([box.daemon.pid, box.view.pid]),
    models: status.scene.models, skipped: status.scene.skippedFrames, damaged: status.camera.damagedFrames,
    late: status.loop.counters.overruns,
    page: page && await page.evaluate(() => ({ ...window.hapticdView.counters, bytes: window.observed.bytes })),
  };
}

/** Prints what happened in so many seconds. */
async function measure(title, box, page) {
  const a = await sample(box, page);
  await setTimeout(1000 * seconds);
  const b = await sample(box, page);
  const passedS = b.s - a.s;
  const percent = (of) => `${((100 * of) / passedS).toFixed(1)} %`;
  const perS = (of, digits = 1) => (of / passedS).toFixed(digits);
  console.log(`${title}: hapticd ${percent(b.daemon - a.daemon)} of a CPU, hapticd-view ${percent(b.view - a.view)}, ` +
    `machine ${((100 * (b.machine.busy - a.machine.busy)) / (b.machine.all - a.machine.all)).toFixed(0)} % busy; ` +
    `${perS(b.models - a.models, 2)} frames/s modelled, ${b.skipped - a.skipped} skipped, ${b.damaged - a.damaged} damaged, ` +
    `${b.late - a.late} ticks late`);
  if (!page) return;
  const pictures = b.page.renders - a.page.renders;
  const perPicture = (of) => `${((1000 * of) / pictures).toFixed(1)} ms`;
  console.log(`  browser: ${percent(b.browser.draws + b.browser.rest - a.browser.draws - a.browser.rest)} of a CPU; for each picture ` +
    `${perPicture(b.browser.draws - a.browser.draws)} of the process that draws, ` +
    `${perPicture(b.browser.rest - a.browser.rest)} of the page and the others`);
  const note = await page.evaluate(() => window.hapticdView.budget.note);
  console.log(`  ${perS(pictures)} pictures/s, ${perS(b.page.depthFrames - a.page.depthFrames)} ` +
    `depth frames/s, ${((b.page.bytes - a.page.bytes) / passedS / 1e6).toFixed(2)} MB/s to the page; ` +
    `it says: ${note || 'nothing is spared'}`);
}

const settings = (process.env.HAPTICD_SETTINGS ?? '').split('\n').filter(Boolean);
const box = new RealBox();
const browser = await Browser.start();
try {
  const url = await box.start({ settings });
  await box.control('status');
  await setTimeout(3000);
  console.log(`load average ${loadavg().map((value) => value.toFixed(2)).join(' ')}; ${width}x${height}, ${seconds} s each`);
  await measure('no page', box);
  const open = async () => {
    const page = await browser.open(url, { viewport: { width, height }, first: observe });
    await until(page, () => window.observed.firstDepthMs !== null);
    return page;
  };
  const firstMs = [];
  let page;
  for (let i = 0; i < kOpenings; i++) {
    await page?.context().close();
    page = await open();
    firstMs.push(await page.evaluate(() => window.observed.firstDepthMs));
  }
  console.log(`first picture with depth after ${firstMs.map((ms) => ms.toFixed(0)).join(', ')} ms`);
  await hasFrames(page, 30);
  await measure('page open', box, page);
  const session = await page.context().newCDPSession(page);
  await session.send('Emulation.setCPUThrottlingRate', { rate: kThrottle });
  await setTimeout(1000 * seconds);
  await measure(`browser ${kThrottle} times slower`, box, page);
  await page.context().close();
  await setTimeout(3000);
  await measure('no page again', box);
} finally {
  await browser.stop();
  await box.stop();
}

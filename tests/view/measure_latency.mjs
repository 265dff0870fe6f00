// SPDX-License-Identifier: Apache-2.0
// measure_latency.mjs [FRAMES]: time from the arrival of a depth frame at hapticd to the end of drawing it, over loopback;
// median and largest of so many frames (100). Not a test: without a graphics card it measures the software that draws.
import { Browser, hasFrames } from './browser.mjs';
import { RealBox } from './real_box.mjs';

const frames = Number(process.argv[2] ?? 100);
/** CLOCK_REALTIME less CLOCK_MONOTONIC, milliseconds. */
const offsetMs = performance.timeOrigin + performance.now() - Number(process.hrtime.bigint()) / 1e6;

const box = new RealBox();
const browser = await Browser.start();
try {
  const page = await browser.open(await box.start(), { viewport: { width: 1024, height: 560 } });
  await hasFrames(page, 10);
  const latencies = await page.evaluate(async ({ count, offset }) => {
    const nextPicture = () => new Promise((resolve) => { requestAnimationFrame(resolve); });
    const found = [];
    for (let seen = window.hapticdView.frameNumber; found.length < count;) {
      await nextPicture();
      const { frameNumber, frameArrivalMs } = window.hapticdView;
      if (frameNumber === seen) continue;
      seen = frameNumber;
      // the page has drawn it in this turn: reading a pixel waits until the picture is done
      window.hapticdView.readPixels(0, 0, 1, 1);
      found.push(performance.timeOrigin + performance.now() - offset - frameArrivalMs);
    }
    return found.sort((a, b) => a - b);
  }, { count: frames, offset: offsetMs });
  const of = (share) => latencies[Math.floor(share * (latencies.length - 1))].toFixed(1);
  console.log(`${frames} frames: median ${of(0.5)} ms, 90 % within ${of(0.9)} ms, largest ${of(1)} ms`);
} finally {
  await browser.stop();
  await box.stop();
}

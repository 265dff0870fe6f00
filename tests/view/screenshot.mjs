// SPDX-License-Identifier: Apache-2.0
// screenshot.mjs FILE [THEME [WIDTH HEIGHT]]: a picture of the page while the simulated hand presses the sphere of
// config/demo.yaml; tools/screenshot calls it.
import { Browser, hasFrames, until } from './browser.mjs';
import { RealBox } from './real_box.mjs';

const [file, colorScheme = 'dark', width = '1200', height = '750'] = process.argv.slice(2);
/** The hand presses with up to 1.5 N. */
const kForceN = 0.7;

const box = new RealBox();
const browser = await Browser.start();
try {
  const page = await browser.open(await box.start({ scene: 'moving_sphere' }), {
    viewport: { width: Number(width), height: Number(height) }, colorScheme });
  await hasFrames(page, 5);
  // the strip charts fill in half a minute
  await until(page, () => performance.now() > 32_000);
  await page.keyboard.press('0');
  // without a graphics card all pixels take a while: meanwhile the picture stands still
  await until(page, (least) => {
    const presses = Number(document.querySelector('#force-number').textContent) >= least;
    if (presses) document.querySelector('#pause').click();
    return presses;
  }, kForceN);
  await page.evaluate(() => {
    const detail = document.querySelector('#full-detail');
    detail.checked = true;
    detail.dispatchEvent(new Event('change'));
  });
  await page.evaluate(() => window.hapticdView.readPixels(0, 0, 1, 1));
  await page.screenshot({ path: file, fullPage: Number(width) < 861 });
  if (page.complaints.length > 0) throw new Error(page.complaints.join('\n'));
} finally {
  await browser.stop();
  await box.stop();
}

// SPDX-License-Identifier: Apache-2.0
// The rim of the sphere that the real box sees, in the picture.
import { assertNear, drawnIn, rectangleOf, showOnly } from './browser.mjs';
import { spherePoints } from './fake_bridge.mjs';
import { kBoxSphere } from './real_box.mjs';

// A point is drawn as a square of the size of its pixel.
const kTolerancePx = 2;
// Half a step of the raw value at 1 m is 1.6 mm of depth, seen from the side at 500 px/m.
const kDepthStepPx = 1;

/** Compares the cloud with the true sphere as camera, hand and a bird see it; the picture must stand still. */
export async function assertRimInThreeViews(page) {
  await showOnly(page, ['cloud']);
  const points = spherePoints(kBoxSphere);
  for (const key of ['1', '2', '3']) {
    await page.keyboard.press(key);
    const drawn = await drawnIn(page);
    const expected = await rectangleOf(page, points);
    for (const side of ['left', 'right', 'top', 'bottom']) {
      assertNear(drawn[side], expected[side], kTolerancePx + (key === '1' ? 0 : kDepthStepPx), `view ${key}, ${side}`);
    }
  }
}

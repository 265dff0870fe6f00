// SPDX-License-Identifier: Apache-2.0
// Buttons, boxes, keys and clicks of the page, and what they do.

import { Controls } from './controls.js';
import { FixtureForm } from './fixture_form.js';
import { pick, PickList } from './picking.js';
import { kColourings } from './surface.js';

const kMissedMs = 2000;

const element = (id) => document.getElementById(id);

/** Says at a place of the picture, and to screen readers, that there is nothing to pick. */
class Missed {
  constructor() {
    this.timer = 0;
  }

  show(xPx, yPx) {
    const note = element('missed');
    const canvas = element('view');
    note.textContent = 'No measured point here';
    element('announce').textContent = 'No measured point there.';
    note.style.left = `${canvas.offsetLeft + xPx}px`;
    note.style.top = `${canvas.offsetTop + yPx}px`;
    note.hidden = false;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.hide(), kMissedMs);
  }

  hide() {
    element('missed').hidden = true;
    element('announce').textContent = '';
  }
}

async function savePng(picture) {
  const blob = await picture?.png();
  if (!blob) return;
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = `hapticd-view-${new Date().toISOString().replace(/[:.]/g, '-')}.png`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** Clicks and taps on the picture: pick a point, or bring it to the middle. */
function connectPicking({ scene, orbit, bridge, hand, redraw, onMove }) {
  const missed = new Missed();
  const picks = new PickList({
    list: element('picks'), distance: element('pick-distance'), command: element('pick-command'),
    note: element('pick-note'), copy: element('pick-copy'), clear: element('pick-clear'),
    use: element('pick-use'), useField: element('pick-use-field'),
  }, (onChange) => new FixtureForm(
    element('fixture-form'), orbit, () => scene.additions.map(({ name }) => name), (message) => bridge.send(message),
    onChange), (list, preview) => {
    scene.picks = list;
    scene.preview = preview;
    redraw();
  });
  const find = (xPx, yPx) => {
    const found = scene.frame && pick(scene.frame, orbit, scene.limitsM, xPx, yPx);
    if (found) missed.hide();
    else missed.show(xPx, yPx);
    return found;
  };
  let picked = null;
  new Controls(element('view'), orbit, {
    onMove,
    hand,
    onPick: (xPx, yPx) => {
      const found = find(xPx, yPx);
      picked = found ? picks.add(found) : null;
    },
    onFocus: (xPx, yPx, { isDoubleClick }) => {
      // the first click of the two has picked a point that nobody asked for
      if (isDoubleClick && picked) picks.remove(picked);
      const found = find(xPx, yPx);
      if (!found) return;
      orbit.focus(found.world);
      onMove();
    },
  });
  return picks;
}

/** Keys of the whole page: name to action. */
function connectKeys(actions) {
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || element('keys').open) return;
    // what has the focus takes its own keys first: Space presses a button, digits choose in a list
    if (event.target.closest('input, select, summary, textarea, button')) {
      if (event.key === ' ' || event.target.closest('select, textarea')) return;
    }
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  });
}

/**
 * `look(name)` goes to a named view; `onMove()` after the eye was moved by hand; `onPause(wanted)`. `picture` may be
 * null, where the browser cannot draw it; `bridge` is the connection, `hand` what a person moves. Returns the list of
 * picked points.
 */
export function connectCommands({ scene, orbit, picture, theme, bridge, hand, redraw, look, onMove, onPause }) {
  const picks = connectPicking({ scene, orbit, bridge, hand, redraw, onMove });

  const pause = element('pause');
  const togglePause = () => {
    const wanted = pause.getAttribute('aria-pressed') !== 'true';
    pause.setAttribute('aria-pressed', String(wanted));
    pause.textContent = wanted ? 'Resume' : 'Pause';
    onPause(wanted);
  };
  const setColouring = (name) => {
    scene.colouring = name;
    element('colouring').value = name;
    redraw();
  };

  new ResizeObserver(() => {
    const canvas = element('view');
    element('crosshair').style.left = `${canvas.offsetLeft + canvas.clientWidth / 2}px`;
    element('crosshair').style.top = `${canvas.offsetTop + canvas.clientHeight / 2}px`;
  }).observe(element('view'));
  for (const button of document.querySelectorAll('[data-view]')) {
    button.addEventListener('click', () => look(button.dataset.view));
  }
  for (const box of document.querySelectorAll('[data-layer]')) {
    box.addEventListener('change', () => {
      scene.layers[box.dataset.layer] = box.checked;
      redraw();
    });
  }
  element('full-detail').addEventListener('change', (event) => picture?.budget.setFull(event.target.checked));
  element('colouring').addEventListener('change', (event) => setColouring(event.target.value));
  pause.addEventListener('click', togglePause);
  element('png').addEventListener('click', () => savePng(picture));
  element('theme').addEventListener('click', () => theme.toggle());
  element('help').addEventListener('click', () => element('keys').showModal());

  connectKeys({
    0: () => look('overview'),
    Home: () => look('overview'),
    1: () => look('camera'),
    2: () => look('hand'),
    3: () => look('above'),
    c: () => setColouring(kColourings[(kColourings.indexOf(scene.colouring) + 1) % kColourings.length]),
    h: () => hand.toggle(),
    p: () => savePng(picture),
    ' ': togglePause,
    '?': () => element('keys').showModal(),
  });
  return picks;
}

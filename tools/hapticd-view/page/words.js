// SPDX-License-Identifier: Apache-2.0
// The words of the status interface in sentences for people, each with the remedy. Unknown words, of a newer
// hapticd, are shown as they are.

const kModes = {
  starting: { title: 'Starting', text: 'The force loop has not run yet.' },
  idle: { title: 'Idle', text: 'Running; no force is commanded.' },
  engaged: { title: 'Engaged', text: 'Forces act on the hand.' },
  holding: { title: 'Holding', text: 'Engaged, but the force is kept at zero or on its way there.' },
  unheard: { title: 'Unknown', text: 'Nothing is heard from the box: forces may still act on the hand.' },
  faulted: { title: 'Faulted', text: 'The force is off until somebody has looked.' },
};

const kCauses = {
  no_scene: ['No depth frame has been modelled yet.', 'Ends with the first frame; see the camera below.'],
  depth_stale: ['The newest depth frame is too old.', 'Ends with the next frame; check the camera and its cable.'],
  handle_stale: ['The handle has stopped measuring.', 'Check its cable or network; if it was lost, engage again.'],
  handle_invalid: ["The handle's position is impossible.", 'Ends with a valid position; calibrate the handle if not.'],
  force_not_finite: [
    'The force law computed a number that is not finite.',
    'Look at the trace of the fault, then run: hapticctl clear-fault',
  ],
  handle_too_fast: [
    'The hand seems to move faster than safety.max_handle_speed_m_per_s.',
    'Ends by itself 0.1 s after the last leap.',
  ],
  handle_clutched: ['The clutch is held.', 'Release the button of the handle.'],
  handle_not_calibrated: ['The handle is not calibrated yet.', "Follow its calibration; 'hapticctl status' says how."],
  handle_replaced: ['The handle was lost and came back.', 'When it is safe, run: hapticctl engage'],
  outside_workspace: ['The handle is outside safety.workspace_radius_m.', 'Move it back inside.'],
  inside_surface: [
    'Engaging was refused: the handle would be in contact at once.',
    'Move it out of the surface, then run: hapticctl engage (or hapticctl engage --inside)',
  ],
  overrun_burst: ['Too many ticks ended late.', 'Ends a second after the burst; if it comes again, the warnings say what helps.'],
  surface_too_near: [
    'The surface in contact is nearer than the camera can measure.',
    'Move the camera away from it, or release contact.',
  ],
  handle_inconsistent: [
    'The device claims a velocity that its positions contradict.',
    'Ends when the two agree again; check the device, its driver and its firmware.',
  ],
  energy_debt: [
    'The hand got more energy from the box than it gave: the loop is unstable.',
    'Lower the stiffness, or shorten the delay of the handle.',
  ],
};

/** Causes that leave a box engaged: what goes on, instead of what has stopped. */
const kEngagedCauses = {
  depth_stale: ['The camera is lost: only the fixtures act that go on without depth.', kCauses.depth_stale[1]],
  surface_too_near: [
    'The surface is too near for the camera: only the fixtures act that go on without depth.',
    kCauses.surface_too_near[1],
  ],
};

/** {title, text} of a mode. */
export const modeInWords = (mode) => kModes[mode] ?? { title: mode || 'Unknown', text: '' };

/** {text, remedy} of a cause; empty texts where the mode says all. */
export function causeInWords(mode, cause) {
  const words = (mode === 'engaged' ? kEngagedCauses[cause] : undefined) ?? kCauses[cause];
  if (words) return { text: words[0], remedy: words[1] };
  const known = cause === 'none' || cause === 'requested' || !cause;
  const remedy = mode === 'idle' ? 'To let forces act, run: hapticctl engage' : '';
  return { text: known ? '' : cause, remedy };
}

const kContacts = {
  free: 'free',
  contact: 'in contact',
  entrenched: 'entrenched: a moving surface passed over the hand',
  behind: 'behind what the camera sees',
};
export const contactInWords = (contact) => kContacts[contact] ?? contact ?? '';

const kLaws = {
  nearest_springs: 'Nearest springs',
  smooth_springs: 'Smooth springs',
  proxy: 'Proxy',
  surface: 'Surface',
};
export const lawInWords = (law) => kLaws[law] ?? law ?? '';

/** Whether the law acts on all points within a radius; the others hold a proxy at the surface. */
export const isLawOfPoints = (law) => law === 'nearest_springs' || law === 'smooth_springs';

/** A number with a fixed count of digits, or a dash where it is not known. */
export const fixed = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits) : '–');

/** "0, 0.123, -0.850" in metres, to the millimetre. */
export const coordinates = (point) => point.map((value) => fixed(value, 3)).join(', ');

/** A duration in the unit that reads best. */
export function duration(ns) {
  if (!Number.isFinite(ns)) return '–';
  if (ns < 1e6) return `${(ns / 1e3).toFixed(0)} µs`;
  if (ns < 1e9) return `${(ns / 1e6).toFixed(1)} ms`;
  return `${(ns / 1e9).toFixed(1)} s`;
}

export function upTime(seconds) {
  if (!Number.isFinite(seconds)) return '–';
  if (seconds < 120) return `${seconds.toFixed(0)} s`;
  return seconds < 7200 ? `${Math.floor(seconds / 60)} min` : `${(seconds / 3600).toFixed(1)} h`;
}

// SPDX-License-Identifier: Apache-2.0
// The words of the status interface in sentences for people, each with its remedy. Unknown words, from a newer
// hapticd, are shown as they are.

const kModes = {
  starting: { title: 'Starting', text: 'The force loop has not started yet.' },
  idle: { title: 'Idle', text: 'Running; no force is commanded.' },
  engaged: { title: 'Engaged', text: 'Forces act on the hand.' },
  holding: { title: 'Holding', text: 'Engaged, but the force is zero or ramping down to zero.' },
  unheard: { title: 'Unknown', text: 'No data from the box: forces may still act on the hand.' },
  faulted: { title: 'Faulted', text: 'Force off until the fault is cleared.' },
};

const kCauses = {
  no_scene: ['No depth frame has been modelled yet.', 'Clears with the first frame; see Camera below.'],
  depth_stale: ['The latest depth frame is too old.', 'Clears with the next frame; check the camera and its cable.'],
  handle_stale: ['The handle has stopped sending measurements.', 'Check its cable or network. If it was lost, engage again.'],
  handle_invalid: ['The handle reports an impossible position.', 'Clears with a valid position; if it does not, calibrate the handle.'],
  force_not_finite: [
    'The force law returned a value that is not finite.',
    'Inspect the trace of the fault, then run: hapticctl clear-fault',
  ],
  handle_too_fast: [
    'The handle appears to move faster than safety.max_handle_speed_m_per_s.',
    'Clears 0.1 s after the last jump.',
  ],
  handle_clutched: ['The clutch is pressed.', 'Release the button on the handle.'],
  handle_not_calibrated: ['The handle is not calibrated yet.', "Calibrate it; 'hapticctl status' explains how."],
  handle_replaced: ['The handle was disconnected and has come back.', 'When it is safe, run: hapticctl engage'],
  outside_workspace: ['The handle is outside safety.workspace_radius_m.', 'Move it back inside.'],
  inside_surface: [
    'Engaging was refused: the handle is in contact, so a force would act at once.',
    'Move it out of the surface, then run: hapticctl engage (to engage anyway: hapticctl engage --inside)',
  ],
  overrun_burst: ['Too many ticks ran late.', 'Clears one second after the burst; if it recurs, see the warnings.'],
  surface_too_near: [
    'The surface in contact is closer than the camera can measure.',
    'Move the camera away, or release contact.',
  ],
  handle_inconsistent: [
    'The velocity that the device reports contradicts its positions.',
    'Clears when the two agree; check the device, its driver and its firmware.',
  ],
  energy_debt: [
    'The hand received more energy from the box than it put in: the loop is unstable.',
    'Reduce the stiffness or the delay of the handle.',
  ],
  frame_lost: [
    'A fixture needs a moving frame whose poses are missing.',
    'Resume the stream of its poses (hapticctl frame list); force resumes when the frame is back.',
  ],
};

/** Causes that leave a box engaged: what goes on, instead of what has stopped. */
const kEngagedCauses = {
  depth_stale: ['Camera lost: only fixtures that work without depth are active.', kCauses.depth_stale[1]],
  surface_too_near: [
    'The surface is too close to the camera: only fixtures that work without depth are active.',
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
  entrenched: 'hand inside the surface; holding it at the last contact',
  behind: 'behind the visible surface',
};
export const contactInWords = (contact) => kContacts[contact] ?? contact ?? '';

const kLaws = {
  nearest_springs: 'Nearest springs',
  smooth_springs: 'Smooth springs',
  proxy: 'Proxy',
  surface: 'Surface',
};
export const lawInWords = (law) => kLaws[law] ?? law ?? '';

const kFrames = {
  none: 'no pose yet',
  live: 'live',
  held: 'poses late, held in place',
  lost: 'lost',
  catching_up: 'catching up',
};

/** {text, level} of the state of a moving frame; `used`: whether an enabled fixture is defined in it. */
export function frameInWords(state, used) {
  const doubtful = state === 'held' || state === 'catching_up' || (state === 'none' && used);
  return { text: kFrames[state] ?? state ?? '', level: state === 'lost' ? 'wrong' : doubtful ? 'doubtful' : '' };
}

/** Whether the law acts on all points within a radius; the others hold a proxy at the surface. */
export const isLawOfPoints = (law) => law === 'nearest_springs' || law === 'smooth_springs';

/** "1 frame", "3 frames" */
export const counted = (count, word) => `${count} ${word}${count === 1 ? '' : 's'}`;

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

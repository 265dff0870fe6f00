// SPDX-License-Identifier: Apache-2.0
// Wires the page: messages of the bridge into the picture, the panel and the charts; commands.js has buttons and keys.

import { Additions } from './additions.js';
import { Charts } from './charts.js';
import { connectCommands } from './commands.js';
import { Hand } from './hand.js';
import { Orbit } from './orbit.js';
import { Notices } from './notices.js';
import { Panel } from './panel.js';
import { Bridge } from './protocol.js';
import { arrowScale, Picture } from './scene.js';
import { Theme } from './themes.js';
import { isQuaternion, isVector, norm, rotationOfQuaternion } from './vectors.js';
import { kViews } from './views.js';
import { isLawOfPoints } from './words.js';

const kTrailNs = 4e9;
/** Share by which the range of the colours follows a frame; all at once they would flicker. */
const kFollow = 0.1;
/** Texts and charts are shown so often: nobody reads faster, and each time costs a layout. */
const kTextMs = 100;
/** After a depth frame so long the next one is expected. */
const kDepthComesMs = 150;
const kLeastGuidanceN = 0.005;

const element = (id) => document.getElementById(id);

/** All that the picture shows. Lengths in metres, vectors in the world frame. */
const scene = {
  frame: null,
  hip: null,
  held: null,
  /** To which the person at the page leads the hand; null: nobody does. */
  target: null,
  proxy: null,
  force: null,
  forceText: '',
  /** Force of the guidance fixtures, and what is written beside its arrow; '': too small for an arrow. */
  guidance: null,
  guidanceText: '',
  /** Where the forbidden regions hold the hand; null while none does. */
  fixtureProxy: null,
  /** Fixtures and tissue regions: {name, group, definition, shape, enabled, inContact}, see additions.js. */
  additions: [],
  trail: [],
  /** {centre, radiusM} of the part that is modelled for the hand; null: all of it, or not known. */
  ball: null,
  radii: { hipM: 0.04, proxyM: 0.008 },
  arrowMPerN: arrowScale(NaN),
  picks: [],
  /** What a person is about to add, like one of `additions`; null: nothing. */
  preview: null,
  layers: { cloud: true, model: true, hand: true, force: true, fixtures: true, trail: true, camera: true, axes: true, grid: true },
  colouring: 'depth',
  /** nearest, farthest, lowest, highest */
  rangeM: [0.4, 4, -1, 1],
  limitsM: [0, 1e3],
  floorM: -0.5,
  centre: [0, 0, -1],
  theme: null,
};
const counters = { depthFrames: 0, windows: 0, states: 0, events: 0 };
const known = { parameters: {}, law: '', distanceM: 1.2, hasExtent: false, touched: false, depthMs: -Infinity };
let paused = false;
/** The newest window of ticks that the texts do not show yet. */
let unshown = null;

const orbit = new Orbit();
const notices = new Notices();
const panel = new Panel();
const charts = new Charts(element('charts'));
const additions = new Additions(element('fixtures'), element('fixtures-card'));
const hand = new Hand({
  tool: element('hand-tool'), button: element('hand-move'), feel: element('hand-feel'), note: element('hand-note'),
}, orbit, (message) => bridge.send(message), () => {
  scene.target = hand.target;
  redraw();
});
let picture = null;
let bridge = null;

const redraw = () => picture?.request();

const theme = new Theme((colours) => {
  scene.theme = colours;
  redraw();
  charts.draw();
});

try {
  picture = new Picture(element('view'), element('labels'), orbit, scene);
} catch (error) {
  notices.fault = error.message;
}

// --- from the bridge

function takeRadii() {
  const { parameters } = known;
  const proxyM = parameters['contact.proxy_radius_m'] ?? 0.008;
  // a law of points looks as far as its radius; the others hold a proxy of the size of its patch
  scene.radii = { hipM: isLawOfPoints(known.law) ? parameters['force.radius_m'] ?? 0.04 : proxyM, proxyM };
  scene.limitsM = [parameters['camera.near_m'] ?? 0, parameters['camera.far_m'] ?? 1e3];
  scene.arrowMPerN = arrowScale(parameters['safety.max_force_n']);
  redraw();
}

function takeWindow(window_) {
  counters.windows++;
  notices.gotData();
  if (paused) return;
  scene.hip = isVector(window_.hip) ? window_.hip : null;
  scene.held = isQuaternion(window_.orientation) ? rotationOfQuaternion(window_.orientation) : null;
  scene.proxy = isVector(window_.proxy) && window_.contact !== 'behind' ? window_.proxy : null;
  scene.force = isVector(window_.force) ? window_.force : null;
  const forceN = scene.force ? norm(scene.force) : NaN;
  hand.takeWindow(scene.hip, forceN);
  scene.forceText = forceN >= 0.005 ? `${forceN.toFixed(2)} N` : '';
  takeFixtures(window_);
  if (window_.law && window_.law !== known.law) {
    known.law = window_.law;
    takeRadii();
  }
  const { trail } = scene;
  const last = trail.at(-1);
  if (last && (window_.timeNs < last.timeNs || window_.timeNs - last.timeNs > kTrailNs)) trail.length = 0;
  if (scene.hip) trail.push({ at: scene.hip, timeNs: window_.timeNs });
  while (trail.length > 0 && window_.timeNs - trail[0].timeNs > kTrailNs) trail.shift();
  unshown = { window_, forceN };
  charts.add(window_);
  redrawHand();
}

/** Where the CPU draws, a picture for the hand alone would take the turn of the next depth frame. */
function redrawHand() {
  const depthComes = performance.now() - known.depthMs < kDepthComesMs;
  if (!(picture?.budget.software && depthComes)) redraw();
}

/** What a window says of fixtures; a bridge of an older version says nothing. */
function takeFixtures(window_) {
  scene.guidance = isVector(window_.guidanceForce) ? window_.guidanceForce : null;
  const guidanceN = scene.guidance ? norm(scene.guidance) : 0;
  scene.guidanceText = guidanceN >= kLeastGuidanceN ? `${guidanceN.toFixed(2)} N guidance` : '';
  scene.fixtureProxy = isVector(window_.fixtureProxy) ? window_.fixtureProxy : null;
  scene.additions = additions.follow(window_, scene.frame);
}

function takeState({ status, ageMs }) {
  counters.states++;
  notices.gotData(ageMs);
  picture?.budget.hearCamera(status.scene?.frameRateHz);
  panel.show(status);
  additions.takeStatus(status);
  const centre = status.scene?.ballCentreMInWorld;
  const radiusM = status.scene?.ballRadiusM;
  const at = centre && [centre.x, centre.y, centre.z];
  scene.ball = isVector(at) && radiusM > 0 ? { centre: at, radiusM } : null;
}

/** Ranges of the colours, floor of the grid and distance of the views, from what the camera sees. */
function follow(frame) {
  const extent = frame.extent();
  if (!extent) return;
  const range = [extent.nearM, Math.max(extent.farM, extent.nearM + 0.05), extent.lowestM, extent.highestM + 0.01];
  const share = known.hasExtent ? kFollow : 1;
  scene.rangeM = scene.rangeM.map((value, i) => value + share * (range[i] - value));
  known.distanceM += share * (extent.medianM - known.distanceM);
  if (known.hasExtent) return;
  known.hasExtent = true;
  scene.floorM = Math.floor(extent.lowestM * 4) / 4;
  scene.centre = frame.toWorld([0, 0, -extent.medianM]);
  if (!known.touched) look('overview');
}

function takeDepth(frame) {
  counters.depthFrames++;
  notices.gotFrame();
  if (paused) {
    bridge.drawn();
    return;
  }
  scene.frame = frame;
  known.depthMs = performance.now();
  follow(frame);
  redraw();
  if (!picture) bridge.drawn();
}

function takeHello() {
  scene.trail = [];
  panel.clearEvents();
  additions.forget();
}

const kTakers = {
  hello: (message) => {
    takeHello(message);
    picks.form.takeHello(message);
    hand.takeHello(message);
  },
  fixture: (message) => picks.form.takeAnswer(message),
  hand: (message) => hand.takeAnswer(message),
  parameters: ({ parameters }) => {
    known.parameters = parameters;
    hand.takeParameters(parameters);
    takeRadii();
  },
  additions: (message) => additions.take(message),
  solids: (message) => additions.takeSolids(message),
  state: takeState,
  window: takeWindow,
  event: ({ event }) => {
    counters.events++;
    panel.addEvent(event);
  },
  box: (message) => { notices.box = message; },
  depth: (message) => { notices.depth = message; },
};

function showNotices() {
  notices.show();
  if (!notices.hearsBox) panel.forgetMode();
}

function showTexts() {
  if (unshown) {
    panel.showWindow(unshown.window_, unshown.forceN);
    additions.show(unshown.window_, known.parameters['proximity.warning_m']);
    charts.draw();
    unshown = null;
  }
  showNotices();
}

bridge = new Bridge({
  onMessage: (message) => kTakers[message.type]?.(message),
  onDepth: takeDepth,
  onConnection: (connection) => {
    notices.connection = connection;
    if (connection.state === 'closed') {
      picks.form.takeLoss();
      hand.takeLoss();
    }
    if (connection.state === 'open') notices.box = { reachable: true, reason: '' };
    showNotices();
  },
  onFault: (text) => {
    notices.fault = text;
    console.error(text);
  },
});
setInterval(showTexts, kTextMs);

/** A page that nobody sees takes no depth. */
function followBudget() {
  bridge.setDepthHz(document.hidden || !picture ? 0 : picture.budget.depthHz);
  element('cost').textContent = picture?.budget.note ?? '';
}

if (picture) {
  picture.onDrawing = () => bridge.drawn();
  picture.onBudget = followBudget;
}
followBudget();
document.addEventListener('visibilitychange', () => {
  followBudget();
  if (!document.hidden) bridge.retryNow();
});
window.addEventListener('online', () => bridge.retryNow());

// --- from the person

function look(name) {
  kViews[name](orbit, { frame: scene.frame, hip: scene.hip, limitsM: scene.limitsM, distanceM: known.distanceM });
  redraw();
}

const picks = connectCommands({
  scene, orbit, picture, theme, bridge, hand, redraw, look,
  onMove: () => {
    known.touched = true;
    redraw();
  },
  onPause: (wanted) => {
    paused = wanted;
    if (wanted) hand.set(false);
    notices.paused = wanted;
    notices.show();
  },
});

/** For tests and for looking into a problem from the browser's console; changes nothing. */
window.hapticdView = Object.freeze({
  get counters() {
    return {
      ...counters,
      renders: picture?.renders ?? 0,
      contextsLost: picture?.contextsLost ?? 0,
      connections: bridge.connections,
    };
  },
  get contextAlive() {
    return Boolean(picture?.ready) && !picture.gl.isContextLost();
  },
  get frameNumber() {
    return scene.frame?.number ?? 0;
  },
  /** When that frame arrived at the box: CLOCK_MONOTONIC there, in milliseconds. */
  get frameArrivalMs() {
    return (scene.frame?.arrivalNs ?? 0) / 1e6;
  },
  get hip() {
    return scene.hip && [...scene.hip];
  },
  /** Where the person leads the hand; null: nobody does. */
  get handTarget() {
    return hand.target && [...hand.target];
  },
  /** {name, kind, ...} of what the form would add; null: nothing. */
  get preview() {
    return scene.preview && { name: scene.preview.name, ...scene.preview.shape };
  },
  /** Lines of all solids that are drawn. */
  get solidLines() {
    return scene.additions.reduce((sum, { shape }) => sum + (shape?.kind === 'solid' ? shape.lines.length : 0), 0);
  },
  /** 1: each pixel of the depth frame is drawn; n: every n-th both ways. */
  get every() {
    return picture.budget.every;
  },
  /** The level of the budget and what the page says of it. */
  get budget() {
    return { level: picture.budget.level, note: picture.budget.note };
  },
  /** The point that the eye turns about. */
  get target() {
    return [...orbit.target];
  },
  get pixelRatio() {
    return picture.pixelRatio;
  },
  /** CSS pixels from the canvas' upper left corner, and the distance from the eye in metres; null behind the eye. */
  project: (x, y, z) => orbit.project([x, y, z]),
  /** Colours of a rectangle of the canvas in device pixels from its lower left corner. */
  readPixels: (x, y, width, height) => Array.from(picture.readPixels(x, y, width, height)),
});

// SPDX-License-Identifier: Apache-2.0
// Plays the bridge's side of /live with a sphere in front of a wall, and what a real box does not do on request: go
// stale, lose the box, refuse a visitor. Serves the page's folder like hapticd-view, with its Content-Security-Policy.
import { createReadStream, existsSync } from 'node:fs';
import { createServer } from 'node:http';
import { basename, extname, join } from 'node:path';
import { WebSocketServer } from 'ws';
import { after, before } from 'node:test';
import { Browser, hasFrames, kLimitMs, pageFolder } from './browser.mjs';

const kTypes = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml' };
const kWidth = 640;
const kHeight = 480;
const kIntrinsics = [594.214342, 591.040537, 339.30781, 242.739138];
const kMPerRaw = 0.001;

/** The sphere, in the camera's frame, which is the world's. */
export const kSphere = { centre: [0.05, -0.04, -1], radiusM: 0.15 };
const kWallM = 1.15;
export const kHip = [0.02, 0.03, -0.87];

/** The depth Z at which the ray of a pixel meets a sphere; 0 where it passes by. */
export function sphereDepth(column, row, sphere = kSphere) {
  const [fx, fy, cx, cy] = kIntrinsics;
  const [x, y, z] = sphere.centre;
  const ray = [(column - cx) / fx, -(row - cy) / fy];
  const a = ray[0] ** 2 + ray[1] ** 2 + 1;
  const b = ray[0] * x + ray[1] * y - z;
  const root = b * b - a * (x * x + y * y + z * z - sphere.radiusM ** 2);
  return root > 0 ? (b - Math.sqrt(root)) / a : 0;
}

/** All points of a sphere that pixels of the camera see, in the world. */
export function spherePoints(sphere = kSphere) {
  const [fx, fy, cx, cy] = kIntrinsics;
  const points = [];
  for (let row = 0; row < kHeight; row++) {
    for (let column = 0; column < kWidth; column++) {
      const z = sphereDepth(column, row, sphere);
      if (z > 0) points.push([((column - cx) * z) / fx, (-(row - cy) * z) / fy, -z]);
    }
  }
  return points;
}

/** A depth message: a linear law of whole millimetres. */
function depthMessage() {
  const message = Buffer.alloc(8 + 280 + 2 * kWidth * kHeight);
  message.writeUInt8(1, 0);
  const header = message.subarray(8);
  header.write('HDEP', 0, 'latin1');
  header.writeUInt16LE(2, 4);
  header.writeUInt16LE(280, 6);
  header.writeUInt32LE(kWidth, 8);
  header.writeUInt32LE(kHeight, 12);
  header.writeUInt32LE(2 * kWidth, 16);
  header.writeUInt8(1, 21);
  header.writeDoubleLE(kMPerRaw, 32);
  kIntrinsics.forEach((value, i) => header.writeDoubleLE(value, 48 + 8 * i));
  [0, 4, 8].forEach((i) => header.writeDoubleLE(1, 80 + 8 * i));
  for (let row = 0; row < kHeight; row++) {
    for (let column = 0; column < kWidth; column++) {
      const depth = sphereDepth(column, row) || kWallM;
      header.writeUInt16LE(Math.round(depth / kMPerRaw), 280 + 2 * (row * kWidth + column));
    }
  }
  return message;
}

const kStatus = {
  mode: 'engaged', cause: 'requested', warnings: [], version: '0.1.0', uptimeS: 61,
  loop: {
    rateHz: 1000, realtimeScheduling: true, counters: { ticks: 61000, overruns: 0 },
    wakeupLatency: { p50Ns: 3000, p99Ns: 9000, p999Ns: 15000, maxNs: 42000 },
  },
  camera: { state: 'streaming', identity: 'synthetic', damagedFrames: 0, detail: '', advice: '' },
  scene: {
    models: 100, points: 2400, lastModelNs: 2.1e6, frameRateHz: 30, pointsOverCapacity: 0, skippedFrames: 0,
    ballCentreMInWorld: { x: kHip[0], y: kHip[1], z: kHip[2] }, ballRadiusM: 0.09,
  },
  handle: { state: 'present', identity: 'simulated', exertsForce: true, rejected: 0, detail: '', advice: '' },
  law: { chosen: 'surface', reason: 'smallest error measured at this distance', filtered: false, handStiffnessNPerM: 500 },
  trace: { state: 'off' },
};

export class FakeBridge {
  /** `status` is sent as it is at each moment; a test may change it, and the flags below. */
  constructor(folder) {
    this.folder = folder;
    this.status = structuredClone(kStatus);
    this.silent = false;
    this.refuses = false;
    this.frames = 0;
    this.windows = 0;
    this.depthHz = 30;
    this.due = 0;
    this.proxy = [kHip[0], kHip[1] + 0.002, kHip[2] + 0.004];
    /** Sent to each page that connects, and with sendAdditions(); the rest of what windows say of fixtures. */
    this.additions = { fixtures: [], regions: [] };
    this.ofFixtures = {};
    /** Takes a request `fixture` and returns what is wrong with it, or a promise of that; null: the bridge takes none. */
    this.change = null;
    /** Whether it takes messages `hand`, those that came, and what it answers to each; null: nothing. */
    this.movesHand = false;
    this.targets = [];
    this.handProblem = null;
    this.message = depthMessage();
  }

  async start(port = 0) {
    this.http = createServer((request, response) => this.serve(request, response));
    this.sockets = new WebSocketServer({ noServer: true });
    this.http.on('upgrade', (request, socket, head) => {
      if (this.refuses) return socket.end('HTTP/1.1 401 Unauthorized\r\nConnection: close\r\n\r\n');
      this.sockets.handleUpgrade(request, socket, head, (client) => this.greet(client));
    });
    await new Promise((resolve) => this.http.listen(port, '127.0.0.1', resolve));
    this.port = this.http.address().port;
    this.timers = [
      setInterval(() => this.sendDepth(), 33), setInterval(() => this.sendWindow(), 16),
      setInterval(() => this.send({ type: 'state', ageMs: 0, status: this.status }), 200),
    ];
    return `http://127.0.0.1:${this.port}/`;
  }

  async stop() {
    this.timers.forEach(clearInterval);
    this.sockets.clients.forEach((client) => client.terminate());
    this.http.closeAllConnections();
    await new Promise((resolve) => this.http.close(resolve));
  }

  serve(request, response) {
    const name = request.url === '/' ? 'index.html' : basename(request.url);
    const file = join(this.folder, name);
    if (this.refuses) return response.writeHead(401).end("run 'hapticctl view'");
    if (!existsSync(file) || !(extname(name) in kTypes)) return response.writeHead(404).end();
    response.writeHead(200, {
      'Content-Type': kTypes[extname(name)],
      'Content-Security-Policy': "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'",
      'Cache-Control': 'no-store',
    });
    createReadStream(file).pipe(response);
  }

  greet(client) {
    this.drawing = false;
    const send = (message) => client.send(JSON.stringify(message));
    client.on('message', async (data) => {
      const message = JSON.parse(data);
      if (message.type === 'drawn') {
        this.drawing = false;
        return;
      }
      if (message.type === 'depth') this.depthHz = message.maxHz;
      if (message.type === 'hand') {
        this.targets.push(message.target);
        if (this.handProblem !== null) send({ type: 'hand', problem: this.handProblem });
      }
      if (message.type !== 'fixture') return;
      const problem = await this.change(message);
      if (client.readyState === client.OPEN) send({ type: 'fixture', name: message.remove ?? message.add.name, problem });
    });
    send({ type: 'hello', protocol: 1, version: '0.1.0', addsFixtures: this.change !== null, movesHand: this.movesHand });
    send({ type: 'additions', ...this.additions });
    send({ type: 'parameters', parameters: {
      'force.radius_m': 0.04, 'contact.proxy_radius_m': 0.008, 'camera.near_m': 0.4, 'camera.far_m': 4,
      'safety.max_force_n': 4, 'proximity.warning_m': 0.01,
      'handle.driver': 'simulated' } });
    ['mode changed from idle to engaged: requested', 'engaged by uid 1000'].forEach((text, i) => send({
      type: 'event', event: { number: i + 1, timeNs: Date.now() * 1e6, kind: 'mode', text, priority: 'info', fields: {} } }));
  }

  send(message) {
    if (this.silent) return;
    const data = Buffer.isBuffer(message) ? message : JSON.stringify(message);
    for (const client of this.sockets.clients) {
      // like the bridge: a slow page gets the newest only
      if (!Buffer.isBuffer(message) || client.bufferedAmount < message.length) client.send(data);
    }
  }

  sendAdditions(additions) {
    this.additions = additions;
    this.send({ type: 'additions', ...additions });
  }

  sendDepth() {
    this.due += this.depthHz / 30;
    if (this.due < 1 || this.silent || this.drawing) return;
    this.drawing = true;
    this.due -= 1;
    this.message.writeBigUInt64LE(BigInt(++this.frames), 8 + 216);
    this.send(this.message);
  }

  sendWindow() {
    const s = ++this.windows * 0.016;
    const force = 1.2 + 0.4 * Math.sin(2 * s);
    this.send({
      type: 'window', ticks: 16, lost: 0, number: 16 * this.windows, timeNs: s * 1e9, hip: kHip,
      proxy: this.proxy, force: [0.1 * force, 0.4 * force, 0.9 * force],
      forceMaxN: force, penetrationMaxM: force / 500, sceneAgeMaxNs: 3e7 + 1e7 * Math.sin(5 * s),
      wakeupLatencyMaxNs: 8000 + 3000 * Math.sin(9 * s), contact: this.proxy ? 'contact' : 'free', contactTicks: this.proxy ? 16 : 0, gain: 1, law: 'surface',
      sceneFrame: this.frames, ...this.ofFixtures,
    });
  }
}

// `node fake_bridge.mjs FOLDER PORT` serves it by hand
if (process.argv[1]?.endsWith('fake_bridge.mjs') && process.argv.length === 4) {
  console.log(await new FakeBridge(process.argv[2]).start(Number(process.argv[3])));
}

/**
 * Opens the page of a fake bridge before the tests of a file, with its first depth frame, and ends both after them.
 * `use({ fake, page })` takes them; `options` as of Browser.open().
 */
export function withFakeBridge(use, options) {
  let fake;
  let browser;
  before(async () => {
    fake = new FakeBridge(pageFolder);
    browser = await Browser.start();
    const page = await browser.open(await fake.start(), options);
    await hasFrames(page, 1);
    await use({ fake, page });
  }, { timeout: kLimitMs });
  after(async () => {
    await browser?.stop();
    await fake?.stop();
  });
}

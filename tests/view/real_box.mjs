// SPDX-License-Identifier: Apache-2.0
// hapticd with a synthetic camera and a simulated handle, and hapticd-view in front of it, for the tests of the page.
import { execFile, spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdtemp, readdir, readFile, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { createInterface } from 'node:readline';
import { setTimeout } from 'node:timers/promises';
import { promisify } from 'node:util';
import { kLimitMs } from './browser.mjs';

const bin = process.env.HAPTICD_BIN;
const source = process.env.HAPTICD_SOURCE;

/** The sphere of its camera, which stands at the world's origin; nothing behind it. */
export const kBoxSphere = { centre: [0, 0, -1], radiusM: 0.15 };

export class RealBox {
  /** `everybody`: whether visitors need no token; `scene`: what its camera sees. */
  async start({ everybody = true, scene = 'sphere' } = {}) {
    this.folder = await mkdtemp(join(tmpdir(), 'hapticd-view-test-'));
    this.everybody = everybody;
    this.scene = scene;
    this.startDaemon();
    return this.startView('--socket', join(this.folder, 'Status'), '--token-file', join(this.folder, 'token'));
  }

  /** Returns the address of the page. */
  async startView(...options) {
    this.view = spawn(join(bin, 'hapticd-view'),
      ['--listen', '127.0.0.1:0', '--page', process.env.HAPTICD_VIEW_PAGE, ...options],
      { stdio: ['ignore', 'pipe', 'inherit'] });
    const lines = createInterface({ input: this.view.stdout });
    const [line] = await once(lines, 'line', { signal: AbortSignal.timeout(kLimitMs) });
    return `http://${line.match(/127\.0\.0\.1:\d+/)[0]}/`;
  }

  /** Records at least so many depth frames with all ticks, and goes on with the trace instead of the box. */
  async showRecording(frames) {
    await this.answers();
    await this.control('trace', 'start', '--depth');
    for (let recorded = 0; recorded < frames;) {
      const { status } = JSON.parse(await this.control('--json', 'status'));
      recorded = status.trace.depthFrames;
    }
    await this.control('trace', 'stop');
    await end(this.view);
    await end(this.daemon);
    const folder = join(this.folder, 'state', 'traces');
    const [trace] = (await readdir(folder)).filter((name) => name.endsWith('.mcap'));
    return this.startView('--no-token', '--trace', join(folder, trace));
  }

  /** Waits until the daemon answers. */
  async answers() {
    for (const begin = Date.now(); ; await setTimeout(50)) {
      try {
        return await this.control('status');
      } catch (error) {
        if (Date.now() - begin > kLimitMs) throw error;
      }
    }
  }

  async control(...words) {
    const { stdout } = await promisify(execFile)(
      join(bin, 'hapticctl'), ['--socket', join(this.folder, 'Control'), ...words], { timeout: kLimitMs });
    return stdout;
  }

  startDaemon() {
    const settings = [
      `control.status_socket=${join(this.folder, 'Status')}`, `control.control_socket=${join(this.folder, 'Control')}`,
      `state.folder=${join(this.folder, 'state')}`,
      `control.depth_for_everyone=${this.everybody}`, `synthetic.scene=${this.scene}`, 'synthetic.noise=off',
      `synthetic.distance_m=${-kBoxSphere.centre[2]}`, `synthetic.sphere_radius_m=${kBoxSphere.radiusM}`,
    ];
    this.daemon = spawn(join(bin, 'hapticd'),
      ['--config', join(source, 'config/demo.yaml'), ...settings.flatMap((setting) => ['--set', setting])],
      { stdio: 'ignore', cwd: this.folder });
  }

  async token() {
    return (await readFile(join(this.folder, 'token'), 'utf8')).trim();
  }

  async stopDaemon() {
    await end(this.daemon);
  }

  async stop() {
    await end(this.view);
    await end(this.daemon);
    if (this.folder) await rm(this.folder, { recursive: true });
  }
}

async function end(child) {
  if (!child || child.exitCode !== null || child.signalCode !== null) return;
  child.kill('SIGTERM');
  await once(child, 'exit');
}

// SPDX-License-Identifier: Apache-2.0
// hapticd with a synthetic camera and a simulated handle, and hapticd-view in front of it, for the tests of the page.
import { execFile, spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdtemp, readFile, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { createInterface } from 'node:readline';
import { promisify } from 'node:util';
import { kLimitMs } from './browser.mjs';

const bin = process.env.HAPTICD_BIN;
const source = process.env.HAPTICD_SOURCE;

/** The sphere of its camera, which stands at the world's origin; nothing behind it. */
export const kBoxSphere = { centre: [0, 0, -1], radiusM: 0.15 };

export const kSphereAlone = [
  'synthetic.scene=sphere', 'synthetic.noise=off', `synthetic.distance_m=${-kBoxSphere.centre[2]}`,
  `synthetic.sphere_radius_m=${kBoxSphere.radiusM}`];

export class RealBox {
  /**
   * Returns the address of the page. `everybody`: whether visitors need no token; `configuration`: its file in config/;
   * `settings`: parameters that differ from it, as "name=value"; `fixtures`: whether pages may add some; `hand`: whether they
   * may move the hand.
   */
  async start({ everybody = true, configuration = 'demo.yaml', settings = kSphereAlone, fixtures = false, hand = false } = {}) {
    this.folder = await mkdtemp(join(tmpdir(), 'hapticd-view-test-'));
    this.configuration = configuration;
    this.settings = [`control.depth_for_everyone=${everybody}`, ...settings];
    this.startDaemon();
    const rights = [...fixtures ? ['--add-fixtures'] : [], ...hand ? ['--move-hand'] : []];
    if (rights.length > 0) {
      rights.push('--control-socket', join(this.folder, 'Control'));
      await this.control('status');
    }
    this.view = spawn(join(bin, 'hapticd-view'),
      ['--listen', '127.0.0.1:0', '--page', process.env.HAPTICD_VIEW_PAGE,
        '--socket', join(this.folder, 'Status'), '--token-file', join(this.folder, 'token'), ...rights],
      { stdio: ['ignore', 'pipe', 'inherit'] });
    const lines = createInterface({ input: this.view.stdout });
    const [line] = await once(lines, 'line', { signal: AbortSignal.timeout(kLimitMs) });
    return `http://${line.match(/127\.0\.0\.1:\d+/)[0]}/`;
  }

  startDaemon() {
    const settings = [
      `control.status_socket=${join(this.folder, 'Status')}`, `control.control_socket=${join(this.folder, 'Control')}`,
      `state.folder=${join(this.folder, 'state')}`,
      ...this.settings,
    ];
    this.daemon = spawn(join(bin, 'hapticd'),
      ['--config', join(source, 'config', this.configuration), ...settings.flatMap((setting) => ['--set', setting])],
      { stdio: 'ignore', cwd: this.folder });
  }

  /** Runs hapticctl, as soon as the daemon takes calls. */
  async control(...words) {
    for (const lastMs = Date.now() + kLimitMs; ;) {
      try {
        return await this.tell(...words);
      } catch (error) {
        if (Date.now() > lastMs) throw error;
        await new Promise((resolve) => { setTimeout(resolve, 200); });
      }
    }
  }

  /** Runs hapticctl once; what it refuses is an error with its `stderr`. */
  tell(...words) {
    return promisify(execFile)(join(bin, 'hapticctl'), ['--socket', join(this.folder, 'Control'), ...words]);
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

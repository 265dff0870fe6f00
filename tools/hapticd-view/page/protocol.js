// SPDX-License-Identifier: Apache-2.0
// The connection to the bridge: WebSocket /live, protocol version 1. It comes back by itself.

import { DepthFrame } from './depth_frame.js';

const kFirstPauseMs = 500;
const kLongestPauseMs = 5000;
const kDepthKind = 1;
const kDepthOffset = 8; // kind and seven bytes of padding

export class Bridge {
  /**
   * `handlers`: onMessage(object), onDepth(DepthFrame), onConnection({state, reason}) with the states `connecting`,
   * `open`, `closed` and `unauthorised`, onFault(text) for messages that cannot be used.
   */
  constructor(handlers) {
    this.handlers = handlers;
    this.pauseMs = kFirstPauseMs;
    this.connections = 0;
    this.socket = null;
    this.timer = 0;
    /** Depth frames a second; a new connection begins with what the bridge sends without being asked. */
    this.depthHz = null;
    this.connect();
  }

  /** Sends a request; lost where there is no connection, since a new connection starts anew. */
  send(message) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  /** Reports that the newest depth frame is being drawn: only then the bridge sends the next one, so none grows old. */
  drawn() {
    this.send({ type: 'drawn' });
  }

  /** Asks for so many depth frames a second; 0: none. */
  setDepthHz(hz) {
    this.depthHz = hz;
    this.send({ type: 'depth', maxHz: hz });
  }

  /** Tries now, not only after the pause. */
  retryNow() {
    if (this.socket) return;
    this.pauseMs = kFirstPauseMs;
    clearTimeout(this.timer);
    this.connect();
  }

  connect() {
    const scheme = location.protocol === 'https:' ? 'wss:' : 'ws:';
    const socket = new WebSocket(`${scheme}//${location.host}/live`);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    this.handlers.onConnection({ state: 'connecting', reason: '' });
    socket.onopen = () => {
      this.connections++;
      if (this.depthHz !== null) this.setDepthHz(this.depthHz);
      this.handlers.onConnection({ state: 'open', reason: '' });
    };
    socket.onmessage = (event) => this.take(event.data);
    socket.onclose = (event) => this.lost(event.reason);
  }

  take(data) {
    // a bridge that accepts and closes at once must not be asked twice a second for ever
    this.pauseMs = kFirstPauseMs;
    try {
      if (typeof data === 'string') {
        this.handlers.onMessage(JSON.parse(data));
      } else if (new Uint8Array(data, 0, 1)[0] === kDepthKind) {
        this.handlers.onDepth(new DepthFrame(data, kDepthOffset));
      }
    } catch (error) {
      if (typeof data !== 'string') this.drawn();
      this.handlers.onFault(error.message);
    }
  }

  async lost(reason) {
    this.socket = null;
    this.timer = setTimeout(() => this.connect(), this.pauseMs);
    this.pauseMs = Math.min(2 * this.pauseMs, kLongestPauseMs);
    this.handlers.onConnection({ state: 'closed', reason });
    // A browser does not say why a WebSocket was refused; the answer to a plain request does.
    try {
      const answer = await fetch('/', { method: 'GET', cache: 'no-store', redirect: 'manual' });
      if (answer.status === 401 || answer.status === 403) {
        this.handlers.onConnection({ state: 'unauthorised', reason: '' });
      }
    } catch {
      // nothing answers: already shown as closed
    }
  }
}

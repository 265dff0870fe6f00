// SPDX-License-Identifier: Apache-2.0
// Compares what look.mjs has seen with the trace of the same time: `compare.mjs FILE TRACE`. Every tick in FILE must be
// in the trace with the same bytes, and the trace must hold the channels of the 3D picture, which decode by their schemas.
// Exit status: 0 all is well, 1 something is not, and what.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";

const [file, trace] = process.argv.slice(2);

/** Bytes of the time of a message behind the head of CDR: of the clock's offset, which drifts from start to start. */
const STAMP_BEGIN = 4;
const STAMP_END = 12;
/** Ticks have their number behind the time. */
const numberOf = (bytes) => Buffer.from(bytes).readBigUInt64LE(STAMP_END);
const stampOf = (bytes) => Buffer.from(bytes).readInt32LE(STAMP_BEGIN) + Buffer.from(bytes).readUInt32LE(STAMP_BEGIN + 4) * 1e-9;
const withoutStamp = (bytes) => Buffer.concat([bytes.subarray(0, STAMP_BEGIN), bytes.subarray(STAMP_END)]);

try {
  const reader = new McapStreamReader({ decompressHandlers: await loadDecompressHandlers(), validateCrcs: true });
  reader.append(await readFile(trace));
  const schemas = new Map();
  const channels = new Map();
  const ticks = new Map();
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Schema") schemas.set(record.id, new TextDecoder().decode(record.data));
    if (record.type === "Channel" && !channels.has(record.id)) {  // the summary repeats them
      const decoder = new MessageReader(parse(schemas.get(record.schemaId), { ros2: true }));
      channels.set(record.id, { topic: record.topic, decoder, messages: [] });
    }
    if (record.type !== "Message") continue;
    const channel = channels.get(record.channelId);
    if (channel.topic === "/hapticd/tick") ticks.set(numberOf(record.data), Buffer.from(record.data));
    channel.messages.push(channel.decoder.readMessage(record.data));
  }
  const live = JSON.parse(await readFile(file, "utf8")).map((text) => Buffer.from(text, "base64"));
  assert.ok(live.length > 0);
  for (const tick of live) {
    const recorded = ticks.get(numberOf(tick));
    assert.ok(recorded !== undefined, `tick ${numberOf(tick)} is not in the trace`);
    assert.deepEqual(withoutStamp(tick), withoutStamp(recorded), `tick ${numberOf(tick)}`);
    assert.ok(Math.abs(stampOf(tick) - stampOf(recorded)) < 0.1, "the clocks' offsets differ");
  }
  const messagesOf = (topic) => [...channels.values()].find((channel) => channel.topic === topic)?.messages ?? [];
  const scenes = messagesOf("/hapticd/scene");
  assert.ok(scenes.length > 10);
  assert.ok(scenes.some(({ markers }) => markers.some(({ ns, action, points }) => ns === "force" && action === 0 && points.length === 2)));
  assert.equal(messagesOf("/hapticd/transforms")[0].transforms[0].child_frame_id, "camera");
  assert.ok(messagesOf("/hapticd/cloud_reach").some(({ data }) => data.byteLength >= 1200));
} catch (error) {
  console.error(error.stack);
  process.exitCode = 1;
}

// SPDX-License-Identifier: Apache-2.0
// Reads a trace by the reader of the MCAP project, with all checksums that it knows: `read_trace.mjs FILE`.
// Prints one JSON object a line: {"reader", "topic", "logTime", "message"} for each message, by the indexed reader
// and by the stream reader; {"channel", "constants", "schema", "metadata"} for the constants and name of each
// schema and what the channel says of itself; {"profile"} of a file that has one; {"metadata"}, {"attachment"}. Numbers are strings, for JSON has neither 64-bit integers nor NaN, infinity and -0.
// Exit status: 0 all is well, 1 the file is not.

import { open, readFile } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";

const text = new TextDecoder();

function plain(value) {
  if (typeof value === "number") return Object.is(value, -0) ? "-0" : String(value);
  if (typeof value === "bigint") return String(value);
  if (ArrayBuffer.isView(value)) return Array.from(value, plain);
  if (Array.isArray(value)) return value.map(plain);
  if (value instanceof Map) return Object.fromEntries(value);
  if (value !== null && typeof value === "object") {
    return Object.fromEntries(Object.entries(value).map(([name, member]) => [name, plain(member)]));
  }
  return value;
}

const print = (object) => console.log(JSON.stringify(object));

/** CRC-32 of zlib. */
function crc32(bytes) {
  let crc = ~0;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; ++bit) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc >>> 0;
}

/** The raw values of a depth frame, as the comments of its schema say. */
function rawValues(depth, constants, decompressHandlers) {
  const pixels = depth.width_px * depth.height_px;
  if (depth.encoding === constants.ENCODING_PLAIN) {
    return Array.from({ length: pixels }, (_, i) => depth.image[2 * i] | (depth.image[2 * i + 1] << 8));
  }
  const bytes = decompressHandlers.zstd(depth.image, BigInt(3 * pixels));
  const above = new Array(depth.width_px).fill(0);
  const values = [];
  let next = 0;
  for (let i = 0; i < pixels; ++i) {
    const byte = bytes[next++];
    if (byte === 254) {
      values.push(depth.raw_no_measurement);
      continue;
    }
    const column = i % depth.width_px;
    if (byte === 255) {
      above[column] = bytes[next++] | (bytes[next++] << 8);
    } else {
      above[column] += byte % 2 === 0 ? byte / 2 : -(byte + 1) / 2;
    }
    values.push(above[column]);
  }
  if (next !== bytes.length) throw new Error(`a depth frame of ${bytes.length} bytes, of which ${next} are used`);
  return values;
}

/** Decodes the messages of a file's channels by the schemas in the file. */
class Decoder {
  #decompressHandlers;
  #schemas = new Map();
  #names = new Map();
  #channels = new Map();

  constructor(decompressHandlers) {
    this.#decompressHandlers = decompressHandlers;
  }

  addSchema(schema) {
    if (schema.encoding !== "ros2msg") throw new Error(`schema encoding ${schema.encoding}`);
    this.#names.set(schema.id, schema.name);
    this.#schemas.set(schema.id, parse(text.decode(schema.data), { ros2: true }));
  }

  addChannel(channel) {
    if (channel.messageEncoding !== "cdr") throw new Error(`message encoding ${channel.messageEncoding}`);
    const definitions = this.#schemas.get(channel.schemaId);
    this.#channels.set(channel.id, { channel, topic: channel.topic, reader: new MessageReader(definitions), definitions });
  }

  print(reader, message) {
    const channel = this.#channels.get(message.channelId);
    const decoded = channel.reader.readMessage(message.data);
    if (channel.topic === "/hapticd/depth") this.#decodeImage(decoded, channel.definitions);
    print({ reader, topic: channel.topic, logTime: String(message.logTime), message: plain(decoded) });
  }

  /** For frames without padding. */
  #decodeImage(depth, definitions) {
    const fields = definitions[0].definitions;
    const constants = Object.fromEntries(fields.filter((field) => field.isConstant).map(({ name, value }) => [name, value]));
    depth.values = rawValues(depth, constants, this.#decompressHandlers);
    const bytes = depth.values.flatMap((value) => [value & 255, value >> 8]);
    if (crc32(bytes) !== depth.raw_crc32) throw new Error("the checksum of a depth frame does not fit");
  }

  printConstants() {
    for (const { channel, topic, definitions } of this.#channels.values()) {
      const constants = definitions[0].definitions.filter((field) => field.isConstant);
      print({
        channel: topic,
        constants: Object.fromEntries(constants.map((field) => [field.name, plain(field.value)])),
        schema: this.#names.get(channel.schemaId),
        metadata: plain(channel.metadata),
      });
    }
  }
}

async function readIndexed(path, decompressHandlers) {
  const file = await open(path);
  try {
    const readable = {
      size: async () => (await file.stat({ bigint: true })).size,
      read: async (offset, length) => {
        const bytes = new Uint8Array(Number(length));
        const { bytesRead } = await file.read(bytes, 0, bytes.length, Number(offset));
        if (bytesRead !== bytes.length) throw new Error(`only ${bytesRead} of ${length} bytes at ${offset}`);
        return bytes;
      },
    };
    const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
    const decoder = new Decoder(decompressHandlers);
    for (const schema of reader.schemasById.values()) decoder.addSchema(schema);
    for (const channel of reader.channelsById.values()) decoder.addChannel(channel);
    if (reader.header.profile !== "") print({ profile: reader.header.profile });
    decoder.printConstants();
    let messages = 0n;
    for await (const message of reader.readMessages({ validateCrcs: true })) {
      decoder.print("indexed", message);
      ++messages;
    }
    if (messages !== reader.statistics?.messageCount) throw new Error("the statistics count other messages");
    for await (const { name, metadata } of reader.readMetadata()) print({ metadata: name, values: plain(metadata) });
    for await (const { name, mediaType, data } of reader.readAttachments({ validateCrcs: true })) {
      print({ attachment: name, mediaType, data: text.decode(data) });
    }
  } finally {
    await file.close();
  }
}

async function readStream(path, decompressHandlers) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  const decoder = new Decoder(decompressHandlers);
  reader.append(await readFile(path));
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Schema") decoder.addSchema(record);
    if (record.type === "Channel") decoder.addChannel(record);
    if (record.type === "Message") decoder.print("stream", record);
  }
  if (!reader.done()) throw new Error("the file is cut off");
}

try {
  const path = process.argv[2];
  const decompressHandlers = await loadDecompressHandlers();
  // each of them has to find what is wrong
  const results = await Promise.allSettled([
    readIndexed(path, decompressHandlers),
    readStream(path, decompressHandlers),
  ]);
  const readers = ["indexed", "stream"];
  results.forEach((result, i) => {
    if (result.status === "rejected") console.error(`${readers[i]}: ${result.reason.message}`);
  });
  process.exitCode = results.some((result) => result.status === "rejected") ? 1 : 0;
} catch (error) {
  console.error(error.message);
  process.exitCode = 1;
}

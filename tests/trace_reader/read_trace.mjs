// Reads a trace by the reader of the MCAP project, with all checksums that it knows: `read_trace.mjs FILE`.
// Prints one JSON object a line: {"reader", "topic", "logTime", "message"} for each message, by the indexed reader
// and by the stream reader; {"channel", "constants"} for the constants of each schema; {"metadata"},
// {"attachment"}. Numbers are strings, for JSON has neither 64-bit integers nor NaN, infinity and -0.
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

/** Decodes the messages of a file's channels by the schemas in the file. */
class Decoder {
  #schemas = new Map();
  #channels = new Map();

  addSchema(schema) {
    if (schema.encoding !== "ros2msg") throw new Error(`schema encoding ${schema.encoding}`);
    this.#schemas.set(schema.id, parse(text.decode(schema.data), { ros2: true }));
  }

  addChannel(channel) {
    if (channel.messageEncoding !== "cdr") throw new Error(`message encoding ${channel.messageEncoding}`);
    const definitions = this.#schemas.get(channel.schemaId);
    this.#channels.set(channel.id, { topic: channel.topic, reader: new MessageReader(definitions), definitions });
  }

  print(reader, message) {
    const channel = this.#channels.get(message.channelId);
    const decoded = channel.reader.readMessage(message.data);
    print({ reader, topic: channel.topic, logTime: String(message.logTime), message: plain(decoded) });
  }

  printConstants() {
    for (const { topic, definitions } of this.#channels.values()) {
      const constants = definitions[0].definitions.filter((field) => field.isConstant);
      print({
        channel: topic,
        constants: Object.fromEntries(constants.map((field) => [field.name, plain(field.value)])),
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
    const decoder = new Decoder();
    for (const schema of reader.schemasById.values()) decoder.addSchema(schema);
    for (const channel of reader.channelsById.values()) decoder.addChannel(channel);
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
  const decoder = new Decoder();
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

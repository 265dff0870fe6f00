// SPDX-License-Identifier: Apache-2.0
// Rewrites traces by the reader and writer of the MCAP project: `rewrite_trace.mjs HOW OUT TOPICS IN...`.
// HOW: chunks (the writer's defaults: schemas and channels in chunks), small-chunks, plain (messages outside of
// chunks), bare (no summary, no indexes), backwards (all messages in chunks, the latest first, which hapticd refuses).
// TOPICS: those to keep, divided by commas, or "all". Several files are merged in the order of time.

import { readFile, writeFile } from "node:fs/promises";
import { McapIndexedReader, McapWriter, TempBuffer } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";

const kHows = {
  chunks: {},
  "small-chunks": { chunkSize: 20_000 },
  plain: { useChunks: false },
  bare: {
    useStatistics: false,
    useSummaryOffsets: false,
    repeatSchemas: false,
    repeatChannels: false,
    useAttachmentIndex: false,
    useMetadataIndex: false,
    useMessageIndex: false,
    useChunkIndex: false,
  },
  backwards: { chunkSize: 20_000 },
};

/** Everything of a file but its indexes. */
async function contentOf(path, wanted, decompressHandlers) {
  const bytes = await readFile(path);
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, length) => new Uint8Array(bytes.buffer, bytes.byteOffset + Number(offset), Number(length)),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const content = { reader, messages: [], metadata: [], attachments: [] };
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    if (!wanted(reader.channelsById.get(message.channelId).topic)) continue;
    content.messages.push({ ...message, data: message.data.slice(), reader });
  }
  for await (const metadata of reader.readMetadata()) content.metadata.push(metadata);
  for await (const attachment of reader.readAttachments({ validateCrcs: true })) content.attachments.push(attachment);
  return content;
}

/** Registers channels with their schemas under ids of the new file. */
class Channels {
  #ids = new Map();

  constructor(writer) {
    this.writer = writer;
  }

  async idOf(reader, channelId) {
    const channel = reader.channelsById.get(channelId);
    if (!this.#ids.has(reader)) this.#ids.set(reader, new Map());
    const ids = this.#ids.get(reader);
    if (!ids.has(channelId)) {
      const schema = reader.schemasById.get(channel.schemaId);
      const schemaId = await this.writer.registerSchema({ name: schema.name, encoding: schema.encoding, data: schema.data });
      ids.set(channelId, await this.writer.registerChannel({ ...channel, schemaId }));
    }
    return ids.get(channelId);
  }
}

const [how, out, topics, ...files] = process.argv.slice(2);
const decompressHandlers = await loadDecompressHandlers();
const wanted = (topic) => topics === "all" || topics.split(",").includes(topic);
const contents = [];
for (const file of files) contents.push(await contentOf(file, wanted, decompressHandlers));
const messages = contents.flatMap((content) => content.messages);
const order = (a, b) => (a.logTime < b.logTime ? -1 : a.logTime > b.logTime ? 1 : 0);
messages.sort(how === "backwards" ? (a, b) => order(b, a) : order);

const buffer = new TempBuffer();
const writer = new McapWriter({ writable: buffer, ...kHows[how] });
await writer.start({ profile: "", library: "rewrite_trace.mjs" });
const channels = new Channels(writer);
for (const { reader, ...message } of messages) {
  await writer.addMessage({ ...message, channelId: await channels.idOf(reader, message.channelId) });
}
// behind the messages, as programs do that find them there
for (const { metadata, attachments } of contents) {
  for (const attachment of attachments) await writer.addAttachment(attachment);
  for (const record of metadata) await writer.addMetadata(record);
}
await writer.end();
await writeFile(out, buffer.get());

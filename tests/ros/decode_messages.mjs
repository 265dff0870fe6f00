// SPDX-License-Identifier: Apache-2.0
// Decodes messages of ROS 2 by their definitions: `decode_messages.mjs FILE`, whose lines are JSON objects with the
// members "definition", in the syntax of .msg files, and "bytes", hexadecimal, with the four bytes of the encoding in
// front. Prints for each {"message", "bytes"}: what it means, and the bytes that the same message is encoded to again.
// Exit status: 0 all could be decoded, 1 one could not.

import { readFile } from "node:fs/promises";
import { parse } from "@foxglove/rosmsg";
import { MessageReader, MessageWriter } from "@foxglove/rosmsg2-serialization";

function plain(value) {
  if (ArrayBuffer.isView(value)) return Array.from(value);
  if (Array.isArray(value)) return value.map(plain);
  if (value !== null && typeof value === "object") {
    return Object.fromEntries(Object.entries(value).map(([name, member]) => [name, plain(member)]));
  }
  return value;
}

try {
  const lines = (await readFile(process.argv[2], "utf8")).split("\n").filter((line) => line !== "");
  for (const line of lines) {
    const { definition, bytes } = JSON.parse(line);
    const definitions = parse(definition, { ros2: true });
    const message = new MessageReader(definitions).readMessage(Buffer.from(bytes, "hex"));
    const again = new MessageWriter(definitions).writeMessage(message);
    console.log(JSON.stringify({ message: plain(message), bytes: Buffer.from(again).toString("hex") }));
  }
} catch (error) {
  console.error(error.message);
  process.exitCode = 1;
}

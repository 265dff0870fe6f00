// SPDX-License-Identifier: Apache-2.0
// A PNG of at most 256 colours: a shaded picture of the page takes a third of the bytes.
import { deflateSync } from 'node:zlib';

const kColours = 256;
/** Colours are told apart to this many bits a channel. */
const kBits = 6;

/** Red, green, blue and opacity of a PNG, decoded by a browser. */
const decode = (page, png) => page.evaluate(async (base64) => {
  const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const image = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
  const canvas = new OffscreenCanvas(image.width, image.height);
  const context = canvas.getContext('2d');
  context.drawImage(image, 0, 0);
  const { data } = context.getImageData(0, 0, image.width, image.height);
  let text = '';
  for (let at = 0; at < data.length; at += 32768) text += String.fromCharCode(...data.subarray(at, at + 32768));
  return { width: image.width, height: image.height, text: btoa(text) };
}, png.toString('base64'));

const keyOf = (r, g, b) => ((r >> (8 - kBits)) << (2 * kBits)) | ((g >> (8 - kBits)) << kBits) | (b >> (8 - kBits));

/** Median cut: boxes of colours are split across their longest side until there are enough; the index of each key. */
function paletteOf(data) {
  const colours = new Map();
  for (let at = 0; at < data.length; at += 4) {
    const key = keyOf(data[at], data[at + 1], data[at + 2]);
    const colour = colours.get(key);
    if (colour) colour.count++;
    else colours.set(key, { key, rgb: [data[at], data[at + 1], data[at + 2]], count: 1 });
  }
  const boxOf = (members) => {
    const sides = [0, 1, 2].map((i) => {
      const values = members.map(({ rgb }) => rgb[i]);
      return values.reduce((a, b) => Math.max(a, b)) - values.reduce((a, b) => Math.min(a, b));
    });
    const axis = sides.indexOf(Math.max(...sides));
    const count = members.reduce((sum, colour) => sum + colour.count, 0);
    return { members, axis, merit: sides[axis] * Math.sqrt(count) };
  };
  const boxes = [boxOf([...colours.values()])];
  while (boxes.length < kColours) {
    boxes.sort((a, b) => a.merit - b.merit);
    const { members, axis, merit } = boxes.pop();
    if (merit === 0) {
      boxes.push({ members, axis, merit });
      break;
    }
    members.sort((a, b) => a.rgb[axis] - b.rgb[axis]);
    boxes.push(boxOf(members.slice(0, members.length >> 1)), boxOf(members.slice(members.length >> 1)));
  }
  const indices = new Map();
  const palette = boxes.flatMap(({ members }, index) => {
    const total = members.reduce((sum, { count }) => sum + count, 0);
    for (const { key } of members) indices.set(key, index);
    return [0, 1, 2].map((i) => Math.round(members.reduce((sum, { rgb, count }) => sum + rgb[i] * count, 0) / total));
  });
  return { palette: Buffer.from(palette), indices };
}

function chunk(type, data) {
  const body = Buffer.concat([Buffer.from(type, 'latin1'), data]);
  const length = Buffer.alloc(4);
  length.writeUInt32BE(data.length);
  const check = Buffer.alloc(4);
  check.writeUInt32BE(crc32(body));
  return Buffer.concat([length, body, check]);
}

/** The check of a chunk (PNG 1.2, annex D); Node.js has one only since version 22. */
function crc32(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; bit++) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  }
  return (crc ^ 0xffffffff) >>> 0;
}

/** `png`: bytes of a PNG; `page`: any page of a browser, which decodes it. */
export async function palettePng(page, png) {
  const { width, height, text } = await decode(page, png);
  const data = Buffer.from(text, 'base64');
  const { palette, indices } = paletteOf(data);
  const rows = Buffer.alloc(height * (width + 1)); // each row begins with its filter: none
  for (let row = 0; row < height; row++) {
    for (let column = 0; column < width; column++) {
      const at = 4 * (row * width + column);
      rows[row * (width + 1) + 1 + column] = indices.get(keyOf(data[at], data[at + 1], data[at + 2]));
    }
  }
  const header = Buffer.alloc(13);
  header.writeUInt32BE(width, 0);
  header.writeUInt32BE(height, 4);
  header.set([8, 3, 0, 0, 0], 8); // 8 bits a pixel, of a palette
  return Buffer.concat([
    Buffer.from([137, 80, 78, 71, 13, 10, 26, 10]), chunk('IHDR', header), chunk('PLTE', palette),
    chunk('IDAT', deflateSync(rows, { level: 9 })), chunk('IEND', Buffer.alloc(0))]);
}

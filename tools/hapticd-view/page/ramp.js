// SPDX-License-Identifier: Apache-2.0
// The colours of a scale: cividis (Nunez, Anderton and Renslow 2018, doi 10.1371/journal.pone.0199239), whose lightness
// rises evenly and which looks the same with and without red-green colour blindness.

const kColours = [
  '#00224e', '#123570', '#3b496c', '#575d6d', '#707173', '#8a8678', '#a59c74', '#c3b369', '#e1cc55', '#fee838'];

/** Red, green and blue, 0..1, at even distances from the lowest value to the highest. */
export const kRamp = kColours.map((hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255));

/** The same for style sheets: `direction` as in "to right". */
export const gradient = (direction, reversed) =>
  `linear-gradient(${direction}, ${(reversed ? [...kColours].reverse() : kColours).join(', ')})`;

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints a line for each depth frame, from the memory that hapticd shares (the method ShareDepth in the interface text).

    depth.py --frames 30

A line holds the number of the frame, its age when it was read, the share of pixels with a measurement, and the smallest and
largest depth in metres. The caller needs the group haptic or haptic-view, and NumPy.
"""
import argparse
import mmap
import struct
import time
from itertools import islice

import hapticd
import numpy

HEAD = struct.Struct("<12sIQQQIII")  # form, slots, first slot, bytes of a slot, offset of the image; changes, newest, closed
FORM = b"HDREGION\1\0\0\0"
NO_SLOT = 0xFFFFFFFF
# Of a frame: form, size, columns, rows, stride, type, law, noise, principle, raw value without a measurement, device ticks,
# coefficients of the law, fx, fy, cx, cy, rotation, position, noise, exposure, arrival, number.
HEADER = struct.Struct("<6sHIIIBBBBII2d4d9d3d3dqqQ")
HEADER_FORM = b"HDEP\2\0"


def frames(memory):
    """Header and raw values of each frame, as far as this program keeps up."""
    seen, end = None, time.monotonic() + 5
    while True:
        form, _, first_slot, slot_bytes, image_offset, changes, newest, closed = HEAD.unpack_from(memory)
        slot = first_slot + newest * slot_bytes
        if changes != seen and newest != NO_SLOT:
            before = memory[slot:slot + 8]  # a counter, odd while the slot is being written
            header = HEADER.unpack_from(memory, slot + 8)
            image = memory[slot + image_offset:slot + image_offset + header[3] * header[4]]
            if (form, header[0]) != (FORM, HEADER_FORM):
                raise hapticd.Error("ShareDepth", "the memory has another layout", "use the example of the same hapticd")
            if before == memory[slot:slot + 8] and before[0] % 2 == 0:
                seen, end = changes, time.monotonic() + 5
                yield header, numpy.frombuffer(image, "<u2").reshape(header[3], header[4] // 2)[:, :header[2]]
        elif closed or time.monotonic() > end:
            raise hapticd.Error("ShareDepth", "the daemon has closed the memory" if closed else "no depth frame for 5 s",
                                "'hapticctl status' shows why")
        else:
            time.sleep(0.002)


parser = argparse.ArgumentParser(description="Prints a line for each depth frame that hapticd shares.")
parser.add_argument("--frames", type=int, default=10)
arguments = parser.parse_args()
with hapticd.plain_errors():
    replies = hapticd.Box().share_depth()  # the memory is written as long as this stream is open
    reply = next(replies)
    memory = mmap.mmap(reply.descriptor, reply.bytes, mmap.MAP_SHARED, mmap.PROT_READ)
    for header, raw in islice(frames(memory), arguments.frames):
        c0, c1 = header[11:13]
        linear = c0 * raw[raw != header[9]] + c1
        depths_m = 1 / linear[linear > 0] if header[6] == 0 else linear
        limits = f"{depths_m.min():.3f} to {depths_m.max():.3f} m" if depths_m.size else "nothing measured"
        print(f"frame {header[-1]}: {(time.monotonic_ns() - header[-2]) / 1e6:.1f} ms old, "
              f"{100 * depths_m.size / raw.size:.1f} % measured, {limits}", flush=True)

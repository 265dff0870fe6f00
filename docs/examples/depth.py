#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints a line for each depth frame, read from the memory that hapticd shares, with Python's standard library alone.

    depth.py --frames 30

A line holds the number of the frame, its age when it was read, the share of pixels with a measurement, and the
smallest and largest depth in metres. The caller needs the group haptic or haptic-view. Exit status: 0 done, 1 the daemon
refused the call, closed the memory, or showed no frame for five seconds.
"""
import argparse
import json
import mmap
import os
import socket
import struct
import sys
import time

REGION_MAGIC = b"HDREGION"
REGION_VERSION = 1
HEAD = struct.Struct("<8sIIQQQIII")  # magic, version, slots, first slot, slot size, image offset, changes, newest, closed
NO_SLOT = 0xFFFFFFFF
COUNTER = struct.Struct("<Q")
FRAME_HEADER_BYTES = 280
RECIPROCAL = 0


def shared_memory(connection):
    """Calls ShareDepth; the connection has to stay open as long as frames are read."""
    call = {"method": "io.hapticd.Status.ShareDepth", "parameters": {}, "more": True}
    connection.sendall(json.dumps(call).encode() + b"\0")
    received, descriptors, _, _ = socket.recv_fds(connection, 65536, 1)
    while received and not received.endswith(b"\0"):
        received += connection.recv(65536)
    reply = json.loads(received.rstrip(b"\0") or b'{"error": "the daemon closed the connection"}')
    if "error" in reply or not descriptors:
        sys.exit(f"depth.py: {reply.get('error')}: {reply.get('parameters')}")
    memory = mmap.mmap(descriptors[0], reply["parameters"]["bytes"], mmap.MAP_SHARED, mmap.PROT_READ)
    os.close(descriptors[0])
    if HEAD.unpack_from(memory)[:2] != (REGION_MAGIC, REGION_VERSION):
        sys.exit("depth.py: the memory has another layout than this program expects")
    return memory


def newest_frame(memory):
    """Header and image of the newest frame, as bytes; None: there is none yet, or it was overwritten meanwhile."""
    _, _, _, first_slot, slot_bytes, image_offset, _, newest, _ = HEAD.unpack_from(memory)
    if newest == NO_SLOT:
        return None
    slot = first_slot + newest * slot_bytes
    before = COUNTER.unpack_from(memory, slot)[0]
    header = memory[slot + COUNTER.size:slot + COUNTER.size + FRAME_HEADER_BYTES]
    height, stride = struct.unpack_from("<II", header, 12)
    image = memory[slot + image_offset:slot + image_offset + height * stride]
    after = COUNTER.unpack_from(memory, slot)[0]
    return (header, image) if before == after and before % 2 == 0 else None


def line_of(header, image):
    width, height, stride = struct.unpack_from("<III", header, 8)
    law = header[21]
    no_measurement = struct.unpack_from("<H", header, 24)[0]
    c0, c1 = struct.unpack_from("<dd", header, 32)
    arrival_ns, frame = struct.unpack_from("<qQ", header, 208)
    age_ms = (time.monotonic_ns() - arrival_ns) / 1e6
    raw = []
    for row in range(height):
        raw += struct.unpack_from(f"<{width}H", image, row * stride)
    values = {value for value in set(raw) if value != no_measurement}
    inverse = [c0 * value + c1 for value in values]
    depths = [1 / z for z in inverse if z > 0] if law == RECIPROCAL else inverse
    share = 100 * sum(value != no_measurement for value in raw) / len(raw)
    limits = f"{min(depths):.3f} to {max(depths):.3f} m" if depths else "nothing measured"
    return f"frame {frame}: {age_ms:.1f} ms old, {share:.1f} % measured, {limits}"


def main():
    parser = argparse.ArgumentParser(description="Prints a line for each depth frame that hapticd shares.")
    parser.add_argument("--socket", default=os.environ.get("HAPTICD_SOCKET") or "/run/hapticd/io.hapticd.Status",
                        help="of hapticd (HAPTICD_SOCKET, else /run/hapticd/io.hapticd.Status)")
    parser.add_argument("--frames", type=int, default=10)
    arguments = parser.parse_args()
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(arguments.socket)
        memory = shared_memory(connection)
        printed = 0
        seen = None
        patience_ends = time.monotonic() + 5
        while printed < arguments.frames:
            changes, _, closed = HEAD.unpack_from(memory)[-3:]
            frame = newest_frame(memory) if changes != seen else None
            if frame:
                seen = changes
                print(line_of(*frame), flush=True)
                printed += 1
                patience_ends = time.monotonic() + 5
            elif closed or time.monotonic() > patience_ends:
                sys.exit("depth.py: " + ("the daemon has closed the memory" if closed else "no frame for 5 s"))
            else:
                time.sleep(0.002)


if __name__ == "__main__":
    main()

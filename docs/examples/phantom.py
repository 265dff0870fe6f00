#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes a segmented phantom, phantom.seg.nrrd, as 3D Slicer would export it: an organ of about 90 mm with bumps, and
a vessel in front of it, as two segments in LPS with voxels of 1 mm. For trying fixtures made from images."""
import gzip
import math
import sys

SIZE = (112, 96, 88)
ORIGIN = (-55.5, -47.5, -43.5)


def is_organ(x, y, z):
    radius = math.sqrt((x / 45) ** 2 + (y / 36) ** 2 + (z / 32) ** 2)
    return radius < 1 + 0.06 * math.sin(x / 9) * math.cos(y / 11) + 0.04 * math.sin(z / 7)


def is_vessel(x, y, z):
    return math.hypot(y - 8 * math.sin(x / 20), z - 37) < 4 and abs(x) < 48


def main(file):
    voxels = bytearray()
    for k in range(SIZE[2]):
        for j in range(SIZE[1]):
            for i in range(SIZE[0]):
                place = (i + ORIGIN[0], j + ORIGIN[1], k + ORIGIN[2])
                voxels.append(2 if is_vessel(*place) else 1 if is_organ(*place) else 0)
    header = f"""NRRD0004
type: unsigned char
dimension: 3
space: left-posterior-superior
sizes: {SIZE[0]} {SIZE[1]} {SIZE[2]}
space directions: (1,0,0) (0,1,0) (0,0,1)
kinds: domain domain domain
encoding: gzip
space origin: ({ORIGIN[0]},{ORIGIN[1]},{ORIGIN[2]})
Segment0_ID:=Segment_1
Segment0_Name:=organ
Segment0_LabelValue:=1
Segment0_Layer:=0
Segment0_Extent:=0 {SIZE[0] - 1} 0 {SIZE[1] - 1} 0 {SIZE[2] - 1}
Segment1_ID:=Segment_2
Segment1_Name:=vessel
Segment1_LabelValue:=2
Segment1_Layer:=0
Segment1_Extent:=0 {SIZE[0] - 1} 0 {SIZE[1] - 1} 0 {SIZE[2] - 1}

"""
    try:
        with open(file, "wb") as output:
            output.write(header.encode())
            output.write(gzip.compress(bytes(voxels)))
    except OSError as error:
        sys.exit(f"phantom.py: {file}: cannot be written: {error.strerror}")
    print(f"{file}: {SIZE[0]} x {SIZE[1]} x {SIZE[2]} voxels of 1 mm, segments organ and vessel")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "phantom.seg.nrrd")

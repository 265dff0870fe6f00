# SPDX-License-Identifier: Apache-2.0
"""Instructions per force and per frame: what hapticbench measures as time is a count in the counted boot."""

import json
import os

import depth_box
from lab import LAB, check, expect, must

RESULT = LAB + "/pareto.json"
INSTRUCTIONS_PER_US = 1000


def prepare():
    depth_box.install_tools()


def finish():
    depth_box.remove_tools()


def extensions():
    """The vector extensions of the processor that the kernels choose by, as the kernel of the guest names them."""
    known = ["avx512f", "avx2", "sse4_1", "ssse3", "asimd"]
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        flags = {word for line in file if line.startswith(("flags", "Features")) for word in line.split()}
    return next((name for name in known if name in flags), "none")


@check("hapticbench counts the instructions of each law's force and of each frame", only_counted=True)
def counted_instructions():
    must("hapticbench", "pareto", "--quick", "--recordings", "/nonexistent", "--json", RESULT, timeout=3000)
    with open(RESULT, encoding="utf-8") as file:
        points = [point for point in json.load(file)["points"] if not point["library"]]
    expect(len(points) == 4, f"{len(points)} laws")
    counts = "; ".join(f"{point['name']} {point['force_us']['mean'] * INSTRUCTIONS_PER_US:.0f} and "
                       f"{point['model_us']['mean'] * INSTRUCTIONS_PER_US:.0f}" for point in points)
    return f"{os.uname().machine}, {extensions()}: per force and per frame: {counts}"

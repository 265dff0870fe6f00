#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes an HDF5 file from a trace: hdf5_from_trace.py grasping.mcap grasping.h5 (needs Debian's python3-h5py)

The groups ticks, models, directives and events have a dataset for each field, vectors with three columns: numbers as in the
trace, all else text, a set of names and values as JSON. The dataset `settings` is the configuration that the trace was
recorded with, as YAML.

    h5py.File("grasping.h5")["ticks/command_force_n_in_world"][:]
"""
import json
import os
import sys
import tempfile

import h5py
import hapticd


def text_of(value):
    return json.dumps(value) if isinstance(value, dict) else str(value)


def write(trace, path):
    with h5py.File(path, "w") as file:
        for channel in ("ticks", "models", "directives", "events"):
            for name, values in getattr(trace, channel).items():
                if values.dtype.kind in "OU":
                    file.create_dataset(f"{channel}/{name}", data=list(map(text_of, values)), dtype=h5py.string_dtype())
                else:
                    file.create_dataset(f"{channel}/{name}", data=values, compression="gzip" if len(values) else None)
        file["settings"] = trace.settings


with hapticd.plain_errors():
    if len(sys.argv) != 3:
        raise hapticd.Error("arguments", "a trace and an HDF5 file are needed", "hdf5_from_trace.py NAME.mcap NAME.h5")
    trace, out = hapticd.read_trace(sys.argv[1]), sys.argv[2]
    if os.path.exists(out):
        raise hapticd.Error(out, "exists already", "give another name")
    with tempfile.TemporaryDirectory(dir=os.path.dirname(out) or ".") as folder:
        write(trace, os.path.join(folder, "unfinished.h5"))
        os.rename(os.path.join(folder, "unfinished.h5"), out)

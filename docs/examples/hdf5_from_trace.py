#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes an HDF5 file from a trace, with h5py (Debian's python3-h5py) and `hapticctl trace export`.

    hdf5_from_trace.py grasping.mcap grasping.h5

The groups ticks, models, directives and events have a dataset for each column of the CSV that hapticctl writes of that
channel; the columns _x, _y and _z of a vector are one dataset of three columns. Numbers are float64, times in
nanoseconds int64, all else is text; where a row has no value stand NaN, 0 and an empty text. The dataset `settings` is
the configuration that the trace was recorded with, as YAML.

    h5py.File("grasping.h5")["ticks/command_force_n_in_world"][:]
"""
import csv
import math
import os
import subprocess
import sys
import tempfile
from itertools import islice

import h5py
import numpy

CHANNELS = ("ticks", "models", "directives", "events")
ROWS_AT_ONCE = 10_000


def fail(text):
    sys.exit(f"hdf5_from_trace.py: {text}")


def rows_of(file):
    """Gives the names of the columns, then each row. A message of an event may have line ends in it."""
    with open(file, encoding="utf-8", newline="") as lines:
        yield from csv.reader(lines)


def is_number(cell):
    try:
        float(cell)
    except ValueError:
        return cell == ""
    return True


def type_of(name, numeric):
    if not numeric:
        return h5py.string_dtype()
    return numpy.int64 if name.endswith("_ns") else numpy.float64


def value_of(cell, kind):
    if kind == numpy.float64:
        return float(cell) if cell else math.nan
    return int(cell or 0) if kind == numpy.int64 else cell


def datasets(names):
    """Returns the places of the columns of each dataset by its name."""
    places = {}
    for place, name in enumerate(names):
        vector = name[:-2] if name.endswith("_x") and name[:-1] + "z" in names else None
        if vector:
            places[vector] = [place, place + 1, place + 2]
        elif not any(place in taken for taken in places.values()):
            places[name or "(unnamed)"] = [place]
    return places


def add_channel(group, file):
    rows = rows_of(file)
    names = next(rows)
    numeric = [True] * len(names)
    for row in rows:
        numeric = [still and is_number(cell) for still, cell in zip(numeric, row)]
    columns = []
    for name, places in datasets(names).items():
        kind = type_of(name, numeric[places[0]])
        shape = (0, len(places)) if len(places) > 1 else (0,)
        dataset = group.create_dataset(name, shape, kind, maxshape=(None, *shape[1:]), chunks=True, compression="gzip")
        columns.append((dataset, places, kind))
    rows = rows_of(file)
    next(rows)
    while batch := list(islice(rows, ROWS_AT_ONCE)):
        for dataset, places, kind in columns:
            values = [[value_of(row[place], kind) for place in places] for row in batch]
            dataset.resize(len(dataset) + len(batch), axis=0)
            dataset[-len(batch):] = values if len(places) > 1 else [value for [value] in values]


def main():
    if len(sys.argv) != 3:
        fail("give a trace and the HDF5 file to write: hdf5_from_trace.py NAME.mcap NAME.h5")
    trace, out = sys.argv[1:]
    if os.path.exists(out):
        fail(f"{out}: exists already")
    with tempfile.TemporaryDirectory(dir=os.path.dirname(out) or ".") as folder:
        unfinished = os.path.join(folder, "unfinished.h5")
        with h5py.File(unfinished, "w") as file:
            for channel in CHANNELS:
                table = os.path.join(folder, channel + ".csv")
                command = ["hapticctl", "trace", "export", trace, "--channel", channel, "--out", table]
                if subprocess.run(command, stdout=subprocess.DEVNULL, check=False).returncode != 0:
                    sys.exit(1)  # hapticctl has said why
                add_channel(file.create_group(channel), table)
            with open(os.path.join(folder, "ticks.settings.yaml"), encoding="utf-8") as settings:
                file["settings"] = settings.read()
        os.rename(unfinished, out)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints every tick of the force loop as CSV: ticks.py --seconds 2 number mode command_force_n_in_world > ticks.csv

Ticks that were lost on the way are counted on standard error.
"""
import argparse
import csv
import sys

import hapticd


def columns_of(tick):
    """Names and values; a vector becomes three columns."""
    for name, value in tick.items():
        if isinstance(value, list):
            yield from zip((f"{name}_{axis}" for axis in "xyz"), value)
        else:
            yield name, value


parser = argparse.ArgumentParser(description="Prints every tick of the force loop as CSV.")
parser.add_argument("fields", nargs="*", default=["number", "planned_ns", "command_force_n_in_world"],
                    help="names of fields as in traces")
parser.add_argument("--seconds", type=float, default=1.0)
arguments = parser.parse_args()
with hapticd.plain_errors():
    ticks = hapticd.Box().ticks(*arguments.fields, seconds=arguments.seconds)
    output = None
    for tick in ticks:
        row = dict(columns_of(tick))
        if output is None:
            output = csv.DictWriter(sys.stdout, row)
            output.writeheader()
        output.writerow(row)
    print(f"ticks.py: {ticks.lost} ticks lost", file=sys.stderr)

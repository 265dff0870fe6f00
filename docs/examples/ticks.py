#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints every tick of the force loop as CSV, with nothing but Python's standard library.

    ticks.py --seconds 2 number mode command_force_n_in_world > ticks.csv

Ticks that were lost on the way are counted on standard error. Exit status: 0 done, 1 the daemon refused the call or
closed the connection.
"""
import argparse
import csv
import json
import os
import socket
import sys
import time

AXES = "xyz"


def messages(connection):
    """The replies of a Varlink connection: JSON objects, each ended by a zero byte."""
    pending = b""
    while True:
        *whole, pending = pending.split(b"\0")
        for message in whole:
            yield json.loads(message)
        received = connection.recv(65536)
        if not received:
            return
        pending += received


def columns_of(name, values):
    """A vector becomes three columns."""
    if isinstance(values[0], list):
        return {f"{name}_{axis}": [value[i] for value in values] for i, axis in enumerate(AXES)}
    return {name: values}


def main():
    parser = argparse.ArgumentParser(description="Prints every tick of the force loop as CSV.")
    parser.add_argument("fields", nargs="*", default=["number", "planned_ns", "command_force_n_in_world"],
                        help="names of fields as in traces")
    parser.add_argument("--socket", default=os.environ.get("HAPTICD_SOCKET") or "/run/hapticd/io.hapticd.Status",
                        help="of hapticd (HAPTICD_SOCKET, else /run/hapticd/io.hapticd.Status)")
    parser.add_argument("--seconds", type=float, default=1.0)
    arguments = parser.parse_args()

    call = {"method": "io.hapticd.Status.Ticks", "parameters": {"fields": arguments.fields}, "more": True}
    output = csv.writer(sys.stdout)
    lost = 0
    end = None
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(arguments.socket)
        connection.sendall(json.dumps(call).encode() + b"\0")
        for reply in messages(connection):
            if "error" in reply:
                print(f"ticks.py: {reply['error']}: {reply['parameters']}", file=sys.stderr)
                return 1
            if reply["parameters"]["count"] == 0:  # the first one: the stream stands
                continue
            columns = {}
            for name, values in reply["parameters"]["ticks"].items():
                columns.update(columns_of(name, values))
            if end is None:
                end = time.monotonic() + arguments.seconds
                output.writerow(columns)
            output.writerows(zip(*columns.values()))
            lost = reply["parameters"]["lostCount"]
            if time.monotonic() >= end:
                print(f"ticks.py: {lost} ticks lost", file=sys.stderr)
                return 0
    print("ticks.py: the daemon closed the connection", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())

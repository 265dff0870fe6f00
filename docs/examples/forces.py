#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints mode and commanded force 20 times a second, as an example of a client: forces.py [STATUS_SOCKET]"""
import json, socket, sys

def newest_ticks(fields, path="/run/hapticd/io.hapticd.Status"):
    call = {"method": "io.hapticd.Status.Ticks", "parameters": {"fields": fields}, "more": True}
    with socket.socket(socket.AF_UNIX) as link:
        link.connect(path)
        link.sendall(json.dumps(call).encode() + b"\0")
        pending = b""
        while received := link.recv(65536):
            *replies, pending = (pending + received).split(b"\0")
            for reply in map(json.loads, replies):
                if "error" in reply: sys.exit(f"forces.py: {reply}")
                if reply["parameters"]["count"]:
                    yield {name: values[-1] for name, values in reply["parameters"]["ticks"].items()}

for tick in newest_ticks(["mode", "command_force_n_in_world"], *sys.argv[1:]):
    print(tick["mode"], *tick["command_force_n_in_world"], flush=True)

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints mode and commanded force (newtons, world frame) 20 times a second, until Ctrl-C."""
import hapticd

with hapticd.plain_errors():
    for tick in hapticd.Box().ticks("mode", "command_force_n_in_world", rate_hz=20):
        print(tick.mode, *tick.command_force_n_in_world, flush=True)

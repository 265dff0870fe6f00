#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A haptic device for hapticd's driver `udp`: device.py ADDRESS:PORT [KEY_FILE]

It is simulated, 50 g in a hand that moves 0.1 m along -z and back every 4 s: replace exchange() by your own device.
"""
import math
import sys
import time

import hapticd

position_m, velocity_m_per_s = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]


def exchange(force_n):
    """Called 1000 times a second: exerts a force and returns where the hand is, both in the device's own frame."""
    hand_m = [0, 0, 0.05 * math.cos(time.monotonic() * math.pi / 2) - 0.05]
    for i in range(3):
        hand_n = 60 * (hand_m[i] - position_m[i]) - 4 * velocity_m_per_s[i]
        velocity_m_per_s[i] += (hand_n + force_n[i]) / 0.05 * 0.001
        position_m[i] += velocity_m_per_s[i] * 0.001
    return position_m


with hapticd.plain_errors():
    hapticd.Device(*sys.argv[1:], limit_n=4).run(exchange)

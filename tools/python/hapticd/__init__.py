# SPDX-License-Identifier: Apache-2.0
"""A haptic controller box (hapticd) from Python: state, parameters, fixtures, streams, traces, and devices of your own.

    import hapticd

    with hapticd.plain_errors():
        box = hapticd.Box()
        box.set({"force.stiffness_n_per_m": 800})
        box.engage()
        for tick in box.ticks("mode", "command_force_n_in_world", rate_hz=20, seconds=5):
            print(tick.mode, tick.command_force_n_in_world)

`Box` calls the daemon, `Device` is a haptic device that the daemon drives, `read_trace()` reads a trace into arrays. What goes
wrong is an `Error`, which says where, what, and what to do. Nothing here is shared between threads: use an object from one
thread at a time. Only `read_trace()` needs NumPy, and only `Table.pandas()` needs pandas.
"""
from .box import Box
from .device import Device, Measured
from .error import Error, NoConnection, Refused, plain_errors
from .interface import Record
from .trace import Table, Trace, read_trace

__all__ = ["Box", "Device", "Error", "Measured", "NoConnection", "Record", "Refused", "Table", "Trace", "plain_errors",
           "read_trace"]

# SPDX-License-Identifier: Apache-2.0
"""A handle behind haptic-bridge, by authenticated packets over the loopback network, past the unit's address filter."""

import collections
import math
import os
import signal
import subprocess
import time

import handles
import installation
from lab import check, configure, counted, engage, expect, force_n, is_active, main_pid, must, reaches, wait_for, write

KEY, OTHER_KEY, LOG = "/run/lab-udp.key", "/run/lab-other.key", "/run/lab-bridge.csv"
BOX = handles.SCENE + f"handle: {{driver: udp}}\nudp_handle: {{peer: '127.0.0.1:47801', key_file: {KEY}}}\n"
# The bridge lets go after 20 ms without a command (drivers/handle/udp/protocol.md).
DEAD_MAN_NS = 20_000_000

bridge = None

# A tick of the device: age of the newest command, whether that asks for a force, the force at the hand.
Row = collections.namedtuple("Row", "age_ns active force_n")


class Bridge:
    """haptic-bridge with its simulated hand, which presses on a wall 1 m away with 2 N."""

    def __init__(self, key=KEY):
        if os.path.exists(LOG):
            os.remove(LOG)
        self.process = subprocess.Popen(
            ["haptic-bridge", "--peer", "127.0.0.1:47800", "--local", "127.0.0.1:47801", "--key-file", key, "--start",
             "0,0,-0.97", "--travel", "0.02", "--log", LOG], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    @staticmethod
    def rows(last_bytes=None):
        """What it logged, or the end of it; the row that is just being written is left out."""
        with open(LOG, "rb") as file:
            file.seek(max(0, os.fstat(file.fileno()).st_size - last_bytes) if last_bytes else 0)
            lines = [line.split(b",") for line in file.read().split(b"\n")[1:-1]]
        return [Row(int(line[3]), line[6] == b"active", math.hypot(*map(float, line[10:13]))) for line in lines]

    def exerts(self, least_n):
        """Whether the device exerts that force or more now."""
        rows = self.rows(1000)
        return bool(rows) and rows[-1].force_n >= least_n

    def end(self):
        """Returns its table of packets."""
        if self.process.poll() is None:
            self.process.terminate()
        said = self.process.communicate(timeout=30)[0]
        expect(self.process.returncode == 0, f"haptic-bridge ended with {self.process.returncode}: {said}")
        return said


def prepare():
    group = must("id", "-g", "hapticd").strip()
    for path, key in ((KEY, "0123456789abcdef0123456789abcdef"), (OTHER_KEY, "another key that nobody has read")):
        write(path, key)
        os.chmod(path, 0o640)
        os.chown(path, 0, int(group))
    configure(BOX)


def finish():
    if bridge and bridge.process.poll() is None:
        bridge.end()
    configure(installation.SIMPLE)
    for path in (KEY, OTHER_KEY, LOG):
        if os.path.exists(path):
            os.remove(path)


def present(now):
    return now["handle"]["state"] == "present"


def press():
    """Engages with a new bridge; its hand feels the wall afterwards."""
    global bridge
    bridge = Bridge()
    reaches("the handle", present)
    reaches("a scene", lambda now: now["tick"]["sceneFrame"] > 0)
    wait_for("engaging is accepted", engage)
    wait_for("the device exerts force", lambda: bridge.exerts(0.5), 20)


@check("a bridge with another key is refused, counted, and moves nothing")
def refused():
    stranger = Bridge(OTHER_KEY)
    try:
        now = reaches("it is counted", lambda now: now["handle"]["link"] and now["handle"]["link"]["rejected"] > 100)
        expect(not present(now), str(now["handle"]))
        expect(not any(row.active or row.force_n for row in stranger.rows()), "the stranger's device exerted a force")
    finally:
        stranger.end()
    return f"{now['handle']['link']['rejected']} packets; {now['handle']['detail']}"


@check("a bridge with the key: the hand feels the wall, and no packet is lost")
def forces():
    press()
    time.sleep(2)
    now = reaches("the loop computes it", lambda now: now["mode"] == "engaged" and force_n(now) > 0.5)
    said = bridge.end()
    link, rows = now["handle"]["link"], Bridge.rows()
    expect(max(row.force_n for row in rows) > 1, "the hand presses with 2 N and felt less than half of it")
    if counted():
        expect(link["lost"] == 0 and "lost 0, duplicated 0" in said, f"{link} {said}")
    return f"{len(rows)} states, round trip p50 {link['roundTrip']['p50Ns'] / 1000:.0f} us, {force_n(now):.2f} N"


@check("a bridge that ends: no force, status says what to do; another one gets no force before somebody engages")
def returns():
    global bridge
    pid = main_pid()
    now = reaches("the handle is lost", lambda now: now["handle"]["state"] == "lost" and force_n(now) == 0)
    bridge = Bridge()
    reaches("the handle", present)
    time.sleep(0.5)
    expect(not any(row.force_n for row in bridge.rows()), "there was force before somebody engaged")
    bridge.end()
    expect(is_active() and main_pid() == pid, "the daemon was restarted")
    return now["handle"]["detail"]


@check("kill -9 of the daemon while the hand presses: the bridge lets go within 20 ms after the last command")
def killed():
    press()
    old = main_pid()
    os.kill(old, signal.SIGKILL)
    wait_for("it lets go", lambda: not bridge.exerts(1e-9))
    wait_for("another daemon", lambda: is_active() and main_pid() not in (0, old), 15)
    reaches("the handle", present)
    bridge.end()
    rows = Bridge.rows()
    expect(any(row.force_n > 0.5 for row in rows), "there was no force to let go of")
    late = [row for row in rows if row.force_n and not (row.active and row.age_ns < DEAD_MAN_NS)]
    expect(not late, f"{len(late)} ticks with a force without a command, the first: {late[:1]}")
    oldest_ms = max(row.age_ns for row in rows if row.force_n) / 1e6
    return f"oldest command with a force {oldest_ms:.1f} ms"

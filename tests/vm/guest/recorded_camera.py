# SPDX-License-Identifier: Apache-2.0
"""A recording as the camera of the service, and a trace of it: recorded, shown and replayed by the installed programs."""

import os
import shutil

import camera
import depth_box
import devices
import installation
from lab import check, configure, counted, engage, expect, force_n, monitor, must, reaches, status

# On the guest's disk: the service may read it there, and a folder of the host is slow.
RECORDING = "/var/lib/lab-recording"
BOX = (f"camera: {{driver: recorded, recording: {RECORDING}}}\n" + camera.HAND +
       "trace: {min_free_mb: 20}\n")  # the guest has a small disk
RECORDED_FRAMES = 30
LEAST_IN_CONTACT = 100 if counted() else 20

trace = None


def prepare():
    shutil.copytree(devices.RECORDING, RECORDING)
    depth_box.install_tools()
    configure(BOX)


def finish():
    configure(installation.SIMPLE)
    depth_box.remove_tools()
    shutil.rmtree(RECORDING)


@check("the service plays a recording again and again as its camera, and the hand feels what is in it")
def plays():
    reaches("frames", camera.streaming, 20)
    engage()
    reaches("force", lambda now: now["mode"] == "engaged" and force_n(now) > 0.5, 20)
    first = status()["camera"]["frames"]
    seconds = 4 if counted() else 10
    strongest_n = max(force_n(reply["status"]) for reply in monitor(seconds))
    now = status()
    frames = now["camera"]["frames"] - first
    expect(frames > (25 * seconds if counted() else len(camera.depth_files())), f"{frames} frames in {seconds} s")
    expect(now["camera"]["state"] == "streaming" and now["mode"] == "engaged", str(now["camera"]))
    return f"{frames} frames in {seconds} s, up to {strongest_n:.2f} N"


@check("a trace with its depth is recorded without a loss and shown")
def recorded():
    global trace
    reaches("force", lambda now: now["mode"] == "engaged" and force_n(now) > 0.1, 20)
    trace = depth_box.record(RECORDED_FRAMES)
    name = os.path.basename(trace).removesuffix(".mcap")
    info = depth_box.answer("trace", "info", trace)
    expect(name in must("hapticctl", "trace", "list"), "the list does not name it")
    shown = must("hapticctl", "trace", "info", trace)
    expect("ticks" in shown, shown)
    expect(info, "no info")
    return " ".join(shown.split())[:200]


@check("haptic-replay computes each tick of the trace again without a bit of difference")
def replayed():
    return depth_box.replayed_trace(trace, LEAST_IN_CONTACT)

# SPDX-License-Identifier: Apache-2.0
"""A camera with 16-bit grey, Y16, and no calibration of its own: the kernel's test driver vivid, and its faults."""

import os
import struct
import time

import depth_box
import installation
import video_nodes
from depth_box import Recording, SameProcess, box, faded, is_felt, streams
from lab import check, configure, counted, drop_in, expect, must, reaches, read, run, status, wait_for

UNIT_UM = 100
RAW = 0  # of every pixel, as vivid draws its blue

path = None


def prepare():
    global path
    depth_box.install_tools()
    must("modprobe", "vivid", "n_devs=1", "node_types=0x1")
    path = wait_for("vivid's node", lambda: next("/dev/" + name for name in os.listdir("/sys/class/video4linux")
                                                 if "vivid" in read(f"/sys/class/video4linux/{name}/name")))
    draw_a_wall()


def draw_a_wall():
    press("Test Pattern", 9)  # blue all over
    press("OSD Text Mode", 2)  # none


def finish():
    configure(installation.SIMPLE)
    wait_for("vivid is unloaded", lambda: run("modprobe", "-r", "vivid").returncode == 0)
    depth_box.remove_tools()


def press(name, value=1):
    with video_nodes.Node(path) as node:
        node.set_control(name, value)


def grey_box(depth_m):
    """The hand begins 1 cm before a wall at that depth."""
    return box(640, 360, place=(0, 0, -depth_m + 0.01), device=path, intrinsics="configured", fx_px=500, fy_px=500,
               cx_px=320, cy_px=180, unit_um=UNIT_UM)


@check("without the group video the service says that it may not open the camera; with it the wall of vivid is felt")
def is_a_wall():
    global RAW
    configure(grey_box(0.7))
    now = reaches("the refusal", lambda now: "cannot be opened: Permission denied" in now["camera"]["detail"], 20)
    detail = now["camera"]["detail"]
    expect("the group video" in detail, detail)
    with drop_in("video", "[Service]\nSupplementaryGroups=video\n"):
        must("systemctl", "restart", "hapticd.service")
        reaches("frames", streams, 20)
        recording = Recording(depth_box.record(3))
        RAW, = struct.unpack_from(">H", recording.pixels(0), 2 * (180 * 640 + 320))
        configure(grey_box(RAW * UNIT_UM * 1e-6))
        now = reaches("a force", is_felt, 30)
        expect(now["camera"]["details"]["format"] == "Y16", str(now["camera"]))
        expect("the noise of this camera is not known" in now["camera"]["advice"], now["camera"]["advice"])
        said = depth_box.replayed_recording(Recording(depth_box.record(20)), 200 if counted() else 20)
    return f"{detail}; raw {RAW}, {RAW * UNIT_UM * 1e-3:.1f} mm; {said}"


def grew(before, name):
    return status()["camera"][name] - before["camera"][name]


@check("vivid's faults while it streams: flagged and dropped buffers are counted, errors are named, and each is survived")
def faults():
    said = []
    with drop_in("video", "[Service]\nSupplementaryGroups=video\n"):
        configure(grey_box(RAW * UNIT_UM * 1e-6))
        reaches("a force", is_felt, 30)
        with SameProcess():
            before = status()
            press("Inject V4L2_BUF_FLAG_ERROR")
            reaches("a damaged frame", lambda now: now["camera"]["damagedFrames"] == before["camera"]["damagedFrames"] + 1)
            said.append("flagged: " + status()["camera"]["detail"])
            before = status()
            press("Percentage of Dropped Buffers", 30)
            time.sleep(3)
            press("Percentage of Dropped Buffers", 0)
            lost, arrived = grew(before, "lostFrames"), grew(before, "frames")
            expect(lost > 10 or not counted(), f"{lost} lost")
            expect(abs(lost / (lost + arrived) - 0.3) < 0.2 or not counted(), f"{lost} lost, {arrived} arrived")
            said.append(f"30 % dropped: {lost} lost beside {arrived}; {status()['camera']['detail']}")
            for fault, text in (("Disconnect", "the camera is gone"),
                                ("Inject Fatal Streaming Error", "VIDIOC_DQBUF fails"),
                                ("Inject VIDIOC_QBUF Error", "VIDIOC_QBUF fails")):
                press(fault)
                now = reaches(f"{fault}: {text}", lambda now: text in now["camera"]["detail"], 20)
                said.append(f"{fault}: {now['camera']['detail']}")
                reaches("a force", is_felt, 30)
            for fault, text in (("Inject VIDIOC_REQBUFS Error", "VIDIOC_REQBUFS fails"),
                                ("Inject VIDIOC_STREAMON Error", "VIDIOC_STREAMON fails")):
                press(fault)  # when it is opened the next time
                press("Disconnect")
                now = reaches(f"{fault}: {text}", lambda now: text in now["camera"]["detail"], 20)
                said.append(f"{fault}: {now['camera']['detail']}")
                reaches("a force", is_felt, 30)
            press("Wrap Sequence Number")  # in the 128th frame of the next stream
            press("Disconnect")
            before = status()
            reaches("the number begins anew", lambda now: now["camera"]["frames"] > before["camera"]["frames"] + 150, 30)
            expect(grew(before, "lostFrames") == 0 or not counted(), "frames count as lost when the number begins anew")
            press("Wrap Sequence Number", 0)
            reaches("a force", is_felt, 30)
    return " | ".join(said)


@check("the module of the camera is unloaded and loaded again: the camera is missed, then found")
def unloaded():
    global path
    with drop_in("video", "[Service]\nSupplementaryGroups=video\n"):
        configure(grey_box(RAW * UNIT_UM * 1e-6))
        reaches("a force", is_felt, 30)
        with SameProcess():
            bound = "/sys/devices/platform/vivid.0/driver"
            name = os.path.basename(os.path.realpath(bound))
            with open(f"/sys/bus/platform/drivers/{name}/unbind", "w") as file:
                file.write("vivid.0")
            now = reaches("it is lost", lambda now: now["camera"]["state"] == "lost" and faded(now), 20)
            with open(f"/sys/bus/platform/drivers/{name}/bind", "w") as file:
                file.write("vivid.0")
            draw_a_wall()
            reaches("a force", is_felt, 30)
    return now["camera"]["detail"]

# SPDX-License-Identifier: Apache-2.0
"""A Kinect on the USB level, opened by libfreenect over libusb and usbfs as the service's user."""

import csv
import math
import time

import devices
import installation
from lab import (CONFIGURATION, DEPTH_TIMEOUT_S, LAB, SAFETY, check, configure, counted, engage, expect, force_n,
                 is_active, main_pid, monitor, must, reaches, read, run, status, wait_for, write)

# On the surface of the thing at rest, 0.52 m from the camera; the hand goes in and out of it.
HAND = f"""safety: {{depth_timeout_s: {DEPTH_TIMEOUT_S}, {SAFETY}}}
simulated_handle:
  {{start_x_m: -0.1214, start_y_m: -0.0502, start_z_m: -0.50, travel_m: 0.03, stroke_m: 0.01, press_s: 0.5, press_force_n: 6}}
force: {{law: nearest_springs}}
"""
BOX = "camera: {driver: freenect}\n" + HAND

kinect = None


def streaming(now):
    return now["camera"]["state"] == "streaming" and now["tick"]["sceneFrame"] > 0


def prepare():
    configure(BOX)


def finish():
    if kinect:
        kinect.end()
    run("dpkg", "--purge", "hapticd-tools", timeout=300)  # what follows is a box without them again
    configure(installation.SIMPLE)


@check("the package of the tools installs beside the box's, and hapticd runs on")
def tools():
    pid = main_pid()
    must("dpkg", "-i", LAB + "/hapticd-tools.deb", timeout=300)
    expect(main_pid() == pid, "the daemon was restarted")
    expect("haptic-replay" in must("haptic-replay", "--version"), "haptic-replay does not run")


@check("a camera that is plugged in long after the start is found; the device node is the daemon's alone")
def late_camera():
    global kinect
    now = reaches("it has looked several times", lambda now: now["uptimeS"] > 3 and now["camera"]["state"] == "absent", 20)
    began = time.monotonic()
    kinect = devices.Kinect()
    now = reaches("a force acts", streaming, 20)
    took_s = time.monotonic() - began
    node = must("sh", "-c", "stat -c '%a %G' $(for d in /sys/bus/usb/devices/*; do "
                "[ \"$(cat $d/idProduct 2>/dev/null)\" = 02ae ] && echo /dev/bus/usb/$(printf %03d $(cat $d/busnum))/"
                "$(printf %03d $(cat $d/devnum)); done)").strip()
    expect(node == "660 hapticd", f"the node of the camera is {node}")
    expect("A00000000000001A" in now["camera"]["identity"], now["camera"]["identity"])
    return f"first force {took_s:.2f} s after plugging it in"


@check("from plugging in the camera to the first force")
def first_force():
    engage()
    kinect.tell("unplug")
    reaches("no force", lambda now: now["camera"]["state"] == "lost" and now["mode"] == "holding" and force_n(now) == 0)
    began = time.monotonic()
    kinect.tell("replug")
    reaches("force", lambda now: force_n(now) > 0.01, 20)
    return f"{time.monotonic() - began:.2f} s"


def depth_files():
    return [line for line in read(devices.RECORDING + "/INDEX.txt").split() if line.startswith("d-")]


def replayed(samples, depth, times):
    """What haptic-replay computes at the samples' positions. samples: replies of Monitor."""
    write("/tmp/hip.csv", "t_s,x_m,y_m,z_m\n" + "".join(
        f"{t:.9f}," + ",".join(repr(sample["status"]["tick"]["hipMInWorld"][axis]) for axis in "xyz") + "\n"
        for sample, t in zip(samples, times)))
    must("haptic-replay", "--config", CONFIGURATION, "--depth", depth, "--hip", "/tmp/hip.csv", "--out", "/tmp/force.csv",
         "--force", timeout=120)
    with open("/tmp/force.csv") as file:
        return [tuple(float(row[name]) for name in ("fx_n", "fy_n", "fz_n")) for row in csv.DictReader(file)]


def difference_n(samples, forces):
    worst = 0.0
    for sample, force in zip(samples, forces):
        computed = sample["status"]["tick"]["lawForceNInWorld"]
        worst = max(worst, math.dist((computed["x"], computed["y"], computed["z"]), force))
    return worst


def computed(replies):
    """Those replies whose tick has a force that was computed from a whole model and a fresh handle."""
    return [reply for reply in replies if not reply["status"]["tick"]["outsideModel"]
            and reply["status"]["mode"] in ("idle", "engaged")]


# haptic-replay writes 9 significant digits of forces up to some 10 N.
ROUNDING_N = 1e-7


@check("forces of single frames equal those of haptic-replay on the same frames")
def frozen_frames():
    in_contact, worst = 0, 0.0
    files = depth_files()
    for frame in (0, len(files) // 2, len(files) - 1):
        kinect.tell(f"freeze {frame}")
        seen = status()["tick"]["sceneFrame"]
        reaches("that frame is used", lambda now: now["tick"]["sceneFrame"] > seen + 3)
        samples = computed(monitor(0.7))
        forces = replayed(samples, f"{devices.RECORDING}/{files[frame]}", [0] * len(samples))
        worst = max(worst, difference_n(samples, forces))
        in_contact += sum(1 for force in forces if math.hypot(*force) > 0.1)
    kinect.tell("play")
    expect(worst < ROUNDING_N, f"they differ by up to {worst:.3g} N")
    expect(in_contact > 20, f"only {in_contact} samples in contact")
    return f"{in_contact} forces, largest difference {worst:.1e} N"


@check("forces of the streaming recording equal those of haptic-replay, frame by frame")
def streamed_frames():
    files = depth_files()
    kinect.tell("unplug")
    reaches("the camera is lost", lambda now: now["camera"]["state"] == "lost")
    kinect.tell("freeze 0")
    kinect.tell("play")  # from the first frame on
    before = status()["camera"]["frames"]
    kinect.tell("replug")
    reaches("the camera streams", lambda now: now["camera"]["frames"] > before, 20)
    samples = [s for s in computed(monitor(1.2 if counted() else 4))
               if before < s["status"]["tick"]["sceneFrame"] < before + len(files) - 3]
    used, least = len({s["status"]["tick"]["sceneFrame"] for s in samples}), 15 if counted() else 3
    expect(used > least, f"only {used} frames were used")
    # Which recorded frame each of the daemon's is, it does not know; the first ones may have been lost while it opened
    # the camera, and in real time a slow guest may lose others. So every sample is computed in every recorded frame.
    stamps = [float(name.split("-")[1]) for name in files]
    rows = [(frame, sample) for frame in range(len(files)) for sample in samples]
    times = [stamps[frame] - stamps[0] + 0.001 + 1e-6 * (number % len(samples)) for number, (frame, _) in enumerate(rows)]
    forces = replayed([sample for _, sample in rows], devices.RECORDING, times)
    worst, at_least, in_contact = 0.0, 0, 0
    for number in sorted({s["status"]["tick"]["sceneFrame"] for s in samples}):
        mine = [i for i, sample in enumerate(samples) if sample["status"]["tick"]["sceneFrame"] == number]
        felt_n = {frame: difference_n([samples[i] for i in mine], [forces[frame * len(samples) + i] for i in mine])
                  for frame in range(at_least, len(files))}
        expect(felt_n, f"frame {number} comes after the last recorded one")
        best = min(felt_n, key=felt_n.get)
        expect(felt_n[best] < ROUNDING_N,
               f"frame {number} is no recorded frame from {at_least} on: {felt_n[best]:.3g} N from frame {best}")
        worst, at_least = max(worst, felt_n[best]), best + 1
        in_contact += sum(1 for i in mine if math.hypot(*forces[best * len(samples) + i]) > 0.1)
    expect(in_contact > (20 if counted() else 3), f"only {in_contact} samples in contact")
    return f"{len(samples)} forces, {in_contact} in contact, largest difference {worst:.1e} N"


@check("unplugged while engaged in mid-frame: the force goes to zero and nothing else is lost")
def unplugged():
    engage()
    reaches("force", lambda now: force_n(now) > 0.5, 20)
    kinect.tell("unplug")
    reaches("the force is held at zero", lambda now: now["mode"] == "holding" and force_n(now) == 0, 10)
    now = reaches("the camera is lost", lambda now: now["camera"]["state"] == "lost")
    expect(is_active(), "the service ended")
    return now["camera"]["detail"]


@check("plugged in again: frames and force return without a restart")
def replugged():
    pid = main_pid()
    kinect.tell("replug")
    reaches("force", lambda now: now["mode"] == "engaged" and force_n(now) > 0.5, 20)
    expect(main_pid() == pid, "the daemon was restarted")


@check("frames with lost packets are counted and not used")
def lost_packets():
    before = status()["camera"]
    kinect.tell("lose 3")
    now = reaches("damaged frames are counted", lambda now: now["camera"]["damagedFrames"] >= before["damagedFrames"] + 10)
    used = now["tick"]["sceneFrame"]
    reaches("more damaged frames", lambda now: now["camera"]["damagedFrames"] >= before["damagedFrames"] + 15)
    expect(status()["tick"]["sceneFrame"] <= used + 1, "damaged frames were used")
    kinect.tell("lose off")
    reaches("intact frames are used again", lambda now: now["tick"]["sceneFrame"] > used + 10)


@check("garbage in packet headers leads to no force that is not finite and no end")
def garbage():
    kinect.tell("garbage")
    replies = monitor(1.0)
    kinect.tell("resume")
    for reply in replies:
        expect(math.isfinite(force_n(reply["status"])) and force_n(reply["status"]) <= 4.0001, str(reply["status"]["tick"]))
    reaches("frames again", streaming, 20)


@check("a camera that stops sending is lost, with a remedy, and found again when it sends")
def stalled():
    kinect.tell("stall")
    now = reaches("the camera is lost", lambda now: now["camera"]["state"] == "lost", 20)
    detail = now["camera"]["detail"]
    expect("stopped sending frames" in detail or "does not respond" in detail, detail)
    kinect.tell("resume")
    reaches("frames again", streaming, 30)
    return now["camera"]["detail"]


@check("a camera that answers no request hangs the opening call, not the daemon; replugging it helps")
def mute():
    pid = main_pid()
    kinect.tell("unplug")
    reaches("the camera is lost", lambda now: now["camera"]["state"] == "lost")
    kinect.tell("mute")
    kinect.tell("replug")
    now = reaches("it says so", lambda now: "does not respond" in now["camera"]["detail"], 30)
    ticks = now["loop"]["counters"]["ticks"]
    time.sleep(4.5)  # more than twice the watchdog's patience
    expect(is_active() and main_pid() == pid, "the daemon was restarted")
    expect(status()["loop"]["counters"]["ticks"] > ticks + (3500 if counted() else 350), "the loop stood")
    kinect.tell("unplug")
    kinect.tell("resume")
    kinect.tell("replug")
    reaches("frames again", streaming, 30)
    return now["camera"]["detail"]


@check("the service stops in time while the opening call hangs")
def stop_while_mute():
    kinect.tell("unplug")
    kinect.tell("mute")
    kinect.tell("replug")
    reaches("it hangs", lambda now: "does not respond" in now["camera"]["detail"], 30)
    must("systemctl", "stop", "hapticd.service")
    expect("timeout" not in must("systemctl", "show", "-p", "Result", "hapticd.service"), "it had to be killed")
    kinect.tell("unplug")
    kinect.tell("resume")
    kinect.tell("replug")
    must("systemctl", "start", "hapticd.service")
    reaches("frames again", streaming, 30)


@check("the kernel's own driver has the camera first: it is taken over")
def kernel_driver_first():
    kinect.tell("unplug")
    must("modprobe", "gspca_kinect")
    kinect.tell("replug")
    reaches("frames", streaming, 20)
    must("modprobe", "-r", "gspca_kinect")


@check("of two cameras the one of the configured serial number is used, and without one status says so")
def two_cameras():
    second = devices.Kinect(serial="B00000000000002B", name="kinect2")
    try:
        configure(BOX.replace("freenect}", "freenect, serial: B00000000000002B}"))
        now = reaches("frames", streaming, 20)
        expect("B00000000000002B" in now["camera"]["identity"], now["camera"]["identity"])
        configure(BOX.replace("freenect}", "freenect, serial: C00000000000003C}"))
        now = reaches("it is missed", lambda now: "C00000000000003C" in now["camera"]["detail"], 20)
        for serial in ("A00000000000001A", "B00000000000002B"):
            expect(serial in now["camera"]["detail"], "does not name " + serial + ": " + now["camera"]["detail"])
        configure(BOX)
        now = reaches("frames", streaming, 20)
        expect(any("camera.serial" in line for line in now["warnings"]), str(now["warnings"]))
        return now["warnings"][0]
    finally:
        second.end()


@check("kill -9 while the camera streams: the new daemon opens it again")
def killed_while_streaming():
    old = main_pid()
    must("kill", "-9", str(old))
    wait_for("another daemon", lambda: main_pid() not in (0, old))
    reaches("frames", streaming, 20)

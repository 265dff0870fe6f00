# SPDX-License-Identifier: Apache-2.0
"""Handles on HID: a controller with our reports and a SpaceMouse, over the kernel's uhid and USB gadgets and hidraw."""

import math
import os
import signal
import time

import devices
import installation
from lab import (DEPTH_TIMEOUT_S, check, configure, counted, engage, expect, force_n, is_active, main_pid,
                 monitor, must, reaches, status, wait_for, write)

# A wall that the hand is 0.2 m away from at first, and what it aims at to press.
SCENE = installation.SIMPLE.replace("noise: off", "noise: off, scene: plane") + "force: {law: nearest_springs}\n"
HANDLE = "handle: {driver: hid, position_z_m: -0.8}\n"
AWAY, PRESSING = "aim 0 0 0", "aim 0 0 -0.185"
# The firmware's watchdog has 20 ms, the driver's farewell less; the rest is the guest's.
ZERO_WITHIN_S = 0.05

handle = None


def prepare():
    global handle
    configure(SCENE + HANDLE)
    reaches("the handle is missed", lambda now: now["handle"]["state"] == "absent" and "1209:0001" in now["handle"]["detail"])
    handle = devices.HidHandle()


def finish():
    if handle:
        handle.end()
    configure(installation.SIMPLE)


def present(now):
    return now["handle"]["state"] == "present"


def press(device=None):
    """Engages in the free and lets the hand press; there is a force at the device afterwards."""
    device = device or handle
    device.tell(AWAY)
    reaches("the hand is away from the wall", lambda now: now["tick"]["hipMInWorld"]["z"] > -0.81)
    wait_for("engaging is accepted", lambda: engage())
    device.tell(PRESSING)
    wait_for("the device exerts force", lambda: device.stats()["force_n"] > 0.2)


@check("a controller that is plugged in long after the start is found by udev and opened through hidraw")
def found():
    now = reaches("the handle", present)
    nodes = [name for name in os.listdir("/sys/class/hidraw")]
    expect(len(nodes) == 1, str(nodes))
    node = must("stat", "-c", "%a %G", "/dev/" + nodes[0]).strip()
    expect(node == "660 hapticd", f"the node is {node}")
    user = must("ps", "-o", "user=", "-p", str(main_pid())).strip()
    expect(user == "hapticd", f"the service runs as {user}")
    expect("T1" in now["handle"]["identity"] and not now["handle"]["detail"], str(now["handle"]))
    reaches("the loop feels it", lambda now: abs(now["tick"]["hipMInWorld"]["z"] + 0.8) < 0.001)


@check("hapticctl doctor knows the controller", only_counted=True)
def doctor():
    said = must("sh", "-c", "hapticctl doctor || true")
    expect("hapticd test controller at /dev/hidraw" in said, said)


@check("forces reach the device, and the hand feels the wall that the loop computes")
def forces():
    press()
    time.sleep(0.5)
    now, stats = status(), handle.stats()
    expect(abs(force_n(now) - stats["force_n"]) < 0.05 * max(1, force_n(now)), f"{force_n(now)} N and {stats}")
    expect(stats["invalid"] == 0, str(stats))
    handle.tell("button 3")
    time.sleep(0.1)
    handle.tell("button 3")
    handle.tell(AWAY)
    reaches("no force", lambda now: force_n(now) == 0)
    return f"{stats['force_n']:.2f} N"


@check("exchanged with at 1 kHz without a loss beside a streaming Kinect", only_counted=True)
def exchange():
    kinect = devices.Kinect(name="kinect-beside")
    try:
        configure(SCENE.replace("driver: synthetic", "driver: freenect").replace(
            "depth_timeout_s: 5", f"depth_timeout_s: {DEPTH_TIMEOUT_S}") + HANDLE)
        reaches("the camera streams", lambda now: now["camera"]["state"] == "streaming" and present(now), 20)
        time.sleep(0.5)
        began, device, link = time.monotonic(), handle.stats(), status()["handle"]["link"]
        frames = status()["camera"]["frames"]
        time.sleep(3)
        seconds, now, end = time.monotonic() - began, status(), handle.stats()
        sent, got = end["sent"] - device["sent"], end["received"] - device["received"]
        lost = now["handle"]["link"]["lost"] - link["lost"]
        said = (f"{sent / seconds:.0f} reports/s in and {got / seconds:.0f} out, {lost} and {end['lost'] - device['lost']} "
                f"lost, round trip p99 {now['handle']['link']['roundTrip']['p99Ns'] / 1e6:.2f} ms, "
                f"{now['camera']['frames'] - frames} frames")
        expect(end["not_taken"] == device["not_taken"] and end["missed_ticks"] - device["missed_ticks"] < 3, f"{device} {end}")
        expect(lost == 0 and end["lost"] == device["lost"], said)
        expect(sent / seconds > 995 and got / seconds > 990, said)
        expect(now["camera"]["frames"] - frames > 60, said)
        return said
    finally:
        kinect.end()
        configure(SCENE + HANDLE)
        reaches("the handle", present)


@check("unplugged while engaged: no force, the daemon goes on and says what to do")
def unplugged():
    press()
    pid = main_pid()
    handle.tell("unplug")
    now = reaches("the force is held", lambda now: now["mode"] != "engaged" and force_n(now) == 0)
    now = reaches("the handle is lost", lambda now: now["handle"]["state"] == "lost")
    expect(is_active() and main_pid() == pid, "the daemon was restarted")
    expect("connect" in now["handle"]["detail"] or "cable" in now["handle"]["detail"], now["handle"]["detail"])
    return f"{now['mode']}, {now['cause']}; {now['handle']['detail']}"


@check("plugged in again: the handle is back, and there is no force before somebody engages")
def replugged():
    handle.tell("replug")
    reaches("the handle", present)
    sent = handle.stats()["sent"]
    wait_for("reports are exchanged", lambda: handle.stats()["sent"] > sent + 300)
    now, stats = status(), handle.stats()
    expect(now["mode"] == "idle" and now["cause"] == "handle_replaced", f"{now['mode']}, {now['cause']}")
    expect(stats["force_n"] == 0, str(stats))
    press()


@check("a device that falls silent: no force, and status says so; speaking again it waits for engage")
def muted():
    press()
    handle.tell("mute")
    began_ns = time.monotonic_ns()
    now = reaches("the handle is lost", lambda now: now["handle"]["state"] == "lost" and force_n(now) == 0)
    expect("no reports" in now["handle"]["detail"], now["handle"]["detail"])
    stats = wait_for("the motors are off", lambda: handle.stats() if handle.stats()["force_n"] == 0 else None)
    if counted():
        expect(stats["last_force_ns"] - began_ns < ZERO_WITHIN_S * 1e9, f"{(stats['last_force_ns'] - began_ns) / 1e6} ms")
    handle.tell("play")
    reaches("the handle", present)
    time.sleep(0.3)
    expect(handle.stats()["force_n"] == 0, "there was force before somebody engaged")
    press()
    return now["handle"]["detail"]


@check("garbage is counted and refused: no force that is not finite, no end", only_counted=True)
def garbage():
    pid, before = main_pid(), status()["handle"]["rejected"]
    handle.tell("garbage")
    replies = monitor(1.0)
    for reply in replies:
        expect(math.isfinite(force_n(reply["status"])) and force_n(reply["status"]) <= 4.0001, str(reply["status"]["tick"]))
    now = reaches("it is refused", lambda now: now["handle"]["state"] == "lost" and now["handle"]["rejected"] > before + 100)
    handle.tell("play")
    reaches("the handle", present)
    expect(main_pid() == pid, "the daemon was restarted")
    return now["handle"]["detail"]


@check("a controller that finds its origin or has a fault gets no force, and status says why", only_counted=True)
def fault():
    handle.tell("home")
    reaches("calibrating", lambda now: now["handle"]["state"] == "calibrating")
    handle.tell("home")
    reaches("the handle", present)
    press()
    handle.tell("fault 7")
    now = reaches("the fault", lambda now: now["handle"]["state"] == "lost" and "fault 7" in now["handle"]["detail"])
    expect(handle.stats()["force_n"] == 0, str(handle.stats()))
    handle.tell("fault 0")
    reaches("the handle", present)
    return now["handle"]["detail"]


def dies(name, kill):
    """What is left of the force at the device when the daemon stops running."""
    press()
    old = main_pid()
    began_ns = time.monotonic_ns()
    kill(old)
    stats = wait_for("the motors are off", lambda: handle.stats() if handle.stats()["force_n"] == 0 else None)
    after_ms = (stats["last_force_ns"] - began_ns) / 1e6
    if counted():
        expect(after_ms < ZERO_WITHIN_S * 1e3, f"{name}: there was force for {after_ms:.1f} ms")
    wait_for("another daemon", lambda: is_active() and main_pid() not in (0, old), 15)
    reaches("the handle", present)
    time.sleep(0.3)
    expect(handle.stats()["force_n"] == 0, "the new daemon exerted force before somebody engaged")
    return f"{after_ms:.1f} ms"


@check("kill -9 of the daemon while engaged: the device's watchdog takes the force away", only_counted=True)
def killed():
    return dies("SIGKILL", lambda pid: os.kill(pid, signal.SIGKILL))


@check("SIGSTOP of the daemon while engaged: the device's watchdog takes the force away")
def stopped():
    must("systemctl", "reset-failed", "hapticd.service")
    return dies("SIGSTOP", lambda pid: os.kill(pid, signal.SIGSTOP))


@check("systemctl stop while engaged: the device is told to switch the motors off")
def stop_service():
    must("systemctl", "reset-failed", "hapticd.service")
    press()
    must("systemctl", "stop", "hapticd.service")
    stats = handle.stats()
    expect(stats["force_n"] == 0, str(stats))
    must("systemctl", "start", "hapticd.service")
    reaches("the handle", present)


@check("a node that is not for the group: status gives the udev rule that is missing", only_counted=True)
def forbidden():
    rule = "/run/udev/rules.d/99-lab.rules"
    os.makedirs(os.path.dirname(rule), exist_ok=True)
    handle.tell("unplug")
    write(rule, 'SUBSYSTEM=="hidraw", GROUP="root", MODE="0600"\n')
    must("udevadm", "control", "--reload")
    try:
        handle.tell("replug")
        now = reaches("it says so", lambda now: "73-handle.rules" in now["handle"]["detail"])
    finally:
        os.remove(rule)
        must("udevadm", "control", "--reload")
    must("udevadm", "trigger", "--action=change", "--subsystem-match=hidraw")
    reaches("the handle", present)
    return now["handle"]["detail"]


@check("of two controllers the one of the configured serial number is used, and without one status says so", only_counted=True)
def two_handles():
    second = devices.HidHandle("T2", "handle2")
    try:
        configure(SCENE + HANDLE.replace("driver: hid", "driver: hid, serial: T2"))
        now = reaches("the handle", present)
        expect("T2" in now["handle"]["identity"] and not now["handle"]["advice"], str(now["handle"]))
        wait_for("it is exchanged with", lambda: second.stats()["received"] > 100)
        configure(SCENE + HANDLE.replace("driver: hid", "driver: hid, serial: T3"))
        now = reaches("it is missed", lambda now: "T3" in now["handle"]["detail"])
        expect("T1, T2" in now["handle"]["detail"], now["handle"]["detail"])
        configure(SCENE + HANDLE)
        now = reaches("the handle", present)
        expect("handle.serial" in now["handle"]["advice"], str(now["handle"]))
        return now["handle"]["advice"]
    finally:
        second.end()


@check("a SpaceMouse moves the HIP and status says that forces are discarded", only_counted=True)
def spacemouse():
    mouse = devices.HidHandle("S1", "spacemouse", ("--spacemouse",))
    try:
        configure(SCENE + "handle: {driver: hid, position_z_m: -0.8}\n"
                  "hid_handle: {kind: spacemouse, device: 256f:c62e, full_speed_m_per_s: 0.1}\n")
        now = reaches("the handle", present)
        expect(not now["handle"]["exertsForce"] and "discarded" in now["handle"]["advice"], str(now["handle"]))
        mouse.tell("push 350 0 -350")
        reaches("right and up", lambda now: now["tick"]["hipMInWorld"]["x"] > 0.05 and now["tick"]["hipMInWorld"]["y"] > 0.05)
        mouse.tell("push 0 0 0")
        time.sleep(0.1)
        rest = status()["tick"]["hipMInWorld"]
        time.sleep(0.3)
        expect(status()["tick"]["hipMInWorld"] == rest, "it moves on after the cap was released")
        if counted():
            before = status()["handle"]["measurements"]
            began = time.monotonic()
            time.sleep(2)
            rate_hz = (status()["handle"]["measurements"] - before) / (time.monotonic() - began)
            # the counts in status are up to 250 ms old
            expect(800 < rate_hz < 1200, f"{rate_hz:.0f} measurements/s")
        return now["handle"]["advice"]
    finally:
        mouse.end()


@check("the controller as a USB gadget: found, opened, exchanged with, unplugged and plugged in again")
def gadget():
    handle.tell("unplug")
    usb = devices.HidGadget()
    try:
        configure(SCENE + HANDLE)
        now = reaches("the handle", present, 20)
        expect("G1" in now["handle"]["identity"], now["handle"]["identity"])
        press(usb)
        before = usb.stats()
        time.sleep(1)
        stats = usb.stats()
        usb.unplug()
        reaches("the handle is lost", lambda now: now["handle"]["state"] == "lost" and force_n(now) == 0)
        usb.plug()
        reaches("the handle", present, 20)
        return (f"{stats['received'] - before['received']} output reports in a second, {stats['invalid']} invalid, "
                f"{stats['lost'] - before['lost']} lost")
    finally:
        usb.end()
        handle.tell("replug")

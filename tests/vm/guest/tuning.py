# SPDX-License-Identifier: Apache-2.0
"""Checking and setting up a box for real time."""

import json
import os

import devices
import installation
from lab import (CONFIGURATION, check, configure, expect, has_realtime_kernel, is_active, must, reaches, read, run,
                 unit_property, write)

BOX = "camera: {driver: freenect}\n"
kinect = None


def prepare():
    global kinect
    configure(BOX)
    kinect = devices.Kinect(name="tuning-kinect")
    reaches("frames", lambda now: now["camera"]["state"] == "streaming", 20)


def finish():
    kinect.end()
    configure(installation.SIMPLE)


@check("hapticctl doctor: nothing fails on a box as installed, and what it finds is true")
def doctor():
    found = {line["name"]: line for line in json.loads(must("hapticctl", "--json", "doctor", timeout=120))}
    expect(not [line for line in found.values() if line["verdict"] == "fail"], str(found))
    text = must("hapticctl", "doctor", timeout=120)
    for name in ("kernel", "service", "daemon"):
        expect(found[name]["verdict"] == "ok" or found[name]["remedy"] or name == "daemon", str(found[name]))
    expected = "ok" if has_realtime_kernel() else "warn"
    expect("PREEMPT_RT" in found["kernel"]["fact"] and found["kernel"]["verdict"] == expected, str(found["kernel"]))
    expect("045e:02ae" in text or "Kinect" in text, text)


@check("hapticctl doctor finds a stopped service and a device that everybody may write to")
def doctor_finds():
    node = must("sh", "-c", "for d in /sys/bus/usb/devices/*; do [ \"$(cat $d/idProduct 2>/dev/null)\" = 02ae ] && "
                "echo /dev/bus/usb/$(printf %03d $(cat $d/busnum))/$(printf %03d $(cat $d/devnum)); done; true").strip()
    os.chmod(node, 0o666)
    must("systemctl", "stop", "hapticd.service")
    done = run("hapticctl", "doctor", timeout=120)
    os.chmod(node, 0o660)
    expect(not is_active(), "looking has started the service")
    must("systemctl", "start", "hapticd.service")
    service = [line for line in done.stdout.splitlines() if "systemctl start hapticd" in line]
    world = [line for line in done.stdout.splitlines() if "666" in line]
    expect(service and not service[0].startswith("ok"), done.stdout)
    expect(world and not world[0].startswith("ok"), done.stdout)


@check("hapticd-realtime-setup: refuses one CPU; with two, apply moves the daemon and revert restores every file")
def realtime_setup():
    if os.cpu_count() == 1:
        done = run("hapticd-realtime-setup", "apply")
        expect(done.returncode == 1 and "one CPU" in done.stdout, done.stdout)
        return "one CPU: refused"
    sums = ("sh", "-c", "find /etc -type f -o -type l | sort | xargs -d '\\n' sha256sum 2>/dev/null; find /etc -type l")
    before = must(*sums)
    must("hapticd-realtime-setup", "apply")
    write(CONFIGURATION, read(CONFIGURATION) + "loop: {cpu: 1}\n")  # as it advises
    must("systemctl", "restart", "hapticd.service")
    expect(unit_property("CPUAffinity") == "0", unit_property("CPUAffinity"))
    now = reaches("ticks", lambda now: now["loop"]["counters"]["ticks"] > 100)
    expect(now["loop"]["cpu"] == 1, f"the loop runs on CPU {now['loop']['cpu']}")
    must("hapticd-realtime-setup", "revert")
    write(CONFIGURATION, BOX)
    expect(must(*sums) == before, "files differ after revert")
    must("systemctl", "restart", "hapticd.service")
    return "applied and reverted"

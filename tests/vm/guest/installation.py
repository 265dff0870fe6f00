# SPDX-License-Identifier: Apache-2.0
"""The package is installed as a user would, then the guest is started again: what follows is a box after power-on."""

import os

from lab import (LAB, SAFETY, check, counted, expect, is_active, must, read, reaches, run, status, unit_property,
                 wait_for, write)

MARK = "/var/lib/lab-installed"
PACKAGE = LAB + "/hapticd.deb"
# Without devices, and with few frames, which cost an emulated CPU much.
SIMPLE = ("camera: {driver: synthetic}\nsynthetic: {noise: off, frame_rate_hz: 2}\n"
          f"safety: {{depth_timeout_s: 5, {SAFETY}}}\n")


def prepare():
    if os.path.exists(MARK):
        return
    # apt costs an emulated CPU seconds; once is enough.
    by_apt = ("apt-get", "install", "-y", "--no-install-recommends", PACKAGE)
    done = run(*(("dpkg", "-i", PACKAGE) if counted() else by_apt), timeout=300)
    write(MARK, done.stdout)
    if done.returncode == 0:
        write(MARK + ".active", "yes" if is_active() else "no")
        write(MARK + ".camera", status()["camera"]["detail"] if is_active() else "")
    os.sync()
    write("/run/lab-starts-again", "")
    must("systemctl", "reboot")
    raise SystemExit


@check("the package installs without complaint and starts the service")
def installs():
    expect(os.path.exists(MARK + ".active"), "installing failed: " + read(MARK)[-800:])
    expect(read(MARK + ".active") == "yes", "the service was not active after installing: " + read(MARK)[-800:])


@check("the service starts at boot and becomes ready")
def starts_at_boot():
    wait_for("hapticd.service is active", is_active, 20)
    ready_us = int(unit_property("ActiveEnterTimestampMonotonic"))
    reaches("the loop ticks", lambda now: now["loop"]["counters"]["ticks"] > 10)
    return f"{ready_us / 1e6:.2f} s after the kernel's start"


@check("the system is healthy after boot")
def healthy():
    failed = must("systemctl", "list-units", "--failed", "--plain", "--no-legend")
    expect(not failed.strip(), failed)


@check("the service runs under its own user, real-time, locked and pinned, without capabilities")
def real_time_without_privileges():
    now = reaches("privileges are known", lambda now: now["mode"] != "starting")
    loop = now["loop"]
    expect(loop["realtimeScheduling"] and loop["memoryLocked"] and loop["cpu"] is not None, str(loop))
    process = read(f"/proc/{unit_property('MainPID')}/status")
    user = must("id", "-u", "hapticd").strip()
    expect(f"Uid:\t{user}\t{user}" in process, process)
    for line in process.splitlines():
        if line.startswith(("CapPrm", "CapEff", "CapBnd")):
            expect(int(line.split()[1], 16) == 0, line)


@check("a box without a camera says what to plug in")
def without_camera():
    now = reaches("the camera is missed", lambda now: "Kinect" in now["camera"]["detail"], 20)
    expect(now["camera"]["state"] == "absent" and "045e:02ae" in now["camera"]["detail"], str(now["camera"]))

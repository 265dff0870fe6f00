# SPDX-License-Identifier: Apache-2.0
"""Upgrade, removal and purge of the package, by dpkg: apt is slow on an emulated CPU."""

import os

import installation
from lab import (CONFIGURATION, LAB, STATUS_SOCKET, check, configure, expect, is_active, main_pid, must, read, run,
                 wait_for)


def prepare():
    configure(installation.SIMPLE + "force: {stiffness_n_per_m: 444}\n")


@check("an upgrade restarts the service and keeps the configuration")
def upgrade():
    pid = main_pid()
    must("dpkg", "-i", LAB + "/hapticd-next.deb", timeout=300)
    wait_for("the new daemon is ready", lambda: is_active() and main_pid() not in (0, pid), 20)
    expect("444" in read(CONFIGURATION), "the configuration was replaced")
    expect("444" in must("hapticctl", "get", "force.stiffness_n_per_m"), "the configuration is not in force")


@check("removal stops the service and leaves the configuration")
def remove():
    must("dpkg", "--remove", "hapticd", timeout=300)
    expect(not is_active(), "the service is still active")
    expect(not os.path.exists(STATUS_SOCKET), "the socket is still there")
    expect(os.path.exists(CONFIGURATION), "the configuration is gone")
    expect(run("pgrep", "-x", "hapticd").returncode == 1, "a daemon is still there")


@check("installed again after removal it runs with the old configuration")
def reinstall():
    must("dpkg", "-i", installation.PACKAGE, timeout=300)
    wait_for("the daemon is ready", is_active, 20)
    expect("444" in must("hapticctl", "get", "force.stiffness_n_per_m"), "the configuration is not in force")


@check("purge leaves nothing behind")
def purge():
    must("dpkg", "--purge", "hapticd", timeout=300)
    places = ("/etc", "/run", "/var/lib", "/usr/bin", "/usr/sbin", "/usr/libexec", "/usr/lib/systemd", "/usr/lib/udev",
              "/usr/lib/sysusers.d", "/usr/lib/tmpfiles.d", "/usr/share/man", "/usr/share/doc/hapticd")
    found = run("find", *places, "-xdev", "-iname", "*hapticd*").stdout.split("\n")
    # dpkg's and systemd's own records of what was once there
    left = [path for path in found if path.startswith("/") and "/dpkg/" not in path and "/apt/" not in path
            and not path.startswith(("/var/lib/systemd/", "/var/lib/lab-", "/run/systemd/", "/run/udev/"))]
    expect(not left, "left behind: " + " ".join(left))
    expect(not must("systemctl", "list-units", "--failed", "--plain", "--no-legend").strip(), "a unit failed")

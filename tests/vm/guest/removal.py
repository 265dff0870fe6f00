"""Upgrade, removal and purge of the package."""

import os

import installation
from lab import (CONFIGURATION, LAB, STATUS_SOCKET, check, configure, expect, is_active, main_pid, must, reaches, read, run,
                 status, wait_for, write)


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
    must("apt-get", "remove", "-y", "hapticd", timeout=300)
    expect(not is_active(), "the service is still active")
    expect(not os.path.exists(STATUS_SOCKET), "the socket is still there")
    expect(os.path.exists(CONFIGURATION), "the configuration is gone")
    expect(run("pgrep", "-x", "hapticd").returncode == 1, "a daemon is still there")


@check("installed again after removal it runs with the old configuration")
def reinstall():
    must("apt-get", "install", "-y", "--no-install-recommends", installation.PACKAGE, timeout=300)
    wait_for("the daemon is ready", is_active, 20)
    expect("444" in must("hapticctl", "get", "force.stiffness_n_per_m"), "the configuration is not in force")


@check("purge leaves nothing behind")
def purge():
    must("apt-get", "purge", "-y", "hapticd", timeout=300)
    left = must("sh", "-c", "find /etc /usr /lib /var/lib /var/log /run -xdev -iname '*hapticd*' ! -path '/usr/share/*' "
                "! -path '/var/lib/systemd/*' ! -path '/var/log/journal/*'").split()
    left = [path for path in left if "/dpkg/" not in path and "/apt/" not in path and "lab-" not in path]
    expect(not left, "left behind: " + " ".join(left))
    expect(not must("systemctl", "list-units", "--failed", "--plain", "--no-legend").strip(), "a unit failed")

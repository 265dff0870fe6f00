# SPDX-License-Identifier: Apache-2.0
"""The service manager and the daemon: watchdog, restart, reload, state in the journal."""

import os
import signal
import time
import urllib.request

import installation
from lab import (CONFIGURATION, Varlink, check, configure, expect, is_active, journal, main_pid, must, reaches, run,
                 set_parameters, unit_property, wait_for, write)


def prepare():
    configure(installation.SIMPLE)


def comes_back(old_pid, seconds):
    began = time.monotonic()
    wait_for("another main process is ready", lambda: is_active() and main_pid() not in (0, old_pid), seconds, 0.05)
    return time.monotonic() - began


@check("kill -9 of the daemon: it is started again")
def killed():
    pid = main_pid()
    os.kill(pid, signal.SIGKILL)
    took_s = comes_back(pid, 10)
    return f"ready again after {took_s:.2f} s"


@check("SIGSTOP of the daemon: the watchdog ends it and it is started again")
def stopped():
    pid = main_pid()
    os.kill(pid, signal.SIGSTOP)
    took_s = comes_back(pid, 15)
    expect("watchdog" in journal("-n", "50").lower(), "no word of the watchdog in the journal")
    return f"ready again after {took_s:.2f} s"


@check("a client that waits during a restart is served by the new daemon")
def queued_client():
    must("systemctl", "stop", "hapticd.service")
    with Varlink() as client:  # connecting starts the service again
        answer = client.call("io.hapticd.Status.GetStatus")
    expect(answer["status"]["loop"]["counters"]["ticks"] >= 1, str(answer))
    wait_for("the service is active", is_active)


@check("reload applies live parameters, reports those that wait for a restart, and keeps the process")
def reload():
    pid = main_pid()
    write(CONFIGURATION, installation.SIMPLE + "force: {stiffness_n_per_m: 321}\nloop: {priority: 70}\n")
    must("systemctl", "reload", "hapticd.service")
    now = reaches("the notice about the priority", lambda now: any("loop.priority" in line for line in now["warnings"]))
    value = must("hapticctl", "get", "force.stiffness_n_per_m")
    expect("321" in value, value)
    expect("restart" in " ".join(now["warnings"]), str(now["warnings"]))
    expect(main_pid() == pid and is_active(), "the process changed")


@check("reload of a bad file changes nothing and says what is wrong with it")
def bad_reload():
    write(CONFIGURATION, "force: {stiffness_n_per_m: 99999}\n")
    run("systemctl", "reload", "hapticd.service")
    now = reaches("the refusal", lambda now: any("not reloaded" in line for line in now["warnings"]))
    expect("99999" in " ".join(now["warnings"]), str(now["warnings"]))
    expect("321" in must("hapticctl", "get", "force.stiffness_n_per_m"), "the value changed")
    expect(is_active(), "the service ended")


@check("a bad file keeps the service from starting, once, and the journal names the line")
def bad_start():
    run("systemctl", "restart", "hapticd.service")
    wait_for("the service has failed", lambda: unit_property("ActiveState") == "failed", 10)
    expect(unit_property("ExecMainStatus") == "78", unit_property("ExecMainStatus"))
    expect(int(unit_property("NRestarts")) == 0, "it was started again though nothing has changed")
    lines = journal("-n", "30")
    expect("hapticd.yaml:1" in lines and "99999" in lines, lines)
    configure(installation.SIMPLE)


@check("changes are in the journal with who made them, the old and the new value")
def structured():
    set_parameters(force__stiffness_n_per_m=432)
    fields = must("journalctl", "--no-pager", "-o", "export", "HAPTICD_PARAMETER=force.stiffness_n_per_m", "-n", "1")
    for field in ("HAPTICD_EVENT=parameter", "HAPTICD_OLD=500", "HAPTICD_NEW=432", "HAPTICD_UID=0", "PRIORITY=5"):
        expect(field in fields, f"{field} is missing in: {fields}")


@check("systemctl status shows what the box does")
def state_line():
    expect("camera streaming" in wait_for("the state is shown",
                                          lambda: unit_property("StatusText") if "streaming" in unit_property(
                                              "StatusText") else None), "")


@check("hapticd-metrics.socket answers a collector on 127.0.0.1 in OpenMetrics", only_counted=True)
def metrics():
    must("systemctl", "start", "hapticd-metrics.socket")
    with urllib.request.urlopen("http://127.0.0.1:9477/metrics", timeout=60) as reply:
        kind, text = reply.headers["Content-Type"], reply.read().decode()
    must("systemctl", "stop", "hapticd-metrics.socket")
    expect(kind.startswith("application/openmetrics-text"), kind)
    expect("\nhapticd_loop_ticks_total " in text and text.endswith("# EOF\n"), text[-300:])
    must("systemd-analyze", "security", "--threshold=20", "hapticd-metrics@.service")
    return f"{len(text)} bytes"


@check("the unit's exposure is below 2.0 and the units are valid")
def exposure():
    must("systemd-analyze", "security", "--threshold=20", "hapticd.service")
    said = must("systemd-analyze", "verify", "--man=no", "hapticd.service", "hapticd-status.socket", "hapticd-control.socket")
    expect("hapticd" not in said, said)

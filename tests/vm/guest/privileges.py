# SPDX-License-Identifier: Apache-2.0
"""Who may do what."""

import contextlib
import os
import pwd
import signal
import socket
import time

import installation
from lab import CONTROL_SOCKET, STATUS_SOCKET, Varlink, check, configure, expect, main_pid, must, run


def prepare():
    configure(installation.SIMPLE)
    must("useradd", "--no-create-home", "stranger")
    must("useradd", "--no-create-home", "--groups", "haptic", "member")
    must("useradd", "--no-create-home", "--groups", "haptic-view", "viewer")


def finish():
    must("userdel", "viewer")
    must("userdel", "stranger")
    must("userdel", "member")


@check("an unprivileged user reads the status")
def stranger_reads():
    said = must("hapticctl", "status", user="stranger")
    expect("force loop" in said, said)


@check("an unprivileged user changes nothing and is told which group it takes")
def stranger_changes_nothing():
    for command in (("engage",), ("set", "force.stiffness_n_per_m=400")):
        done = run("hapticctl", *command, user="stranger")
        expect(done.returncode != 0 and "haptic" in done.stdout, f"{command}: {done.returncode} {done.stdout}")
    done = run("hapticctl", "--socket", STATUS_SOCKET, "engage", user="stranger")
    expect(done.returncode != 0, done.stdout)
    expect("500" in must("hapticctl", "get", "force.stiffness_n_per_m"), "the value changed")


@check("a member of the group haptic changes parameters and engages")
def member_changes():
    must("hapticctl", "set", "force.stiffness_n_per_m=400", user="member")
    expect("400" in must("hapticctl", "get", "force.stiffness_n_per_m", user="stranger"), "not set")
    must("hapticctl", "engage", user="member")
    must("hapticctl", "disengage", user="member")


@check("the depth image is for the groups haptic and haptic-view; the latter changes nothing")
def depth_image():
    denied = run("hapticctl", "snapshot", "--force", "--png", "/tmp/stranger.png", user="stranger")
    expect(denied.returncode != 0 and "haptic-view" in denied.stdout, f"{denied.returncode} {denied.stdout}")
    for user in ("member", "viewer"):
        must("hapticctl", "snapshot", "--force", "--png", f"/tmp/{user}.png", user=user)
        os.remove(f"/tmp/{user}.png")
    done = run("hapticctl", "engage", user="viewer")
    expect(done.returncode != 0, done.stdout)


def flood_forever(connections):
    """Fills each connection with calls, hangs up without reading, connects again."""
    calls = b'{"method":"io.hapticd.Status.GetParameters","oneway":true}\0' * 4000
    sockets = [None] * connections
    turn = 0
    while True:
        if sockets[turn]:
            sockets[turn].close()
        sockets[turn] = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        sockets[turn].setblocking(False)
        with contextlib.suppress(OSError):  # the line of those who wait may be full
            sockets[turn].connect(STATUS_SOCKET)
            while sockets[turn].send(calls) > 0:
                pass
        turn = (turn + 1) % connections


@contextlib.contextmanager
def flooding(user, connections):
    stranger = pwd.getpwnam(user)
    child = os.fork()
    if child == 0:
        try:
            os.setgroups([])
            os.setgid(stranger.pw_gid)
            os.setuid(stranger.pw_uid)
            flood_forever(connections)
        finally:
            os._exit(1)
    try:
        yield
        expect(os.waitpid(child, os.WNOHANG) == (0, 0), "the flood ended early")
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)
        with contextlib.suppress(ChildProcessError):
            os.waitpid(child, 0)


@check("40 connections of an unprivileged user that flood the status socket delay neither the watchdog nor disengage",
       only_counted=True)
def flood():
    configure(installation.SIMPLE)  # a new start: the longest gap is counted from there
    pid = main_pid()
    longest_s = 0.0
    with flooding("stranger", 40):
        for _ in range(30):
            time.sleep(0.1)
            with Varlink(CONTROL_SOCKET) as client:
                client.call("io.hapticd.Control.Engage", insideSurface=True)
            began = time.monotonic()
            with Varlink(CONTROL_SOCKET) as client:
                client.call("io.hapticd.Control.Disengage")
            longest_s = max(longest_s, time.monotonic() - began)
        with Varlink(CONTROL_SOCKET) as client:
            now = client.call("io.hapticd.Status.GetStatus")["status"]
    gap_s = now["control"]["longestGapNs"] * 1e-9
    expect(main_pid() == pid, "the daemon was started again")
    expect(gap_s < 0.5, f"the watchdog waited for {gap_s:.3f} s")
    expect(longest_s < 0.1, f"disengaging took {longest_s:.3f} s")
    expect(now["loop"]["traceTicksDropped"] == 0 and now["control"]["ticksLost"] == 0, str(now["control"]))
    return f"watchdog {gap_s * 1e3:.1f} ms, disengage {longest_s * 1e3:.1f} ms at most"


@check("device nodes belong to the daemon's group and to nobody else")
def sockets():
    expect(must("stat", "-c", "%a %G", CONTROL_SOCKET).strip() == "660 haptic", must("stat", CONTROL_SOCKET))
    expect(must("stat", "-c", "%a", STATUS_SOCKET).strip() == "666", must("stat", STATUS_SOCKET))
    expect(must("stat", "-c", "%a %G", "/dev/cpu_dma_latency").strip() == "660 hapticd",
           must("stat", "/dev/cpu_dma_latency"))

# SPDX-License-Identifier: Apache-2.0
"""Tools of the checks: registering them, running programs, asking the daemon, waiting.

A check is a function marked with @check("sentence"); it fails by raising, best through expect(). Checks run in the order
in which their modules are named in `main`, each on what the ones before left; module.prepare(), if there, runs before the
module's first check and module.finish() after its last one.
"""

import contextlib
import json
import os
import socket
import subprocess
import time

LAB = "/lab"
STATUS_SOCKET = "/run/hapticd/io.hapticd.Status"
CONTROL_SOCKET = "/run/hapticd/io.hapticd.Control"
CONFIGURATION = "/etc/hapticd/hapticd.yaml"

def counted():
    """Whether the guest's clock counts instructions, so that times can be asserted."""
    with open("/proc/cmdline") as line:
        return "lab.boot=counted" in line.read()


def has_realtime_kernel():
    return "-rt-" in os.uname().release


# An emulated CPU in real time starves threads for longer than a real one: there, inputs may be that much older before
# they count as stale.
HANDLE_TIMEOUT_S = 0.01 if counted() else 1
DEPTH_TIMEOUT_S = 0.5 if counted() else 3
# The same holds for the force thread: there, late ticks are no reason for a release.
SAFETY = (f"handle_timeout_s: {HANDLE_TIMEOUT_S}, engage_inside: true"
          + ("" if counted() else ", overrun_burst: 65"))

CHECKS = []


class Failure(Exception):
    pass


def check(sentence, only_counted=False):
    def register(function):
        function.sentence = sentence
        function.only_counted = only_counted
        CHECKS.append(function)
        return function
    return register


def expect(condition, what):
    if not condition:
        raise Failure(what)


# For programs that are to end by themselves; an emulated CPU in real time takes its time.
PATIENCE_S = 60 if counted() else 300


def run(*command, user=None, timeout=PATIENCE_S, stdin=None):
    """Runs a program to its end; never raises for its exit status."""
    if user:
        command = ("/usr/sbin/runuser", "-u", user, "--", *command)
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=timeout,
                          input=stdin)


def must(*command, **options):
    """Runs a program that has to succeed; returns its output."""
    done = run(*command, **options)
    expect(done.returncode == 0, f"{' '.join(command)} ended with {done.returncode}: {done.stdout.strip()[-600:]}")
    return done.stdout


def write(path, text):
    with open(path, "w") as file:
        file.write(text)


def read(path):
    with open(path) as file:
        return file.read()


def wait_for(what, condition, seconds=10, period=0.02):
    """Polls until condition() is true and returns what it returned; an exception counts as false."""
    deadline = time.monotonic() + seconds * (1 if counted() else 6)
    while True:
        last = None
        try:
            result = condition()
            if result:
                return result
        except (OSError, Failure, KeyError, ValueError) as error:
            last = error
        if time.monotonic() > deadline:
            raise Failure(f"not within {seconds} s: {what}" + (f" ({last})" if last else ""))
        time.sleep(period)


class Varlink:
    """A connection to one of the daemon's sockets."""

    def __init__(self, path=STATUS_SOCKET, timeout=10):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.socket.settimeout(timeout)
        self.socket.connect(path)
        self.pending = b""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, method, more=False, **parameters):
        message = {"method": method, "parameters": parameters}
        if more:
            message["more"] = True
        self.socket.sendall(json.dumps(message).encode() + b"\0")

    def receive(self):
        while b"\0" not in self.pending:
            data = self.socket.recv(65536)
            if not data:
                raise OSError("the daemon closed the connection")
            self.pending += data
        message, self.pending = self.pending.split(b"\0", 1)
        reply = json.loads(message)
        if "error" in reply:
            raise Failure(f"{reply['error']}: {json.dumps(reply.get('parameters', {}))}")
        return reply["parameters"]

    def call(self, method, **parameters):
        self.send(method, **parameters)
        return self.receive()


def status():
    with Varlink() as daemon:
        return daemon.call("io.hapticd.Status.GetStatus")["status"]


def set_parameters(**parameters):
    with Varlink(CONTROL_SOCKET) as daemon:
        daemon.call("io.hapticd.Control.SetParameters",
                    parameters={name.replace("__", "."): value for name, value in parameters.items()})


def engage(engaged=True):
    with Varlink(CONTROL_SOCKET) as daemon:
        return daemon.call("io.hapticd.Control." + ("Engage" if engaged else "Disengage"))


def monitor(seconds, interval_ms=20):
    """All replies of a Monitor stream over that time."""
    replies = []
    with Varlink() as daemon:
        daemon.send("io.hapticd.Status.Monitor", more=True, intervalMs=interval_ms)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            replies.append(daemon.receive())
    return replies


def reaches(what, condition, seconds=10):
    """Waits until condition(status) holds; returns that status."""
    def attempt():
        now = status()
        return now if condition(now) else None
    return wait_for(what, attempt, seconds)


def force_n(now):
    force = now["tick"]["commandForceNInWorld"]
    return sum(force[axis] ** 2 for axis in "xyz") ** 0.5


def unit_property(name, unit="hapticd.service"):
    return must("systemctl", "show", "--property", name, "--value", unit).strip()


def main_pid():
    return int(unit_property("MainPID"))


def is_active():
    return unit_property("ActiveState") == "active"


def configure(text):
    """Replaces the configuration and restarts the service; it is ready afterwards."""
    write(CONFIGURATION, text)
    must("systemctl", "reset-failed", "hapticd.service")
    must("systemctl", "restart", "hapticd.service")
    reaches("the daemon answers", lambda now: now["loop"]["counters"]["ticks"] > 0)


def force_thread(pid):
    """The folder of the force thread in /proc."""
    for thread in os.listdir(f"/proc/{pid}/task"):
        if read(f"/proc/{pid}/task/{thread}/comm").strip() == "hapticd-force":
            return f"/proc/{pid}/task/{thread}"
    raise Failure("there is no thread hapticd-force")


def page_faults(folder):
    fields = read(folder + "/stat").rsplit(")", 1)[1].split()
    return int(fields[7]) + int(fields[9])


def journal(*arguments):
    return must("journalctl", "--no-pager", "--unit", "hapticd.service", "--output", "cat", *arguments)


@contextlib.contextmanager
def drop_in(name, text):
    """A drop-in of the service for the time of a `with` block."""
    folder = "/run/systemd/system/hapticd.service.d"
    os.makedirs(folder, exist_ok=True)
    write(f"{folder}/{name}.conf", text)
    must("systemctl", "daemon-reload")
    try:
        yield
    finally:
        os.remove(f"{folder}/{name}.conf")
        must("systemctl", "daemon-reload")

# SPDX-License-Identifier: Apache-2.0
"""The live view: who may look, what it may do, and that the force loop does not notice it."""

import base64
import grp
import http.cookiejar
import json
import os
import signal
import socket
import threading
import time
import urllib.error
import urllib.request

import camera
import devices
import installation
from lab import Varlink, check, configure, expect, main_pid, must, reaches, run, status, unit_property, wait_for

UNIT = "hapticd-view.service"
HOST = "127.0.0.1:8765"
VIEWERS = 4
WINDOW_MS = 15000

kinect = None


def prepare():
    global kinect
    must("useradd", "--no-create-home", "--groups", "haptic-view", "viewer")
    must("useradd", "--no-create-home", "stranger")
    kinect = devices.Kinect(name="view-kinect")
    configure(camera.BOX + "control: {engage_at_start: true}\n")
    reaches("frames", camera.streaming, 20)


def finish():
    must("systemctl", "stop", UNIT)
    configure(installation.SIMPLE)
    kinect.end()
    must("userdel", "viewer")
    must("userdel", "stranger")


def page_address():
    return json.loads(must("hapticctl", "--json", "view", user="viewer"))["page"]


def pid_of_view():
    return int(unit_property("MainPID", UNIT))


def tcp_sockets(pid):
    """The inodes of the TCP sockets that a process has open."""
    opened = set()
    for name in os.listdir(f"/proc/{pid}/fd"):
        target = os.readlink(f"/proc/{pid}/fd/{name}")
        if target.startswith("socket:["):
            opened.add(target[len("socket:["):-1])
    inodes = set()
    for table in ("tcp", "tcp6"):
        with open(f"/proc/net/{table}") as file:
            inodes.update(line.split()[9] for line in file.readlines()[1:])
    return opened & inodes


class Viewer(threading.Thread):
    """A WebSocket client of /live that reads everything and keeps the number of bytes."""

    def __init__(self, token):
        super().__init__(daemon=True)
        self.bytes = 0
        self.connection = socket.create_connection(("127.0.0.1", 8765), timeout=30)
        key = base64.b64encode(os.urandom(16)).decode()
        request = (f"GET /live?token={token} HTTP/1.1\r\nHost: {HOST}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
                   f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n")
        self.connection.sendall(request.encode())
        reply = self.connection.recv(65536)
        expect(reply.startswith(b"HTTP/1.1 101"), reply[:200])

    def run(self):
        try:
            while received := self.connection.recv(1 << 20):
                self.bytes += len(received)
        except OSError:
            pass  # closed by end()

    def end(self):
        self.connection.shutdown(socket.SHUT_RDWR)
        self.join()
        self.connection.close()


def viewers(count):
    token = page_address().split("token=")[1]
    clients = [Viewer(token) for _ in range(count)]
    for client in clients:
        client.start()
    return clients


@check("the live picture is served on demand, and only to those with the token")
def served_with_token():
    expect(unit_property("ActiveState", "hapticd-view.socket") == "active", "the socket is not active")
    denied = run("hapticctl", "view", user="stranger")
    expect(denied.returncode != 0 and "haptic-view" in denied.stdout, denied.stdout)
    address = page_address()
    try:
        urllib.request.urlopen(f"http://{HOST}/", timeout=30)
        expect(False, "served without the token")
    except urllib.error.HTTPError as refused:
        expect(refused.code == 401, refused.code)
    jar = urllib.request.HTTPCookieProcessor(http.cookiejar.CookieJar())
    with urllib.request.build_opener(jar).open(address, timeout=30) as page:
        expect("token" not in page.url, page.url)
        expect("default-src 'none'" in page.headers["Content-Security-Policy"], page.headers)
        expect(b"hapticd" in page.read(), "another page")
    expect(unit_property("ActiveState", UNIT) == "active", "the service does not run")


@check("the live view's process may see the depth image and control nothing")
def privileges():
    with open(f"/proc/{pid_of_view()}/status") as file:
        fields = dict(line.rstrip("\n").split(":\t", 1) for line in file if ":\t" in line)
    groups = {int(number) for number in fields["Groups"].split()}
    expect("0" not in fields["Uid"].split(), fields["Uid"])
    expect(grp.getgrnam("haptic-view").gr_gid in groups, groups)
    expect(grp.getgrnam("haptic").gr_gid not in groups, groups)
    expect(int(fields["CapEff"], 16) == 0 and fields["NoNewPrivs"].strip() == "1", fields["CapEff"])
    expect(not tcp_sockets(main_pid()), "hapticd itself has a TCP socket")
    expect(tcp_sockets(pid_of_view()), "this test does not see TCP sockets")


@check("depth frames reach a viewer through the sandboxes of both services")
def depth_arrives():
    client, = viewers(1)
    try:
        wait_for("two frames", lambda: client.bytes > 2 * 640 * 480 * 2, 30)
    finally:
        client.end()


@check("a live view that is stopped or killed changes nothing for the box")
def box_does_not_notice():
    clients = viewers(2)
    before = status()
    pid = pid_of_view()
    os.kill(pid, signal.SIGSTOP)
    time.sleep(3)
    os.kill(pid, signal.SIGKILL)
    time.sleep(2)
    after = status()
    for client in clients:
        client.end()
    expect(after["mode"] == before["mode"], f'{before["mode"]}, then {after["mode"]}')
    late = after["loop"]["counters"]["overruns"] - before["loop"]["counters"]["overruns"]
    lost = after["loop"]["traceTicksDropped"] - before["loop"]["traceTicksDropped"]
    expect(lost == 0, f"{lost} ticks lost")
    page_address()  # it is there again
    return f"{late} late ticks"


def wakeup_p999_ns():
    """Over one window of Monitor."""
    with Varlink(timeout=120) as daemon:
        daemon.send("io.hapticd.Status.Monitor", more=True, intervalMs=WINDOW_MS, fields=["mode"])
        daemon.receive()  # at once
        window = daemon.receive()["window"]
    expect(window["ticks"] > 0.9 * WINDOW_MS, window)
    return window["wakeupLatency"]["p999Ns"]


@check(f"the wake-up latency is within 10 % of that without viewers when {VIEWERS} look", only_counted=True)
def latency_with_viewers():
    must("systemctl", "stop", UNIT)
    without = wakeup_p999_ns()
    clients = viewers(VIEWERS)
    with_viewers = wakeup_p999_ns()
    received = [client.bytes for client in clients]
    for client in clients:
        client.end()
    expect(min(received) > 1 << 20, f"{received} bytes received")
    # a bucket of the histogram, a sixteenth of a power of two, is added to the tenth
    expect(with_viewers <= 1.1 * without + 512, f"p99.9 {without} ns without, {with_viewers} ns with viewers")
    return f"p99.9 {without / 1000:.1f} us without, {with_viewers / 1000:.1f} us with {VIEWERS} viewers"

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The built daemon under many kinds of load at once: what is lost, and what grows.

HAPTICD_PROGRAM and HAPTICCTL_PROGRAM name the programs. HAPTICD_SOAK_SECONDS: how long the load lasts (6);
HAPTICD_SOAK_SEED: of what is random (chosen and printed). Clients run in parallel: the same seed gives each of them the
same sequence, not the same interleaving.
"""

import itertools
import json
import math
import multiprocessing
import os
import random
import signal
import socket
import subprocess
import tempfile
import threading
import time
import unittest

HAPTICD = os.environ["HAPTICD_PROGRAM"]
HAPTICCTL = os.environ["HAPTICCTL_PROGRAM"]
SECONDS = float(os.environ.get("HAPTICD_SOAK_SECONDS", "6"))
SEED = int(os.environ.get("HAPTICD_SOAK_SEED", random.randrange(2**32)))
PATIENCE_S = 30

# In contact with a wall from the first frame to the last. The flight recorder is full before memory is looked at.
YAML = """safety: {handle_timeout_s: 1, depth_timeout_s: 5, engage_inside: true, overrun_burst: 65}
camera: {driver: synthetic}
synthetic: {scene: plane, noise: off, distance_m: 1}
simulated_handle: {start_z_m: -0.97, travel_m: 0.02, stroke_m: 0.01}
trace: {flight_recorder_s: 2, min_free_mb: 0}
"""

WRONG_CALLS = [
    b'{"method":"io.hapticd.Status.GetStatus","parameters":',
    b'{"method":"io.hapticd.Control.SetParameters","parameters":{"parameters":[]}}',
    b'{"method":"io.hapticd.Status.Monitor","parameters":{"intervalMs":0},"more":true}',
    b'{"method":"no.such.Method"}',
    b"[[[[[[[[[[[[[[[[[[[[]]]]]]]]]]]]]]]]]]]]",
    b'{"method":42}',
]


class Client:
    """A connection to one of the daemon's sockets."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(PATIENCE_S)
        try:
            self.socket.connect(path)
        except OSError:
            self.socket.close()
            raise
        self.received = b""

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.socket.close()

    def send(self, method, parameters=None, **flags):
        call = {"method": "io.hapticd." + method, "parameters": parameters or {}, **flags}
        self.socket.sendall(json.dumps(call).encode() + b"\0")

    def reply(self):
        while b"\0" not in self.received:
            received = self.socket.recv(1 << 16)
            if not received:
                raise ConnectionError("the daemon closed the connection")
            self.received += received
        text, _, self.received = self.received.partition(b"\0")
        return json.loads(text)

    def call(self, method, parameters=None):
        self.send(method, parameters)
        return self.reply()


class Daemon:
    """hapticd on the simulated handle and a computed scene, in a folder of its own."""

    def __init__(self, test):
        folder = tempfile.TemporaryDirectory(prefix="hapticd-soak-")
        test.addCleanup(folder.cleanup)
        os.chmod(folder.name, 0o711)  # for another user to connect
        self.configuration = os.path.join(folder.name, "hapticd.yaml")
        self.status_socket = os.path.join(folder.name, "Status")
        self.control_socket = os.path.join(folder.name, "Control")
        self.log = open(os.path.join(folder.name, "log"), "w+", encoding="utf-8", errors="replace")
        test.addCleanup(self.log.close)
        self.configure(YAML)
        settings = {"state.folder": os.path.join(folder.name, "state"),
                    "control.status_socket": self.status_socket,
                    "control.control_socket": self.control_socket}
        command = [HAPTICD, "--config", self.configuration]
        command += [f"--set={name}={value}" for name, value in settings.items()]
        self.process = subprocess.Popen(command, stdout=self.log, stderr=self.log)
        test.addCleanup(self.kill)
        if not becomes_true(lambda: self.process.poll() is not None or self.answers()) or not self.answers():
            test.fail("hapticd does not start: " + self.words())

    def answers(self):
        try:
            return "parameters" in self.call("Status.GetStatus")
        except OSError:
            return False

    def call(self, method, parameters=None):
        with Client(self.control_socket) as client:
            return client.call(method, parameters)

    def status(self):
        return self.call("Status.GetStatus")["parameters"]["status"]

    def live_parameters(self):
        parameters = self.call("Status.GetParameters")["parameters"]["parameters"]
        return [parameter for parameter in parameters if parameter["effect"] == "live"]

    def configure(self, text):
        with open(self.configuration, "w", encoding="utf-8") as file:
            file.write(text)

    def reload(self, text):
        self.configure(text)
        self.process.send_signal(signal.SIGHUP)

    def words(self):
        self.log.seek(0)
        return self.log.read()

    def kill(self):
        self.process.kill()
        self.process.wait()

    def proc(self, *path):
        return os.path.join("/proc", str(self.process.pid), *path)

    def resident_kb(self):
        with open(self.proc("status"), encoding="ascii", errors="replace") as file:
            return next(int(line.split()[1]) for line in file if line.startswith("VmRSS:"))

    def descriptors_and_threads(self):
        return len(os.listdir(self.proc("fd"))), len(os.listdir(self.proc("task")))

    def force_thread_faults(self):
        for task in os.listdir(self.proc("task")):
            with open(self.proc("task", task, "stat"), encoding="ascii", errors="replace") as file:
                name, _, fields = file.read().rpartition(")")
            if name.endswith("(hapticd-force"):
                minor, _, major = fields.split()[7:10]
                return int(minor) + int(major)
        raise LookupError("hapticd has no force thread")


def becomes_true(condition):
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


class Load:
    """Clients that run until stop(); what went wrong is in `problems`."""

    def __init__(self, daemon):
        self.daemon = daemon
        self.stopped = threading.Event()
        self.problems = []
        self.answers = {}
        self.live = daemon.live_parameters()
        kinds = [self.watch_quickly, self.watch_slowly, self.watch_ticks, self.watch_with_hapticctl,
                 self.ask_parameters, self.steer, self.ask_status_among_garbage]
        self.threads = [threading.Thread(target=self.run, args=(kind,)) for kind in kinds]
        for thread in self.threads:
            thread.start()

    def stop(self):
        self.stopped.set()
        for thread in self.threads:
            thread.join()

    def run(self, kind):
        name = kind.__name__
        self.answers[name] = 0
        try:
            for _ in kind(random.Random(f"{SEED} {name}")):
                self.answers[name] += 1
                if self.stopped.is_set():
                    return
        except (OSError, ValueError) as error:
            self.problems.append(f"{name}: {error!r}")

    def watch(self, method, parameters, pause_s):
        with Client(self.daemon.status_socket) as client:
            client.send(method, parameters, more=True)
            while True:
                yield client.reply()
                self.stopped.wait(pause_s)

    def watch_quickly(self, _):
        return self.watch("Status.Monitor", {"intervalMs": 20}, 0)

    def watch_slowly(self, _):
        """Reads more slowly than the daemon sends, which must leave replies out."""
        return self.watch("Status.Monitor", {"intervalMs": 20}, 1)

    def watch_ticks(self, _):
        return self.watch("Status.Ticks", {"fields": ["number", "hip_m_in_world"]}, 0)

    def watch_with_hapticctl(self, _):
        command = [HAPTICCTL, "--json", "--socket", self.daemon.status_socket, "watch"]
        with subprocess.Popen(command, stdout=subprocess.PIPE) as watch:
            try:
                for line in watch.stdout:
                    yield json.loads(line)
                self.problems.append("hapticctl watch ended")
            finally:
                watch.kill()

    def ask_parameters(self, _):
        with Client(self.daemon.status_socket) as client:
            while True:
                yield client.call("Status.GetParameters")
                self.stopped.wait(0.002)

    def steer(self, chance):
        """Changes parameters on one connection; one call in ten engages or disengages."""
        with Client(self.daemon.control_socket) as client:
            while True:
                if chance.randrange(10) == 0:
                    yield client.call(chance.choice(["Control.Engage", "Control.Engage", "Control.Disengage"]))
                else:
                    values, allowed = self.random_change(chance)
                    reply = client.call("Control.SetParameters", {"parameters": values})
                    if not allowed and "error" not in reply:
                        self.problems.append(f"forbidden values are taken: {values}")
                    yield reply
                self.stopped.wait(chance.uniform(0.005, 0.1))

    def random_change(self, chance):
        """One to three live parameters with values in their ranges; one change in four must be refused."""
        values = {parameter["name"]: allowed_value(parameter, chance)
                  for parameter in chance.choices(self.live, k=chance.randint(1, 3))}
        if chance.randrange(4) > 0:
            return values, True
        parameter = chance.choice(self.live)
        beyond = 1 + chance.uniform(0, 1e6)
        forbidden = [("force.no_such_parameter", 1), (parameter["name"], ["not a value"])]
        if parameter["maximum"] is not None:
            forbidden += [(parameter["name"], parameter["maximum"] + beyond),
                          (parameter["name"], parameter["minimum"] - beyond)]
        values.update([chance.choice(forbidden)])
        return values, False

    def ask_status_among_garbage(self, chance):
        """Asks on a new connection each time, and sends garbage in between without reading what comes back."""
        while True:
            garbage = chance.choice([chance.choice(WRONG_CALLS), chance.randbytes(chance.randint(1, 5000))])
            with Client(chance.choice([self.daemon.status_socket, self.daemon.control_socket])) as client:
                client.socket.setblocking(False)
                client.socket.send(garbage + chance.choice([b"", b"\0", b"\0"]))
            with Client(self.daemon.status_socket) as client:
                yield client.call("Status.GetStatus")
            self.stopped.wait(chance.uniform(0.005, 0.02))


def allowed_value(parameter, chance):
    if parameter["kind"] == "boolean":
        return chance.choice([False, True])
    if parameter["kind"] == "integer":
        return chance.randint(int(parameter["minimum"]), int(parameter["maximum"]))
    if parameter["kind"] == "number":
        return chance.uniform(parameter["minimum"], parameter["maximum"])
    return chance.choice(parameter["choices"]) if parameter["kind"] == "choice" else ""


def extreme_values(parameters):
    """Sets of values, among which each parameter has both ends of its range, or each of its choices."""
    ranges = [allowed_range(parameter) for parameter in parameters]
    for index in range(max(map(len, ranges))):
        yield {parameter["name"]: values[index % len(values)] for parameter, values in zip(parameters, ranges)}


def allowed_range(parameter):
    if parameter["kind"] == "boolean":
        return [False, True]
    if parameter["kind"] in ("integer", "number"):
        return [parameter["minimum"], parameter["maximum"]]
    return parameter["choices"] if parameter["kind"] == "choice" else [""]


def certain_growth(samples):
    """How much (time, value) has grown since the start at 97.5 % confidence, by the median of the slopes between all
    pairs (P. K. Sen, "Estimates of the regression coefficient based on Kendall's tau", 1968): what is taken once and
    kept is no growth, what is taken again and again is."""
    begin_s = max(3, samples[-1][0] / 5)
    settled = [sample for sample in samples if sample[0] >= begin_s]
    slopes = sorted((later[1] - earlier[1]) / (later[0] - earlier[0])
                    for earlier, later in itertools.combinations(settled, 2))
    count = len(settled)
    deviation = math.sqrt(count * (count - 1) * (2 * count + 5) / 18)  # of Kendall's S; a rank changes S by 2
    slope = slopes[max(0, len(slopes) // 2 - math.ceil(deviation))]
    return slope * (settled[-1][0] - settled[0][0])


def flood(path, connections):
    """Sends calls without a pause and hangs up when the kernel takes no more, as another user where it may."""
    if os.geteuid() == 0:
        os.setgroups([])
        os.setgid(65534)
        os.setuid(65534)
    calls = [(json.dumps({"method": "io.hapticd.Status.GetParameters", "oneway": oneway}).encode() + b"\0") * 4096
             for oneway in (True, False)]
    sockets = [None] * connections
    turn = 0
    while True:
        turn += 1
        if sockets[turn % connections] is not None:
            sockets[turn % connections].close()
        client = sockets[turn % connections] = socket.socket(socket.AF_UNIX)
        client.setblocking(False)
        try:
            client.connect(path)
            while True:
                client.send(calls[turn // connections % 2])
        except OSError:
            pass  # refused, or the buffer is full: on to the next


class Soak(unittest.TestCase):
    def test_under_many_clients_nothing_is_lost_and_nothing_grows(self):
        daemon = Daemon(self)
        # Once before the count, what keeps resources: the first trace and the threads for files, a frame with each
        # extreme value, and a reload.
        daemon.call("Control.DumpTrace")
        daemon.call("Status.ListTraces")
        for values in extreme_values(daemon.live_parameters()):
            self.assertNotIn("error", daemon.call("Control.SetParameters", {"parameters": values}))
            frames = daemon.status()["scene"]["frames"]
            self.assertTrue(becomes_true(lambda: daemon.status()["scene"]["frames"] > frames + 1))
        daemon.reload(YAML)
        self.assertTrue(becomes_true(lambda: "configuration reloaded" in daemon.words()), daemon.words())
        before = daemon.descriptors_and_threads()
        faults = daemon.force_thread_faults()
        load = Load(daemon)
        try:
            resident_kb = self.disturb(daemon)
        finally:
            load.stop()

        self.assertEqual(load.problems, [])
        for name, answers in load.answers.items():
            self.assertGreater(answers, 0, name)
        self.assertLess(certain_growth(resident_kb), 1024 * max(1, SECONDS / 600))
        self.assertTrue(becomes_true(lambda: daemon.descriptors_and_threads() <= before),
                        f"{daemon.descriptors_and_threads()} after, {before} before")
        status = daemon.status()
        self.assertGreater(status["loop"]["counters"]["ticks"], 0)
        self.assertEqual(status["loop"]["traceTicksDropped"], 0)
        self.assertEqual(status["scene"]["pointsOverCapacity"], 0)
        self.assertEqual(status["loop"]["counters"]["notFiniteTicks"], 0)
        if status["loop"]["memoryLocked"]:
            self.assertEqual(status["loop"]["pageFaults"], 0)
            self.assertEqual(daemon.force_thread_faults(), faults)
        daemon.process.terminate()
        self.assertEqual(daemon.process.wait(PATIENCE_S), 0, daemon.words())

    def disturb(self, daemon):
        """Reloads the same, a damaged and a wrong configuration in turn; returns samples of memory in use."""
        configurations = [YAML, YAML + "force: [\n", YAML + "no_such_group: {name: 1}\n"]
        samples = []
        begin = time.monotonic()
        while time.monotonic() < begin + SECONDS:
            if len(samples) % 10 == 0:
                daemon.reload(configurations[len(samples) // 10 % 3])
            self.assertIsNone(daemon.process.poll(), daemon.words())
            samples.append((time.monotonic() - begin, daemon.resident_kb()))
            time.sleep(max(0.05, SECONDS / 1000))
        return samples

    def test_a_flood_by_another_user_loses_no_tick_and_delays_no_disengage_for_ever(self):
        daemon = Daemon(self)
        processes = [multiprocessing.Process(target=flood, args=(daemon.status_socket, 10), daemon=True)
                     for _ in range(4)]
        for process in processes:
            process.start()
            self.addCleanup(process.kill)
        disengaged = 0
        deadline = time.monotonic() + SECONDS / 2
        while time.monotonic() < deadline:
            daemon.call("Control.Engage", {"insideSurface": True})
            subprocess.run([HAPTICCTL, "--socket", daemon.control_socket, "disengage"], check=True,
                           timeout=PATIENCE_S, stdout=subprocess.DEVNULL)
            disengaged += 1
        status = daemon.status()
        self.assertGreater(disengaged, 0)
        self.assertTrue(all(process.is_alive() for process in processes))
        self.assertEqual(status["loop"]["traceTicksDropped"], 0)
        self.assertEqual(status["control"]["ticksLost"], 0)
        self.assertGreater(status["control"]["longestGapNs"], 0)


if __name__ == "__main__":
    multiprocessing.set_start_method("fork")
    print(f"HAPTICD_SOAK_SEED={SEED}", flush=True)
    unittest.main(verbosity=2)

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The Python module and its examples with a running daemon. HAPTICD_PROGRAM and HAPTICCTL_PROGRAM name the programs."""
import contextlib
import csv
import inspect
import math
import os
import pathlib
import re
import select
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import h5py
import numpy

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools/python"))
import hapticd  # noqa: E402
from hapticd.interface import Interface  # noqa: E402

HAPTICD, HAPTICCTL = os.environ.get("HAPTICD_PROGRAM", ""), os.environ.get("HAPTICCTL_PROGRAM", "")
PATIENCE_S = float(os.environ.get("HAPTICD_TEST_PATIENCE_S", "60"))
INTERFACES = ROOT / "daemon/control"
FRAMES = "\nframes:\n  - {name: phantom}\n"


def eventually(condition):
    """Waits until the condition is true, and returns what it returned."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if found := condition():
            return found
        time.sleep(0.02)
    raise AssertionError(f"not within {PATIENCE_S} s")


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_port:
        any_port.bind(("127.0.0.1", 0))
        return any_port.getsockname()[1]


class Daemon:
    """A daemon in a folder of its own, in the scene of the tutorial. It ends with the test, or after ten minutes."""

    def __init__(self, test, *settings):
        folder = tempfile.TemporaryDirectory()
        test.addClassCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        configuration = (ROOT / "config/demo-fixtures.yaml").read_text(encoding="utf-8").replace("\n...", FRAMES + "...")
        (self.folder / "hapticd.yaml").write_text(configuration, encoding="utf-8")
        words = ["timeout", "600", HAPTICD, "--config", "hapticd.yaml"]
        for setting in ("state.folder=state", "safety.handle_timeout_s=1", "safety.depth_timeout_s=5", *settings):
            words += ["--set", setting]
        self.process = subprocess.Popen(words, cwd=folder.name, start_new_session=True, stdout=subprocess.DEVNULL,
                                        stderr=subprocess.DEVNULL)
        test.addClassCleanup(self.end)
        self.socket = str(self.folder / "hapticd-demo.Control")
        eventually(self.answers)

    def answers(self):
        with contextlib.suppress(hapticd.NoConnection):
            return hapticd.Box(self.socket).status()

    def end(self):
        if self.process.poll() is None:
            for number in (signal.SIGCONT, signal.SIGTERM):
                os.killpg(self.process.pid, number)
        try:
            self.process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()


class Test(unittest.TestCase):
    def expect_error(self, kind, function, *parts):
        """`parts` are regular expressions of where, what and remedy."""
        with self.assertRaises(kind) as raised:
            function()
        error = raised.exception
        for part, said in zip(parts, (error.where, error.what, error.remedy), strict=True):
            self.assertRegex(said, part)
        return error


class InterfaceText(Test):
    """The text of the interfaces as it is in the tree."""

    def test_every_method_and_error_of_the_text_is_known(self):
        for name in ("io.hapticd.Status", "io.hapticd.Control", "org.varlink.service"):
            text = (INTERFACES / f"{name}.varlink").read_text(encoding="utf-8")
            interface = Interface(text)
            self.assertEqual([f"{name}.{method}" for method in re.findall(r"^method (\w+)", text, re.MULTILINE)],
                             [method.name for method in interface.methods.values()])
            self.assertEqual([f"{name}.{error}" for error in re.findall(r"^error (\w+)", text, re.MULTILINE)], [*interface.errors])

    def test_signatures_types_and_explanations_are_those_of_the_text(self):
        control = Interface((INTERFACES / "io.hapticd.Control.varlink").read_text(encoding="utf-8"))
        self.assertEqual("(region: 'str', stiffness_n_per_m: 'float', damping_n_s_per_m: 'float | None' = None) -> 'Record'",
                         str(control.methods["set_stiffness"].signature))
        self.assertIn("stiffness_n_per_m (float): Newtons per metre", control.methods["set_stiffness"].doc)
        status = Interface((INTERFACES / "io.hapticd.Status.varlink").read_text(encoding="utf-8"))
        self.assertEqual(["monitor", "ticks", "events", "get_snapshot", "share_depth"],
                         [name for name, method in status.methods.items() if method.streams])


class BridgeProtocol(Test):
    """Device, with the daemon's side of the protocol written a second time."""

    COMMAND = struct.Struct("<4sBBHQQqQQQ3d24xI56x")

    def setUp(self):
        self.box = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(self.box.close)
        self.box.bind(("127.0.0.1", 0))
        self.forces = []
        self.ends = threading.Event()

    def exchange(self, force_n):
        self.forces.append(force_n[2])
        if self.ends.is_set():
            raise EOFError
        return hapticd.Measured((0.1, 0.2, 0.3), buttons=5, orientation_xyzw=(0, 0, 1, 0), gripper_rad=0.5)

    def start(self):
        device = hapticd.Device(f"127.0.0.1:{self.box.getsockname()[1]}")

        def drive():
            with self.assertRaises(EOFError):
                device.run(self.exchange)

        thread = threading.Thread(target=drive, daemon=True)
        thread.start()
        return thread

    def answer(self, force_n, session=7, number=None, mode=1, spoil=lambda packet: packet, **echo):
        """Answers the newest state with a command; the number of a good one is that of the state."""
        state = None
        while select.select([self.box], [], [], 0 if state else PATIENCE_S)[0]:
            state, peer = self.box.recvfrom(512)
        self.assertTrue(state, "no state came")
        theirs, count = struct.unpack_from("<QQ", state, 8)
        body = self.COMMAND.pack(b"HPTC", 2, 2, 0, session, number or count, 1, echo.get("session_echoed", theirs),
                                 echo.get("number_echoed", count), echo.get("age_ns", 0), 0, 0, force_n, mode)
        self.box.sendto(spoil(body + struct.pack("<I", crc_32c(body))), peer)
        return state

    def good(self, force_n):
        """Returns the number of a command that was exerted."""
        end, numbers = len(self.forces), []

        def is_exerted():
            numbers.append(struct.unpack_from("<Q", self.answer(force_n), 16)[0])
            return force_n in self.forces[end:]

        eventually(is_exerted)
        return numbers[-1]

    def test_states_hold_what_the_device_measures(self):
        thread = self.start()
        state = self.answer(1.0)
        self.assertEqual(168, len(state))
        self.assertEqual(struct.pack("<I", crc_32c(state[:164])), state[164:])
        self.assertEqual((b"HPTC", 2, 1, 4), struct.unpack_from("<4sBBH", state))
        self.assertEqual((0.1, 0.2, 0.3, 0, 0, 0, 5, 3, 1), struct.unpack_from("<6dIHH", state, 56))
        self.assertEqual((0, 0, 1, 0, 0.5, 0, 0), struct.unpack_from("<4ddQI", state, 112))
        self.good(1.0)
        self.ends.set()
        thread.join(PATIENCE_S)
        self.assertEqual(0, self.forces[-1])

    def test_only_commands_that_prove_themselves_are_exerted(self):
        thread = self.start()
        number = self.good(1.0)
        for wrong in ({"session_echoed": 5}, {"number_echoed": 0}, {"number_echoed": 1 << 40}, {"age_ns": 10**9}, {"mode": 2},
                      {"force_n": math.inf}, {"force_n": 2000.0}, {"number": number - 1}, {"session": 8, "number_echoed": 1},
                      {"spoil": lambda packet: packet[:-1]}, {"spoil": lambda packet: packet[:60] + b"\1" + packet[61:]}):
            for _ in range(3):
                self.answer(**{"force_n": 2.0, **wrong})
        self.good(3.0)
        self.assertLessEqual(set(self.forces), {0, 1.0, 3.0})
        end = len(self.forces)
        eventually(lambda: self.answer(9.0) and max(self.forces[end:], default=0) > 3)
        self.assertEqual(4.0, max(self.forces))  # the limit of the device
        eventually(lambda: self.forces[-1] == 0)  # nothing comes any more: 20 ms later the force ends
        self.ends.set()
        thread.join(PATIENCE_S)

    def test_a_key_that_cannot_be_used_is_named(self):
        self.expect_error(hapticd.Error, lambda: hapticd.Device("127.0.0.1:1", "/nowhere"), "127.0.0.1:1", "No such file", "key")
        self.expect_error(hapticd.Error, lambda: hapticd.Device("127.0.0.1:1", os.devnull), os.devnull, "0 bytes", "16 to 1024")
        self.expect_error(hapticd.Error, lambda: hapticd.Device("nonsense"), "nonsense", ".", "ADDRESS:PORT")


def crc_32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0x82F63B78 * (crc & 1)
    return crc ^ 0xFFFFFFFF


class RunningBox(Test):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(cls)
        cls.box = hapticd.Box(cls.daemon.socket)
        eventually(lambda: cls.box.status().mode == "engaged")

    def test_the_status_has_every_part(self):
        status = self.box.status()
        self.assertEqual("synthetic", status.camera.identity.split()[0])
        self.assertGreater(status.tick.number, 0)
        self.assertGreater(status.loop.wakeup_latency.p99_ns, 0)
        with self.assertRaisesRegex(AttributeError, "there is no nonsense among mode"):
            status.nonsense

    def test_parameters_are_set_all_or_none(self):
        self.box.set({"force.stiffness_n_per_m": 450, "contact.friction": numpy.float64(0.125)})
        self.assertEqual((450, 0.125), (self.box.get("force.stiffness_n_per_m"), self.box.get("contact.friction")))
        error = self.expect_error(hapticd.Refused, lambda: self.box.set({"force.stiffness_n_per_m": -1}),
                                  r"^force\.stiffness_n_per_m$", "^-1 N/m is out of range$", r"^allowed: 0\.\.5000 N/m")
        self.assertEqual("io.hapticd.Control.InvalidValue", error.name)
        self.expect_error(hapticd.Refused, lambda: self.box.set({"force.radius_m": 9, "contact.friction": 0.5, "force.law": 3}),
                          "SetParameters$", "force.law: .*force.radius_m: |force.radius_m: .*force.law: ", "allowed: .*; ")
        self.assertEqual(0.125, self.box.get("contact.friction"))
        self.expect_error(hapticd.Refused, lambda: self.box.set({"force.stifness_n_per_m": 1}), "force.stifness", "no parameter",
                          "did you mean force.stiffness_n_per_m")
        self.expect_error(hapticd.Refused, lambda: self.box.get("nonsense"), "nonsense", "no parameter", "hapticd.yaml")
        self.expect_error(hapticd.Refused, lambda: self.box.set({"camera.driver": "v4l2"}), "SetParameters", "camera.driver",
                          "restart hapticd")
        self.expect_error(hapticd.Error, lambda: self.box.set({"force.radius_m": math.nan}), "SetParameters", "cannot be sent", "finite")

    def test_methods_of_the_daemon_are_methods_here(self):
        self.assertIn("engage", dir(self.box))
        self.assertEqual("(inside_surface: 'bool | None' = None) -> 'Record'", str(inspect.signature(self.box.engage)))
        self.assertIn("Requests force", self.box.engage.__doc__)
        with self.assertRaises(TypeError):
            self.box.engage(insideSurface=True)
        with self.assertRaisesRegex(AttributeError, "no method nonsense"):
            self.box.nonsense()
        self.assertEqual("idle", self.box.disengage().mode)
        self.assertIn(self.box.engage(inside_surface=True).mode, ("engaged", "holding"))
        self.expect_error(hapticd.Refused, self.box.clear_fault, "ClearFault", "the mode is not faulted", "status")
        self.expect_error(hapticd.Refused, self.box.stop_trace, "StopTrace", "none is being written", "start one first")
        self.expect_error(hapticd.Refused, lambda: self.box.set_stiffness("nowhere", 1), "nowhere", "no region", "region list")

    def test_streams_of_the_daemon_are_iterators(self):
        self.assertEqual("configuration", next(self.box.events()).event.kind)
        self.assertIn("mode", next(self.box.monitor(interval_ms=20, fields=["mode"])).status)

    def test_fixtures_are_added_changed_listed_and_removed(self):
        fixtures = self.box.fixtures
        fixtures.add("nerve", kind="sphere", position_m=numpy.array([0.5, 0, -0.8]), radius_m=0.05)
        self.addCleanup(lambda: [fixtures.remove(one.name) for one in fixtures.list()])
        fixtures.change("nerve", enabled=False, radius_m=0.04)
        [nerve] = fixtures.list()
        self.assertEqual(("nerve", "client", False), (nerve.name, nerve.origin, nerve.enabled))
        self.assertEqual(([0.5, 0, -0.8], 0.04), (nerve.definition.position_m, nerve.definition.radius_m))
        self.expect_error(hapticd.Refused, lambda: fixtures.add("vein", kind="sphere", position_m=[0, 0, 0], radius_m=-1),
                          "^fixture vein, radius_m$", "out of range", r"set radius_m to .*\.\.")
        fixtures.remove("nerve")
        self.assertEqual([], fixtures.list())
        self.expect_error(hapticd.Refused, lambda: fixtures.remove("nerve"), "fixture nerve", "no fixture", "fixture list")
        self.box.regions.add("nodule", shape="sphere", position_m=[0.5, 0, -0.8], radius_m=0.02, stiffness_n_per_m=900)
        self.assertEqual(["nodule"], [one.name for one in self.box.regions.list()])
        self.box.regions.remove("nodule")

    def test_poses_of_a_moving_frame_are_fed(self):
        frames = self.box.frames
        for i in range(5):
            frames.feed("phantom", [0.1 + i * 1e-6, 0, -0.8, 0, 0, 0, 1], age_s=0, wait=i > 2)
            time.sleep(0.005)
        frame = eventually(lambda: next((one for one in frames.list() if one.position_m), None))
        self.assertEqual("phantom", frame.name)
        self.assertAlmostEqual(0.1, frame.position_m[0], delta=1e-3)
        self.expect_error(hapticd.Refused, lambda: frames.feed("phantom", [0, 0, 0, 0, 0, 0, 2]), "phantom", "quaternion|length", ".")
        self.expect_error(hapticd.Refused, lambda: frames.feed("nowhere", [0, 0, 0, 0, 0, 0, 1]), "FeedPose", "nowhere", "configuration")
        self.expect_error(hapticd.Error, lambda: frames.feed("phantom", [0, 0, 0]), "phantom", "3 numbers", "quaternion")

    def test_ticks_are_in_order_and_complete_or_counted(self):
        ticks = self.box.ticks("number", "mode", "hip_m_in_world", seconds=0.3)
        received = list(ticks)
        numbers = [tick.number for tick in received]
        self.assertEqual(sorted(set(numbers)), numbers)
        self.assertEqual(ticks.lost, numbers[-1] - numbers[0] + 1 - len(numbers))
        self.assertEqual(3, len(received[0].hip_m_in_world))
        self.expect_error(hapticd.Refused, lambda: list(self.box.ticks("force")), "force", "no such field", "did you mean")

    def test_a_trace_is_read_as_hapticctl_exports_it(self):
        name = self.box.start_trace(label="module").name
        self.box.mark_trace("half-time")
        first = self.box.status().tick.number
        eventually(lambda: self.box.status().tick.number > first + 500)
        self.box.stop_trace()
        path = str(self.daemon.folder / f"state/traces/{name}.mcap")
        trace = hapticd.read_trace(path)
        for channel in ("ticks", "models", "directives", "events"):
            file = str(self.daemon.folder / f"{channel}.csv")
            subprocess.run([HAPTICCTL, "trace", "export", path, "--channel", channel, "--out", file], check=True,
                           stdout=subprocess.DEVNULL, timeout=PATIENCE_S)
            self.expect_same(getattr(trace, channel), file)
        self.assertIn("half-time", [fields.get("MARK") for fields in trace.events["fields"]])
        exported = (self.daemon.folder / "ticks.settings.yaml").read_text(encoding="utf-8")  # below comments
        self.assertTrue(trace.settings and exported.endswith(trace.settings))
        self.assertEqual(["time_s", "number"], list(hapticd.read_trace(path, ["number"]).ticks))
        self.expect_damage_found(path)
        self.expect_hdf5(trace, path)

    def expect_same(self, table, file):
        """Numbers to the last bit; a field that does not apply to the law in use is empty in CSV."""
        with open(file, encoding="utf-8", newline="") as lines:
            rows = list(csv.DictReader(lines))
        self.assertEqual(len(rows), len(table))
        for name, values in table.items():
            for part in range(values.shape[1] if values.ndim == 2 else 1):
                column = f"{name}_{'xyz'[part]}" if values.ndim == 2 else name
                for row, value in zip(rows, values[:, part] if values.ndim == 2 else values):
                    if name == "parameters":
                        flags = {"false": "0", "true": "1"}
                        self.assertEqual({one: flags.get(text, text) for one, text in value.items()}, {one: row[one] for one in value})
                    elif isinstance(value, dict):
                        self.assertEqual("; ".join(f"{one}={text}" for one, text in value.items()), row[column])
                    elif isinstance(value, str):
                        self.assertEqual(value, row[column])
                    elif row[column]:
                        numpy.testing.assert_equal(float(value), float(row[column]), column)

    def expect_damage_found(self, path):
        content = pathlib.Path(path).read_bytes()
        damaged = str(self.daemon.folder / "damaged.mcap")
        flipped = bytearray(content)
        flipped[len(content) // 2] ^= 1
        for wrong, what in ((content[:len(content) // 2], "not finished"), (flipped, "chunk|damaged"), (b"text", "not a trace")):
            pathlib.Path(damaged).write_bytes(wrong)
            self.expect_error(hapticd.Error, lambda: hapticd.read_trace(damaged), "damaged.mcap", what, "trace recover|give a trace")
        self.expect_error(hapticd.Error, lambda: hapticd.read_trace("/nowhere"), "/nowhere", "No such file", "give a finished trace")
        self.expect_error(hapticd.Error, lambda: hapticd.read_trace(path, ["nonsense"]), "fields", "nonsense", "all of them")

    def expect_hdf5(self, trace, path):
        out = str(self.daemon.folder / "trace.h5")
        self.assertEqual((0, ""), run_example("hdf5_from_trace.py", self.daemon.socket, path, out)[::2])
        with h5py.File(out) as file:
            self.assertEqual(["directives", "events", "models", "settings", "ticks"], sorted(file))
            forces = file["ticks/command_force_n_in_world"][:]
            numpy.testing.assert_array_equal(trace.ticks["command_force_n_in_world"], forces)
            self.assertEqual(list(trace.events["text"]), list(file["events/text"].asstr()))
        self.assertIn("exists already", run_example("hdf5_from_trace.py", self.daemon.socket, path, out)[2])

    def test_a_user_who_only_reads_is_told_so(self):
        reader = hapticd.Box(str(self.daemon.folder / "hapticd-demo.Status"))
        self.assertGreater(reader.status().tick.number, 0)
        self.expect_error(hapticd.Refused, reader.disengage, "Disengage", "does not permit", "control socket")

    def test_without_a_daemon_there_is_a_clear_error(self):
        self.expect_error(hapticd.NoConnection, lambda: hapticd.Box("/nowhere"), "/nowhere", "no such socket", "HAPTICD_SOCKET")


class RunningDevice(Test):
    """A hand that goes 60 mm down, 10 mm behind the front of the ball, by 0.05 mm each time that the daemon is asked."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.key = pathlib.Path(folder.name, "udp.key")
        cls.key.write_bytes(bytes(range(32)))
        cls.key.chmod(0o640)
        cls.port = free_port()
        cls.daemon = Daemon(cls, "handle.driver=udp", "udp_handle.peer=127.0.0.1", f"udp_handle.port={cls.port}",
                            f"udp_handle.key_file={cls.key}", "handle.position_z_m=-0.8", "handle.measure_latency=false",
                            "control.engage_at_start=false")

    def test_forces_are_those_of_the_daemon_and_end_when_it_hangs(self):
        box = hapticd.Box(self.daemon.socket)
        device = hapticd.Device(f"127.0.0.1:{self.port}", str(self.key))
        forces, ends, goes_down, z_m = [], threading.Event(), threading.Event(), [0.0]

        def exchange(force_n):
            forces.append(force_n)
            if ends.is_set():
                raise EOFError
            if goes_down.is_set():
                z_m[0] = max(z_m[0] - 5e-5, -0.06)
            return hapticd.Measured((0, 0, z_m[0]), orientation_xyzw=(0, 0, 0, 1), gripper_rad=0.25)

        def drive():
            with contextlib.suppress(EOFError):
                device.run(exchange)

        thread = threading.Thread(target=drive, daemon=True)
        thread.start()
        try:
            eventually(lambda: box.status().handle.state == "present" and device.connected)
            eventually(lambda: box.engage().mode == "engaged")
            goes_down.set()
            commanded = set()
            for tick in box.ticks("command_force_n_in_world", "handle_gripper_rad", seconds=PATIENCE_S):
                commanded.add(tuple(tick.command_force_n_in_world))
                exerted = [force_n for force_n in forces[:-200] if force_n[2] > 0.01]
                if len(exerted) > 20:
                    break
            self.assertEqual(0.25, tick.handle_gripper_rad)
            self.assertGreater(len(commanded & set(exerted)), 10)
            os.killpg(self.daemon.process.pid, signal.SIGSTOP)
            eventually(lambda: not device.connected and forces[-1] == (0, 0, 0))
        finally:
            os.killpg(self.daemon.process.pid, signal.SIGCONT)
            ends.set()
            thread.join(PATIENCE_S)


class Examples(Test):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(cls)

    def test_ticks_are_printed_as_csv(self):
        status, printed, said = run_example("ticks.py", self.daemon.socket, "--seconds", "0.2", "number", "mode", "hip_m_in_world")
        self.assertEqual(0, status, said)
        header, *rows = list(csv.reader(printed.splitlines()))
        self.assertEqual(["number", "mode", "hip_m_in_world_x", "hip_m_in_world_y", "hip_m_in_world_z"], header)
        numbers = [int(row[0]) for row in rows]
        self.assertRegex(said, f"^ticks.py: {numbers[-1] - numbers[0] + 1 - len(numbers)} ticks lost$")

    def test_depth_frames_are_printed(self):
        status, printed, said = run_example("depth.py", self.daemon.socket, "--frames", "3")
        self.assertEqual(0, status, said)
        form = r"^frame (\d+): [\d.]+ ms old, ([\d.]+) % measured, ([\d.]+) to [\d.]+ m$"
        numbers, shares, nearest_m = zip(*(map(float, re.match(form, line).groups()) for line in printed.splitlines()))
        self.assertEqual(sorted(set(numbers)), list(numbers))
        self.assertGreater(min(shares), 50)
        for depth_m in nearest_m:  # the ball's front is 0.85 m from the camera, with noise
            self.assertAlmostEqual(0.85, depth_m, delta=0.02)

    def test_errors_are_one_line(self):
        for name, *arguments in (["forces.py"], ["ticks.py"], ["depth.py"], ["device.py", "nowhere"], ["hdf5_from_trace.py"],
                                 ["phantom.py", "/nowhere/file"]):
            with self.subTest(name):
                status, printed, said = run_example(name, "/nowhere", *arguments)
                self.assertEqual((1, ""), (status, printed), said)
                self.assertRegex(said, f"^{name}: [^\n]+\n$")
        self.assertRegex(run_example("ticks.py", self.daemon.socket, "nonsense")[2], "^ticks.py: nonsense: [^\n]+\n$")

    def test_a_reader_that_goes_away_is_no_error(self):
        words = f"{sys.executable} -B {ROOT / 'docs/examples/forces.py'} | head -n 2"
        finished = subprocess.run(["bash", "-c", words], env=environment_for(self.daemon.socket), text=True, capture_output=True,
                                  timeout=PATIENCE_S)
        self.assertEqual((2, ""), (len(finished.stdout.splitlines()), finished.stderr))


def environment_for(box):
    return {**os.environ, "PYTHONPATH": str(ROOT / "tools/python"), "HAPTICD_SOCKET": box}


def run_example(name, box, *arguments):
    """Returns the exit status, what it printed, and what it complained about."""
    finished = subprocess.run([sys.executable, "-B", str(ROOT / "docs/examples" / name), *arguments], env=environment_for(box),
                              text=True, capture_output=True, timeout=PATIENCE_S)
    return finished.returncode, finished.stdout, finished.stderr


if __name__ == "__main__":
    unittest.main(warnings="ignore")

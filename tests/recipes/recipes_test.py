#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The recipes of docs/recipes.md with the built programs: its own commands, code and files, as far as they need no hardware.

HAPTICD_PROGRAM and HAPTICCTL_PROGRAM name the programs. A recipe whose programs this machine lacks is skipped, with the
reason; the exit status is 77 then.
"""

import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

HAPTICD = os.environ["HAPTICD_PROGRAM"]
HAPTICCTL = os.environ["HAPTICCTL_PROGRAM"]
ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "docs/examples"
PATIENCE_S = float(os.environ.get("HAPTICD_TEST_PATIENCE_S", "60"))
RECIPES = (ROOT / "docs/recipes.md").read_text(encoding="utf-8")


def command(beginning):
    """The words of the command of a recipe that begins so."""
    lines = [line for line in RECIPES.splitlines() if re.match("    (PYTHONPATH=\\S+ )?" + re.escape(beginning), line)]
    assert len(lines) == 1, f"docs/recipes.md has {len(lines)} commands that begin with '{beginning}'"
    return lines[0].split()


def code(language):
    return re.search(f"```{language}\n(.*?)```", RECIPES, re.DOTALL).group(1)


def shell_client():
    first = "    printf '%s\\0'"
    return RECIPES[RECIPES.index(first):].split("\n\n")[0]


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_port:
        any_port.bind(("127.0.0.1", 0))
        return any_port.getsockname()[1]


class Recipes(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.environment = {**os.environ, "PYTHONPATH": str(ROOT / "tools/python"), "PYTHONDONTWRITEBYTECODE": "1",
                            "HAPTICD_SOCKET": "hapticd-demo.Status"}

    def start(self, words, **options):
        process = subprocess.Popen(words, cwd=self.folder, text=True, start_new_session=True, env=self.environment, **options)
        self.addCleanup(self.end, process)
        return process

    @staticmethod
    def end(process):
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGTERM)
            try:
                process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        if process.stdout:
            process.stdout.close()

    def box(self, *more):
        """A box in the scene of the tutorial, as the recipe of a device starts it, with more options."""
        self.start([HAPTICD, "--config", str(ROOT / "config/demo-fixtures.yaml"), *more,
                    "--set", "state.folder=" + str(self.folder / "state")], stderr=subprocess.DEVNULL)
        self.eventually(lambda: (self.folder / "hapticd-demo.Control").exists())

    def hapticctl(self, *words):
        return subprocess.run([HAPTICCTL, "--socket", "hapticd-demo.Control", *words], cwd=self.folder, text=True,
                              capture_output=True, timeout=PATIENCE_S)

    def status(self):
        return json.loads(self.hapticctl("--json", "status").stdout)["status"]

    def eventually(self, condition):
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            if condition():
                return
            time.sleep(0.05)
        self.fail(f"not within {PATIENCE_S} s")

    def force_n(self):
        return max(map(abs, self.status()["tick"]["commandForceNInWorld"].values()))

    def try_device(self, options, arguments):
        port = free_port()
        words = command("build/release/bin/hapticd")
        self.box(*words[words.index("--set"):], "--set", f"udp_handle.port={port}", *options)
        _, script, _ = command("docs/examples/device.py")
        device = self.start([sys.executable, str(ROOT / script), f"127.0.0.1:{port}", *arguments])
        self.eventually(lambda: self.hapticctl("engage").returncode == 0)
        self.eventually(lambda: self.force_n() > 1)
        self.end(device)
        self.eventually(lambda: self.status()["mode"] in ("holding", "idle") and self.force_n() == 0)

    def test_a_device_in_python_is_held_by_the_ball(self):
        self.try_device([], [])

    def test_a_device_in_python_with_a_key_is_held_by_the_ball(self):
        key = self.folder / "udp.key"
        key.write_bytes(bytes(range(32)))
        key.chmod(0o640)
        self.try_device(["--set", f"udp_handle.key_file={key}"], [str(key)])

    def test_the_configuration_of_a_d435_is_valid(self):
        checked = subprocess.run([HAPTICD, "--check", "--config", EXAMPLES / "d435.yaml"], text=True, capture_output=True)
        self.assertEqual(0, checked.returncode, checked.stderr)
        self.assertIn("camera.driver = v4l2", checked.stdout)

    def test_a_standoff_keeps_the_hand_off(self):
        self.box()
        added = self.hapticctl(*command("hapticctl fixture add")[1:])
        self.assertEqual("added keep-off\n", added.stdout, added.stderr)
        self.eventually(lambda: any(state in self.hapticctl("fixture", "list").stdout for state in ("in contact", "breach")))

    def test_a_trace_is_read_by_numpy(self):
        self.box()
        for words in (command("hapticctl trace start"), command("hapticctl trace stop")):
            self.eventually(lambda: self.force_n() > 0)
            self.assertEqual(0, self.hapticctl(*words[1:]).returncode)
        name = json.loads(self.hapticctl("--json", "trace", "list").stdout)["traces"][0]["name"]
        export = [name if word == "NAME" else word for word in command("hapticctl trace export")[1:]]
        exported = self.hapticctl(*export)
        self.assertEqual(0, exported.returncode, exported.stderr)
        with_numpy = code("python").split("\n\n")[0].replace("NAME.mcap", f"state/traces/{name}.mcap")
        run = subprocess.run([sys.executable, "-c", with_numpy], cwd=self.folder, text=True, capture_output=True, env=self.environment)
        self.assertEqual(0, run.returncode, run.stderr)
        seconds, force_n = map(float, run.stdout.split())
        self.assertGreater(seconds, 0)
        self.assertGreater(force_n, 0)

    def need(self, *programs):
        for program in programs:
            if not shutil.which(program):
                self.skipTest(f"there is no {program}")

    def expect_forces(self, words):
        self.box()
        self.eventually(lambda: self.force_n() > 0)
        client = self.start(words, stdout=subprocess.PIPE)
        numbers = [re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", client.stdout.readline()) for _ in range(3)]
        self.assertEqual([3, 3, 3], list(map(len, numbers)))

    def test_python_prints_forces(self):
        self.expect_forces([sys.executable, str(EXAMPLES / "forces.py")])

    def test_c_prints_forces(self):
        self.need("cc")
        subprocess.run(["cc", "-Wall", "-Wextra", "-Werror", "-o", "forces", EXAMPLES / "forces.c"], cwd=self.folder, check=True)
        self.expect_forces(["./forces"])

    def test_a_shell_prints_forces(self):
        self.need("socat", "jq")
        self.expect_forces(["bash", "-c", shell_client().replace("/run/hapticd/io.hapticd.Status", "hapticd-demo.Status")])

    def test_the_units_that_send_mail_are_valid(self):
        self.need("systemd-analyze")
        units = [shutil.copy(ROOT / "systemd/examples" / name, self.folder)
                 for name in ("hapticd-mail.service", "hapticd-check.service", "hapticd-check.timer")]
        verified = subprocess.run(["systemd-analyze", "verify", *units], text=True, capture_output=True)
        self.assertEqual((0, ""), (verified.returncode, verified.stderr))


if __name__ == "__main__":
    result = unittest.main(exit=False).result
    sys.exit(77 if result.wasSuccessful() and result.skipped else not result.wasSuccessful())

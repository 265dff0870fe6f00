# SPDX-License-Identifier: Apache-2.0
"""A box whose depth comes from a camera that the kernel drives: its configuration, what is felt, its traces."""

import csv
import json
import math
import os
import shutil
import struct

from lab import (CONFIGURATION, DEPTH_TIMEOUT_S, LAB, SAFETY, counted, expect, force_n, main_pid, must, reaches, run,
                 status, unit_property)

TRACES = "/var/lib/hapticd/traces"
WORK = "/dev/shm/depth-box"

# On the tilted plane of the emulated scene, to the right of where its sphere moves; the hand goes in and out of it.
PLACE = (0.22, 0, -0.535)


def hand(x_m, y_m, z_m):
    return (f"safety: {{depth_timeout_s: {DEPTH_TIMEOUT_S}, {SAFETY}}}\n"
            f"simulated_handle: {{start_x_m: {x_m}, start_y_m: {y_m}, start_z_m: {z_m}, travel_m: 0.03, stroke_m: 0.01, "
            "press_s: 0.5, press_force_n: 3}\ncontrol: {engage_at_start: true}\ntrace: {min_free_mb: 20}\n")


def box(width=848, height=480, rate=30, law="nearest_springs", place=PLACE, **camera):
    """A configuration for a mode of the camera; `place`: where the hand begins; `camera`: further settings of it."""
    settings = {"driver": "v4l2", "near_m": 0.2, "width_px": width, "height_px": height, "rate_hz": rate, **camera}
    listed = ", ".join(f"{name}: {value}" for name, value in settings.items())
    return f"camera: {{{listed}}}\nforce: {{law: {law}}}\n" + hand(*place)


def install_tools():
    must("dpkg", "-i", LAB + "/hapticd-tools.deb", timeout=300)


def remove_tools():
    run("dpkg", "--purge", "hapticd-tools", timeout=300)
    shutil.rmtree(WORK, ignore_errors=True)


def streams(now):
    return now["camera"]["state"] == "streaming" and now["tick"]["sceneFrame"] > 0


def is_felt(now):
    return streams(now) and now["mode"] == "engaged" and force_n(now) > 0.1


def faded(now):
    return now["mode"] == "holding" and now["cause"] == "depth_stale" and force_n(now) == 0


class SameProcess:
    """For a `with` block: the service neither ends nor is started again in it."""

    def __enter__(self):
        self.before = self._now()

    def __exit__(self, kind, *_):
        if kind is None:
            expect(self._now() == self.before, f"process and restarts were {self.before} and are {self._now()}")

    @staticmethod
    def _now():
        return main_pid(), unit_property("NRestarts")


def answer(*arguments):
    return json.loads(must("hapticctl", "--json", *arguments))


def record(frames):
    """Records a trace with that many depth frames at least; returns its path."""
    name = answer("trace", "start", "--depth", "--label", "lab")["name"]
    reaches("depth in the trace", lambda now: now["trace"]["depthFrames"] >= frames, 120)
    lost = status()["trace"]
    answer("trace", "stop")
    expect(lost["ticksLost"] == 0 and lost["depthFramesLost"] == 0 or not counted(), str(lost))
    return f"{TRACES}/{name}.mcap"


def count_in(text, words):
    """The number before `words`."""
    return int(text.split(words)[0].split()[-1].lstrip("("))


def replayed_trace(path, least_in_contact):
    """What haptic-replay says of the trace: it computes each tick from the recorded depth again."""
    said = must("haptic-replay", "--trace", path, timeout=1200)
    expect("different: 0 ticks" in said and "largest difference: 0 N" in said, said)
    ticks, contact = count_in(said, " ticks computed again"), count_in(said, " in contact")
    expect(contact >= least_in_contact, said)
    return f"{ticks} ticks of the trace computed again, {contact} in contact, none differs by a bit"


def rows_of(path):
    with open(path) as file:
        return list(csv.DictReader(file))


class Recording:
    """The depth of a trace as a recording, with the trace's ticks and models."""

    def __init__(self, trace):
        self.folder = WORK + "/recording"
        shutil.rmtree(WORK, ignore_errors=True)
        os.makedirs(WORK)
        must("hapticctl", "trace", "export", trace, "--format", "recording", "--out", self.folder, timeout=600)
        self.ticks = self._channel(trace, "ticks")
        self.models = self._channel(trace, "models")
        self.frames = rows_of(self.folder + "/frames.csv")
        with open(self.folder + "/camera.yaml") as file:
            lines = [line.split(":", 1) for line in file if ":" in line]
        self.camera = {name.strip(): value.strip() for name, value in lines}

    @staticmethod
    def _channel(trace, channel):
        path = f"{WORK}/{channel}.csv"
        must("hapticctl", "trace", "export", trace, "--channel", channel, "--out", path, timeout=600)
        return rows_of(path)

    def pixels(self, frame):
        """The raw bytes of a frame, big-endian."""
        with open(f"{self.folder}/{self.frames[frame]['file']}", "rb") as file:
            expect(file.readline() == b"P5\n", "no PGM")
            size = file.readline().split()
            expect(file.readline() == b"65535\n", "not 16 bits")
            data = file.read()
        expect(len(data) == 2 * int(size[0]) * int(size[1]), f"{len(data)} bytes")
        return data

    def forces(self):
        """Per tick that was computed from a recorded frame: HIP, the law's force, the frame's place in the recording."""
        place = {row["device_ticks"]: index for index, row in enumerate(self.frames)}
        frame_of = {row["frame"]: place.get(row["device_ticks"]) for row in self.models}
        found = []
        for tick in self.ticks:
            frame = frame_of.get(tick["scene_frame"])
            if frame is None or tick["outside_model"] not in ("false", "0") or tick["mode"] not in ("engaged", "idle"):
                continue
            found.append((vector(tick, "hip_m_in_world"), vector(tick, "law_force_n_in_world"), frame))
        return found


def vector(row, name):
    return tuple(row[f"{name}_{axis}"] for axis in "xyz")


# haptic-replay writes 9 significant digits of forces up to some 10 N.
ROUNDING_N = 1e-7


def replayed_recording(recording, least_in_contact):
    """What haptic-replay computes from the exported depth at the trace's positions, compared with the trace."""
    forces = sorted(recording.forces(), key=lambda force: force[2])
    stamps = [int(row["time_ns"]) for row in recording.frames]
    with open(WORK + "/hip.csv", "w") as file:
        file.write("t_s,x_m,y_m,z_m\n")
        for number, (hip, _, frame) in enumerate(forces):
            file.write(f"{(stamps[frame] - stamps[0]) * 1e-9 + 0.0001 + number * 1e-9:.9f},{','.join(hip)}\n")
    must("haptic-replay", "--config", CONFIGURATION, "--depth", recording.folder, "--hip", WORK + "/hip.csv", "--out",
         WORK + "/forces.csv", "--force", timeout=1200)
    computed = rows_of(WORK + "/forces.csv")
    expect(len(computed) == len(forces), f"{len(computed)} of {len(forces)} forces")
    worst, in_contact = 0.0, 0
    for (_, felt, frame), row in zip(forces, computed):
        expect(int(row["frame"]) == frame, f"frame {row['frame']} instead of {frame}")
        felt_n = [float(value) for value in felt]
        worst = max(worst, math.dist(felt_n, [float(row[name]) for name in ("fx_n", "fy_n", "fz_n")]))
        in_contact += math.hypot(*felt_n) > 0.1
    expect(worst < ROUNDING_N, f"they differ by up to {worst:.3g} N")
    expect(in_contact >= least_in_contact, f"only {in_contact} of {len(forces)} in contact")
    return f"{len(forces)} forces from the exported depth, {in_contact} in contact, largest difference {worst:.1e} N"


def scene_steps(camera, column, row, phase):
    """The raw value of a pixel of the emulated scene (tests/vm/emulators/uvc/depth_scene.h), by its description alone."""
    x = (column - float(camera["cx_px"])) / float(camera["fx_px"])
    y = (row - float(camera["cy_px"])) / float(camera["fy_px"])
    depth_m = 0.6 / (1 + 0.25 * x + 0.1 * y)
    centre = (-0.07 + 0.02 * phase, 0.01, 0.45)
    a, b = x * x + y * y + 1, x * centre[0] + y * centre[1] + centre[2]
    discriminant = b * b - a * (sum(value * value for value in centre) - 0.06 ** 2)
    if discriminant >= 0:
        depth_m = min(depth_m, (b - math.sqrt(discriminant)) / a)
    return depth_m / float(camera["unit_m"])


def expect_scene(recording):
    """Every recorded frame is the next of the scene; returns how many pixels were compared with the scene itself.

    Frames that show the sphere at the same place have to be equal in each byte; of one frame of each place every
    sixteenth pixel of every sixteenth row is computed.
    """
    width, height = int(recording.camera["width_px"]), int(recording.camera["height_px"])
    first_of_phase, numbers, compared = {}, [], 0
    for index in range(len(recording.frames)):
        data = recording.pixels(index)
        number = sum((data[2 * i + 1] & 0xF) << 4 * i for i in range(8))  # it stands in the first eight pixels
        numbers.append(number)
        if number % 8 in first_of_phase:
            expect(data[16:] == first_of_phase[number % 8], f"frame {number} differs from those of the same place")
            continue
        first_of_phase[number % 8] = data[16:]
        for row in range(16, height, 16):
            for column in range(0, width, 16):
                raw, = struct.unpack_from(">H", data, 2 * (row * width + column))
                steps = scene_steps(recording.camera, column, row, number % 8)
                # rounded to a step; the camera states its intrinsics with 24 bits
                expect(abs(raw - steps) < 0.51, f"frame {number}, pixel ({column}, {row}): {raw} instead of {steps}")
                compared += 1
    gaps = sum(later - earlier - 1 for earlier, later in zip(numbers, numbers[1:]))
    return len(numbers), gaps, compared

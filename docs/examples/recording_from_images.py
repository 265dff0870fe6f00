#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes a recording for hapticd and haptic-replay from depth images, with Python's standard library alone.

    recording_from_images.py --fx 525 --fy 525 --cx 319.5 --cy 239.5 images/ recording/
    recording_from_images.py --fx 525 --fy 525 --cx 319.5 --cy 239.5 --unit-m 0.0002 \\
        --poses groundtruth.txt depth.txt recording/

The images are PNG files with 16 bits of grey, in millimetres unless --unit-m says otherwise, where 0 means that nothing
was measured. They come from a folder (all *.png in the order of their names, numbers in them by their values, --rate
apart) or from a list with one line 'SECONDS FILE' for each image, as data sets in the TUM RGB-D format have it; paths in
it are relative to the list. Lines that begin with # are ignored. A file of poses has lines 'SECONDS X Y Z QX QY QZ QW',
the pose of the optical frame in the world. With a list an image gets the pose nearest in time, if that is within 20 ms;
with a folder line N belongs to image N. Exit status: 0 done, 1 an error, which is named; the recording is then not made.
"""
import argparse
import math
import os
import re
import shutil
import struct
import sys
from bisect import bisect_left
from decimal import Decimal, InvalidOperation

NS_PER_S = 10**9
POSE_WITHIN_NS = 20 * 10**6
PNG_START = struct.Struct(">8sI4sIIBB")  # signature, length and name of the first chunk, width, height, bits, colour
PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
LEAST_SIDE, MOST_COLUMNS, MOST_ROWS = 16, 1280, 800
NORM_TOLERANCE = 0.01


def fail(text):
    sys.exit(f"recording_from_images.py: {text}")


def entries(path, values):
    """Returns 'FILE:LINE', the time in ns and the other values for each line that is not a comment."""
    try:
        with open(path, encoding="utf-8-sig") as lines:
            split = [(f"{path}:{number}", line.split()) for number, line in enumerate(lines, 1)]
    except (OSError, UnicodeDecodeError) as error:
        fail(f"{path}: cannot be read: {error}")
    found = []
    for where, cells in split:
        if not cells or cells[0].startswith("#"):
            continue
        if len(cells) != values + 1:
            fail(f"{where}: has {len(cells)} values, where a time and {values} more are expected")
        try:
            time = Decimal(cells[0])
            found.append((where, int(time * NS_PER_S), cells[1:]))
        except (InvalidOperation, ValueError, OverflowError):
            fail(f"{where}: {cells[0]!r} is not a time in seconds")
        if not 0 <= found[-1][1] < 2**63:
            fail(f"{where}: {cells[0]!r} is not a time in seconds from 0 on")
    return found


def natural_order(name):
    """frame2 comes before frame10; names that differ in leading zeros only keep an order."""
    parts = re.split(r"([0-9]+)", name)
    return [(int(part), part) if number % 2 else part for number, part in enumerate(parts)]


def images_of(source, rate_hz):
    """Returns 'where', the time in ns and the path for each image, in the order of time."""
    if os.path.isdir(source):
        names = sorted((name for name in os.listdir(source) if name.lower().endswith(".png")), key=natural_order)
        images = [(os.path.join(source, name), round(number * NS_PER_S / rate_hz), os.path.join(source, name))
                  for number, name in enumerate(names)]
    else:
        folder = os.path.dirname(source)
        images = [(where, time, os.path.join(folder, cells[0])) for where, time, cells in entries(source, 1)]
    if not images:
        fail(f"{source}: names no image; give a folder with *.png files, or a list with lines 'SECONDS FILE'")
    for (_, earlier, _), (where, later, _) in zip(images, images[1:]):
        if later <= earlier:
            fail(f"{where}: the time is not after that of the image before; sort the list")
    return images


def size_of(where, path):
    try:
        with open(path, "rb") as file:
            start = file.read(PNG_START.size)
    except OSError as error:
        fail(f"{where}: {error.strerror}: {path}")
    if len(start) < PNG_START.size or not start.startswith(PNG_SIGNATURE):
        fail(f"{where}: {path} is not a PNG file")
    _, _, _, width, height, bits, colour = PNG_START.unpack(start)
    if bits != 16 or colour != 0:
        fail(f"{where}: {path} does not have 16 bits of grey; colour images and images of 8 bits are not depth")
    if not (LEAST_SIDE <= width <= MOST_COLUMNS and LEAST_SIDE <= height <= MOST_ROWS):
        fail(f"{where}: {path} has {width} x {height} pixels; "
             f"{LEAST_SIDE} x {LEAST_SIDE} to {MOST_COLUMNS} x {MOST_ROWS} are possible")
    return width, height


def poses_of(path):
    """Returns the time in ns and the seven numbers as text for each pose."""
    poses = []
    for where, time, cells in entries(path, 7):
        try:
            numbers = [float(cell) for cell in cells]
        except ValueError:
            fail(f"{where}: a pose has numbers only")
        if not all(map(math.isfinite, numbers)):
            fail(f"{where}: a pose has finite numbers only")
        if abs(math.hypot(*numbers[3:]) - 1) > NORM_TOLERANCE:
            fail(f"{where}: the quaternion does not have the norm 1; its order is QX QY QZ QW")
        poses.append((time, [repr(number) for number in numbers]))
    return poses


def poses_by_image(images, poses, path, in_order):
    if in_order:
        if len(poses) != len(images):
            fail(f"{path}: has {len(poses)} poses for {len(images)} images; give a list of the images with their times")
        return [numbers for _, numbers in poses]
    poses = sorted(poses)
    times = [time for time, _ in poses]
    found = []
    for _, time, _ in images:
        after = bisect_left(times, time)
        near = [poses[i] for i in (after - 1, after) if 0 <= i < len(poses)]
        nearest = min(near, key=lambda pose: abs(pose[0] - time), default=None)
        found.append(nearest[1] if nearest and abs(nearest[0] - time) <= POSE_WITHIN_NS else [""] * 7)
    return found


def camera_text(options, width, height):
    optional = "".join(f"  {name}: {value!r}\n" for name, value in (("near_m", options.near), ("far_m", options.far))
                       if value is not None)
    noise = (options.noise_c0_m, options.noise_c1, options.noise_c2_per_m)
    return (f"recording:\n  version: 1\ncamera:\n  width_px: {width}\n  height_px: {height}\n"
            f"  fx_px: {options.fx!r}\n  fy_px: {options.fy!r}\n  cx_px: {options.cx!r}\n  cy_px: {options.cy!r}\n"
            f"  law: linear\n  unit_m: {options.unit_m!r}\n  raw_no_measurement: 0\n"
            f"  principle: {options.principle}\n{optional}"
            "noise:\n" + "".join(f"  {name}: {value!r}\n" for name, value in zip(("c0_m", "c1", "c2_per_m"), noise)))


def number(text):
    value = float(text)
    if not math.isfinite(value):
        raise ValueError
    return value


def positive(text):
    value = number(text)
    if value <= 0:
        raise ValueError
    return value


def not_negative(text):
    value = number(text)
    if value < 0:
        raise ValueError
    return value


def parsed():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", help="folder of images, or a list of them with their times")
    parser.add_argument("recording", help="folder to make, which must not exist")
    for name in ("fx", "fy"):
        parser.add_argument(f"--{name}", type=positive, required=True, metavar="PX", help="focal length in pixels")
    for name in ("cx", "cy"):
        parser.add_argument(f"--{name}", type=number, required=True, metavar="PX", help="principal point in pixels")
    parser.add_argument("--unit-m", type=positive, default=0.001, metavar="M",
                        help="depth of one raw unit in metres (0.001; TUM RGB-D: 0.0002)")
    parser.add_argument("--rate", type=positive, default=30.0, metavar="HZ", help="images per second of a folder (30)")
    parser.add_argument("--poses", metavar="FILE", help="lines 'SECONDS X Y Z QX QY QZ QW'")
    parser.add_argument("--near", type=positive, metavar="M", help="the camera measures nothing nearer")
    parser.add_argument("--far", type=positive, metavar="M", help="the camera measures nothing farther")
    parser.add_argument("--principle", choices=("structured_light", "active_stereo", "time_of_flight"),
                        default="active_stereo", help="how the camera measures (active_stereo)")
    for name, unit in (("c0-m", "m"), ("c1", "1"), ("c2-per-m", "1/m")):
        parser.add_argument(f"--noise-{name}", type=not_negative, default=0.0, metavar="C",
                            help=f"coefficient of sigma(Z) = c0 + c1 Z + c2 Z^2, in {unit} (0: not known)")
    return parser.parse_args()


def main():
    options = parsed()
    if os.path.lexists(options.recording):
        fail(f"{options.recording}: exists already; name a folder that does not")
    images = images_of(options.source, options.rate)
    width, height = size_of(*images[0][::2])
    for where, _, path in images[1:]:
        if size_of(where, path) != (width, height):
            fail(f"{where}: {path} does not have {width} x {height} pixels as the first image has")
    columns = "file,time_ns"
    poses = [[]] * len(images)
    if options.poses is not None:
        columns += ",x_m,y_m,z_m,qx,qy,qz,qw"
        poses = poses_by_image(images, poses_of(options.poses), options.poses, os.path.isdir(options.source))

    unfinished = options.recording.rstrip("/") + ".unfinished"
    try:
        os.mkdir(unfinished)
    except OSError as error:
        fail(f"{unfinished}: cannot be made: {error.strerror}")
    try:
        lines = [columns]
        for count, ((_, time, path), pose) in enumerate(zip(images, poses), 1):
            name = f"depth-{count:06}.png"
            shutil.copyfile(path, os.path.join(unfinished, name))
            lines.append(",".join([name, str(time), *pose]))
        for name, text in (("camera.yaml", camera_text(options, width, height)), ("frames.csv", "\n".join(lines) + "\n")):
            with open(os.path.join(unfinished, name), "w", encoding="utf-8") as file:
                file.write(text)
        os.rename(unfinished, options.recording)
    except OSError as error:
        shutil.rmtree(unfinished, ignore_errors=True)
        fail(f"{options.recording}: cannot be written: {error}")
    with_pose = sum(1 for pose in poses if pose and pose[0])
    print(f"{options.recording}: {len(images)} frames of {width} x {height} pixels, {with_pose} with a pose")


if __name__ == "__main__":
    main()

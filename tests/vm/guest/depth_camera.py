# SPDX-License-Identifier: Apache-2.0
"""Depth cameras of the USB video class, driven by the kernel's uvcvideo: what it offers, every pixel, and faults."""

import json
import os
import struct
import subprocess
import time
import zlib

import devices
import video_nodes
from lab import LAB, check, counted, expect, must, read, run, status, wait_for, write

camera = None


def prepare():
    global camera
    camera = devices.DepthCamera()


def finish():
    if camera:
        camera.end()


def command(node, seconds, options):
    words = [f"{LAB}/bin/capture-depth", "--device", node, "--seconds", str(seconds)]
    for name, value in options.items():
        words += ["--" + name.replace("_", "-"), str(value)]
    return words


def capture(seconds, **options):
    """What capture-depth saw."""
    said = must(*command(camera.node(), seconds, options), timeout=3000)
    return json.loads(said.splitlines()[-1])


def begun(seconds):
    """A capture in the background that has got its first frames."""
    running = subprocess.Popen(command(camera.node(), seconds, {}), stdout=subprocess.PIPE, text=True)
    wait_for("it streams", lambda: camera.stats()["streaming"] and camera.stats()["frames"] > 5, 30)
    return running


def expect_whole(seen, least_frames):
    """Nothing that the bus has delivered is lost or wrong; where the guest takes too long the camera skips a frame."""
    for name in ("lost", "damaged", "wrong_frames", "wrong_pixels", "silences"):
        expect(seen[name] == 0, f"{name}: {seen}")
    expect(seen["skipped"] <= 2 or not counted(), f"skipped: {seen}")
    # an emulated CPU in real time takes a frame now and then
    expect(seen["frames"] >= (least_frames if counted() else 3) and seen["ended"] == "in time", str(seen))


@check("uvcvideo offers each size and rate of the camera as Z16, on a node that is named after it")
def enumerated():
    with video_nodes.Node(camera.node()) as node:
        expect(node.formats() == ["Z16 "], str(node.formats()))
        sizes = node.sizes("Z16 ")
        expect(sizes == [(640, 480), (848, 480), (1280, 720), (640, 360), (480, 270), (424, 240)], str(sizes))
        expect(node.rates("Z16 ", 848, 480) == [30, 60, 90], str(node.rates("Z16 ", 848, 480)))
    return wait_for("a name by serial number", lambda: [link for link in os.listdir("/dev/v4l/by-id")
                                                        if camera.serial in link and link.endswith("video-index0")])[0]


@check("the extension unit answers through UVCIOC_CTRL_QUERY: details, intrinsics, table with checksum, depth unit")
def hardware_monitor():
    with video_nodes.Node(camera.node()) as node:
        expect(node.unit(1, video_nodes.GET_LEN, bytes(2)) == struct.pack("<H", 1024), "length of selector 1")
        echo, details = node.monitor(0x10)
        expect(echo == 0x10 and details[12:16] == bytes((1, 0, 16, 5)), f"firmware {echo} {details[:20].hex()}")
        expect(details[48:54].hex() == "813522070123", details[48:54].hex())
        echo, modes = node.monitor(0x7E)
        items = [struct.unpack_from("<HH4f", modes, at) for at in range(0, len(modes), 20)]
        expect((848, 480, 424.0, 424.0, 425.75, 237.75) in [tuple(round(value, 2) for value in item) for item in items],
               str(items))
        echo, table = node.monitor(0x15, 25)
        kind, size, _, checksum = struct.unpack_from("<HIII", table, 2)
        expect((kind, size) == (25, 560) and len(table) == 576, f"{kind} {size} {len(table)}")
        expect(checksum == zlib.crc32(table[16:]), "checksum")
        values = struct.unpack("<Iiiii", node.monitor(0x2C, 9, 0)[1])
        expect(values == (1000, 0, 65535, 0, 0), str(values))
        node.monitor(0x2B, 9, 0, data=struct.pack("<Iiiii", 100, 0, 65535, 0, 0))
        expect(struct.unpack_from("<I", node.monitor(0x2C, 9, 0)[1])[0] == 100, "the unit was not taken")
        echo, _ = node.monitor(0x99)
        expect(echo < 0, f"an unknown command: {echo}")
        temperatures = node.unit(9, video_nodes.GET_CUR, bytes(4))
        expect(temperatures == bytes((1, 1, 31, 38)), temperatures.hex())
    try:
        expect_whole(capture(2, unit_um=100), 10)
    finally:
        camera.replug()


def late_ticks():
    return status()["loop"]["counters"]["overruns"]


def streams(seconds, width, height, rate):
    began, late = time.monotonic(), late_ticks()
    seen = capture(seconds, width=width, height=height, rate=rate)
    expect_whole(seen, seconds * rate - rate // 3 - 2)
    expect(abs(seen["interval_us"] - 1e6 / rate) < 2, str(seen["interval_us"]))
    late = late_ticks() - late
    expect(late == 0 or not counted(), f"{late} ticks of the daemon beside it were late")
    return (f"{seen['frames']} frames in {time.monotonic() - began:.1f} s, {seen['lost']} lost, {seen['skipped']} skipped, "
            f"{seen['wrong_pixels']} wrong pixels, {late} late ticks beside it")


@check("60 s of 848 x 480 at 90 Hz: no frame is lost, every pixel is right", only_counted=True)
def fast():
    return streams(60, 848, 480, 90)


@check("60 s of 848 x 480 at 30 Hz: no frame is lost, every pixel is right", only_counted=True)
def usual():
    return streams(60, 848, 480, 30)


@check("each size streams with every pixel right")
def all_sizes():
    return "; ".join(streams(4, width, height, 30)
                     for width, height in ((1280, 720), (640, 480), (640, 360), (480, 270), (424, 240)))


@check("a damaged frame is dropped, the frames around it arrive")
def single_faults():
    said = []
    for fault in ("silent", "header-long", "header-short", "error-bit", "frame-short", "frame-long", "other-size",
                  "empty-payload"):
        running = begun(4)
        spoilt = camera.stats()["spoilt"]
        camera.tell(f"fault {fault} once")
        seen = json.loads(running.communicate(timeout=300)[0])
        said.append(f"{fault} {seen['frames']}/{seen['lost']}/{seen['skipped']}/{seen['damaged']}")
        expect(seen["wrong_pixels"] == 0 and seen["ended"] == "in time", f"{fault}: {seen}")
        expect(camera.stats()["spoilt"] == spoilt + 1, f"{fault}: no frame was damaged")
        missing = seen["skipped"] + seen["damaged"]
        expect(1 <= missing <= 3 and seen["frames"] > 110 if counted() else missing >= 1, f"{fault}: {seen}")
    return ", ".join(said)


@check("while frames are damaged none arrives as whole; afterwards all do")
def lasting_faults():
    said = []
    for fault in ("silent", "header-long", "header-short", "error-bit", "frame-short", "other-size", "empty-payload"):
        camera.tell("fault " + fault)
        seen = capture(1.5)
        camera.tell("resume")
        said.append(f"{fault} {seen['frames']} ({seen['damaged']} marked)")
        expect(seen["frames"] == seen["damaged"], f"{fault}: {seen}")
        expect_whole(capture(1.5), 10)
    return ", ".join(said)


@check("a camera that states half the size of its frames streams all the same: the kernel computes it")
def lies():
    camera.replug("fault lies-about-size")
    seen = capture(2)
    camera.replug("resume")
    expect_whole(seen, 10)


@check("unplugged while it streams, the node fails at once; replugged with another mode it offers that one")
def another_mode():
    running = begun(30)
    camera.replug("modes 424x240")
    seen = json.loads(running.communicate(timeout=300)[0])
    expect("No such device" in seen["ended"], str(seen))
    with video_nodes.Node(camera.node()) as node:
        expect(node.sizes("Z16 ") == [(424, 240)], str(node.sizes("Z16 ")))
    refused = run(*command(camera.node(), 1, {}))
    expect(refused.returncode == 69 and "424x240" in refused.stdout, refused.stdout)
    expect_whole(capture(2, width=424, height=240), 10)
    camera.replug("modes all")


@check("with broken descriptors the kernel offers no depth, and works on")
def broken_descriptors():
    said = []
    for fault in ("unknown-format", "no-frames", "frame-zero", "interval-zero", "no-endpoint", "descriptor-cut"):
        camera.replug("fault " + fault)
        wait_for("it is looked at", lambda: camera.stats()["configured"])
        time.sleep(0.5)
        done = run(*command(camera.node(), 1, {})) if not camera.is_absent() else None
        said.append(f"{fault}: " + ("no node" if done is None else done.stdout.strip()[-90:]))
        expect(done is None or done.returncode == 69 or json.loads(done.stdout.splitlines()[-1])["wrong_pixels"] == 0,
               f"{fault}: {done}")
        camera.tell("resume")
    camera.replug()
    expect_whole(capture(1.5), 10)
    return "; ".join(said)


@check("the metadata node carries times, and RealSense's own blocks once the kernel knows the camera as one")
def metadata():
    def offered():
        with video_nodes.Node(camera.nodes()[1]) as node:
            return node.formats(video_nodes.META_CAPTURE)
    wait_for("nodes", camera.nodes)
    before = offered()
    write("/sys/bus/usb/drivers/uvcvideo/new_id", "8086 0b07 0e 8086 0b03")
    camera.replug()
    wait_for("nodes", camera.nodes)
    after = offered()
    with video_nodes.Node(camera.nodes()[1]) as node:
        node.choose_metadata("D4XX")
        running = begun(6)
        timings = [video_nodes.timing_of(buffer) for buffer in node.metadata(20 if counted() else 3)]
    running.communicate(timeout=300)
    write("/sys/bus/usb/drivers/uvcvideo/remove_id", "8086 0b07")
    camera.replug()
    expect(before == ["UVCH"] and after == ["UVCH", "D4XX"], f"{before}, then {after}")
    expect(len(timings) >= 3 and all(timing[:4] == (0x80000001, 40, 1, 0x3F) for timing in timings), str(timings[:2]))
    numbers = [timing[4] for timing in timings]
    expect(all(later > earlier for earlier, later in zip(numbers, numbers[1:])), f"frame counters: {numbers}")
    expect(all(timing[5] == timing[7] // 2 and timing[8] == 33333 for timing in timings), str(timings[:2]))
    return f"{before}, then {after}; exposure {timings[0][7]} us"


@check("an Orbbec camera enumerates beside it, answers its own protocol and streams")
def orbbec():
    second = devices.DepthCamera("CP0E54000042", "orbbec", ("--model", "gemini335"))
    try:
        with video_nodes.Node(second.node()) as node:
            error, unit = node.orbbec(1, struct.pack("<I", 176), 2)
            expect((error, struct.unpack_from("<f", unit)[0]) == (0, 1.0), f"{error} {unit.hex()}")
            error, told = node.orbbec(29, struct.pack("<I", 4027), 2)
            version, size = struct.unpack_from("<HI", told)
            expect((error, version, size) == (0, 0, 4 * 152), f"{error} {version} {size}")
            error, items = node.orbbec(30, struct.pack("<III", 4027, 0, size), 2, 3)
            fx, fy, cx, cy, width, height = struct.unpack_from("<4f2h", items)
            expect(error == 0 and (width, height) == (848, 480) and abs(fx - 454.69) < 0.1, f"{fx} {fy} {cx} {cy}")
        said = must(*command(second.node(), 3, {"model": "gemini335", "width": 848, "height": 480}))
        expect_whole(json.loads(said.splitlines()[-1]), 10)
    finally:
        second.end()


@check("vivid is a second source: it streams 16-bit grey, Y16")
def vivid():
    must("modprobe", "vivid", "n_devs=1", "node_types=0x1")
    try:
        names = [f"/sys/class/video4linux/{name}/name" for name in os.listdir("/sys/class/video4linux")]
        path = next(name for name in names if "vivid" in read(name)).split("/")[-2]
        with video_nodes.Node("/dev/" + path) as node:
            expect("Y16 " in node.formats(), str(node.formats()))
        said = must(*command("/dev/" + path, 3, {"format": "Y16 ", "width": 640, "height": 360}))
        seen = json.loads(said.splitlines()[-1])
        expect(seen["frames"] > 10 and seen["damaged"] == 0 and seen["ended"] == "in time", str(seen))
    finally:
        wait_for("vivid is unloaded", lambda: run("modprobe", "-r", "vivid").returncode == 0)

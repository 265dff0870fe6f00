# SPDX-License-Identifier: Apache-2.0
"""The installed service on depth cameras that misbehave: unplugged, mute, damaged, and of wrong descriptions."""

import time

import devices
import installation
from depth_box import SameProcess, box, faded, is_felt, streams
from lab import Failure, check, configure, counted, expect, is_active, reaches, run, status, wait_for

camera = None


def prepare():
    global camera
    configure(box())
    camera = devices.DepthCamera(name="depth-faults")
    reaches("a force", is_felt, 30)


def finish():
    if camera:
        camera.end()
    configure(installation.SIMPLE)


def says(text):
    return lambda now: text in now["camera"]["detail"] or text in now["camera"]["advice"]


def returns(seconds=30):
    """The force is there again."""
    began = time.monotonic()
    reaches("a force", is_felt, seconds)
    return time.monotonic() - began


def is_lost(now):
    return now["camera"]["state"] == "lost"


@check("unplugged while it is felt: the force fades, the driver says so, and both return by themselves")
def unplugged():
    with SameProcess():
        camera.tell("unplug")
        now = reaches("the camera is lost and the force gone", lambda now: is_lost(now) and faded(now), 20)
        detail = now["camera"]["detail"]
        camera.tell("replug")
        return f"{detail}; force {returns():.2f} s after it was plugged in again"


@check("plugged in with another mode it is refused with the list; it serves once configured, or with its modes again")
def another_mode():
    refusal = "answers with 424 x 240 instead of 848 x 480"
    with SameProcess():
        camera.replug("modes 424x240")
        now = reaches("the refusal", says(refusal), 20)
        detail = now["camera"]["detail"]
        expect("one of: 424 x 240" in detail and is_lost(now), detail)
        reaches("no force", faded, 20)
        time.sleep(3)
        expect(says(refusal)(status()), "it no longer searches")
        camera.replug("modes all")
        first_s = returns()
        camera.replug("modes 424x240")
        reaches("the refusal", says(refusal), 20)
    configure(box(424, 240))
    now = reaches("a force", is_felt, 30)
    expect(now["camera"]["details"]["widthPx"] == 424, str(now["camera"]))
    camera.replug("modes all")
    configure(box())
    returns()
    return f"{detail}; force {first_s:.2f} s after all modes were back"


# Whether the kernel notices the loss of a single frame by the numbers of the others.
SINGLE = {"silent": False, "header-long": True, "header-short": False, "error-bit": True, "frame-short": True,
          "frame-long": True, "other-size": True, "empty-payload": True, "frame-id-stuck": False,
          "frame-repeated": False}


@check("a single damaged frame costs that frame: no force is lost, and the status counts it where the kernel does")
def single_faults():
    said = []
    reaches("a force", is_felt, 30)
    with SameProcess():
        for fault, counted_as_lost in SINGLE.items():
            before, spoilt = status()["camera"], camera.stats()["spoilt"]
            camera.tell(f"fault {fault} once")
            now = reaches("frames after it", lambda now: camera.stats()["spoilt"] > spoilt
                          and now["camera"]["frames"] > before["frames"] + 10, 20)
            gone = now["camera"]["lostFrames"] + now["camera"]["damagedFrames"] - before["lostFrames"] - before["damagedFrames"]
            said.append(f"{fault} {gone}")
            expect(gone >= counted_as_lost, f"{fault}: {now['camera']}")
            expect(now["mode"] == "engaged" or not counted(), f"{fault}: {now['mode']} {now['cause']}")
            expect(now["camera"]["state"] == "streaming", f"{fault}: {now['camera']}")
    return "counted as lost or damaged: " + ", ".join(said)


@check("while all frames are damaged the force fades as with stale depth, and it returns when they are whole")
def lasting_faults():
    said = []
    with SameProcess():
        for fault in ("silent", "header-long", "header-short", "error-bit", "frame-short", "other-size", "empty-payload"):
            camera.tell("fault " + fault)
            now = reaches(f"{fault}: no force", lambda now: is_lost(now) and faded(now), 30)
            expect("stopped sending frames" in now["camera"]["detail"], now["camera"]["detail"])
            camera.tell("resume")
            said.append(f"{fault} {returns():.1f} s")
    return "back after " + ", ".join(said)


@check("frames too long, repeated or with a frame id that stands still end neither the daemon nor the search")
def strange_frames():
    said = []
    with SameProcess():
        for fault in ("frame-long", "frame-repeated", "frame-id-stuck"):
            before = status()["camera"]["frames"]
            camera.tell("fault " + fault)
            time.sleep(6)
            now = status()
            said.append(f"{fault}: {now['camera']['frames'] - before} frames in 6 s, {now['mode']}")
            camera.tell("resume")
            returns()
    return "; ".join(said)


@check("a camera that no longer answers while it streams loses no frame; plugged in again like that it is named")
def mute():
    with SameProcess():
        reaches("a temperature", lambda now: now["camera"]["details"]["temperatureC"] is not None, 20)
        before = status()
        camera.tell("fault mute")
        now = reaches("no temperature", lambda now: now["camera"]["details"]["temperatureC"] is None, 30)
        stale = now["loop"]["counters"]["depthStaleTicks"] - before["loop"]["counters"]["depthStaleTicks"]
        expect(stale == 0 and streams(now) and now["camera"]["lostFrames"] == before["camera"]["lostFrames"]
               or not counted(), f"{stale} ticks with stale depth, {now['camera']}")
        camera.tell("fault silent")
        reaches("it is opened again", lambda now: is_lost(now) and "stopped sending" not in now["camera"]["detail"], 60)
        named = status()["camera"]["detail"]
        expect("does not answer" in named, named)
        reaches("no force", faded, 20)
        camera.tell("resume")
        returned_s = returns(60)
        camera.tell("fault mute")
        camera.replug()
        now = reaches("it is missed", lambda now: is_lost(now) and "no video device" in now["camera"]["detail"], 60)
        camera.replug("resume")
        returns(60)
        expect(is_active(), "the service ended")
    return f"opened again: {named}; back {returned_s:.1f} s after it answers; plugged in mute: {now['camera']['detail']}"


# Of what the kernel makes no video device, or one that cannot stream.
DESCRIPTOR_FAULTS = ("unknown-format", "no-frames", "frame-zero", "interval-zero", "no-endpoint", "descriptor-cut")
# What the status says of each.
D435_FAULTS = {
    "no-unit": "no control 1 in its extension unit 3",
    "unit-stalls": "no control 1 in its extension unit 3, or refuses it",
    "unit-length": "control 1 does not have 1024 bytes",
    "monitor-error": "the command 0x10 fails with error",
    "monitor-echo": "the reply to the command 0x10 is to 0x11",
    "monitor-length": "states 100000 bytes",
    "no-mode-table, table-checksum": "has the checksum",
    "no-mode-table, table-size": "RealSense table 25: has 512 bytes",
    "no-mode-table, table-type": "is of type",
    "no-mode-table, table-focal-zero": "the focal length (0, ",
    "mode-not-finite, table-checksum": "has the checksum",
    "unit-zero": "has a unit of 0 um",
    "disparity": "delivers disparities instead of depth",
}
# A part of what the camera reports is wrong, and the rest serves.
D435_WARNINGS = {
    "lies-about-size": "",
    "no-mode-table": "",
    "mode-not-listed": "",
    "mode-not-finite": "the focal length (nan, ",
    "table-checksum": "has the checksum",
    "table-size": "RealSense table 25: has 512 bytes",
    "table-type": "is of type",
    "table-focal-zero": "the focal length (0, ",
}
GEMINI_FAULTS = {
    "response-magic": "begins with 0x0000 instead of 0x4252",
    "response-number": "the response to request",
    "response-error": "the camera refuses property 1000 with error",
    "list-size": "are not a list of items of 152 bytes",
    "mode-not-listed": "Orbbec list: states 0 bytes",
    "mode-not-finite": "the focal length (nan, ",
    "unit-zero": "Orbbec depth unit: is 0 m",
    "unit-stalls": "no control 2 in its extension unit 3, or refuses it",
    "unit-length": "control 2 does not have 64 bytes",
    "no-unit": "no control 2 in its extension unit 3",
}


def plugged_in_with(device, faults):
    device.replug("resume", *("fault " + name for name in faults.split(", ")))


def shows(faults, condition, wrong):
    """The camera's status once the condition holds, or what it is instead, which is added to `wrong`."""
    try:
        return reaches("what the status shall say", condition, 10)["camera"]
    except Failure:
        now = status()["camera"]
        wrong.append(f"{faults}: {now['state']}, {now['detail']}, {now['advice']}")
        return now


def refused(device, faults):
    """Per fault what the status says; the device streams again after each."""
    said, wrong = [], []
    with SameProcess():
        for names, expected in faults.items():
            plugged_in_with(device, names)
            now = shows(names, lambda now: is_lost(now) and says(expected)(now), wrong)
            said.append(f"{names}: {now['detail']}")
            device.replug("resume")
            reaches(f"frames after {names}", streams, 30)
    expect(not wrong, " | ".join(wrong))
    return said


@check("a D435 with broken descriptors is missed or refused, searched on, and used when they are right again",
       only_counted=True)
def broken_descriptors():
    configure(box(424, 240))
    reaches("frames", streams, 30)
    said = []
    with SameProcess():
        for fault in DESCRIPTOR_FAULTS:
            plugged_in_with(camera, fault)
            wait_for("the kernel has looked at it", lambda: camera.stats()["configured"])
            time.sleep(3)
            now = status()["camera"]
            expect(now["state"] == "lost" and "is gone" not in now["detail"], f"{fault}: {now}")
            listed = run("hapticctl", "camera", "list").stdout.splitlines()[0]
            said.append(f"{fault}: {now['detail']}; camera list: {listed}")
            camera.replug("resume")
            reaches(f"frames after {fault}", streams, 30)
    return f"{len(said)} kinds: " + " | ".join(said)


@check("a D435 with a wrong description is refused with its reason, searched on, and used when it is right again",
       only_counted=True)
def bad_d435():
    configure(box(424, 240))
    reaches("frames", streams, 30)
    said = refused(camera, D435_FAULTS)
    return f"{len(said)} kinds: " + " | ".join(said)


@check("a D435 whose description is wrong in part serves with what is right, and the status says what is wrong",
       only_counted=True)
def partly_bad_d435():
    said, wrong = [], []
    with SameProcess():
        for names, expected in D435_WARNINGS.items():
            plugged_in_with(camera, names)
            reaches("it is gone", is_lost, 20)
            now = shows(names, lambda now: is_felt(now) and expected in now["camera"]["advice"]
                        and bool(expected) == bool(now["camera"]["advice"]), wrong)
            said.append(f"{names}: {now['advice'] or 'as usual'}")
        camera.replug("resume")
    expect(not wrong, " | ".join(wrong))
    return f"{len(said)} kinds: " + " | ".join(said)


@check("an Orbbec camera with wrong answers is refused with its reason, searched on, and used when it is right again",
       only_counted=True)
def bad_gemini():
    gemini = devices.DepthCamera("CP0E54000042", "bad-orbbec", ("--model", "gemini335"))
    try:
        configure(box(640, 480, serial=gemini.serial))
        reaches("a force", is_felt, 30)
        said = refused(gemini, GEMINI_FAULTS)
    finally:
        gemini.end()
        configure(box())
    reaches("frames", streams, 20)
    return f"{len(said)} kinds: " + " | ".join(said)

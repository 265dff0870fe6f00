# SPDX-License-Identifier: Apache-2.0
"""The installed service on depth cameras that uvcvideo drives: what it shows of them, and the forces of their depth."""

import json
import time

import depth_box
import devices
import installation
from depth_box import Recording, box, is_felt, streams
from lab import check, configure, counted, expect, monitor, must, reaches, run, status, write

camera = None
# An emulated CPU in real time takes a frame now and then, and its force thread does not get every tick.
RECORDED_FRAMES = 45 if counted() else 15
LEAST_IN_CONTACT = 300 if counted() else 50


def prepare():
    global camera
    depth_box.install_tools()
    configure(box())
    camera = devices.DepthCamera(name="depth-force")


def finish():
    if camera:
        camera.end()
    depth_box.remove_tools()
    configure(installation.SIMPLE)


@check("a D435 that is plugged in is found: serial number, firmware, mode and temperature; its unit is set to 100 um")
def found():
    began = time.monotonic()
    now = reaches("frames", streams, 20)
    took_s = time.monotonic() - began
    rights = must("stat", "-c", "%a %G", camera.node()).strip()
    expect(rights == "660 hapticd", f"the node is {rights}")
    now = reaches("its temperature", lambda now: now["camera"]["details"]["temperatureC"] == 38, 10)
    details = now["camera"]["details"]
    shown = (details["serial"], details["firmware"], details["format"], details["widthPx"], details["heightPx"],
             details["rateHz"])
    expect(shown == ("813522070123", "5.16.0.1", "Z16", 848, 480, 30), str(details))
    expect(camera.serial in now["camera"]["identity"], now["camera"]["identity"])
    expect(now["camera"]["advice"] == "", now["camera"]["advice"])
    expect(camera.stats()["depth_unit_um"] == 100, str(camera.stats()))
    return f"frames after {took_s:.2f} s; {now['camera']['identity']}, firmware {details['firmware']}, 38 degrees"


def observed(seconds, rate):
    """Two clients watch for that time; what the camera sent and the daemon used of it."""
    reaches("frames", streams, 20)
    sent, before = camera.stats(), status()
    replies = monitor(seconds, 200)
    after, sent_after = status(), camera.stats()

    def grew(*path):
        values = []
        for now in (before, after):
            for name in path:
                now = now[name]
            values.append(now)
        return values[1] - values[0]

    sent_frames, skipped = sent_after["frames"] - sent["frames"], sent_after["skipped"] - sent["skipped"]
    frames, models = grew("camera", "frames"), grew("scene", "models")
    ticks, late = grew("loop", "counters", "ticks"), grew("loop", "counters", "overruns")
    worst_us = max(reply["window"]["maxWakeupLatencyNs"] or 0 for reply in replies[1:]) / 1000
    expect(grew("camera", "lostFrames") == 0 and grew("camera", "damagedFrames") == 0 or not counted(),
           str(after["camera"]))
    expect(abs(sent_frames - frames) <= 3 or not counted(), f"{sent_frames} frames were sent, {frames} arrived")
    if counted():
        expect(skipped == 0, f"the camera found no room for {skipped} frames")
        expect(abs(frames - seconds * rate) <= 4, f"{frames} frames in {seconds} s")
        expect(ticks > 990 * seconds and late == 0, f"{late} of {ticks} ticks late")
        expect(grew("loop", "counters", "depthStaleTicks") == 0, "depth was stale")
    return (f"{frames} frames of {sent_frames} sent in {seconds} s, {grew('camera', 'lostFrames')} lost, "
            f"{grew('camera', 'damagedFrames')} damaged, {models} models, {ticks} ticks, {late} late, worst wake-up "
            f"{worst_us:.0f} us")


# "late" and "lost" of a real boot are those of an emulated CPU: they are printed, and asserted in the counted boot only.
@check("848 x 480 at 30 Hz: every frame that the bus delivers arrives" + (", no tick is late" if counted() else ""))
def usual_rate():
    return observed(20 if counted() else 6, 30)


@check("848 x 480 at 90 Hz for 60 s: every frame that the bus delivers arrives and no tick is late", only_counted=True)
def fast():
    configure(box(rate=90))
    try:
        return observed(60, 90)
    finally:
        configure(box())


def felt_and_replayed():
    reaches("a force", is_felt, 30)
    trace = depth_box.record(RECORDED_FRAMES)
    return trace, depth_box.replayed_trace(trace, LEAST_IN_CONTACT)


@check("the hand feels the emulated plane; a replay of the trace computes the same forces")
def felt():
    configure(box(law="surface"))
    return felt_and_replayed()[1]


@check("the depth of a trace is that of the scene; the forces of its export equal those that were felt")
def exported():
    configure(box())
    trace, said = felt_and_replayed()
    recording = Recording(trace)
    shown = {name: float(recording.camera[name]) for name in ("fx_px", "fy_px", "cx_px", "cy_px", "unit_m")}
    expect(abs(shown["fx_px"] - 424) < 1e-3 and shown["cx_px"] == 425.75 and shown["cy_px"] == 237.75, str(shown))
    expect(abs(shown["unit_m"] - 1e-4) < 1e-12, str(shown))
    frames, gaps, compared = depth_box.expect_scene(recording)
    expect(gaps == 0 or not counted(), f"{gaps} frames are missing")
    forces = depth_box.replayed_recording(recording, LEAST_IN_CONTACT)
    return f"{frames} frames, {compared} pixels computed anew; {forces}; {said}"


@check("where the kernel knows the camera as a RealSense, the age of a frame counts from its exposure")
def exposure():
    trace = depth_box.record(10)
    before = [row["exposure_ns"] for row in Recording(trace).frames]
    write("/sys/bus/usb/drivers/uvcvideo/new_id", "8086 0b07 0e 8086 0b03")
    try:
        camera.replug()
        reaches("the camera is lost", lambda now: now["camera"]["state"] != "streaming")
        reaches("a force", is_felt, 30)
        recording = Recording(depth_box.record(20))
    finally:
        write("/sys/bus/usb/drivers/uvcvideo/remove_id", "8086 0b07")
        camera.replug()
    reaches("a force", is_felt, 30)
    expect(not any(value not in ("", "0") for value in before), str(before[:3]))
    ages_ms = [(int(row["time_ns"]) - int(row["exposure_ns"])) * 1e-6 for row in recording.frames if row["exposure_ns"]]
    expect(len(ages_ms) == len(recording.frames) or not counted(), f"{len(ages_ms)} of {len(recording.frames)} frames")
    # The camera states an exposure in the middle of the first quarter of a period, and sends it after a whole one.
    stated_ms = 1000 / 30 * 7 / 8
    expect(len(ages_ms) > 3 and min(ages_ms) >= stated_ms - 0.01, str(ages_ms[:5]))
    expect(max(ages_ms) < stated_ms + 20 or not counted(), f"{max(ages_ms)} ms")
    return (f"not known without; with metadata {min(ages_ms):.2f} to {max(ages_ms):.2f} ms at the arrival, "
            f"{stated_ms:.2f} ms of them before the transfer")


@check("hapticctl camera list, camera test and doctor work for the user hapticd, and tell others what they lack")
def commands():
    must("systemctl", "stop", "hapticd-status.socket", "hapticd-control.socket", "hapticd.service")
    try:
        listed = must("hapticctl", "camera", "list", user="hapticd")
        line = next(line for line in listed.splitlines() if camera.serial in line)
        expect(line.startswith("used") and "Z16" in line and "D435" in line, listed)
        expect("hapticd takes its depth from /dev/video" in listed, listed)
        test = json.loads(must("hapticctl", "--json", "camera", "test", "--seconds", "3", user="hapticd"))
        least = 85 if counted() else 3
        expect(test["frames"] >= least and test["lostFrames"] == 0 or not counted(), str(test))
        expect(abs(test["rateHz"] - 30) < 0.3 or not counted(), str(test["rateHz"]))
        refused = run("hapticctl", "camera", "test", "--seconds", "1", user="nobody")
        expect(refused.returncode != 0 and "cannot be opened: Permission denied" in refused.stdout, refused.stdout)
        stopped = must("hapticctl", "camera", "test", "--seconds", "2", user="hapticd")
    finally:
        must("systemctl", "start", "hapticd-status.socket", "hapticd-control.socket", "hapticd.service")
    reaches("frames", streams, 20)
    busy = run("hapticctl", "camera", "test", "--seconds", "1")
    expect(busy.returncode != 0 and "the running hapticd holds the camera" in busy.stdout, busy.stdout)
    found = [line for line in json.loads(must("hapticctl", "--json", "doctor", timeout=120))
             if line["name"].startswith(("depth camera", "uvcvideo"))]
    expect(found and all(line["verdict"] == "ok" for line in found), str(found))
    facts = "; ".join(line["fact"] for line in found)
    shown = [line for line in stopped.splitlines() if line.startswith("frames")]
    return (f"{line}; {shown[0]}; to others: {refused.stdout.strip()[:120]}; while it runs: {busy.stdout.strip()[:110]}; "
            f"doctor: {facts}")


@check("an Orbbec camera streams beside it with the intrinsics of its own protocol, and is felt")
def orbbec():
    second = devices.DepthCamera("CP0E54000042", "orbbec", ("--model", "gemini335"))
    try:
        configure(box(serial=second.serial))
        now = reaches("a force", is_felt, 30)
        details = now["camera"]["details"]
        expect((details["serial"], details["firmware"]) == (second.serial, "1.2.20.0"), str(details))
        expect(second.stats()["depth_unit_um"] == 100 and now["camera"]["advice"] == "", str(now["camera"]))
        trace = depth_box.record(RECORDED_FRAMES)
        said = depth_box.replayed_trace(trace, LEAST_IN_CONTACT)
        recording = Recording(trace)
        shown = {name: float(recording.camera[name]) for name in ("fx_px", "cx_px", "unit_m")}
        # half of 848 pixels over the tangent of half of 86 degrees
        expect(abs(shown["fx_px"] - 454.69) < 0.01 and abs(shown["unit_m"] - 1e-4) < 1e-9, str(shown))
        frames, gaps, compared = depth_box.expect_scene(recording)
        expect(gaps == 0 or not counted(), f"{gaps} frames are missing")
        forces = depth_box.replayed_recording(recording, LEAST_IN_CONTACT)
    finally:
        second.end()
        configure(box())
    reaches("frames", streams, 20)
    return f"fx {shown['fx_px']:.2f} px; {frames} frames, {compared} pixels computed anew; {forces}; {said}"

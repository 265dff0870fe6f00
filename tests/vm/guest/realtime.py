# SPDX-License-Identifier: Apache-2.0
"""Times of the force loop, beside a streaming camera, LEDs and clients. Asserted where the clock counts instructions."""

import threading
import time

import camera
import devices
import installation
import leds
from lab import (Failure, check, configure, drop_in, expect, force_thread, main_pid, monitor, must, page_faults, reaches,
                 status)

WORST_WAKEUP_NS = 100_000

kinect = None
chip = None


def prepare():
    global kinect, chip
    chip = devices.GpioChip(leds.LINES)
    kinect = devices.Kinect(name="realtime-kinect")
    configure(camera.BOX + leds.LEDS + "control: {engage_at_start: true}\n")
    reaches("frames", camera.streaming, 20)


def finish():
    configure(installation.SIMPLE)
    kinect.end()
    chip.remove()


def observe(seconds):
    """What the loop did while two clients watched: late ticks and the worst wake-up, nanoseconds."""
    client = threading.Thread(target=monitor, args=(seconds, 200))
    before = status()
    client.start()
    replies = monitor(seconds, 200)
    client.join()
    after = status()
    late = after["loop"]["counters"]["overruns"] - before["loop"]["counters"]["overruns"]
    ticks = after["loop"]["counters"]["ticks"] - before["loop"]["counters"]["ticks"]
    frames = after["camera"]["frames"] - before["camera"]["frames"]
    worst_ns = max(reply["window"]["maxWakeupLatencyNs"] or 0 for reply in replies[1:])
    return ticks, frames, late, worst_ns


def assert_on_time(seconds):
    ticks, frames, late, worst_ns = observe(seconds)
    expect(ticks > 990 * seconds, f"{ticks} ticks in {seconds} s")
    expect(frames > 29 * seconds, f"{frames} frames in {seconds} s")
    expect(late == 0, f"{late} of {ticks} ticks late")
    expect(worst_ns < WORST_WAKEUP_NS, f"worst wake-up {worst_ns / 1000:.0f} us")
    return f"{ticks} ticks, {frames} frames, worst wake-up {worst_ns / 1000:.0f} us"


@check("no late tick in 60 s with camera, LEDs and clients, worst wake-up below 100 us", only_counted=True)
def on_time():
    return assert_on_time(60)


@check("the force thread waits for no page while it runs")
def no_page_faults():
    folder = force_thread(main_pid())
    before = page_faults(folder)
    time.sleep(3)
    expect(page_faults(folder) == before, f"{page_faults(folder) - before} page faults")
    shown = status()["loop"]["pageFaults"]
    expect(shown == 0, f"{shown} page faults since the first tick")


@check("without SCHED_FIFO the same assertion fails", only_counted=True)
def has_teeth():
    with drop_in("no-realtime", "[Service]\nLimitRTPRIO=0\n"):
        must("systemctl", "restart", "hapticd.service")
        now = reaches("frames", camera.streaming, 20)
        expect(not now["loop"]["realtimeScheduling"], "it still has real-time scheduling")
        expect(any("real-time" in line for line in now["warnings"]), str(now["warnings"]))
        try:
            said = assert_on_time(4)
        except Failure as error:
            result = str(error)
        else:
            raise Failure("it passed: " + said)
    must("systemctl", "restart", "hapticd.service")
    return result

# SPDX-License-Identifier: Apache-2.0
"""LEDs on a real gpiochip: the daemon drives lines of the character device, the checks read them from the other side."""

import time

import devices
import installation
from lab import check, configure, engage, expect, is_active, must, reaches, status, wait_for

LINES = ["LED_POWER", "LED_CAMERA", "LED_CONTACT", "LED_FAULT"]
LEDS = """leds:
  driver: gpiod
  chip: box-leds
  power_line: LED_POWER
  camera_line: 1
  contact_line: LED_CONTACT
  fault_line: LED_FAULT active-low
"""
# A hand that rests 35 mm before a wall, then 5 mm inside it.
AWAY = "simulated_handle: {start_z_m: -0.8, travel_m: 0.001, stroke_m: 0}\n"
PRESSING = "simulated_handle: {start_z_m: -0.97, travel_m: 0.02, stroke_m: 0.01}\n"
WALL = installation.SIMPLE.replace("noise: off", "noise: off, scene: plane") + "force: {law: nearest_springs}\n"
# Share of the time that an LED shines, and how often it goes on per second: lowest and highest, with the
# tolerance of sampling at 20 ms over an odd number of periods.
PATTERNS = {"off": (0, 0, 0, 0), "on": (1, 1, 0, 0), "slow_blink": (0.3, 0.7, 0.3, 0.7), "double_blink": (0.1, 0.3, 1.5, 2.5),
            "fast_blink": (0.3, 0.7, 4, 6)}

chip = None


def prepare():
    global chip
    chip = devices.GpioChip(LINES)
    configure(WALL + AWAY + LEDS)


def finish():
    configure(installation.SIMPLE)
    chip.remove()


def lit(name):
    return chip.value(name) == (0 if name == "LED_FAULT" else 1)


def shows(**patterns):
    """Watches all LEDs for some periods: each has to shine as the daemon says and as named here."""
    reaches("the daemon means " + str(patterns),
                     lambda now: all(now["leds"][led] == pattern for led, pattern in patterns.items()))
    samples, began = [], time.monotonic()
    while time.monotonic() - began < 4:
        samples.append([lit(name) for name in LINES])
        time.sleep(0.02)
    seconds = time.monotonic() - began
    for led, pattern in patterns.items():
        own = [sample[LINES.index("LED_" + led.upper())] for sample in samples]
        share = sum(own) / len(own)
        rises_hz = sum(1 for before, after in zip(own, own[1:]) if after and not before) / seconds
        least, most, slowest_hz, fastest_hz = PATTERNS[pattern]
        expect(least <= share <= most and slowest_hz <= rises_hz <= fastest_hz,
               f"{led} shone {share:.2f} of the time and went on {rises_hz:.1f} times a second: not {pattern}")


@check("LEDs, fine and idle: power and camera on, contact and fault off")
def idle():
    reaches("the camera streams", lambda now: now["camera"]["state"] == "streaming" and not now["warnings"])
    shows(power="on", camera="on", contact="off", fault="off")


@check("LED contact: blinks slowly while engaged without contact, on in contact, off when disengaged")
def contact():
    engage()
    wait_for("engaged", lambda: status()["mode"] == "engaged")
    shows(contact="slow_blink")
    configure(WALL + PRESSING + LEDS + "control: {engage_at_start: true}\n")
    reaches("contact", lambda now: now["mode"] == "engaged" and now["leds"]["contact"] == "on")
    shows(contact="on")
    engage(False)
    reaches("disengaged", lambda now: now["leds"]["contact"] == "off")
    shows(contact="off")


@check("LED fault: blinks for a warning, flashes twice while the force is held, active-low")
def fault():
    configure(WALL.replace("synthetic}", "freenect}") + PRESSING + LEDS)
    reaches("the camera is missed", lambda now: now["warnings"])
    shows(fault="slow_blink", camera="off", power="on")
    configure(WALL.replace("depth_timeout_s: 5", "depth_timeout_s: 0.05") + PRESSING + LEDS +
              "control: {engage_at_start: true}\n")
    reaches("the force is held", lambda now: now["mode"] == "holding" and now["cause"] == "depth_stale"
            and now["leds"]["fault"] == "double_blink")


@check("a line that another program holds is a warning, and taken when it is free")
def busy():
    must("systemctl", "stop", "hapticd.service")
    holder = must("sh", "-c", "gpioset --mode=signal box-leds 2=0 >/dev/null 2>&1 & echo $!").strip()
    wait_for("the line is held", lambda: "gpioset" in must("gpioinfo", "box-leds"))
    configure(WALL + PRESSING + LEDS)
    now = reaches("a warning about the line", lambda now: any("LED_CONTACT" in line for line in now["warnings"]))
    must("kill", holder)
    reaches("the LEDs are there", lambda now: now["leds"]["state"] == "present" and not now["warnings"])
    return "; ".join(line for line in now["warnings"] if "LED_CONTACT" in line)


@check("the chip vanishes: a warning, forces go on; it returns: the LEDs shine again")
def vanishing():
    ticks = status()["loop"]["counters"]["ticks"]
    chip.vanish()
    now = reaches("the LEDs are missed", lambda now: now["leds"]["state"] != "present" and now["warnings"])
    reaches("the loop goes on", lambda now: now["loop"]["counters"]["ticks"] > ticks + 1000)
    expect(is_active(), "the service ended")
    chip.appear()
    reaches("the LEDs are back", lambda now: now["leds"]["state"] == "present")
    wait_for("power shines", lambda: lit("LED_POWER"))
    return "; ".join(now["warnings"])


@check("all LEDs go off when the service stops")
def off_at_exit():
    must("systemctl", "stop", "hapticd.service")
    wait_for("all lines are free", lambda: "hapticd" not in must("gpioinfo", "box-leds"))
    expect(not any(lit(name) for name in LINES if name != "LED_FAULT"), str([chip.value(name) for name in LINES]))
    must("systemctl", "start", "hapticd.service")

# SPDX-License-Identifier: Apache-2.0
"""What the service costs with the configuration that the package installs: memory, wake-ups, bytes written."""

import os
import time

import devices
import installation
from lab import (CONFIGURATION, CONTROL_SOCKET, LAB, Varlink, check, configure, expect, main_pid, must, read, reaches,
                 unit_property)

MEMORY_LIMIT_KB = 64 * 1024
# Parts of the memory from this size on are named.
NAMED_KB = 2048
WINDOW_S = 60
LOOP_HZ = 1000

kinect = None


def prepare():
    global kinect
    kinect = devices.Kinect(name="footprint-kinect")
    shipped = must("sh", "-c", f"dpkg-deb --fsys-tarfile {LAB}/hapticd.deb | tar -xO .{CONFIGURATION}")
    configure(shipped)
    reaches("frames", lambda now: now["camera"]["state"] == "streaming", 20)


def finish():
    configure(installation.SIMPLE)
    kinect.end()


def field(text, name):
    """The number of a line `name: number` in a file of /proc."""
    for line in text.splitlines():
        if line.startswith(name + ":"):
            return int(line.split()[1])
    raise KeyError(name)


def parts_of_memory(pid):
    """Resident memory by what it is, kB, the largest first; each anonymous mapping is a part of its own."""
    parts, name = {}, ""
    for line in read(f"/proc/{pid}/smaps").splitlines():
        words = line.split()
        if not words[0].endswith(":"):  # a mapping begins: its addresses, rights, offset, device, inode, name
            path = words[5] if len(words) > 5 else ""
            if path.startswith("/") or path.startswith("["):
                name = os.path.basename(path)
            else:
                name = "anonymous at " + words[0].split("-")[0]
        elif words[0] == "Rss:":
            parts[name] = parts.get(name, 0) + int(words[1])
    return sorted(parts.items(), key=lambda part: -part[1])


def memory(pid):
    """Resident memory in kB, and a sentence about it."""
    text = read(f"/proc/{pid}/status")
    resident = field(text, "VmRSS")
    kinds = ", ".join(f"{field(text, kind) / 1024:.1f} {what}" for kind, what in
                      (("RssAnon", "anonymous"), ("RssFile", "of files"), ("RssShmem", "shared")))
    named = [(name, size) for name, size in parts_of_memory(pid) if size >= NAMED_KB]
    return resident, (f"{resident / 1024:.1f} MB ({kinds}); parts of {NAMED_KB // 1024} MB or more: "
                      + ", ".join(f"{name} {size / 1024:.1f}" for name, size in named))


class Costs:
    """Counters of the service and of the journal that writes for it."""

    def __init__(self):
        self.pid = main_pid()
        self.began = time.monotonic()
        self.wakeups = {}
        for thread in os.listdir(f"/proc/{self.pid}/task"):
            folder = f"/proc/{self.pid}/task/{thread}"
            name = read(folder + "/comm").strip()
            self.wakeups[name] = self.wakeups.get(name, 0) + field(read(folder + "/status"), "voluntary_ctxt_switches")
        self.written = field(read(f"/proc/{self.pid}/io"), "write_bytes")
        journal = int(unit_property("MainPID", "systemd-journald.service"))
        self.journal_written = field(read(f"/proc/{journal}/io"), "write_bytes")


def costs_of_a_minute():
    """Wake-ups per second by thread, bytes that the service and the journal wrote."""
    before = Costs()
    time.sleep(WINDOW_S)
    after = Costs()
    expect(before.pid == after.pid, "the daemon was restarted")
    seconds = after.began - before.began
    wakeups = {name: (count - before.wakeups.get(name, 0)) / seconds for name, count in after.wakeups.items()}
    return wakeups, after.written - before.written, after.journal_written - before.journal_written


def observed():
    wakeups, written, journal_written = costs_of_a_minute()
    by_thread = ", ".join(f"{name} {rate:.0f}" for name, rate in sorted(wakeups.items(), key=lambda item: -item[1])
                          if rate >= 0.5)
    expect(abs(wakeups["hapticd-force"] - LOOP_HZ) < 0.02 * LOOP_HZ, f"the force loop does not wake up at 1 kHz: {by_thread}")
    expect(written == 0, f"the service wrote {written} bytes in {WINDOW_S} s though nothing is recorded")
    return (f"{sum(wakeups.values()):.0f} wake-ups/s ({by_thread}); the service wrote {written * 3600 // WINDOW_S} bytes/h, "
            f"the journal {journal_written * 3600 // WINDOW_S}")


@check(f"as installed, with a Kinect: at most {MEMORY_LIMIT_KB // 1024} MB of resident memory")
def resident_memory():
    resident_kb, said = memory(main_pid())
    expect(resident_kb <= MEMORY_LIMIT_KB, said)
    return said


@check("as installed, idle for a minute: only the loop wakes up at 1 kHz, and the service writes nothing to the disk")
def idle():
    return observed()


@check("as installed, engaged for a minute: likewise, and the memory does not grow beyond its limit")
def engaged():
    with Varlink(CONTROL_SOCKET) as client:
        client.call("io.hapticd.Control.Engage", insideSurface=True)
    reaches("engaged", lambda now: now["mode"] == "engaged")
    said = observed()
    reaches("still engaged", lambda now: now["mode"] == "engaged")
    resident_kb, parts = memory(main_pid())
    expect(resident_kb <= MEMORY_LIMIT_KB, parts)
    return f"{said}; {resident_kb / 1024:.1f} MB"

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A haptic device for hapticd's driver `udp`, with Python's standard library alone: device.py ADDRESS:PORT [KEY_FILE]
A bridge as in drivers/handle/udp/protocol.md. Its device is simulated: put your own into measure() and exert()."""
import hmac, math, secrets, socket, struct, sys, time
LIMIT_N = 4  # what device and person can bear; hapticd has its own limit
TABLE = list(range(256))  # of CRC-32C
for _ in range(8): TABLE = [n >> 1 ^ (0x82F63B78 if n & 1 else 0) for n in TABLE]

class Device:  # 50 g in a hand that moves 0.1 m along -z and back, every 4 s; metres and newtons in its own frame
    position, velocity, start = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], time.monotonic()
    def measure(self):
        return self.position
    def exert(self, force):
        goal = [0, 0, 0.05 * math.cos((time.monotonic() - self.start) * math.pi / 2) - 0.05]
        for i in range(3):
            hand_n = 60 * (goal[i] - self.position[i]) - 4 * self.velocity[i]
            self.velocity[i] += (hand_n + force[i]) / 0.05 * 0.001
            self.position[i] += self.velocity[i] * 0.001

def sealed(body, key):  # with its checksum and, if there is a key, its signature
    crc = 0xFFFFFFFF
    for byte in body: crc = TABLE[(crc ^ byte) & 255] ^ crc >> 8
    packet = body + struct.pack("<I", crc ^ 0xFFFFFFFF)
    return packet + hmac.digest(key, packet, "sha256") if key else packet

def waiting(link):  # a flood of packets must not keep the loop from driving the device
    for _ in range(16):
        try: yield link.recv(256, socket.MSG_DONTWAIT)
        except OSError: return

def run(device, link, key, session, number=0, force=(0, 0, 0), due=0):
    peer, newest, arrival, sent_then, best_echo, sent = 0, 0, 0, 0, 0, {}  # of the last command accepted; times of sending
    while True:
        now = time.monotonic_ns()
        for packet in waiting(link):
            if not hmac.compare_digest(packet, sealed(packet[:108], key)): continue
            command = struct.unpack("<4sBBHQQqQQQ3dQqIfI", packet[:108])
            *kind, theirs, count, _, echoed, echo, age, x, y, z, _, _, _, _, mode = command
            size = math.hypot(x, y, z)
            if kind != [b"HPTC", 1, 2, bool(key)] or not theirs or not count or mode > 1 or not size <= 1000: continue
            if echoed != session or now - sent.get(echo, -10**9) > 10**8 or age > 10**8: continue  # proves nothing
            renumbered = count + 64 <= newest and echo > sent_then
            if (count <= newest and not renumbered) if theirs == peer else echo <= best_echo: continue  # not newer
            peer, newest, arrival, sent_then, best_echo = theirs, count, now, number, max(echo, best_echo)
            force = [mode * f * LIMIT_N / max(size, LIMIT_N) for f in (x, y, z)]
        device.exert(force if now - arrival < 20_000_000 else (0, 0, 0))  # the dead man, in the loop that drives the device
        number += 1
        sent[number], _ = now, sent.pop(number - 200, None)
        head = b"HPTC", 1, 1, 4 | bool(key), session, number, now, peer, newest, now - arrival if peer else 0
        try: link.send(sealed(struct.pack("<4sBBHQQqQQQ6dI", *head, *device.measure(), 0, 0, 0, 0), key))
        except OSError: pass  # hapticd is not there yet
        due = max(due + 1_000_000, now)  # 1 kHz
        time.sleep(max(0, due - time.monotonic_ns()) / 1e9)

if __name__ == "__main__":
    (host, port), link = sys.argv[1].split(":"), socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.connect((host, int(port)))  # so packets of others never arrive
    try: run(device := Device(), link, open(sys.argv[2], "rb").read() if len(sys.argv) > 2 else b"", secrets.randbits(64) or 1)
    finally: device.exert((0, 0, 0))

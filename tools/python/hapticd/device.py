# SPDX-License-Identifier: Apache-2.0
"""A haptic device of your own, for the driver `udp` of hapticd: version 2 of its protocol (drivers/handle/udp/protocol.md)."""
from __future__ import annotations

import contextlib
import dataclasses
import hmac
import math
import secrets
import signal
import socket
import struct
import sys
import threading
import time
from typing import Callable, Iterator, Sequence, Union

from .error import Error

Vector = Sequence[float]
_HEAD = "<4sBBHQQqQQQ"  # magic, version, kind, flags; session, number, time; echo: session, number, age
_COMMAND = struct.Struct(_HEAD + "3dQqIfIHH4ddQI")  # force; tick, time, offers, damping; mode; reserved: torque, gripper force
_STATE = struct.Struct(_HEAD + "3d3dIHH4ddQI")  # position, velocity, buttons; measured, driven; orientation, gripper, latency
_STATE_FORM, _COMMAND_FORM = (b"HPTC", 2, 1), (b"HPTC", 2, 2)  # magic, version, kind
_FORCE_ENDS_NS = 20_000_000  # after the newest command
_PROOF_NS = 100_000_000
_RENUMBERED = 64
_LARGEST_NUMBER = 1 << 62
_ZERO = (0.0, 0.0, 0.0)
_CRC_TABLE = list(range(256))  # of CRC-32C
for _ in range(8):
    _CRC_TABLE = [value >> 1 ^ (0x82F63B78 if value & 1 else 0) for value in _CRC_TABLE]


@dataclasses.dataclass
class Measured:
    """What a device measures, in the handle's frame, whose pose in the world is hapticd's `handle.position_*` and `.*_rad`."""

    position_m: Vector  # x, y, z, at most 10 m
    velocity_m_per_s: Vector | None = None  # if the device measures it; hapticd compares it with the positions
    buttons: int = 0  # bit n: button n is pressed
    orientation_xyzw: Vector | None = None  # unit quaternion that maps vectors of the held tool to the handle's frame
    gripper_rad: float | None = None  # opening angle
    calibrated: bool = True  # False while the device does not know its position: there is no force then
    fault: bool = False  # True while it malfunctions: there is no force then


Exchange = Callable[[tuple[float, float, float]], Union[Vector, Measured]]


class Device:
    """A device that hapticd drives over UDP.

    `Device("127.0.0.1:47800").run(exchange)` calls `exchange(force_n) -> position_m` 1000 times a second: it exerts the force
    on the hand (newtons) and returns where the hand is (metres), or `Measured`, both in the handle's frame. The force is zero
    before hapticd has answered and whenever the newest command is 20 ms old. What hapticd cannot do: end the force of a program
    that is killed or hangs in `exchange`. Only the device itself can, with a timeout of its own.
    """

    def __init__(self, address: str, key_file: str | None = None, *, limit_n: float = 4.0, latency_s: float = 0.0) -> None:
        """`address`: ADDRESS:PORT of hapticd (`udp_handle.port`, 47800). `key_file`: the file of the key that both share.
        `limit_n`: what device and person can bear; no longer force is asked of `exchange`. `latency_s`: what the device adds
        to the delay from a motion to the force that responds to it, up to 1 s. Errors: an address or key that cannot be used."""
        host, _, port = address.rpartition(":")
        try:
            self._key = b""
            if key_file is not None:
                with open(key_file, "rb") as file:
                    self._key = file.read()
            self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._socket.connect((host, int(port)))  # so packets of others never arrive
        except (OSError, ValueError, OverflowError) as error:
            raise Error(f"device at {address}", str(error), "give ADDRESS:PORT of hapticd, and the file of its key") from error
        if key_file is not None and not 16 <= len(self._key) <= 1024:
            raise Error(key_file, f"a key of {len(self._key)} bytes", "a key has 16 to 1024 bytes: openssl rand 32")
        self.limit_n, self.latency_s = limit_n, latency_s
        self._session, self._number = secrets.randbits(64) or 1, 0  # the number of the newest state
        self._sent_ns: dict[int, int] = {}  # when the newest states were sent
        # of the newest command that was taken over: its session and number, arrival, our number then; the highest echo so far
        self._peer = self._newest = self._arrival_ns = self._sent_before = self._best_echo = 0
        self._force_n = _ZERO

    @property
    def connected(self) -> bool:
        """Whether a command of hapticd that was taken over is younger than 20 ms."""
        return self._peer != 0 and time.monotonic_ns() - self._arrival_ns < _FORCE_ENDS_NS

    def run(self, exchange: Exchange, rate_hz: int = 1000) -> None:
        """Drives the device until an exception ends it, as Ctrl-C and SIGTERM do; the last force is zero, whatever ends it."""
        due = 0
        try:
            with _sigterm_as_exception():
                while True:
                    with contextlib.suppress(OSError):  # nothing more, or hapticd is not there yet
                        for _ in range(16):  # a flood of packets must not keep the loop from driving the device
                            self._take(self._socket.recv(512, socket.MSG_DONTWAIT), time.monotonic_ns())
                    measured = exchange(self._force_n if self.connected else _ZERO)
                    self._send(measured if isinstance(measured, Measured) else Measured(measured))
                    due = max(due + 1_000_000_000 // rate_hz, time.monotonic_ns())
                    time.sleep(max(0, due - time.monotonic_ns()) / 1e9)
        finally:
            exchange(_ZERO)

    def _take(self, packet: bytes, now: int) -> None:
        """Takes over a command that passes sections 2 and 3 of the protocol."""
        body = packet[:_COMMAND.size]
        if len(body) != _COMMAND.size or not hmac.compare_digest(packet, self._sealed(body)):
            return
        (magic, version, kind, flags, session, number, made_ns, echo_session, echo, echo_age_ns, *force_n,
         _, _, _, damping, mode, _, _, t_x, t_y, t_z, gripper_n, _, _, _) = _COMMAND.unpack(body)
        numbers = (number, made_ns, echo, echo_age_ns)
        size_n = math.hypot(*force_n)
        if (magic, version, kind) != _COMMAND_FORM or flags != bool(self._key) or not session or not number or not (
                all(0 <= value <= _LARGEST_NUMBER for value in numbers) and size_n <= 1000 and mode <= 1
                and math.hypot(t_x, t_y, t_z) <= 100 and abs(gripper_n) <= 1000 and damping == damping):
            return
        sent_ns = self._sent_ns.get(echo)
        if echo_session != self._session or sent_ns is None or now - sent_ns > _PROOF_NS or echo_age_ns > _PROOF_NS:
            return  # it does not show that its sender runs now
        if session == self._peer:
            renumbered = number + _RENUMBERED <= self._newest and echo > self._sent_before
            if number <= self._newest and not renumbered:
                return
        elif echo <= self._best_echo:
            return
        self._peer, self._newest, self._arrival_ns, self._sent_before = session, number, now, self._number
        self._best_echo = max(self._best_echo, echo)
        share = mode * self.limit_n / max(size_n, self.limit_n)
        self._force_n = (force_n[0] * share, force_n[1] * share, force_n[2] * share)

    def _send(self, measured: Measured) -> None:
        now = time.monotonic_ns()
        self._number += 1
        self._sent_ns[self._number] = now
        self._sent_ns.pop(self._number - 1000, None)
        has_velocity, has_orientation, has_gripper = (
            value is not None for value in (measured.velocity_m_per_s, measured.orientation_xyzw, measured.gripper_rad))
        flags = bool(self._key) | has_velocity << 1 | measured.calibrated << 2 | measured.fault << 3
        state = _STATE.pack(
            *_STATE_FORM, flags, self._session, self._number, now, self._peer, self._newest,
            now - self._arrival_ns if self._peer else 0, *measured.position_m,
            *(measured.velocity_m_per_s if has_velocity else _ZERO), measured.buttons, has_orientation | has_gripper << 1, 1,
            *(measured.orientation_xyzw if has_orientation else (0, 0, 0, 1)), measured.gripper_rad if has_gripper else 0, round(self.latency_s * 1e9), 0)
        with contextlib.suppress(OSError):  # hapticd is not there yet
            self._socket.send(self._sealed(state))

    def _sealed(self, body: bytes) -> bytes:
        """A packet with its checksum and, if there is a key, its signature."""
        crc = 0xFFFFFFFF
        for byte in body:
            crc = _CRC_TABLE[(crc ^ byte) & 255] ^ crc >> 8
        packet = body + struct.pack("<I", crc ^ 0xFFFFFFFF)
        return packet + hmac.digest(self._key, packet, "sha256") if self._key else packet


@contextlib.contextmanager
def _sigterm_as_exception() -> Iterator[None]:
    """SIGTERM, which would otherwise end the program at once, raises SystemExit. Only the main thread gets signals."""
    before = None
    if threading.current_thread() is threading.main_thread():
        before = signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    try:
        yield
    finally:
        if before is not None:
            signal.signal(signal.SIGTERM, before)

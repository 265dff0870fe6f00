# SPDX-License-Identifier: Apache-2.0
"""A connection to the daemon: Varlink messages over a Unix socket, and which socket that is."""
from __future__ import annotations

import json
import os
import socket
import time
from typing import Any, Iterator, Mapping

from .error import Error, NoConnection
from .interface import Record, snake

CONTROL_SOCKET = "/run/hapticd/io.hapticd.Control"
STATUS_SOCKET = "/run/hapticd/io.hapticd.Status"
ANSWER_WITHIN_S = 10.0
_RUNNING = "is hapticd running? Start it with 'systemctl start hapticd', or name its socket with HAPTICD_SOCKET"


def find_socket(named: str | None) -> str:
    """The socket to use, as hapticctl finds it: the one that is named, else that of HAPTICD_SOCKET, else that of the service:
    the control socket, or the status socket, on which nothing can be changed, where this user may use only that one."""
    if path := named or os.environ.get("HAPTICD_SOCKET"):
        return path
    try:
        Link(CONTROL_SOCKET).close()
    except NoConnection:
        if not os.path.exists(STATUS_SOCKET):
            raise
        return STATUS_SOCKET
    return CONTROL_SOCKET


class Link:
    """One connection, for one thread. `descriptor` is the file that came along with a reply, else None."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.descriptor: int | None = None
        self._pending = b""
        self._socket = socket.socket(socket.AF_UNIX)
        self._socket.settimeout(ANSWER_WITHIN_S)
        try:
            self._socket.connect(path)
        except OSError as error:
            self.close()
            raise _no_connection(path, error) from error

    def close(self) -> None:
        """Ends the connection, and with it a stream."""
        self._socket.close()

    def send(self, method: str, parameters: Mapping[str, Any] | None, **flags: bool) -> None:
        """Sends a call without the parameters that are None. Arrays and numbers of NumPy may be among them."""
        sent = {name: value for name, value in (parameters or {}).items() if value is not None}
        try:
            call = json.dumps({"method": method, "parameters": sent, **flags}, allow_nan=False,
                              default=lambda value: value.tolist())
        except (AttributeError, TypeError, ValueError) as error:
            raise Error(method, f"a parameter cannot be sent: {error}", "give finite numbers, texts, lists and dicts") from error
        try:
            self._socket.sendall(call.encode() + b"\0")
        except OSError as error:
            raise self._broken(str(error)) from error

    def replies(self, limit_s: float | None = ANSWER_WITHIN_S) -> Iterator[Record]:
        """Each reply, with its `parameters`, `error` and `continues`. Errors: none comes within limit_s seconds (None: never
        mind), or the daemon closes the connection."""
        while True:
            *whole, self._pending = self._pending.split(b"\0")
            for message in whole:
                yield json.loads(message, object_hook=lambda members: Record((snake(name), members[name]) for name in members))
            end = None if limit_s is None else time.monotonic() + limit_s
            while b"\0" not in self._pending:
                self._pending += self._received(end)

    def _received(self, end: float | None) -> bytes:
        try:
            self._socket.settimeout(None if end is None else max(end - time.monotonic(), 0.001))
            received, descriptors, _, _ = socket.recv_fds(self._socket, 65536, 1)
        except TimeoutError as error:
            raise NoConnection(self.path, "no answer in time", "hapticd may be starting or busy: try again") from error
        except OSError as error:
            raise self._broken(str(error)) from error
        if descriptors:
            self.descriptor = descriptors[0]
        if not received:
            raise self._broken("the daemon closed the connection")
        return received

    def _broken(self, what: str) -> NoConnection:
        return NoConnection(self.path, what, "see 'systemctl status hapticd'; it refuses clients when too many are connected")


def _no_connection(path: str, error: OSError) -> NoConnection:
    if isinstance(error, PermissionError):
        return NoConnection(path, "no permission to use this socket",
                            "members of the group haptic may: 'sudo usermod -aG haptic $USER', then log in again")
    what = {FileNotFoundError: "there is no such socket", ConnectionRefusedError: "nothing listens on this socket"}
    return NoConnection(path, what.get(type(error), f"cannot connect: {error}"), _RUNNING)

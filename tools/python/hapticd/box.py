# SPDX-License-Identifier: Apache-2.0
"""The box: calls to a running daemon and its streams."""
from __future__ import annotations

import contextlib
import re
import time
from typing import Any, Callable, Iterator, Mapping, Sequence

from .error import Error, NoConnection, Refused
from .interface import Interface, Record
from .link import ANSWER_WITHIN_S, Link, find_socket

_STATUS, _CONTROL = "io.hapticd.Status", "io.hapticd.Control"
_REMEDIES = {
    "ChangedMeanwhile": "list again what there is, then repeat the change",
    "FeedLimited": "send fewer a second",
    "InvalidParameter": "compare its name and type with help(); this hapticd may be of another version than this module",
    "MethodNotFound": "install the same version of hapticd and of this module",
    "NotFaulted": "the warnings in status() say what is wrong",
    "NotApplied": "the warnings in status() say why the force loop does not run",
    "PermissionDenied": "use the control socket, as members of the group haptic may; HAPTICD_SOCKET names another one",
    "Refused": "the warnings in status() say what to do; where only the surface is in the way, engage(inside_surface=True)",
    "RestartRequired": "set them in hapticd's configuration file, then restart hapticd",
    "UnknownFrame": "add it to the list frames of the configuration",
    "WouldLoosen": "disengage() first, or undo(loosen=True)",
}


class Box:
    """A running hapticd.

    Every method of the daemon is a method here, under its name in Python: `box.engage(inside_surface=True)`,
    `box.disengage()`, `box.start_trace(label="trial")`, `box.list_profiles()`; the daemon tells their names, parameters and
    explanations (`dir(box)`, `help(box.engage)`). They return a Record with the fields of the reply, or for a stream such as
    `box.events(kinds=["breach"])` an iterator of them; a file that comes along is their `descriptor`. Vectors are in the world
    frame, in the unit that ends their name. Objects that are sent, such as a Pose, have names as in the interface text.

    Errors: NoConnection where there is no daemon or no permission, Refused where the daemon refuses a call; then nothing was
    changed. After a restart of the daemon the next call connects again.
    """

    def __init__(self, socket: str | None = None) -> None:
        """`socket`: path of a socket of the daemon; without it HAPTICD_SOCKET, else that of the service, as for hapticctl."""
        self.socket = find_socket(socket)
        self._link: Link | None = Link(self.socket)
        self._interface: Interface | None = None
        self.fixtures = Additions(self, "Fixtures")
        self.regions = Additions(self, "Regions")
        self.frames = Frames(self)

    def status(self) -> Record:
        """The whole state at this moment: mode, cause, warnings, loop, tick, camera, handle, law, fixtures, ..."""
        return self.call(_STATUS + ".GetStatus").status

    def get(self, name: str) -> Any:
        """The value of a parameter, "force.stiffness_n_per_m"; `get_parameters()` also has units, ranges and help."""
        return self.call(_STATUS + ".GetParameters", {"names": [name]}).parameters[0].value

    def set(self, values: Mapping[str, Any]) -> Record:
        """Sets live parameters by their names, all or none. Errors: Refused names each that is unknown or out of range."""
        return self.call(_CONTROL + ".SetParameters", {"parameters": dict(values)})

    def ticks(self, *fields: str, rate_hz: int | None = None, or_changed: Sequence[str] | None = None,
              interval_ms: int | None = None, seconds: float | None = None) -> Ticks:
        """A stream of ticks of the force loop, a Record each.

        `fields`: names as in traces; without any number, mode, HIP and commanded force. `rate_hz`: fewer ticks, evenly in
        time; without it every one, 1000 a second. `or_changed`: also ticks in which one of these fields changes.
        `interval_ms`: time between two batches of ticks (50). `seconds`: its end, since the first tick.
        """
        names = fields or ("number", "mode", "hip_m_in_world", "command_force_n_in_world")
        parameters = {"fields": names, "rateHz": rate_hz, "orChanged": or_changed, "intervalMs": interval_ms}
        return Ticks(self.stream(_STATUS + ".Ticks", parameters, ANSWER_WITHIN_S), seconds)

    def call(self, method: str, parameters: Mapping[str, Any] | None = None, *, oneway: bool = False) -> Record:
        """Calls a method by its full name, with names as in the interface text; fields that are None are left out. `oneway`:
        does not wait for the answer, so that a refusal stays unseen. Returns the fields of the reply."""
        try:
            self._link = self._link or Link(self.socket)
            if not oneway:
                return next(self._replies(self._link, method, parameters))
            self._link.send(method, parameters, oneway=True)
            return Record()
        except NoConnection:
            self._link = None
            raise

    def stream(self, method: str, parameters: Mapping[str, Any] | None = None, limit_s: float | None = None) -> Iterator[Record]:
        """Calls a method that streams, over a connection of its own, and gives the fields of each reply. Errors: no reply
        within limit_s seconds; None: it waits for ever."""
        with contextlib.closing(Link(self.socket)) as link:
            yield from self._replies(link, method, parameters, limit_s, more=True)

    def _replies(self, link: Link, method: str, parameters: Mapping[str, Any] | None, limit_s: float | None = ANSWER_WITHIN_S,
                 more: bool = False) -> Iterator[Record]:
        link.send(method, parameters, more=more)
        for reply in link.replies(limit_s):
            fields = reply.get("parameters") or Record()
            if "error" in reply:
                raise self._refusal(method, reply.error, fields)
            if link.descriptor is not None:
                fields["descriptor"], link.descriptor = link.descriptor, None
            yield fields
            if not reply.get("continues"):
                return

    def _known(self) -> Interface:
        """The interface as this daemon describes it."""
        if self._interface is None:
            self._interface = Interface("\n".join(
                self.call("org.varlink.service.GetInterfaceDescription", {"interface": name}).description
                for name in ("org.varlink.service", _STATUS, _CONTROL)))
        return self._interface

    def _refusal(self, method: str, name: str, parameters: Record) -> Refused:
        short = name.rpartition(".")[2]
        remedy = _REMEDIES.get(short, f"see the error {short} in 'man hapticd-varlink'")
        if parts := [_problem(short, one, remedy) for one in parameters.get("problems") or [parameters]
                     if isinstance(one, str) or "reason" in one or "allowed" in one]:
            wheres, whats, remedies = zip(*parts)
            if len(parts) > 1:
                wheres, whats = [method], ["; ".join(f"{where}: {what}" if where else what for where, what, _ in parts)]
            return Refused(wheres[0] or method, whats[0], "; ".join(dict.fromkeys(remedies)), name, parameters)
        meaning = name
        with contextlib.suppress(Error):
            meaning = self._known().errors.get(name, name).rstrip(".")
        details = ", ".join(f"{field} {value}" for field, value in parameters.items())
        return Refused(method, meaning + (f": {details}" if details else ""), remedy, name, parameters)

    def __getattr__(self, name: str) -> Callable[..., Any]:
        method = None if name.startswith("_") else self._known().methods.get(name)
        if method is None:
            raise AttributeError(f"hapticd has no method {name}; dir(box) lists them")

        def function(*arguments: Any, **named: Any) -> Any:
            return (self.stream if method.streams else self.call)(method.name, method.parameters(arguments, named))

        function.__name__, function.__doc__, function.__signature__ = name, method.doc, method.signature  # type: ignore
        return function

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._known().methods})


def _problem(error: str, problem: Any, remedy: str) -> tuple[str, str, str]:
    """Where, what and remedy of a problem that an error lists, or of the error itself."""
    if isinstance(problem, str):
        problem = {"reason": problem}
    noun = {"FixtureRefused": "fixture ", "RegionRefused": "region "}.get(error, "")
    name = noun + (problem.get("name") or problem.get("parameter") or problem.get("frame") or "")
    where = ", ".join(part for part in (name, problem.get("field")) if part)
    reason = problem.get("reason") or "this value is not accepted"
    if problem.get("remedy"):
        return where, reason, problem["remedy"]
    if in_brackets := re.fullmatch(r"(.*) \((.*)\)", reason, re.DOTALL):  # as the daemon writes its remedies
        return where, in_brackets[1], in_brackets[2]
    return where, reason, f"allowed: {problem['allowed']}" if problem.get("allowed") else remedy


class Ticks:
    """A stream of ticks, to iterate over once. `lost` counts those that did not arrive so far; their numbers are missing."""

    def __init__(self, replies: Iterator[Record], seconds: float | None) -> None:
        self.lost = 0
        self._replies, self._seconds = replies, seconds

    def __iter__(self) -> Iterator[Record]:
        end = None
        for reply in self._replies:
            self.lost = reply.lost_count
            for values in zip(*reply.ticks.values()):
                yield Record(zip(reply.ticks, values))
            if reply.count and self._seconds is not None:
                end = end or time.monotonic() + self._seconds
                if time.monotonic() >= end:
                    return


class Additions:
    """The virtual fixtures, or the tissue regions, of a box. Members have the names and units that they have in the
    configuration (man 5 hapticd.yaml): positions in metres in the world frame, or in their moving frame."""

    def __init__(self, box: Box, kind: str) -> None:
        self._box, self._kind = box, kind

    def list(self) -> list[Record]:
        """What there is, in its order: name, origin, definition, and what it does now."""
        return self._box.call(f"{_STATUS}.List{self._kind}")[self._kind.lower()]

    def add(self, name: str, **members: Any) -> int:
        """Adds one: add("nerve", kind="sphere", position_m=[0, 0, -0.8], radius_m=0.05). Returns the generation of the list.
        Errors: Refused names each member that is wrong."""
        return self._changed(add=[{"name": name, **members}])

    def change(self, name: str, **members: Any) -> int:
        """Changes members of one: change("nerve", enabled=False). Returns the generation of the list."""
        return self._changed(change=[{"name": name, **members}])

    def remove(self, *names: str) -> int:
        """Removes those of these names, all or none. Returns the generation of the list."""
        return self._changed(remove=list(names))

    def _changed(self, **changes: Any) -> int:
        return self._box.call(f"{_CONTROL}.Change{self._kind}", changes).generation


class Frames:
    """The moving frames of a box, which its configuration lists and a tracker feeds."""

    def __init__(self, box: Box) -> None:
        self._box = box

    def list(self) -> list[Record]:
        """What there is, in the order of the configuration: name, state, pose in effect, fixtures, ..."""
        return self._box.call(_STATUS + ".ListFrames").frames

    def feed(self, name: str, pose: Sequence[float], *, age_s: float | None = None, time_ns: int | None = None,
             velocity_m_per_s: Sequence[float] | None = None, wait: bool = True) -> None:
        """Feeds a pose of a frame, at most 500 a second.

        `pose`: x, y, z of its origin in the world (metres), then x, y, z, w of the unit quaternion that maps vectors in the
        frame to the world. When that was: `time_ns` by CLOCK_MONOTONIC of the daemon's machine (`time.monotonic_ns()`), or
        `age_s` seconds ago; without either now. `velocity_m_per_s`: of the origin, in the world, if it is known.
        `wait`: for the answer. Errors: Refused says why the pose is not used; without `wait` that stays unseen.
        """
        if len(pose) != 7:
            raise Error(f"frame {name}", f"a pose of {len(pose)} numbers", "give x, y, z and the quaternion x, y, z, w")
        self._box.call(_CONTROL + ".FeedPose", {
            "frame": name, "positionM": pose[:3], "orientationXyzw": pose[3:], "timeNs": time_ns, "ageS": age_s,
            "velocityMPerS": velocity_m_per_s}, oneway=not wait)

# SPDX-License-Identifier: Apache-2.0
"""The daemon's methods and objects under their names in Python, with types and explanations, from the interface text that it
serves: `commandForceNInWorld` there is `command_force_n_in_world` here."""
from __future__ import annotations

import functools
import inspect
import re
from typing import Any, NamedTuple

_COMMENT = r"((?:^ *#[^\n]*\n)*)^ *"
_METHOD = re.compile(_COMMENT + r"method (\w+)\((.*?)\) -> \((\)|.*?^\))", re.MULTILINE | re.DOTALL)
_ERROR = re.compile(_COMMENT + r"error (\w+)", re.MULTILINE)
_FIELD = re.compile(_COMMENT + r"(\w+): ([^\n]+?),?$", re.MULTILINE)
_TYPES = {"bool": "bool", "int": "int", "float": "float", "string": "str", "object": "Any"}


@functools.lru_cache(maxsize=None)
def snake(name: str) -> str:
    """GetStatus -> get_status, p50Ns -> p50_ns. Other names stay as they are."""
    return re.sub(r"(?<!^)([A-Z])", r"_\1", name).lower() if name.isalnum() else name


class Record(dict[str, Any]):
    """An object of the interface: a dictionary whose members can also be read as attributes, `status.tick.hip_m_in_world.x`.

    Names end in their unit (`_n` newtons, `_m` metres, `_ns` nanoseconds); numbers that are not finite are None."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"there is no {name} among {', '.join(self) or 'no members'}") from None


def _text(comment: str) -> str:
    return " ".join(line.strip().lstrip("#").strip() for line in comment.splitlines())


def python_type(varlink: str) -> str:
    """?[]string -> list[str] | None"""
    if varlink.startswith("?"):
        return python_type(varlink[1:]) + " | None"
    if varlink.startswith("[]"):
        return f"list[{python_type(varlink[2:])}]"
    if varlink.startswith("[string]"):
        return f"dict[str, {python_type(varlink[8:])}]"
    return _TYPES.get(varlink, "str" if varlink.startswith("(") else varlink)


class Method(NamedTuple):
    """A method of an interface."""

    name: str  # io.hapticd.Control.Engage
    signature: inspect.Signature
    doc: str
    streams: bool  # to be called with the flag "more"

    def parameters(self, arguments: tuple[Any, ...], named: dict[str, Any]) -> dict[str, Any]:
        """The fields of a call. Errors: TypeError for wrong names, as of any function."""
        bound = self.signature.bind(*arguments, **named).arguments
        return {re.sub(r"_(\w)", lambda found: found[1].upper(), name): value for name, value in bound.items()}


class Interface:
    """`methods` by their names in Python, `errors` by their full names with what they mean."""

    def __init__(self, text: str) -> None:
        """`text`: interface texts, one behind the other."""
        self.methods: dict[str, Method] = {}
        self.errors: dict[str, str] = {}
        for name, part in re.findall(r"^interface (\S+)(.*?)(?=^interface|\Z)", text, re.MULTILINE | re.DOTALL):
            self.methods |= {snake(method): _method(f"{name}.{method}", comment, inputs, outputs)
                             for comment, method, inputs, outputs in _METHOD.findall(part)}
            self.errors |= {f"{name}.{error}": _text(comment) for comment, error in _ERROR.findall(part)}


def _method(name: str, comment: str, inputs: str, outputs: str) -> Method:
    fields = [(snake(field), varlink, _text(about)) for about, field, varlink in _FIELD.findall(inputs)]
    signature = inspect.Signature(
        [inspect.Parameter(field, inspect.Parameter.POSITIONAL_OR_KEYWORD, annotation=python_type(varlink),
                           default=None if varlink.startswith("?") else inspect.Parameter.empty)
         for field, varlink, _ in sorted(fields, key=lambda one: one[1].startswith("?"))], return_annotation="Record")
    results = [(snake(field), varlink, _text(about)) for about, field, varlink in _FIELD.findall(outputs)]
    doc = _text(comment)
    for title, lines in (("Parameters", fields), ("Returns a Record with", results)):
        if lines:
            doc += f"\n\n{title}:\n" + "\n".join(f"  {field} ({python_type(kind)}): {about}" for field, kind, about in lines)
    return Method(name, signature, doc, 'flag "more"' in doc)

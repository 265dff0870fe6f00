# SPDX-License-Identifier: Apache-2.0
"""What goes wrong, as exceptions with three parts: where, what, and what to do."""
from __future__ import annotations

import contextlib
import importlib
import os
import sys
from types import ModuleType
from typing import Any, Iterator, Mapping


class Error(Exception):
    """`where` is a file, socket, method, parameter or fixture; `what` is wrong with it; `remedy` says what to do."""

    def __init__(self, where: str, what: str, remedy: str) -> None:
        super().__init__(where, what, remedy)
        self.where, self.what, self.remedy = where, what, remedy

    def __str__(self) -> str:
        return f"{self.where}: {self.what} ({self.remedy})"


class NoConnection(Error):
    """The daemon does not run, does not answer, has closed the connection, or may not be used by this user."""


class Refused(Error):
    """The daemon refused a call. `name` is the error in the interface text, `parameters` are the fields that it has there."""

    def __init__(self, where: str, what: str, remedy: str, name: str, parameters: Mapping[str, Any]) -> None:
        super().__init__(where, what, remedy)
        self.name, self.parameters = name, parameters


def optional_module(name: str, package: str, user: str) -> ModuleType:
    """Imports a module that only `user` needs. Errors: it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise Error(user, f"needs the module {name}: {error}", f"install it, on Debian with 'apt install {package}'") from error


@contextlib.contextmanager
def plain_errors() -> Iterator[None]:
    """For scripts: what goes wrong inside of the block is one line on standard error, and exit status 1. It ends without a
    line when nobody reads its output any more (status 1), and at Ctrl-C (status 130)."""
    try:
        yield
        sys.stdout.flush()
    except Error as error:
        print(f"{os.path.basename(sys.argv[0])}: {' '.join(str(error).split())}", file=sys.stderr)
        sys.exit(1)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or Python complains at its end
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Documents name parameters, commands, options, files and code; a name that does not exist sends the reader nowhere.

The arguments are the paths of all programs. Names are compared with the source tree, the parameters of the configuration
and of the drivers, and the help of the programs and their commands.
"""

import bisect
import fnmatch
import functools
import os
import pathlib
import re
import subprocess
import sys
import unittest
from collections import defaultdict

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAMS = {pathlib.Path(path).name: path for path in sys.argv[1:]}

# Names that are no mistake although nothing here has them, and why.
EXCEPTIONS = {
    "UpperCamel": "the form of names, in CONTRIBUTING.md",
    "lowerCamel": "the form of names, in CONTRIBUTING.md",
    "kMaxName": "the form of names, in CONTRIBUTING.md",
    "kMinName": "the form of names, in CONTRIBUTING.md",
    "INDEX.txt": "a file of libfreenect's recordings",
    "--remap": "an option of ROS 2",
    "--qos-durability": "an option of ROS 2",
    "SystemMaxUse": "a setting of journald",
    "bInterval": "a field of USB descriptors",
}
if "hapticd-ros" not in PROGRAMS:
    for option in ("domain", "interface", "namespace", "arm", "frame", "gravity-compensation", "wrench"):
        EXCEPTIONS["--" + option] = "an option of hapticd-ros or haptic-crtk-bridge, which this build has not"

ROOMS = r"(?:\.ci|config|daemon|docs|drivers|rt|systemd|tests|tools)"
FILE_ENDINGS = set("h cpp yaml csv json conf md mcap js txt png inc html mjs py in ply".split())


def pattern(text):
    return re.compile(text, re.ASCII)


IDENTIFIER = pattern(r"[A-Za-z_]\w*")
SPAN = pattern(r"`([^`\n]+(?:\n[^`\n]+)?)`")
WORD = pattern(r"""[^\s'"()\[\]]+""")
STATISTICS = pattern(r" [^ ]+ +\| +[0-9]+ [+-]+")  # of a change, which may add files
CAPITALS = pattern(r"(?:^|[^A-Za-z])([A-Z][A-Z_]+)(?![A-Za-z])")
PARAMETER = pattern(r"(?:^|[^\w./$-])([a-z_]+)\.([a-z][a-z0-9_]*)(?![\w(/*])(?!\.\w)")
PATH = pattern(r"(?:^|[^\w./$}>-])(" + ROOMS + r"/[\w./{},*-]+)")
OPTION = pattern(r"--[a-z][a-z0-9-]*|-[A-Za-z]")
LONE_OPTION = pattern(r"(--[a-z][a-z0-9-]*)([ =].*)?")
FILE = pattern(r"[\w-]+\.(h|cpp|cmake|inc|md|py|bash|txt|varlink|mjs|js)")
FILE_BELOW = pattern(r"[\w.-]+(/[\w.-]+)+\.(h|cpp|cmake|inc|md|py|bash|txt|varlink|yaml|mjs|js)")
NAME = pattern(r"(?:~?\w+(?:<[^>]*>)?::)*~?\w+(?:<[^>]*>)?(\([^)]*\))?")
HUMPS = pattern(r"[A-Z]+[a-z0-9]+(?:[A-Z]+[a-z0-9]*)+|[a-z]+[a-z0-9]*(?:[A-Z]+[a-z0-9]*)+")


def read(path):
    return (ROOT / path).read_text(encoding="utf-8", errors="replace")


class Command:
    """A program or one of its subcommands, by its --help."""

    def __init__(self, line, texts):
        finished = subprocess.run([*line, "--help"], capture_output=True, text=True, check=False)
        assert finished.returncode == 0, f"{line} --help: {finished.stderr}"
        texts.append(finished.stdout)
        self.options = {}  # "--config", "-c": whether a value follows
        self.commands = {}
        section = None
        lines = finished.stdout.splitlines() + [""]
        for entry, following in zip(lines, lines[1:]):
            if not entry.startswith("  "):
                section = entry
            elif entry[:30].strip():  # else it goes on with the text of the one above
                has_text = entry[29:30] == " " and len(entry) > 30 and (entry[28] == " " or following[:30].strip())
                name = (entry[:30] if has_text else entry).split()
                if section == "Options:":
                    self.options |= {one: len(name) > 1 for one in OPTION.findall(name[0])}
                if section == "Subcommands:":
                    self.commands[name[0]] = Command([*line, name[0]], texts)

    def has(self, option):
        return option in self.options or any(below.has(option) for below in self.commands.values())


def is_placeholder(text):
    """Whether a name stands for any of its kind: `drivers/camera/NAME/`, `hapticctl COMMAND`."""
    files = {"README", "CHANGELOG", "CONTRIBUTING", "LICENSE", "INDEX"}
    return any(mark in text for mark in ("...", "…", "<")) or any(word not in files for word in CAPITALS.findall(text))


def expanded(path):
    """The paths that `a.{h,cpp}` stands for."""
    found = re.fullmatch(r"([^{]*)\{(.*?)\}(.*)", path)
    return [found[1] + part + found[3] for part in found[2].split(",")] if found else [path]


def code_of(text):
    """The code of a Markdown text as (offset, text, whether it is the line of a block). A span may go on in the next
    line, but not in the next paragraph."""
    code, prose, offset, fenced, in_paragraph = [], "", 0, False, False
    for line in text.splitlines(keepends=True):
        fence = line.lstrip(" `") != line.lstrip(" ") and line.lstrip(" ").startswith("```")
        block = not fence and (fenced or (not in_paragraph and line.startswith("    ")))
        fenced ^= fence
        if block:
            code.append((offset, line.rstrip("\n"), True))
        else:
            in_paragraph = not fence and line.strip() != ""
        prose += " " * (len(line) - 1) + "\n" if block or fence else line
        offset += len(line)
    return code + [(found.start(1), found[1], False) for found in SPAN.finditer(prose)]


def comments_of(text):
    """The lines of comments without their mark, the others blank."""
    return "".join(line.replace("#", " ", 1) if line.lstrip(" ").startswith("#") else " " * (len(line) - 1) + "\n"
                   for line in text.splitlines(keepends=True))


class Known:
    """What there is."""

    def __init__(self):
        self.files = set()
        self.names = set()  # of files and folders, without their paths
        self.words = defaultdict(set)  # identifiers of the sources, and in which files
        self.script_options = set()
        for folder, folders, files in os.walk(ROOT):
            folders[:] = [name for name in folders if name not in ("build", ".git", "node_modules", "__pycache__")]
            self.names.update(folders, files)
            self.files.update(os.path.relpath(os.path.join(folder, name), ROOT) for name in files)
        for path in self.files:
            ending = pathlib.PurePath(path).suffix
            if path.startswith("tests/style/") or ending in (".md", ".png", ".svg") or not (ROOT / path).is_file():
                continue
            text = read(path)
            for word in set(IDENTIFIER.findall(text)):
                self.words[word].add(path)
            if ending in ("", ".py", ".bash", ".cpp"):
                self.script_options.update(re.findall(r"--[a-z][a-z0-9-]*", text))
        self.sorted_files = sorted(self.files)
        self.help = []  # (program, text)
        self.programs = {}
        for name, path in PROGRAMS.items():
            texts = []
            self.programs[name] = Command([path], texts)
            self.help += [(name, text) for text in texts]
        # hapticd.yaml lists those of a box; those of what stands in for devices are in its tables only
        self.parameters = set()
        group = ""
        for line in read("config/hapticd.yaml").splitlines():
            group = line[:-1] if re.fullmatch(r"[a-z_]+:", line) else group
            if found := re.match(r"  (?:# )?([a-z0-9_]+): ", line):
                self.parameters.add(f"{group}.{found[1]}")
        for path in self.files:
            if path.startswith("config/settings/") and path.endswith(".cpp"):
                self.parameters.update(re.findall(r"HAPTICD_PARAMETER\(([a-z_]+\.[a-z0-9_]+),", read(path)))
            if path.startswith(("drivers/camera/", "drivers/handle/")) and path.endswith(".h"):
                self.parameters.update(re.findall(r'"([a-z_]+\.[a-z0-9_]+)"', read(path)))
        self.groups = {group for group, name in (one.split(".") for one in self.parameters) if name not in FILE_ENDINGS}

    def is_there(self, path):
        """Whether there is a file or folder, or files of this name with any ending."""
        following = bisect.bisect_left(self.sorted_files, path + ".")
        return (ROOT / path).exists() or any(
            file.startswith(path + ".") for file in self.sorted_files[following:following + 1])

    def exists(self, name, document):
        if "*" in name:
            parts = name.split("/")
            return any(len(file.split("/")) == len(parts) and all(map(fnmatch.fnmatchcase, file.split("/"), parts))
                       for file in self.files)
        return self.is_there(name) or self.is_there(os.path.normpath(os.path.join(os.path.dirname(document), name)))

    def of_any_program(self, option):
        return any(program.has(option) for program in self.programs.values())

    def is_script(self, word):
        return "/" in word and word in self.files and pathlib.PurePath(word).suffix in ("", ".py", ".bash", ".mjs")


@functools.cache
def known():
    return Known()


class Check:
    """The check of one document; `wrong` has each wrong name as "file:line: name: what is wrong"."""

    def __init__(self, document, text, kind="markdown"):
        self.document, self.text, self.wrong = document, text, []
        shown = comments_of(text) if kind == "comments" else text
        code = code_of(shown)
        if kind == "markdown":
            parts = [(offset, part) for offset, part, _ in code if not STATISTICS.fullmatch(part)]
        else:
            parts = [(found.start(), found[0]) for found in re.finditer(r"[^\n]+", shown)]
        for offset, part in parts:
            self.parameters(part, offset)
            self.paths(part, offset)
            self.commands(part, offset, kind != "markdown")
        for offset, part, block in code:
            if not block:
                self.lone_option(part, offset)
                self.identifiers(part, offset)

    def add(self, offset, name, what):
        if name not in EXCEPTIONS:
            self.wrong.append(f"{self.document}:{self.text.count(chr(10), 0, offset) + 1}: {name}: {what}")

    def parameters(self, text, offset):
        for found in PARAMETER.finditer(text):
            name = f"{found[1]}.{found[2]}"
            if found[1] in known().groups and found[2] not in FILE_ENDINGS and name not in known().parameters:
                self.add(offset + found.start(1), name, "there is no parameter of this name")

    def paths(self, text, offset):
        for found in PATH.finditer(text):
            name = found[1].rstrip(".,/")
            for one in [] if is_placeholder(name) else expanded(name):
                if not known().exists(one, self.document):
                    self.add(offset + found.start(1), one, "there is no file or folder of this path")

    def commands(self, line, offset, prose):
        """Programs and scripts with their subcommands and options. In prose only the first word behind a program is taken
        for a subcommand."""
        path = []  # the program and its subcommands so far
        said = ""  # the same in words, or a script
        is_complete = False  # no subcommand follows
        has_value = False  # the value of an option follows
        for found in WORD.finditer(line):
            at = offset + found.start()
            word = found[0].rstrip(";|&,.:")
            program = word.rsplit("/", 1)[-1]
            if program in known().programs and not has_value:
                path, said = [known().programs[program]], program
                is_complete = not path[0].commands
            elif not has_value and known().is_script(word):
                path, said = [], word
            elif word.startswith("-"):
                has_value = said != "" and self.option(word, path, said, at, prose)
            elif has_value:
                has_value = False
            elif path and not is_complete and word:
                said += " " + word
                below = path[-1].commands.get(word)
                if below:
                    path.append(below)
                elif re.fullmatch(r"[a-z][a-z-]*", word):
                    self.add(at, said, "the program has no such command")
                is_complete = prose or not below or not below.commands
            if word != found[0] or word == "-":
                path, said, has_value = [], "", False

    def option(self, word, path, said, offset, prose):
        """Returns whether the value of the option is another word."""
        name = re.split("[=/]", word)[0]
        if not OPTION.fullmatch(name):
            return False
        for command in path:
            if name in command.options:
                return command.options[name] and "=" not in word
        if not path:  # a script passes on options of programs
            if name not in read(said) and not known().of_any_program(name):
                self.add(offset, f"{said} {name}", "the script has no such option")
        elif not prose or not path[0].has(name):
            self.add(offset, f"{said} {name}", "the program has no such option")
        return False

    def lone_option(self, span, offset):
        """An option that stands alone is one of any of our programs or scripts."""
        found = LONE_OPTION.fullmatch(span)
        if found and not known().of_any_program(found[1]) and found[1] not in known().script_options:
            self.add(offset, found[1], "no program here has such an option")

    def identifiers(self, span, offset):
        """Names of types, functions and source files that are all of a span."""
        if is_placeholder(span):
            return
        if FILE.fullmatch(span):
            if span not in known().names:
                self.add(offset, span, "there is no file of this name")
            return
        if FILE_BELOW.fullmatch(span) and not re.match(ROOMS + "/", span):
            if not known().exists(span, self.document):
                self.add(offset, span, "there is no file of this path")
            return
        found = NAME.fullmatch(span)
        parts = re.sub(r"<[^>]*>|\([^)]*\)|~", "", span)
        if not found or parts.startswith("std::") or not ("::" in parts or found[1] or HUMPS.fullmatch(parts)):
            return
        if not set.intersection(*(known().words.get(part, set()) for part in parts.split("::"))):
            self.add(offset, span, "no source has this name")


def is_comments(file):
    return file.endswith(".varlink") or (file.startswith("systemd/") and not file.endswith(".md")) or (
        file.startswith("config/") and file.endswith(".yaml"))


class DocumentNames(unittest.TestCase):
    maxDiff = None

    def expect_right(self, document, text, kind="markdown"):
        self.assertEqual([], Check(document, text, kind).wrong)

    def expect_right_in(self, files, kind, at_least):
        files = [file for file in known().sorted_files if files(file)]
        self.assertGreater(len(files), at_least)
        for file in files:
            with self.subTest(file):
                text = read(file)
                if kind == "plain":  # of roff, the text
                    text = re.sub(r"\\f[BIRP]", "", text.replace("\\-", "-"))
                self.expect_right(file, text, kind)

    def test_exist_in_every_markdown_file(self):  # but not in CHANGELOG.md, which names what earlier versions had
        self.expect_right_in(lambda file: file.endswith(".md") and file != "CHANGELOG.md", "markdown", 50)

    def test_exist_in_the_comments_of_interfaces_units_and_configurations(self):
        self.expect_right_in(is_comments, "comments", 10)

    def test_exist_in_help_and_manual_pages(self):
        for program, text in known().help:
            self.expect_right(program + " --help", text, "plain")
        self.expect_right_in(lambda file: file.startswith("tools/manual/") and file.endswith(".in"), "plain", 5)

    def test_are_found_where_they_are_wrong(self):
        for text, name, kind in (
                ("Set `force.radius_mm` lower.", "force.radius_mm", "markdown"),
                ("Set `safety.maximum_force_n=2`.", "safety.maximum_force_n", "markdown"),
                ("    hapticctl set force.radius=0.03", "force.radius", "markdown"),
                ("# below camera.closest_m", "camera.closest_m", "comments"),
                ("limits loop.rate.", "loop.rate", "plain"),
                ("Set `synthetic.sead`.", "synthetic.sead", "markdown"),
                ("Run `hapticctl engages`.", "hapticctl engages", "markdown"),
                ("Run `hapticctl trace begin`.", "hapticctl trace begin", "markdown"),
                ("    sudo hapticctl --socket /run/a stats", "hapticctl stats", "markdown"),
                ("`hapticctl status | hapticbench tables`", "hapticbench tables", "markdown"),
                ("# see hapticctl stats", "hapticctl stats", "comments"),
                ("Run `hapticctl trace start --deep`.", "hapticctl trace start --deep", "markdown"),
                ("Run `hapticd --configuration FILE`.", "hapticd --configuration", "markdown"),
                ("Run `tools/figures --hapticbenches X`.", "tools/figures --hapticbenches", "markdown"),
                ("The option `--full-models`.", "--full-models", "markdown"),
                ("See `rt/base/parameter.h`.", "rt/base/parameter.h", "markdown"),
                ("See `rt/base/parameters.{h,cpp}`.", "rt/base/parameters.cpp", "markdown"),
                ("See `tests/stile/`.", "tests/stile", "markdown"),
                ("See `parameterz.h`.", "parameterz.h", "markdown"),
                ("See `examples/depths.py`.", "examples/depths.py", "markdown"),
                ("# written by tools/figure", "tools/figure", "comments"),
                ("The class `HapticKernel`.", "HapticKernel", "markdown"),
                ("It calls `computeForces()`.", "computeForces()", "markdown"),
                ("`rt::HapticCore::stepping()`", "rt::HapticCore::stepping()", "markdown"),
                ("`HapticCore::linesOfParameter`", "HapticCore::linesOfParameter", "markdown")):
            with self.subTest(text):
                wrong = Check("docs/any.md", f"A line.\n\n{text}\n", kind).wrong
                self.assertEqual(1, len(wrong), wrong)
                self.assertTrue(wrong[0].startswith(f"docs/any.md:3: {name}: "), wrong)

    def test_are_accepted_where_they_are_right(self):
        for text in (
                "`force.radius_m`, `force.radius_m=0.03`, `trace.mcap`, `handle.h`, `synthetic.seed`",
                "`hapticctl trace start`, `hapticctl`, `hapticctl COMMAND`, `hapticctl status | grep x`",
                "`hapticctl trace start --depth`, `--set`, `hapticd --config FILE --set a=b`, `systemctl --user`",
                "`rt/base/parameters.h`, `tests/`, `drivers/camera/NAME/`, `/etc/config/none`, `rt/*/*.h`, `examples/depth.py`",
                "`HapticCore`, `rt::HapticCore::step()`, `TripleBuffer<T>`, `std::expected`, `kMaxFixtures`"):
            with self.subTest(text):
                self.expect_right("docs/any.md", text)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])

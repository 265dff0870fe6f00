# SPDX-License-Identifier: Apache-2.0
"""The rules of the tree: which module may use which, which folder which, and what the real-time core must not contain.

Each check takes the root of a tree and returns what is wrong in it, as "file:line: what".
"""

import functools
import os
import re

# The rooms, and which of the others each may use. A room may lie in another one, of whose files it is no part then.
ROOMS = {
    "rt": "",
    "config": "rt",
    "drivers": "rt config",
    "daemon/trace": "rt config drivers",
    "daemon/status": "rt config drivers daemon/trace",
    "daemon": "rt config drivers daemon/trace daemon/status",
    "tools": "rt config drivers daemon/trace daemon/status",  # the daemon itself only through its sockets
}
# may use everything, nobody may use it
TESTS = "tests"

# Libraries outside the house, by how the paths of their headers begin, and the only folders that may include them.
GUARDED_LIBRARIES = {
    "boost/": "tools/haptic-bridge/inverse3 tools/hapticd-view",
    "dds/": "tools/hapticd-ros/dds",
    "gpiod": "drivers/led/gpiod",
    "hidapi": "drivers",
    "libfreenect": "drivers/camera/freenect",
    "libraw1394": "tools/haptic-bridge/phantom_omni",
    "libusb": "drivers",
    "lz4": "daemon/trace",
    "nettle/": "config/base drivers/handle/udp",
    "nlohmann/": "daemon tools",
    "png.h": "drivers/camera/recorded tools/hapticctl/snapshot",
    "systemd/": "daemon tools/hapticd-view/server tools/lib/device",
    "yaml-cpp/": "config",
    "zlib.h": "tools/lib/solids/files",
    "zstd": "daemon/trace",
}

LIBRARIES = """tools/lib/bridge tools/lib/child tools/lib/client tools/lib/depth_noise tools/lib/device
    tools/lib/device_check tools/lib/offline tools/lib/options tools/lib/oracle tools/lib/parts
    tools/lib/plot tools/lib/registration tools/lib/solids/field tools/lib/solids/files tools/lib/text
    tools/lib/truth"""
STUDIES = LIBRARIES + " tools/hapticbench/engine"

# Each folder of a room, or the one file of it that puts a program together, and which other folders of the same room its
# files may include. A name that ends in "/" stands for all folders below it, a folder that ends in "/*" for each one in it
# that has no row of its own.
FOLDERS = {
    # the core, from what a channel holds to the loop that uses everything
    "rt/base": "",
    "rt/channels": "rt/base",
    "rt/depth": "rt/base rt/channels",
    "rt/scene": "rt/base rt/channels rt/depth",
    "rt/laws": "rt/base rt/scene",
    "rt/modelling": "rt/base rt/depth rt/laws rt/modelling/surface rt/scene",
    "rt/modelling/focus": "rt/base rt/depth rt/scene",
    "rt/modelling/surface": "rt/base rt/depth rt/modelling/focus rt/scene",
    "rt/safety": "rt/base rt/channels",
    "rt/fixtures": "rt/base rt/channels rt/laws rt/safety rt/scene",
    "rt/tissue": "rt/base rt/channels rt/depth rt/fixtures rt/laws rt/safety",
    "rt/tracking": "rt/base rt/depth rt/fixtures",
    "rt/loop": "rt/base rt/channels rt/depth rt/fixtures rt/laws rt/modelling rt/safety rt/scene rt/tissue",

    "config/base": "",
    "config/yaml": "config/base",
    "config/solids": "config/base",
    "config/settings": "config/base config/solids",
    "config/additions": "config/base config/settings config/yaml",
    "config": "config/",

    "drivers": "drivers/",  # selects among the drivers of all devices
    "drivers/base": "",
    "drivers/camera": "drivers/base",
    "drivers/camera/*": "drivers/base drivers/camera",
    "drivers/depth_region": "",
    "drivers/handle": "drivers/base",
    "drivers/handle/*": "drivers/base drivers/handle",
    "drivers/led": "drivers/base",
    "drivers/led/gpiod": "drivers/base drivers/led",

    "daemon": "daemon/",  # combines its parts
    "daemon/base": "",
    "daemon/control": "daemon/base daemon/state daemon/control/",
    "daemon/control/base": "daemon/base daemon/state daemon/control/server",
    "daemon/control/methods": "daemon/base daemon/state daemon/control/base daemon/control/server",
    "daemon/control/server": "daemon/base",
    "daemon/control/streams": "daemon/base daemon/control/base daemon/control/server",
    "daemon/scene": "daemon/base",
    "daemon/state": "daemon/base",
    "daemon/recorder": "daemon/base daemon/scene daemon/state",

    "daemon/status": "",

    "daemon/trace/export": "daemon/trace/format daemon/trace/reader",
    "daemon/trace/ros": "daemon/trace/format",
    "daemon/trace/format": "daemon/trace/mcap",
    "daemon/trace/mcap": "",
    "daemon/trace/reader": "daemon/trace/format daemon/trace/mcap",
    "daemon/trace/recovery": "daemon/trace/format daemon/trace/mcap daemon/trace/reader",
    "daemon/trace/writer": "daemon/trace/format daemon/trace/mcap daemon/trace/ros",

    # programs, which may use all libraries and no other program
    "tools/haptic-palpate": LIBRARIES,
    "tools/haptic-bridge": LIBRARIES + " tools/haptic-bridge/",
    "tools/haptic-bridge/*": LIBRARIES + " tools/haptic-bridge/base",
    "tools/haptic-replay": LIBRARIES,
    "tools/hapticbench": STUDIES + " tools/hapticbench/strokes",
    "tools/hapticbench/occlusion": STUDIES,
    "tools/hapticbench/solids": STUDIES,
    "tools/hapticbench/godobject": STUDIES,
    "tools/hapticbench/strokes": STUDIES,
    "tools/hapticbench/engine": LIBRARIES,
    "tools/hapticctl": "tools/lib/child tools/lib/client tools/lib/depth_noise tools/lib/options tools/lib/plot "
                       "tools/lib/registration tools/lib/ros tools/lib/text tools/hapticctl/",
    "tools/hapticctl/additions": "tools/lib/client tools/lib/options tools/lib/registration tools/lib/solids/field "
                                 "tools/lib/solids/files tools/lib/text tools/hapticctl/base tools/hapticctl/text",
    "tools/hapticctl/base": "tools/lib/client tools/lib/text tools/hapticctl/text",
    "tools/hapticctl/doctor": "tools/lib/child tools/lib/client",
    "tools/hapticctl/snapshot": "tools/lib/client",
    "tools/hapticctl/text": "tools/lib/client tools/lib/text",
    "tools/hapticd-view": "tools/lib/client tools/lib/options tools/hapticd-view/box_link tools/hapticd-view/live "
                          "tools/hapticd-view/server",
    "tools/hapticd-view/box_link": "tools/lib/client tools/hapticd-view/live",
    "tools/hapticd-view/live": "tools/lib/client",
    "tools/hapticd-view/server": "tools/hapticd-view/live",
    "tools/hapticd-ros": "tools/lib/client tools/lib/options tools/hapticd-ros/box "
                         "tools/hapticd-ros/commands tools/hapticd-ros/dds tools/hapticd-ros/scene tools/lib/ros",
    "tools/hapticd-ros/box": "tools/lib/client tools/lib/ros",
    "tools/hapticd-ros/commands": "tools/lib/client tools/hapticd-ros/dds tools/lib/ros",
    "tools/hapticd-ros/dds": "tools/lib/ros",
    "tools/hapticd-ros/scene": "tools/lib/client tools/hapticd-ros/box tools/hapticd-ros/dds tools/lib/ros",
    "tools/haptic-crtk-bridge": "tools/lib/bridge tools/lib/device tools/lib/device_check tools/lib/options "
                                "tools/hapticd-ros/dds tools/lib/ros",
    "tools/manual": "",

    "tools/lib/bridge": "tools/lib/child tools/lib/options",
    "tools/lib/child": "",
    "tools/lib/client": "",
    "tools/lib/depth_noise": "",
    "tools/lib/device": "tools/lib/bridge",
    "tools/lib/device_check": "tools/lib/bridge tools/lib/child tools/lib/device",
    "tools/lib/offline": "",
    "tools/lib/options": "",
    "tools/lib/parts": "tools/lib/options",
    "tools/lib/oracle": "",
    "tools/lib/plot": "",
    "tools/lib/ros": "",
    "tools/lib/registration": "",
    "tools/lib/solids/field": "tools/lib/solids/files",
    "tools/lib/solids/files": "",
    "tools/lib/text": "",
    "tools/lib/truth": "",
}
# more than that, a reader does not overlook
MAX_SOURCES_OF_FOLDER = 30

# What the real-time core must not include.
FORBIDDEN_HEADERS = """any condition_variable deque exception filesystem format fstream functional future iomanip ios iostream
    istream list locale map mutex ostream queue regex semaphore set shared_mutex sstream stdexcept string thread unordered_map
    unordered_set vector cstdio stdio.h""".split()
# Some are included indirectly, so their names are searched for too.
FORBIDDEN_TEXTS = {
    r"\b(throw|try|catch)\b": "exceptions are not for the real-time core",
    r"\b(dynamic_cast|typeid)\b": "it is compiled without type information",
    r"\bnew\b|\b(malloc|calloc|realloc|aligned_alloc|free)\s*\(": "memory comes from std::make_unique",
    r"\bdelete\b(?!\s*;)": "memory goes with its owner",
    r"\bstd::(string|vector|deque|list|map|set|unordered_map|unordered_set|function|any|shared_ptr|make_shared|mutex|"
    r"lock_guard|unique_lock|thread|jthread|cout|cerr)\b": "it allocates, locks or prints",
    r"\b(printf|fprintf|puts|fopen|system)\s*\(": "it prints or opens files",
    # except as `member(std::make_unique<...` without a semicolon
    r"^(?!\s*[:,]?\s*\w+\(std::make_unique\b.*[^;]$).*\bmake_unique\b": "memory is asked for in constructors only",
}
# They run before the loop, and may ask for memory anywhere.
START_UP_ONLY = ["warm_up.cpp"]

COMMENT_OR_LITERAL = re.compile(r"""(?P<include>\#[ \t]*include[^\n]*) | //[^\n]* | /\*.*?(?:\*/|\Z) | R"\(.*?(?:\)"|\Z)
    | "(?:\\.|[^"\\\n])*"? | (?<![0-9A-Fa-f])'(?:\\.|[^'\\\n])*'?""", re.DOTALL | re.VERBOSE)
INCLUDE = re.compile(r"""^\s*\#\s*include\s*[<"]([^>"]+)[>"]""", re.VERBOSE)
CMAKE_COMMAND = re.compile(r"([\w.\-/]+) *\(")
FINDS = "find_file find_library find_package find_path find_program pkg_check_modules pkg_search_module".split()
ADDS = "add_library add_executable add_custom_target add_room_test".split()


@functools.cache
def plain_lines(path):
    """The lines of a C++ file, without comments and without the content of literals. Includes are left as they are."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    return COMMENT_OR_LITERAL.sub(lambda found: found["include"] or re.sub(r"[^\n]", " ", found[0]), text).split("\n")


def cmake_commands(path):
    """The commands of a CMake file as (line, name, arguments), those inside of functions and conditions too. Arguments are
    split at everything that cannot be in the name of a target, so that those in generator expressions are found."""
    with open(path, encoding="utf-8") as file:
        text = re.sub(r"#[^\n]*", lambda found: " " * len(found[0]), file.read())
    at = 0
    while found := CMAKE_COMMAND.search(text, at):
        at, depth = found.end(), 1
        while depth and at < len(text):
            depth += {"(": 1, ")": -1}.get(text[at], 0)
            at += 1
        yield text.count("\n", 0, found.start()) + 1, found[1], re.findall(r"[\w.\-/]+", text[found.end():at])


def files_in(root, folder, endings):
    """The files of a folder and below, relative to the root, in the order of their names."""
    return sorted(os.path.relpath(os.path.join(place, name), root) for place, _, names in os.walk(os.path.join(root, folder))
                  for name in names if name.endswith(endings))


def code_in(root, folder):
    return files_in(root, folder, (".h", ".cpp", ".h.in", ".cpp.in"))


def room_of(path):
    """The innermost room that a path from the root lies in, or nothing."""
    return max((room for room in [TESTS, *ROOMS] if path.startswith(room + "/")), key=len, default="")


def of_rooms(root, find):
    """Each room with each file of it that `find(root, folder)` finds."""
    return [(room, file) for room in ROOMS for file in find(root, room) if room_of(file) == room]


def includes_of_rooms(root):
    """Each include of a room as (where, room, file, what is included)."""
    for room, file in of_rooms(root, code_in):
        for number, line in enumerate(plain_lines(os.path.join(root, file)), 1):
            if found := INCLUDE.match(line):
                yield f"{file}:{number}: ", room, file, found[1]


def leaves_its_folder(path):
    return path == ".." or path.startswith("../") or "/../" in path


def may_use(room, other):
    return other in (room, "") or other in ROOMS[room].split()


def wrong_includes(root):
    """Each include that its room may not have."""
    wrong = []
    for where, room, _, included in includes_of_rooms(root):
        if leaves_its_folder(included):
            wrong.append(f'{where}"{included}" is no path from the root')
        if not may_use(room, room_of(included)):
            wrong.append(f'{where}{room} must not include "{included}" of {room_of(included)}')
    return wrong


def wrong_libraries(root):
    """Each include of a guarded library outside of its folders."""
    return [f'{where}"{included}" does not belong here' for where, _, file, included in includes_of_rooms(root)
            for header, folders in GUARDED_LIBRARIES.items()
            if included.startswith(header) and not any(file.startswith(folder + "/") for folder in folders.split())]


def wrong_links(root):
    """Each link, dependency or source of a CMake target that its room may not have."""
    owners = {}
    for folder in [*ROOMS, TESTS]:
        for file in files_in(root, folder, "CMakeLists.txt"):
            owners |= {arguments[0]: room_of(file) for _, name, arguments in cmake_commands(os.path.join(root, file))
                       if name in ADDS and arguments}
    wrong = []
    for room, file in of_rooms(root, lambda root, folder: files_in(root, folder, "CMakeLists.txt")):
        for line, _, arguments in cmake_commands(os.path.join(root, file)):
            for argument in arguments:
                # ${CMAKE_SOURCE_DIR}/room/file arrives here as /room/file
                of_file = room_of(argument.removeprefix("/"))
                if leaves_its_folder(argument):
                    wrong.append(f'{file}:{line}: "{argument}" leaves the room')
                elif not may_use(room, of_file):
                    wrong.append(f"{file}:{line}: {room} must not use a file of {of_file}")
                elif not may_use(room, owners.get(argument, "")):
                    wrong.append(f"{file}:{line}: {room} must not use {argument} of {owners[argument]}")
    return wrong


def optional_dependencies(root):
    """Each search for a package, library or program in a CMake file that goes on without it: what is built would depend on
    what a machine happens to have. The compiler's cache may be missing."""
    folders = ["rt", "config", "drivers", "daemon", "tools", TESTS]
    files = ["CMakeLists.txt"] if os.path.exists(os.path.join(root, "CMakeLists.txt")) else []
    files += [file for folder in folders for file in files_in(root, folder, ("CMakeLists.txt", ".cmake"))]
    return [f"{file}:{line}: {name} {arguments[0]} goes on where it finds nothing" for file in sorted(files)
            for line, name, arguments in cmake_commands(os.path.join(root, file))
            if name in FINDS and arguments and not {"REQUIRED", "ccache"} & set(arguments)]


def folders_without_a_room(root):
    """Top-level folders with C++ in them that are no room."""
    return [name for name in sorted(os.listdir(root))
            if not name.startswith(".") and name != "build" and not room_of(name + "/") and code_in(root, name)]


def rule_of(rules, file):
    """The name of the row of a file itself, else of its folder, else of every folder beside that; or None."""
    folder = os.path.dirname(file)
    return next((name for name in (file, folder, os.path.dirname(folder) + "/*") if name in rules), None)


def may_use_folder(rules, rule, folder):
    return any(name == folder or (name.endswith("/") and folder.startswith(name)) for name in rules[rule].split())


def wrong_includes_inside(root, rules):
    """Each include of another folder of the same room that its folder may not have."""
    wrong = []
    for where, room, file, included in includes_of_rooms(root):
        folder, other = os.path.dirname(file), os.path.dirname(included)
        rule = rule_of(rules, file)
        if room_of(included) == room and folder != other and not (rule and may_use_folder(rules, rule, other)):
            wrong.append(f'{where}{folder} must not include "{included}"')
    return wrong


def folders_without_rules(root, rules):
    """Each folder with code in a room that has no row, and each row without code."""
    files = {file for _, file in of_rooms(root, code_in)}
    folders = {os.path.dirname(file) for file in files}
    used = {rule_of(rules, folder + "/") for folder in folders} | files
    return [f"{folder} has no rule" for folder in sorted(folders) if not rule_of(rules, folder + "/")] + [
        f"{rule} has a rule and no code" for rule in rules if rule not in used]


def cycles_of(rules):
    """Each folder that its own row leads back to, as "a -> b -> a"."""
    cycles = []

    def follow(path, seen):
        for following in rules:
            if following.endswith(".cpp") or not may_use_folder(rules, path[-1], following):
                continue  # nobody includes a file
            if following == path[0]:
                cycles.append(" -> ".join([*path, following]))
            elif following not in seen:
                seen.add(following)
                follow([*path, following], seen)

    for rule in rules:
        follow([rule], set())
    return cycles


def crowded_folders(root):
    """Each folder with more sources than a reader overlooks."""
    sources = [os.path.dirname(file) for folder in ["rt", "config", "drivers", "daemon", "tools", TESTS]
               for file in files_in(root, folder, (".h", ".cpp"))]
    return [f"{folder} wants folders of its own" for folder in sorted(set(sources))
            if sources.count(folder) > MAX_SOURCES_OF_FOLDER]


def wrong_in_realtime_code(root, folder="rt", start_up_only=START_UP_ONLY):
    """Each construct in the C++ files of a folder that the real-time core must not use: headers of containers, strings,
    streams and locks; exceptions; allocations except in the initialisers of a constructor."""
    wrong = []
    for file in code_in(root, folder):
        for number, line in enumerate(plain_lines(os.path.join(root, file)), 1):
            if included := INCLUDE.match(line):
                if included[1] in FORBIDDEN_HEADERS:
                    wrong.append(f"{file}:{number}: <{included[1]}> is not for the real-time core")
                continue
            for text, what in FORBIDDEN_TEXTS.items():
                found = re.search(text, line, re.ASCII)
                if found and not ("constructors" in what and os.path.basename(file) in start_up_only):
                    wrong.append(f'{file}:{number}: "{found[0].strip()}": {what}')
    return wrong

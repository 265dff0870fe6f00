#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The tree keeps its rules (rules.py), and each rule finds what is planted against it in a tree of its own."""

import itertools
import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
import rules  # noqa: E402

ROOT = str(pathlib.Path(__file__).resolve().parents[2])
ROOMS = [*rules.ROOMS, rules.TESTS]


def library_of(room):
    """The library that a planted tree has in a room."""
    return "hapticd_" + room.replace("/", "_")


def is_allowed(source, target):
    """The house plan: each of these may use those before it, and the tools all of them but the daemon."""
    order = ["rt", "config", "drivers", "daemon/trace", "daemon/status", "daemon"]
    if source == target:
        return True
    if target in ("tests", "tools"):
        return False
    return target != "daemon" if source == "tools" else order.index(target) < order.index(source)


class PlantedTree(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = folder.name

    def write(self, file, content):
        path = pathlib.Path(self.root, file)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content, encoding="utf-8")
        rules.plain_lines.cache_clear()

    def write_rooms(self):
        """A header and a target in each room, and nothing wrong."""
        for room in ROOMS:
            self.write(f"{room}/own.h", "#pragma once\n")
            self.write(f"{room}/inner/own.cpp", f'#include "{room}/own.h"\n#include <vector>\n')
            self.write(f"{room}/CMakeLists.txt", f"add_library({library_of(room)} own.cpp)\n")


class Rooms(PlantedTree):
    def setUp(self):
        super().setUp()
        self.write_rooms()

    def test_keep_their_rules(self):
        for root in (ROOT, self.root):
            for check in (rules.wrong_includes, rules.wrong_libraries, rules.wrong_links, rules.optional_dependencies,
                          rules.folders_without_a_room):
                with self.subTest(check.__name__, root=root):
                    self.assertEqual([], check(root))

    def test_are_found_with_their_code(self):
        for room in rules.ROOMS:
            self.assertTrue(pathlib.Path(ROOT, room, "CMakeLists.txt").exists(), room)

    def test_must_not_have_a_planted_include_of_any_forbidden_direction(self):
        for source in rules.ROOMS:
            for target, quotes in itertools.product(ROOMS, ('""', "<>")):
                planted = f"{source}/inner/planted.h"
                self.write(planted, f"#pragma once\n  #  include {quotes[0]}{target}/own.h{quotes[1]}\n")
                wrong = rules.wrong_includes(self.root)
                self.assertEqual(0 if is_allowed(source, target) else 1, len(wrong), f"{source} includes {target}")
                self.assertTrue(all(line.startswith(planted + ":2: ") for line in wrong), wrong)
            pathlib.Path(self.root, planted).unlink()

    def test_must_not_have_a_planted_link_of_any_forbidden_direction(self):
        for source in rules.ROOMS:
            planted = f"{source}/inner/CMakeLists.txt"
            for target, form in itertools.product(ROOMS, ("@", "$<BUILD_INTERFACE:@>", '"@"')):
                library = form.replace("@", library_of(target))
                self.write(planted, "add_library(planted STATIC planted.cpp)\n\ntarget_link_libraries(planted\n"
                                    f"  PUBLIC fmt::fmt  # why\n  PRIVATE {library})\n")
                wrong = rules.wrong_links(self.root)
                self.assertEqual(0 if is_allowed(source, target) else 1, len(wrong), f"{source} links {library}")
                self.assertTrue(all(line.startswith(planted + ":3: ") for line in wrong), wrong)
            pathlib.Path(self.root, planted).unlink()

    def test_must_not_include_a_library_outside_of_its_folders(self):
        self.write("drivers/led/gpiod/planted.cpp", "#include <gpiod.h>\n#include <string>\n")
        self.write("config/inner/planted.cpp", "#include <yaml-cpp/parser.h>\n")
        self.assertEqual([], rules.wrong_libraries(self.root))
        self.write("drivers/led/planted.cpp", "\n#include <gpiod.h>\n")
        self.write("rt/inner/planted.cpp", "#include <nlohmann/json.hpp>\n")
        self.assertEqual(['rt/inner/planted.cpp:1: "nlohmann/json.hpp" does not belong here',
                          'drivers/led/planted.cpp:2: "gpiod.h" does not belong here'], rules.wrong_libraries(self.root))

    def test_must_not_depend_on_what_may_be_missing(self):
        self.write("tools/CMakeLists.txt", "find_package(fmt REQUIRED)\nfind_package(PCL QUIET COMPONENTS search)\nif(TRUE)\n"
                                           "  pkg_check_modules(FFTW fftw3)\nendif()\nfind_program(CCACHE ccache)\n")
        self.write("tests/inner/more.cmake", "find_library(GSL gsl)\n")
        self.assertEqual(["tests/inner/more.cmake:1: find_library GSL goes on where it finds nothing",
                          "tools/CMakeLists.txt:2: find_package PCL goes on where it finds nothing",
                          "tools/CMakeLists.txt:4: pkg_check_modules FFTW goes on where it finds nothing"],
                         rules.optional_dependencies(self.root))

    def test_have_no_ways_around_their_doors(self):
        self.write("rt/inner/planted.cpp", '#include "../../daemon/own.h"\n')
        self.assertEqual(1, len(rules.wrong_includes(self.root)))
        for path in ("../daemon/own.cpp", "${CMAKE_SOURCE_DIR}/daemon/own.cpp"):
            self.write("rt/CMakeLists.txt", f"add_library(hapticd_rt own.cpp {path})\n")
            self.assertEqual(1, len(rules.wrong_links(self.root)), path)

    def test_may_be_named_in_comments(self):
        self.write("rt/inner/planted.cpp", '// #include "daemon/own.h"\n/*\n#include "daemon/own.h"\n*/\n')
        self.write("rt/inner/CMakeLists.txt", "# target_link_libraries(planted hapticd_daemon)\n")
        self.assertEqual([], rules.wrong_includes(self.root) + rules.wrong_links(self.root))

    def test_are_the_only_folders_with_code(self):
        self.write("common/README.md", "")
        self.assertEqual([], rules.folders_without_a_room(self.root))
        self.write("common/helpers.h", "#pragma once\n")
        self.assertEqual(["common"], rules.folders_without_a_room(self.root))


class Folders(PlantedTree):
    """In the planted tree `upper` may use `lower`."""

    def setUp(self):
        super().setUp()
        self.rules = {"daemon": "", "daemon/main.cpp": "daemon/", "daemon/upper": "daemon/lower", "daemon/lower": ""}
        self.write("daemon/upper/own.h", "#pragma once\n")
        self.write("daemon/lower/own.h", "#pragma once\n")
        self.write("daemon/main.cpp", '#include "daemon/upper/own.h"\n')
        self.write("daemon/upper/use.cpp", '#include "daemon/lower/own.h"\n#include "rt/own.h"\n')

    def test_keep_their_rules(self):
        self.write("daemon/own.h", "#pragma once\n")
        for root, table in ((ROOT, rules.FOLDERS), (self.root, self.rules)):
            with self.subTest(root=root):
                self.assertEqual([], rules.wrong_includes_inside(root, table))
                self.assertEqual([], rules.folders_without_rules(root, table))
                self.assertEqual([], rules.cycles_of(table))
                self.assertEqual([], rules.crowded_folders(root))

    def test_must_not_include_in_a_direction_that_is_not_declared(self):
        self.write("daemon/lower/planted.h", '#pragma once\n#include "daemon/upper/own.h"\n')
        self.write("daemon/planted.cpp", '#include "daemon/lower/own.h"\n')
        self.assertEqual(['daemon/lower/planted.h:2: daemon/lower must not include "daemon/upper/own.h"',
                          'daemon/planted.cpp:1: daemon must not include "daemon/lower/own.h"'],
                         rules.wrong_includes_inside(self.root, self.rules))

    def test_have_rules_and_rules_have_folders(self):
        self.write("daemon/own.h", "#pragma once\n")
        self.write("daemon/lower/new/own.h", "#pragma once\n")
        self.rules["daemon/gone"] = ""
        self.assertEqual(["daemon/lower/new has no rule", "daemon/gone has a rule and no code"],
                         rules.folders_without_rules(self.root, self.rules))

    def test_below_one_may_have_a_common_rule(self):
        self.write("daemon/own.h", "#pragma once\n")
        self.write("daemon/lower/one/own.h", '#pragma once\n#include "daemon/lower/own.h"\n')
        self.write("daemon/lower/two/own.h", '#pragma once\n#include "daemon/lower/one/own.h"\n')
        self.rules |= {"daemon/lower/*": "daemon/lower", "daemon/upper/*": ""}
        self.assertEqual(["daemon/upper/* has a rule and no code"],
                         rules.folders_without_rules(self.root, self.rules))
        self.assertEqual(['daemon/lower/two/own.h:2: daemon/lower/two must not include "daemon/lower/one/own.h"'],
                         rules.wrong_includes_inside(self.root, self.rules))

    def test_have_no_cycle(self):
        self.rules["daemon/lowest"] = "daemon/upper"
        self.assertEqual([], rules.cycles_of(self.rules))
        self.rules["daemon/lower"] = "daemon/lowest"
        self.assertEqual(["daemon/upper -> daemon/lower -> daemon/lowest -> daemon/upper",
                          "daemon/lower -> daemon/lowest -> daemon/upper -> daemon/lower",
                          "daemon/lowest -> daemon/upper -> daemon/lower -> daemon/lowest"], rules.cycles_of(self.rules))

    def test_hold_no_more_than_a_reader_overlooks(self):
        for number in range(31):
            self.assertEqual([], rules.crowded_folders(self.root))
            self.write(f"tests/{number}.cpp", "")
        self.assertEqual(["tests wants folders of its own"], rules.crowded_folders(self.root))


class RealtimeCore(PlantedTree):
    def wrong_in(self, code, **options):
        self.write("rt/planted.cpp", code)
        return rules.wrong_in_realtime_code(self.root, **options)

    def test_keeps_its_rules(self):
        self.assertEqual([], rules.wrong_in_realtime_code(ROOT))

    def test_must_not_have_any_planted_header(self):
        for header in ("iostream", "string", "vector", "mutex", "thread", "functional", "map", "fstream", "sstream",
                       "unordered_map", "condition_variable", "stdexcept"):
            self.assertEqual([f"rt/planted.cpp:4: <{header}> is not for the real-time core"],
                             self.wrong_in(f"#pragma once\n\n// fine\n#include <{header}>\n"))

    def test_must_not_have_any_planted_statement(self):
        for line in ("throw 1;", "try {", "} catch (...) {", "int* p = new int(1);", "auto p = new (place) int;", "delete p;",
                     "delete[] p;", "void* p = std::malloc(10);", "free(p);", "std::vector<int> v;",
                     "const std::string text;", "std::function<void()> f;", "std::lock_guard lock(m);",
                     "memory = std::make_unique<int[]>(n);", "auto memory = std::make_unique<int[]>(n);",
                     "use(std::make_unique<int[]>(n));", 'printf("%d", 1);', "auto& d = dynamic_cast<Derived&>(base);"):
            self.assertTrue(self.wrong_in(f"  {line}\n"), line)

    def test_may_ask_for_memory_at_the_start_and_for_nothing_else(self):
        code = "#include <vector>\nauto memory = std::make_unique<int[]>(n);\n"
        self.assertEqual(2, len(self.wrong_in(code)))
        self.assertEqual(1, len(self.wrong_in(code, start_up_only=["planted.cpp"])))

    def test_may_have_everything_else(self):
        self.assertEqual([], self.wrong_in(r"""#include <array>
#include "rt/base/vec3.h"
// throw new std::string, std::vector
/* try { delete p; }
   catch */
const char* text = "new std::mutex \" throw";
constexpr int kMany = 1'000; const char quote = '\'';
Scene(const Scene&) = delete;
Scene::Scene(std::size_t n)
    : memory_(std::make_unique<int[]>(n)),
      more_(std::make_unique<int[]>(n)) {}
Scene::Row::Row()
    : first(std::make_unique<int[]>(n)) {}
bool newest = isFree(free_radius_m_);
"""))


if __name__ == "__main__":
    unittest.main()

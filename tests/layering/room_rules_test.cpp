// SPDX-License-Identifier: Apache-2.0
#include "tests/layering/room_rules.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;
using Strings = std::vector<std::string>;

const fs::path kSource = HAPTICD_SOURCE_FOLDER;
const Strings kRooms{"rt", "config", "drivers", "daemon/trace", "daemon/status", "daemon", "tools", "tests"};

/// The library that the planted tree has in a room.
std::string libraryOf(std::string room) {
  std::ranges::replace(room, '/', '_');
  return "hapticd_" + room;
}

/// A tree with a header and a target in each room, and nothing wrong.
class PlantedTree {
 public:
  PlantedTree() {
    for (const std::string& room : kRooms) {
      fs::create_directories(folder_.path() / room / "inner");
      write(room + "/own.h", "#pragma once\n");
      write(room + "/inner/own.cpp", "#include \"" + room + "/own.h\"\n#include <vector>\n");
      write(room + "/CMakeLists.txt", "add_library(" + libraryOf(room) + " own.cpp)\n");
    }
  }
  void write(const std::string& file, const std::string& content) const { folder_.write(file, content); }
  const fs::path& path() const { return folder_.path(); }

 private:
  TemporaryFolder folder_;
};

/// The house plan: each of these may use those before it, and the tools all of them but the daemon.
bool isAllowed(const std::string& from, const std::string& to) {
  const Strings order{"rt", "config", "drivers", "daemon/trace", "daemon/status", "daemon"};
  const auto rank = [&order](const std::string& room) {
    return std::find(order.begin(), order.end(), room) - order.begin();
  };
  if (from == to) return true;
  if (to == "tests" || to == "tools") return false;
  return from == "tools" ? to != "daemon" : rank(to) < rank(from);
}

TEST(Rooms, IncludeOnlyWhatTheyMayUse) {
  EXPECT_EQ(wrongIncludes(kSource), Strings{});
}

TEST(Rooms, IncludeLibrariesOnlyWhereTheyBelong) {
  EXPECT_EQ(wrongLibraries(kSource), Strings{});
}

TEST(Rooms, LinkOnlyWhatTheyMayUse) {
  EXPECT_EQ(wrongLinks(kSource), Strings{});
}

TEST(Rooms, TakeNoDependencyBecauseItIsFound) {
  EXPECT_EQ(optionalDependencies(kSource), Strings{});
}

TEST(RoomRules, FindEveryDependencyThatMayBeMissing) {
  const PlantedTree tree;
  EXPECT_EQ(optionalDependencies(tree.path()), Strings{});
  tree.write("tools/CMakeLists.txt",
             "find_package(fmt REQUIRED)\nfind_package(PCL QUIET COMPONENTS search)\nif(TRUE)\n  "
             "pkg_check_modules(FFTW fftw3)\nendif()\nfind_program(CCACHE ccache)\n");
  tree.write("tests/inner/more.cmake", "find_library(GSL gsl)\n");
  EXPECT_EQ(optionalDependencies(tree.path()),
            (Strings{"tests/inner/more.cmake:1: find_library GSL goes on where it finds nothing",
                     "tools/CMakeLists.txt:2: find_package PCL goes on where it finds nothing",
                     "tools/CMakeLists.txt:4: pkg_check_modules FFTW goes on where it finds nothing"}));
}

TEST(Rooms, AreTheOnlyFoldersWithCode) {
  EXPECT_EQ(foldersWithoutARoom(kSource), Strings{});
}

TEST(Rooms, AreFoundWithTheirCode) {
  for (const Room& room : rooms()) {
    EXPECT_TRUE(fs::exists(kSource / room.name / "CMakeLists.txt")) << room.name;
  }
}

TEST(RoomRules, FindNothingInATreeWithNothingWrong) {
  const PlantedTree tree;
  EXPECT_EQ(wrongIncludes(tree.path()), Strings{});
  EXPECT_EQ(wrongLibraries(tree.path()), Strings{});
  EXPECT_EQ(wrongLinks(tree.path()), Strings{});
  EXPECT_EQ(foldersWithoutARoom(tree.path()), Strings{});
}

TEST(RoomRules, FindAPlantedIncludeOfEveryForbiddenDirectionAndNoOther) {
  for (const Room& from : rooms()) {
    const PlantedTree tree;
    for (const std::string& to : kRooms) {
      for (const std::string quotes : {"\"\"", "<>"}) {
        tree.write(from.name + "/inner/planted.h", "#pragma once\n  #  include " + quotes.substr(0, 1) + to +
                                                       "/own.h" + quotes.substr(1) + "\n");
        const Strings wrong = wrongIncludes(tree.path());
        ASSERT_EQ(wrong.size(), isAllowed(from.name, to) ? 0U : 1U) << from.name << " includes " << to;
        for (const std::string& line : wrong) {
          EXPECT_TRUE(line.starts_with(from.name + "/inner/planted.h:2: ")) << line;
        }
      }
    }
  }
}

TEST(RoomRules, FindALibraryOutsideOfItsFolders) {
  const PlantedTree tree;
  fs::create_directories(tree.path() / "drivers/led/gpiod");
  tree.write("drivers/led/gpiod/planted.cpp", "#include <gpiod.h>\n#include <string>\n");
  tree.write("config/inner/planted.cpp", "#include <yaml-cpp/parser.h>\n");
  EXPECT_EQ(wrongLibraries(tree.path()), Strings{});
  tree.write("drivers/led/planted.cpp", "\n#include <gpiod.h>\n");
  tree.write("rt/inner/planted.cpp", "#include <nlohmann/json.hpp>\n");
  EXPECT_EQ(wrongLibraries(tree.path()),
            (Strings{"rt/inner/planted.cpp:1: \"nlohmann/json.hpp\" does not belong here",
                     "drivers/led/planted.cpp:2: \"gpiod.h\" does not belong here"}));
}

TEST(RoomRules, FindAPlantedLinkOfEveryForbiddenDirectionAndNoOther) {
  for (const Room& from : rooms()) {
    const PlantedTree tree;
    for (const std::string& to : kRooms) {
      for (const std::string form : {"@", "$<BUILD_INTERFACE:@>", "\"@\""}) {
        std::string library = form;
        library.replace(library.find('@'), 1, libraryOf(to));
        tree.write(from.name + "/inner/CMakeLists.txt",
                   "add_library(planted STATIC planted.cpp)\n\n"
                   "target_link_libraries(planted\n  PUBLIC fmt::fmt  # why\n  PRIVATE " +
                       library + ")\n");
        const Strings wrong = wrongLinks(tree.path());
        ASSERT_EQ(wrong.size(), isAllowed(from.name, to) ? 0U : 1U) << from.name << " links " << library;
        for (const std::string& line : wrong) {
          EXPECT_TRUE(line.starts_with(from.name + "/inner/CMakeLists.txt:3: ")) << line;
        }
      }
    }
  }
}

TEST(RoomRules, FindWaysAroundTheRoomsDoors) {
  const PlantedTree tree;
  tree.write("rt/inner/planted.cpp", "#include \"../../daemon/own.h\"\n");
  EXPECT_EQ(wrongIncludes(tree.path()).size(), 1U);
  tree.write("rt/CMakeLists.txt", "add_library(hapticd_rt own.cpp ../daemon/own.cpp)\n");
  EXPECT_EQ(wrongLinks(tree.path()).size(), 1U);
  tree.write("rt/CMakeLists.txt", "add_library(hapticd_rt own.cpp ${CMAKE_SOURCE_DIR}/daemon/own.cpp)\n");
  EXPECT_EQ(wrongLinks(tree.path()).size(), 1U);
}

TEST(RoomRules, LetCommentsNameWhatTheyLike) {
  const PlantedTree tree;
  tree.write("rt/inner/planted.cpp", "// #include \"daemon/own.h\"\n/*\n#include \"daemon/own.h\"\n*/\n");
  tree.write("rt/inner/CMakeLists.txt", "# target_link_libraries(planted hapticd_daemon)\n");
  EXPECT_EQ(wrongIncludes(tree.path()), Strings{});
  EXPECT_EQ(wrongLinks(tree.path()), Strings{});
}

TEST(RoomRules, FindATopLevelFolderThatIsNoRoom) {
  const PlantedTree tree;
  fs::create_directories(tree.path() / "common");
  EXPECT_EQ(foldersWithoutARoom(tree.path()), Strings{});
  tree.write("common/helpers.h", "#pragma once\n");
  EXPECT_EQ(foldersWithoutARoom(tree.path()), Strings{"common"});
}

}  // namespace
}  // namespace hapticd::test

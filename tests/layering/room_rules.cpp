// SPDX-License-Identifier: Apache-2.0
#include "tests/layering/room_rules.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <set>

#include "tests/layering/cmake_commands.h"
#include "tests/layering/plain_code.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTests = "tests";  // may use everything, nobody may use it

bool mayUse(const Room& room, const std::string& other) {
  return other == room.name ||
         std::find(room.may_use.begin(), room.may_use.end(), other) != room.may_use.end();
}

std::vector<fs::path> cmakeFilesIn(const fs::path& folder) {
  std::vector<fs::path> files;
  if (!fs::exists(folder)) return files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().filename() == "CMakeLists.txt") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Those of `files` that lie in the room itself, not in one inside it.
std::vector<fs::path> inRoom(const fs::path& root, const Room& room, std::vector<fs::path> files) {
  std::erase_if(files, [&](const fs::path& file) {
    return roomOfPath(fs::relative(file, root).string()) != room.name;
  });
  return files;
}

/// Returns the room of each target of the tree.
std::map<std::string, std::string> ownersOfTargets(const fs::path& root) {
  std::map<std::string, std::string> owners;
  const auto addTargetsOf = [&](const Room& room) {
    for (const fs::path& file : inRoom(root, room, cmakeFilesIn(root / room.name))) {
      for (const CMakeCommand& command : cmakeCommands(contentOf(file))) {
        const bool adds = command.name == "add_library" || command.name == "add_executable" ||
                          command.name == "add_custom_target" || command.name == "add_room_test";
        if (adds && !command.arguments.empty()) owners[command.arguments.front()] = room.name;
      }
    }
  };
  for (const Room& room : rooms()) addTargetsOf(room);
  addTargetsOf({kTests, {}});
  return owners;
}

bool leavesItsFolder(const std::string& path) {
  return path == ".." || path.starts_with("../") || path.find("/../") != std::string::npos;
}

bool isBelowOneOf(const std::vector<std::string>& folders, const std::string& path) {
  return std::any_of(folders.begin(), folders.end(),
                     [&path](const std::string& folder) { return path.starts_with(folder + "/"); });
}

/// Returns the violation by a CMake argument in a room, or nothing.
std::string wrongArgument(const Room& room, const std::string& argument,
                          const std::map<std::string, std::string>& owners) {
  if (leavesItsFolder(argument)) return "\"" + argument + "\" leaves the room";
  // ${CMAKE_SOURCE_DIR}/room/file arrives here as /room/file
  const std::string path = roomOfPath(argument.starts_with('/') ? argument.substr(1) : argument);
  if (!path.empty() && !mayUse(room, path)) return room.name + " must not use a file of " + path;
  const auto target = owners.find(argument);
  if (target == owners.end() || mayUse(room, target->second)) return {};
  return room.name + " must not use " + argument + " of " + target->second;
}

bool searches(const CMakeCommand& command) {
  static const std::set<std::string> names{"find_file",        "find_library", "find_package",
                                           "find_path",        "find_program", "pkg_check_modules",
                                           "pkg_search_module"};
  return names.contains(command.name) && !command.arguments.empty();
}

/// The CMake code of a source tree.
std::vector<fs::path> allCMakeFilesIn(const fs::path& root) {
  std::vector<fs::path> files{root / "CMakeLists.txt"};
  for (const std::string folder : {"rt", "config", "drivers", "daemon", "tools", kTests}) {
    if (!fs::exists(root / folder)) continue;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / folder)) {
      const bool is_one = entry.path().filename() == "CMakeLists.txt" || entry.path().extension() == ".cmake";
      if (is_one) files.push_back(entry.path());
    }
  }
  std::ranges::sort(files);
  return files;
}

}  // namespace

const std::vector<Room>& rooms() {
  static const std::vector<Room> all{
      {"rt", {}},
      {"config", {"rt"}},
      {"drivers", {"rt", "config"}},
      {"daemon/trace", {"rt", "config", "drivers"}},
      {"daemon/status", {"rt", "config", "drivers", "daemon/trace"}},
      {"daemon", {"rt", "config", "drivers", "daemon/trace", "daemon/status"}},
      {"tools",
       {"rt", "config", "drivers", "daemon/trace",
        "daemon/status"}},  // the daemon itself only through its sockets
  };
  return all;
}

std::string roomOfPath(const std::string& path) {
  std::string innermost;
  const auto consider = [&](const std::string& name) {
    if (path.starts_with(name + "/") && name.size() > innermost.size()) innermost = name;
  };
  consider(kTests);
  for (const Room& room : rooms()) consider(room.name);
  return innermost;
}

std::vector<fs::path> codeFilesOf(const fs::path& root, const Room& room) {
  return inRoom(root, room, codeFilesIn(root / room.name));
}

std::vector<std::string> wrongIncludes(const fs::path& root) {
  std::vector<std::string> wrong;
  for (const Room& room : rooms()) {
    for (const fs::path& file : codeFilesOf(root, room)) {
      const std::vector<std::string> lines = plainLines(contentOf(file));
      for (std::size_t i = 0; i < lines.size(); ++i) {
        const std::string included = includedBy(lines[i]);
        const std::string other = roomOfPath(included);
        const std::string where = place(root, file, i + 1) + ": ";
        if (leavesItsFolder(included))
          wrong.push_back(where + "\"" + included + "\" is no path from the root");
        if (other.empty() || mayUse(room, other)) continue;
        wrong.push_back(where + room.name + " must not include \"" + included + "\" of " + other);
      }
    }
  }
  return wrong;
}

const std::vector<GuardedLibrary>& guardedLibraries() {
  static const std::vector<GuardedLibrary> all{
      {"boost/", {"tools/haptic-bridge/inverse3", "tools/hapticd-view"}},
      {"dds/", {"tools/hapticd-ros/dds"}},
      {"gpiod", {"drivers/led/gpiod"}},
      {"hidapi", {"drivers"}},
      {"libfreenect", {"drivers/camera/freenect"}},
      {"libraw1394", {"tools/haptic-bridge/phantom_omni"}},
      {"libusb", {"drivers"}},
      {"lz4", {"daemon/trace"}},
      {"nettle/", {"config/base", "drivers/handle/udp"}},
      {"png.h", {"drivers/camera/recorded", "tools/hapticctl/snapshot"}},
      {"nlohmann/", {"daemon", "tools"}},
      {"systemd/", {"daemon", "tools/hapticd-view/server", "tools/lib/device"}},
      {"yaml-cpp/", {"config"}},
      {"zlib.h", {"tools/lib/solids/files"}},
      {"zstd", {"daemon/trace"}},
  };
  return all;
}

std::vector<std::string> wrongLibraries(const fs::path& root) {
  std::vector<std::string> wrong;
  for (const Room& room : rooms()) {
    for (const fs::path& file : codeFilesOf(root, room)) {
      const std::string path = fs::relative(file, root).string();
      const std::vector<std::string> lines = plainLines(contentOf(file));
      for (std::size_t i = 0; i < lines.size(); ++i) {
        const std::string included = includedBy(lines[i]);
        for (const GuardedLibrary& library : guardedLibraries()) {
          if (!included.starts_with(library.header) || isBelowOneOf(library.folders, path)) continue;
          wrong.push_back(place(root, file, i + 1) + ": \"" + included + "\" does not belong here");
        }
      }
    }
  }
  return wrong;
}

std::vector<std::string> wrongLinks(const fs::path& root) {
  std::vector<std::string> wrong;
  const std::map<std::string, std::string> owners = ownersOfTargets(root);
  for (const Room& room : rooms()) {
    for (const fs::path& file : inRoom(root, room, cmakeFilesIn(root / room.name))) {
      for (const CMakeCommand& command : cmakeCommands(contentOf(file))) {
        for (const std::string& argument : command.arguments) {
          const std::string what = wrongArgument(room, argument, owners);
          if (what.empty()) continue;
          wrong.push_back(place(root, file, static_cast<std::size_t>(command.line)) + ": " + what);
        }
      }
    }
  }
  return wrong;
}

std::vector<std::string> optionalDependencies(const fs::path& root) {
  std::vector<std::string> wrong;
  for (const fs::path& file : allCMakeFilesIn(root)) {
    if (!fs::exists(file)) continue;
    for (const CMakeCommand& command : cmakeCommands(contentOf(file))) {
      const std::vector<std::string>& words = command.arguments;
      const bool is_needed = std::ranges::find(words, "REQUIRED") != words.end();
      const bool is_cache = std::ranges::find(words, "ccache") != words.end();
      if (!searches(command) || is_needed || is_cache) continue;
      wrong.push_back(place(root, file, static_cast<std::size_t>(command.line)) + ": " + command.name + " " +
                      words.front() + " goes on where it finds nothing");
    }
  }
  return wrong;
}

std::vector<std::string> foldersWithoutARoom(const fs::path& root) {
  std::vector<std::string> folders;
  for (const fs::directory_entry& entry : fs::directory_iterator(root)) {
    const std::string name = entry.path().filename().string();
    if (!entry.is_directory() || name.starts_with('.') || name == "build" || !roomOfPath(name + "/").empty())
      continue;
    if (!codeFilesIn(entry.path()).empty()) folders.push_back(name);
  }
  return folders;
}

}  // namespace hapticd::test

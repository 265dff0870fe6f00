#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hapticd::test {

/// The rooms, and which of the others each may use.
struct Room {
  std::string name;
  std::vector<std::string> may_use;
};
const std::vector<Room>& rooms();

/// Each include of a source tree that its room may not have, as "file:line: what is wrong".
std::vector<std::string> wrongIncludes(const std::filesystem::path& root);

/// Each link, dependency or source of a CMake target that its room may not have.
std::vector<std::string> wrongLinks(const std::filesystem::path& root);

/// Top-level folders with C++ in them that are no room.
std::vector<std::string> foldersWithoutARoom(const std::filesystem::path& root);

}  // namespace hapticd::test

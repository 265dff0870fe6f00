// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hapticd::test {

/// The rooms, and which of the others each may use. A room may lie in another one, of whose files it is no
/// part then.
struct Room {
  std::string name;  ///< path of its folder from the root of the tree
  std::vector<std::string> may_use;
};
const std::vector<Room>& rooms();

/// The innermost room that a path from the root of the tree lies in, or nothing.
std::string roomOfPath(const std::string& path);

/// The C++ files of a room.
std::vector<std::filesystem::path> codeFilesOf(const std::filesystem::path& root, const Room& room);

/// A library outside the house that only some folders may include.
struct GuardedLibrary {
  std::string header;  ///< how the paths of its headers begin
  std::vector<std::string> folders;
};
const std::vector<GuardedLibrary>& guardedLibraries();

/// Each include of a source tree that its room may not have, as "file:line: what is wrong".
std::vector<std::string> wrongIncludes(const std::filesystem::path& root);

/// Each include of a guarded library outside of its folders, in the same form.
std::vector<std::string> wrongLibraries(const std::filesystem::path& root);

/// Each link, dependency or source of a CMake target that its room may not have.
std::vector<std::string> wrongLinks(const std::filesystem::path& root);

/// Each search for a package, library or program in a CMake file that goes on without it: what is built would
/// depend on what a machine happens to have. The compiler's cache may be missing.
std::vector<std::string> optionalDependencies(const std::filesystem::path& root);

/// Top-level folders with C++ in them that are no room.
std::vector<std::string> foldersWithoutARoom(const std::filesystem::path& root);

}  // namespace hapticd::test

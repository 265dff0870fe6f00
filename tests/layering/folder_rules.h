// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hapticd::test {

/// A folder of a room, or the one file of it that puts a program together, and which other folders of the
/// same room its files may include. A name that ends in "/" stands for all folders below it, a folder that
/// ends in "/*" for each one in it that has no rule of its own.
struct FolderRule {
  std::string folder;
  std::vector<std::string> may_use;
};

/// The rule of each folder with code in a room.
const std::vector<FolderRule>& folderRules();

/// Each include of another folder of the same room that its folder may not have, as "file:line: what is
/// wrong".
std::vector<std::string> wrongIncludesInside(const std::filesystem::path& root,
                                             const std::vector<FolderRule>& rules);

/// Each folder with code in a room that has no rule, and each rule of a folder without code.
std::vector<std::string> foldersWithoutRules(const std::filesystem::path& root,
                                             const std::vector<FolderRule>& rules);

/// Each folder that its own rules lead back to, as "a -> b -> a".
std::vector<std::string> cyclesOf(const std::vector<FolderRule>& rules);

}  // namespace hapticd::test

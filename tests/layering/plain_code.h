// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/file_content.h"

namespace hapticd::test {

/// The lines of a C++ text, without comments and without the content of string and character literals.
/// Includes are left as they are.
std::vector<std::string> plainLines(std::string_view text);

/// The file that a line of plainLines() includes, or nothing.
std::string includedBy(const std::string& line);

/// The C++ files of a folder and below, in the order of their names.
std::vector<std::filesystem::path> codeFilesIn(const std::filesystem::path& folder);

/// "path:line", the path relative to `root`.
std::string place(const std::filesystem::path& root, const std::filesystem::path& file, std::size_t line);

}  // namespace hapticd::test

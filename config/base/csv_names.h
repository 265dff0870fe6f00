// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hapticd::base {

/// Returns a text without the mark that some programs put in front of UTF-8.
std::string_view withoutByteOrderMark(std::string_view text);

/// Returns the names of the columns from the first line of a CSV file. Programs of tables write a byte-order
/// mark in front of it, quotes around names, blanks, and a carriage return at its end, all of which are
/// removed.
std::vector<std::string> csvNames(std::string_view line);

}  // namespace hapticd::base

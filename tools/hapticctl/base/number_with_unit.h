// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <string>
#include <string_view>

namespace hapticd::tools {

/// The number that `text`, a number and a unit such as "5mm" or "0.8 N/mm", is in `unit`, as text to be
/// parsed further: of the number itself where the unit is the same, else multiplied. Text that is not a
/// number with letters behind it is returned without change. Errors: the text says which units are possible.
/// Thread: any. RT: not safe.
std::expected<std::string, std::string> inUnit(std::string_view text, std::string_view unit);

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "config/error.h"

namespace hapticd::tools {

inline constexpr std::string_view kFiguresBegin = "<!-- figures: begin -->";
inline constexpr std::string_view kFiguresEnd = "<!-- figures: end -->";

/// `text` with `figures` between the two marks, which stay, in place of what is there. `where`: for the
/// error. Errors: a mark is not there, or twice, or they are in the wrong order.
config::Result<std::string> withFigures(const std::string& text, const std::string& figures,
                                        const std::string& where);

/// The same in a file, which stays as it is where that fails.
/// Errors: those of withFigures(); the file cannot be read or written.
config::Result<void> putFigures(const std::filesystem::path& readme, const std::string& figures);

}  // namespace hapticd::tools

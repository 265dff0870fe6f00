#pragma once

#include <filesystem>
#include <string_view>

#include "config/error.h"

namespace hapticd::tools {

/// Writes a file that is there as a whole or not at all, also after a crash or on a full disk; while it is
/// written it has another name in the same folder. `replace`: an existing file may be replaced. Errors: it
/// exists, the folder is missing or not writable, the disk is full.
config::Result<void> writeWholeFile(const std::filesystem::path& file, std::string_view bytes, bool replace);

/// The same check beforehand, for work that takes long.
config::Result<void> mayWrite(const std::filesystem::path& file, bool replace);

}  // namespace hapticd::tools

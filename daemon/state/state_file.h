// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "config/error.h"

namespace hapticd::daemon {

/// Gives the file this content. After a crash or a loss of power it has either that or what it had before:
/// a temporary file beside it is written, synchronised, and renamed. A missing folder is made. Errors: no
/// permission, no space; the file is as it was.
/// Thread: any.  Progress: blocking (the disk).
config::Result<void> replaceFile(const std::filesystem::path& file, std::string_view content);

/// Errors: no permission. That there is no such file is none.
/// Thread: any.  Progress: blocking.
config::Result<void> removeFile(const std::filesystem::path& file);

/// The content of a file of at most 64 KiB, or nothing where there is no file.
/// Errors: it is longer, a link or no regular file, no permission.
/// Thread: any.  Progress: blocking.
config::Result<std::optional<std::string>> readStateFile(const std::filesystem::path& file);

}  // namespace hapticd::daemon

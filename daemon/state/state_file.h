// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "config/error.h"

namespace hapticd::daemon {

/// Replaces the content of a file. After a crash or a power failure the file has either its new content or
/// its old one: a temporary file beside it is written, synchronised and renamed. Creates a missing folder.
/// Errors: no permission, no space; the file is unchanged then.
/// Thread: any.  Progress: blocking (the disk).
config::Result<void> replaceFile(const std::filesystem::path& file, std::string_view content);

/// Removes a file. Errors: no permission; a missing file is no error.
/// Thread: any.  Progress: blocking.
config::Result<void> removeFile(const std::filesystem::path& file);

/// The content of a file of at most 1 MiB, or nothing where there is no file.
/// Errors: it is longer, a link or no regular file, no permission.
/// Thread: any.  Progress: blocking.
config::Result<std::optional<std::string>> readStateFile(const std::filesystem::path& file);

}  // namespace hapticd::daemon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "config/base/descriptor.h"
#include "config/base/error.h"

namespace hapticd::daemon {

/// Replaces the content of a file. After a crash or a power failure the file has either its new content or
/// its old one: a temporary file beside it is written, synchronised and renamed. Creates a missing folder.
/// Errors: no permission, no space; the file is unchanged then.
/// Thread: any.  Progress: blocking (the disk).
base::Result<void> replaceFile(const std::filesystem::path& file, std::string_view content);

/// Removes a file. Errors: no permission; a missing file is no error.
/// Thread: any.  Progress: blocking.
base::Result<void> removeFile(const std::filesystem::path& file);

/// The content of a file of at most 1 MiB, or nothing where there is no file.
/// Errors: it is longer, a link or no regular file, no permission.
/// Thread: any.  Progress: blocking.
base::Result<std::optional<std::string>> readStateFile(const std::filesystem::path& file);

/// Ensures that only this process writes to a state folder, by a lock on the file `hapticd.lock` in it, which
/// contains the process ID. The lock ends with the object, or with the process however that ends.
/// Thread: any.  Progress: blocking (the disk).
class StateLock {
 public:
  /// Creates a missing folder, and removes what replaceFile() of a killed process has left in one. Holds no
  /// lock if the folder and the file can neither be created nor opened, because nothing can be written there
  /// then. Errors: another process holds the lock.
  static base::Result<StateLock> take(const std::filesystem::path& state_folder);

  bool held() const { return static_cast<bool>(file_); }

 private:
  explicit StateLock(base::Descriptor file) : file_(std::move(file)) {}

  base::Descriptor file_;
};

}  // namespace hapticd::daemon

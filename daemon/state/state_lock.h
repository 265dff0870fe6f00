// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <utility>

#include "config/descriptor.h"
#include "config/error.h"

namespace hapticd::daemon {

/// Ensures that only this process writes to a state folder, by a lock on the file `hapticd.lock` in it, which
/// contains the process ID. The lock ends with the object, or with the process however that ends.
/// Thread: any.  Progress: blocking (the disk).
class StateLock {
 public:
  /// Creates a missing folder. Holds no lock if the folder and the file can neither be created nor opened,
  /// because nothing can be written there then. Errors: another process holds the lock.
  static config::Result<StateLock> take(const std::filesystem::path& state_folder);

  bool held() const { return static_cast<bool>(file_); }

 private:
  explicit StateLock(config::Descriptor file) : file_(std::move(file)) {}

  config::Descriptor file_;
};

}  // namespace hapticd::daemon

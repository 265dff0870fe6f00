// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <utility>

#include "config/descriptor.h"
#include "config/error.h"

namespace hapticd::daemon {

/// That this process alone writes below a state folder: a lock on the file `hapticd.lock` in it, which holds
/// the number of the process. The lock ends with the object, or with the process however that ends.
/// Thread: any.  Progress: blocking (the disk).
class StateLock {
 public:
  /// Makes the folder where it is missing. Holds nothing where folder and file can be neither made nor
  /// opened: nothing can be written there then. Errors: another process holds it.
  static config::Result<StateLock> take(const std::filesystem::path& state_folder);

  bool held() const { return static_cast<bool>(file_); }

 private:
  explicit StateLock(config::Descriptor file) : file_(std::move(file)) {}

  config::Descriptor file_;
};

}  // namespace hapticd::daemon

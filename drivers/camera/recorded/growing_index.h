// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "config/descriptor.h"
#include "config/error.h"

namespace hapticd::drivers {

/// The index of a recording that is being written, in its new folder. It consists of whole lines at any time.
/// Thread: one.  RT: not safe.
class GrowingIndex {
 public:
  /// Creates the folder of a recording, which must not exist yet, and an empty index in it.
  /// Errors: the folder or the file cannot be created.
  static config::Result<GrowingIndex> create(const std::filesystem::path& folder, std::string_view name);

  /// Appends a line, which includes its end.
  /// Errors: disk errors; the index then ends with the previous line.
  config::Result<void> append(std::string_view line);

 private:
  GrowingIndex(std::filesystem::path file, config::Descriptor index)
      : file_(std::move(file)), index_(std::move(index)) {}

  std::filesystem::path file_;
  config::Descriptor index_;
  std::int64_t bytes_ = 0;  ///< length of the complete lines
};

}  // namespace hapticd::drivers

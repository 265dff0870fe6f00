// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "config/error.h"

namespace hapticd::daemon {

/// Of megabytes as settings have them.
std::uint64_t bytesOf(double megabytes);
/// "12.3 MB".
std::string megabytes(std::uint64_t bytes);

/// The space on the disk of the traces. Thread: one.
class DiskSpace {
 public:
  /// `folder`: the one that is there before the traces' own is made.
  DiskSpace(std::filesystem::path folder, double min_free_mb);

  /// Asks the system.
  void measure();
  /// Nothing: not known.
  std::optional<std::uint64_t> freeBytes() const { return free_bytes_; }

  // Nothing is wrong where the space is not known: then the attempt to write says why.

  /// Errors: less is free than trace.min_free_mb.
  config::Result<void> enoughToGoOn() const { return enough(least_bytes_); }
  /// Errors: the same, or less than a trace's head and first chunks take; else each attempt would leave some.
  config::Result<void> enoughToBegin() const;

 private:
  config::Result<void> enough(std::uint64_t least_bytes) const;

  std::filesystem::path folder_;
  std::uint64_t least_bytes_;
  std::optional<std::uint64_t> free_bytes_;
};

}  // namespace hapticd::daemon

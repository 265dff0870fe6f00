// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "config/error.h"

namespace hapticd::daemon {

/// The bytes of a number of megabytes, as used by settings.
std::uint64_t bytesOf(double megabytes);
/// A size for people: "12.3 MB".
std::string megabytes(std::uint64_t bytes);

/// The free space on the disk of the traces. Thread: one.
class DiskSpace {
 public:
  /// `folder`: exists before the folder of the traces is created in it.
  DiskSpace(std::filesystem::path folder, double min_free_mb);

  /// Reads the free space from the system.
  void measure();
  /// Free space at the last reading; nothing: not known.
  std::optional<std::uint64_t> freeBytes() const { return free_bytes_; }

  // Unknown space is no error here: the attempt to write reports the reason.

  /// Whether a trace may go on. Errors: less than trace.min_free_mb is free.
  config::Result<void> enoughToGoOn() const { return enough(least_bytes_); }
  /// Whether a trace may start. Errors: as above, or less than its head and first chunks take, because each
  /// failed attempt would leave an incomplete file.
  config::Result<void> enoughToBegin() const;

 private:
  config::Result<void> enough(std::uint64_t least_bytes) const;

  std::filesystem::path folder_;
  std::uint64_t least_bytes_;
  std::optional<std::uint64_t> free_bytes_;
};

}  // namespace hapticd::daemon

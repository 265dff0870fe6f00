// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/trace/mcap_format.h"

namespace hapticd::drivers::mcap {

/// Merges the messages of parts of a file that overlap in time into the order of their times; messages with
/// the same time keep their order in the file.
/// Thread: one.
class Merger {
 public:
  /// Adds records; those other than messages are skipped. `offset`: of the part in the file.
  void add(std::uint64_t offset, std::string records);
  /// Returns the next message whose time is not after `until_ns`; false if there is none. Valid until the
  /// next call.
  bool next(std::uint64_t until_ns, MessageRecord& message);
  /// Returns the size of the messages held because later ones in the file may be earlier in time.
  std::size_t bytes() const { return bytes_; }

 private:
  struct Stretch {
    std::uint64_t offset = 0;
    std::unique_ptr<const std::string> records;
    std::vector<MessagePlace> messages;  ///< sorted by time
    std::size_t next = 0;
  };
  static bool isLater(const Stretch& a, const Stretch& b);

  std::vector<Stretch> stretches_;           ///< a heap with the earliest message first
  std::unique_ptr<const std::string> last_;  ///< owner of the last message, if it is no longer in a part
  std::size_t bytes_ = 0;
};

}  // namespace hapticd::drivers::mcap

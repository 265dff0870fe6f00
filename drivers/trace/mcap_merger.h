// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/trace/mcap_format.h"

namespace hapticd::drivers::mcap {

/// Puts the messages of stretches of a file that overlap in time in the order of their times; those of one
/// time stay as they follow each other in the file. Thread: one.
class Merger {
 public:
  /// Takes records over; others than messages are skipped. `offset`: of the stretch in the file.
  void add(std::uint64_t offset, std::string records);
  /// The next message, if its time is not beyond `until_ns`. Valid until the next call.
  bool next(std::uint64_t until_ns, MessageRecord& message);
  /// Held because later messages may be earlier in time.
  std::size_t bytes() const { return bytes_; }

 private:
  struct Stretch {
    std::uint64_t offset = 0;
    std::unique_ptr<const std::string> records;
    std::vector<MessageRecord> messages;  ///< by their times
    std::size_t next = 0;
  };
  static bool isLater(const Stretch& a, const Stretch& b);

  std::vector<Stretch> stretches_;           ///< a heap, that of the earliest message first
  std::unique_ptr<const std::string> last_;  ///< what the last message is in, if nothing else is
  std::size_t bytes_ = 0;
};

}  // namespace hapticd::drivers::mcap

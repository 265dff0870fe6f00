// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <ostream>

#include "tests/stress/two_threads.h"

namespace hapticd::test {

/// Observations of a reader while a writer published `writes` sealed values in sequence.
struct TripleBufferFindings {
  std::uint64_t torn = 0;       ///< values mixed from two writes
  std::uint64_t not_newer = 0;  ///< refreshes that returned true without a later value
  std::uint64_t changed = 0;    ///< values that changed while held by the reader
  bool newest_seen = false;     ///< the last value was seen in the end
  std::uint64_t refreshes = 0;

  bool faultless() const { return torn == 0 && not_newer == 0 && changed == 0 && newest_seen; }
};
inline std::ostream& operator<<(std::ostream& stream, const TripleBufferFindings& found) {
  return stream << found.torn << " torn, " << found.not_newer << " not newer, " << found.changed
                << " changed while held, newest " << (found.newest_seen ? "seen" : "missed") << ", in "
                << found.refreshes << " refreshes";
}

/// `buffer` must hold a value sealed with sequence number 0.
template <typename Buffer>
TripleBufferFindings stressTripleBuffer(Buffer& buffer, std::uint64_t writes, Pace pace) {
  TripleBufferFindings found;
  std::atomic<bool> all_written{false};
  const auto write = [&] {
    for (std::uint64_t sequence = 1; sequence <= writes; ++sequence) {
      buffer.back().seal(sequence);
      buffer.publish();
      turn(pace.writer_turns);
    }
    all_written.store(true, std::memory_order_release);
  };
  const auto read = [&] {
    std::uint64_t last = 0;
    for (bool finishing = false; true;) {
      if (buffer.refresh()) {
        ++found.refreshes;
        const std::uint64_t sequence = buffer.front().sequence();
        if (sequence <= last || sequence > writes) ++found.not_newer;
        if (!buffer.front().isIntact()) ++found.torn;
        last = sequence;
      } else if (finishing) {
        break;
      }
      turn(pace.reader_turns);
      std::atomic_signal_fence(std::memory_order_seq_cst);  // forces the value to be read again
      if (buffer.front().sequence() != last || !buffer.front().isIntact()) ++found.changed;
      finishing = all_written.load(std::memory_order_acquire);
    }
    found.newest_seen = last == writes;
  };
  runTogether(write, read);
  return found;
}

}  // namespace hapticd::test

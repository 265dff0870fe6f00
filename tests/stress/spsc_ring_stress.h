// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <ostream>
#include <vector>

#include "tests/stress/two_threads.h"

namespace hapticd::test {

/// Result of transferring `items` sealed values pushed in sequence by a producer.
struct SpscRingFindings {
  std::uint64_t torn = 0;          ///< values mixed from two
  std::uint64_t out_of_order = 0;  ///< values popped twice, after a later one, or never pushed
  std::uint64_t lost = 0;          ///< accepted by push() but never popped
  std::uint64_t unasked = 0;       ///< refused by push() but popped
  std::uint64_t miscounted = 0;    ///< difference between dropped() and the refusals of push()
  std::uint64_t accepted = 0;
  std::uint64_t refused = 0;
  std::uint64_t found_empty = 0;

  bool faultless() const {
    return torn == 0 && out_of_order == 0 && lost == 0 && unasked == 0 && miscounted == 0;
  }
};
inline std::ostream& operator<<(std::ostream& stream, const SpscRingFindings& found) {
  return stream << found.torn << " torn, " << found.out_of_order << " out of order, " << found.lost
                << " lost, " << found.unasked << " unasked, dropped() wrong by " << found.miscounted << "; "
                << found.accepted << " accepted, " << found.refused << " refused";
}

/// `push_first`: number of items pushed before the consumer starts.
template <typename Value, typename Ring>
SpscRingFindings stressSpscRing(Ring& ring, std::uint64_t items, std::uint64_t push_first, Pace pace) {
  SpscRingFindings found;
  std::vector<char> was_accepted(items + 1);
  std::vector<char> was_popped(items + 1);
  const auto push = [&](std::uint64_t sequence) {
    was_accepted[sequence] = ring.push(Value(sequence)) ? 1 : 0;
  };
  for (std::uint64_t sequence = 1; sequence <= push_first; ++sequence) push(sequence);

  std::atomic<bool> all_pushed{false};
  const auto produce = [&] {
    for (std::uint64_t sequence = push_first + 1; sequence <= items; ++sequence) {
      push(sequence);
      turn(pace.writer_turns);
    }
    all_pushed.store(true, std::memory_order_release);
  };
  const auto consume = [&] {
    Value value(0);
    std::uint64_t last = 0;
    for (bool finishing = false; true;) {
      if (ring.pop(value)) {
        if (!value.isIntact()) ++found.torn;
        const std::uint64_t sequence = value.sequence();
        if (sequence <= last || sequence > items) ++found.out_of_order;
        if (sequence <= items) was_popped[sequence] = 1;
        last = sequence;
        turn(pace.reader_turns);
        continue;
      }
      ++found.found_empty;
      if (finishing) break;
      finishing = all_pushed.load(std::memory_order_acquire);
    }
  };
  runTogether(produce, consume);

  for (std::uint64_t sequence = 1; sequence <= items; ++sequence) {
    const bool accepted = was_accepted[sequence] != 0;
    const bool popped = was_popped[sequence] != 0;
    found.accepted += accepted ? 1 : 0;
    found.refused += accepted ? 0 : 1;
    found.lost += accepted && !popped ? 1 : 0;
    found.unasked += !accepted && popped ? 1 : 0;
  }
  found.miscounted =
      ring.dropped() > found.refused ? ring.dropped() - found.refused : found.refused - ring.dropped();
  return found;
}

}  // namespace hapticd::test

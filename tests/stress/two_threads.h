// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <latch>
#include <thread>

namespace hapticd::test {

/// Runs both functions at the same time, `second` in the calling thread, and waits for both.
template <typename First, typename Second>
void runTogether(First first, Second second) {
  std::latch start(2);
  std::jthread thread([&] {
    start.arrive_and_wait();
    first();
  });
  start.arrive_and_wait();
  second();
}

/// Iterations of an empty loop between two operations of each side, which determine the slower side.
struct Pace {
  int writer_turns = 0;
  int reader_turns = 0;
};

inline void turn(int times) {
  for (int i = 0; i < times; ++i) std::atomic_signal_fence(std::memory_order_seq_cst);
}

}  // namespace hapticd::test

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <latch>
#include <thread>

namespace hapticd::test {

/// Runs both at the same time, `second` in the calling thread, to their ends.
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

/// How many times each side turns an empty loop between two operations: who is slower.
struct Pace {
  int writer_turns = 0;
  int reader_turns = 0;
};

inline void turn(int times) {
  for (int i = 0; i < times; ++i) std::atomic_signal_fence(std::memory_order_seq_cst);
}

}  // namespace hapticd::test

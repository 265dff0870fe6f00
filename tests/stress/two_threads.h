// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <latch>
#include <ostream>
#include <string>
#include <thread>

#include "rt/base/cache_line.h"
#include "tests/support/rerun.h"
#include "tests/support/sanitizer.h"

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

/// A value of many cache lines in which every word follows from its sequence number, so that a mix of two
/// values is detected.
template <std::size_t kBytes>
class SealedValue {
  static_assert(kBytes > 2 * rt::kCacheLine && kBytes % sizeof(std::uint64_t) == 0);

 public:
  SealedValue() = default;
  explicit SealedValue(std::uint64_t sequence) noexcept { seal(sequence); }

  void seal(std::uint64_t sequence) noexcept {
    for (std::size_t i = 0; i < words_.size(); ++i) words_[i] = wordOf(sequence, i);
  }
  std::uint64_t sequence() const noexcept { return words_[0]; }
  bool isIntact() const noexcept {
    for (std::size_t i = 1; i < words_.size(); ++i) {
      if (words_[i] != wordOf(words_[0], i)) return false;
    }
    return true;
  }

 private:
  static std::uint64_t wordOf(std::uint64_t sequence, std::size_t i) noexcept {
    return sequence ^ (i * 0x9E3779B97F4A7C15);
  }

  std::array<std::uint64_t, kBytes / sizeof(std::uint64_t)> words_{};
};

using SmallValue = SealedValue<256>;   ///< fast to copy: many exchanges per second
using LargeValue = SealedValue<4096>;  ///< slow to copy: the other side often interferes

/// Channels with too weak memory orders, one per instance of a parameterised test.
struct WeakOrders {
  const char* name;
  void (*stress)();            ///< uses two threads
  bool (*worksInOneThread)();  ///< orders do not matter in one thread
};
inline std::ostream& operator<<(std::ostream& stream, const WeakOrders& orders) {
  return stream << orders.name;
}
inline std::string nameOf(const testing::TestParamInfo<WeakOrders>& info) {
  return info.param.name;
}

/// Runs the current test again in a process of its own, in which rerunPart() is "race", and expects
/// ThreadSanitizer to stop it at a data race.
inline void expectDataRaceInRerun() {
  constexpr int kReported = 66;
  const Finished process = rerunThisTest("race", {"TSAN_OPTIONS=halt_on_error=1 exitcode=66"});
  EXPECT_EQ(process.ending, exitedWith(kReported));
  EXPECT_NE(process.errors.find("ThreadSanitizer: data race"), std::string::npos) << process.errors;
}

/// Checks that the channel is correct except for its orders and that ThreadSanitizer detects those.
inline void expectThatWeakOrdersAreNoticed(const WeakOrders& orders) {
  if (!rerunPart().empty()) return orders.stress();
  EXPECT_TRUE(orders.worksInOneThread());
  if (kThreadSanitizer) {
    expectDataRaceInRerun();
  } else {
    reportNotChecked(
        "that these orders are noticed: the processor orders more than it is asked to, only a build "
        "with ThreadSanitizer (preset tsan) sees the difference");
  }
}

}  // namespace hapticd::test

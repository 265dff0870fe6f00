// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <ostream>
#include <string>

#include "tests/support/rerun.h"
#include "tests/support/sanitizer.h"

namespace hapticd::test {

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

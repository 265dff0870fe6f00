// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <mutex>
#include <ostream>
#include <string>
#include <thread>

#include "rt/base/realtime_safe.h"
#include "tests/support/rerun.h"

// Deliberate violations of the force thread's rules: RealtimeSanitizer must end the process at each of them.

namespace hapticd::test {
namespace {

std::atomic<void*> kept;
std::mutex mutex;

void allocatesInRealTime() HAPTICD_RT {
  kept.store(std::malloc(10), std::memory_order_relaxed);
}
void locksInRealTime() HAPTICD_RT {
  mutex.lock();
  mutex.unlock();
}
void throwsInRealTime() HAPTICD_RT {
  try {
    throw 1;
  } catch (int) {
  }
}
void yieldsInRealTime() HAPTICD_RT {
  std::this_thread::yield();
}

struct Deed {
  const char* name;
  void (*function)();
};
std::ostream& operator<<(std::ostream& stream, const Deed& deed) {
  return stream << deed.name;
}
std::string nameOf(const testing::TestParamInfo<Deed>& info) {
  return info.param.name;
}

class RealtimeSanitizer : public testing::TestWithParam<Deed> {};

TEST_P(RealtimeSanitizer, EndsTheProcessAt) {
  if (!rerunPart().empty()) return GetParam().function();
  const Finished process = rerunThisTest("misconduct");
  constexpr int kReported = 43;  // the sanitizer's exit status
  EXPECT_EQ(process.ending, exitedWith(kReported));
  EXPECT_NE(process.errors.find("RealtimeSanitizer: unsafe-library-call"), std::string::npos)
      << process.errors;
}

INSTANTIATE_TEST_SUITE_P(, RealtimeSanitizer,
                         testing::Values(Deed{"AnAllocation", [] { allocatesInRealTime(); }},
                                         Deed{"ALock", [] { locksInRealTime(); }},
                                         Deed{"AnException", [] { throwsInRealTime(); }},
                                         Deed{"ASystemCall", [] { yieldsInRealTime(); }}),
                         nameOf);

}  // namespace
}  // namespace hapticd::test

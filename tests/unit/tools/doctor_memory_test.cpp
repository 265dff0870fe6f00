// SPDX-License-Identifier: Apache-2.0
// What `hapticctl doctor` says of memory: what is left, and what the configuration takes.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "doctor_fixture.h"
#include "tools/hapticctl/doctor/memory_need.h"

namespace hapticd::tools {
namespace {

class DoctorsMemory : public DoctorOnFiles {
 protected:
  DoctorsMemory() {
    test::fillWithAGoodBox(files);
    box.daemon = {true, "", 3, true, {}};
  }
};

TEST_F(DoctorsMemory, CountsTheMemoryThatADaemonWillTakeWhileItDoesNotRun) {
  const std::int64_t need_kib = static_cast<std::int64_t>(memoryNeed({}).total()) / 1024;
  const auto leave = [&](std::int64_t kib) {
    files.set("proc/meminfo",
              "MemTotal: 8000000 kB\nMemAvailable: " + std::to_string(need_kib + kib) + " kB");
  };
  box.daemon = {};
  leave(257 * 1024);
  EXPECT_EQ(only(checkMemory).verdict, Verdict::ok);
  leave(250 * 1024);
  EXPECT_TRUE(says(only(checkMemory), Verdict::warn, "hapticd takes about", "close other programs"));
  leave(50 * 1024);
  EXPECT_TRUE(says(only(checkMemory), Verdict::fail, "hapticd takes about", "close other programs"));
}

TEST_F(DoctorsMemory, SaysThatAMachineHasTooLittleMemoryForTheConfiguration) {
  const auto say = [&](std::int64_t total_mib) {
    files.set("proc/meminfo",
              "MemTotal: " + std::to_string(total_mib * 1024) + " kB\nMemAvailable: 300000 kB");
    return only(checkMemory);
  };
  const std::int64_t need_mib = static_cast<std::int64_t>(memoryNeed({}).total()) / (1 << 20);
  EXPECT_EQ(say(need_mib + 256).verdict, Verdict::ok);
  EXPECT_TRUE(says(say(need_mib + 255), Verdict::warn, "too much for", "trace.flight_recorder_s (6 MiB)"));
  EXPECT_TRUE(says(say(need_mib + 63), Verdict::fail, "too much for", "grid.point_capacity (9 MiB)"));
  box.configuration.settings.trace.flight_recorder_s = 60;
  box.configuration.settings.loop.rate_hz = 4000;
  EXPECT_TRUE(says(say(need_mib + 256), Verdict::warn, "too much for", "trace.flight_recorder_s (151 MiB)"));
}

TEST_F(DoctorsMemory, WeighsTheMemoryThatIsLeft) {
  const auto leave = [this](int kib) {
    files.set("proc/meminfo", "MemAvailable: " + std::to_string(kib) + " kB\nSwapTotal: 1024000 kB");
  };
  leave(256 * 1024);
  EXPECT_TRUE(says(only(checkMemory), Verdict::ok, "256 MiB available, 1000 MiB of swap", ""));
  leave(255 * 1024);
  EXPECT_TRUE(says(only(checkMemory), Verdict::warn, "255 MiB", "close other programs"));
  leave(63 * 1024);
  EXPECT_TRUE(says(only(checkMemory), Verdict::fail, "63 MiB", "close other programs"));
}

TEST_F(DoctorsMemory, WarnsOfSwapWhenTheDaemonsMemoryIsNotLocked) {
  box.daemon.memory_locked = false;
  EXPECT_EQ(only(checkMemory).verdict, Verdict::ok);
  files.set("proc/meminfo", "MemAvailable: 4096000 kB\nSwapTotal: 1024000 kB");
  EXPECT_TRUE(says(only(checkMemory), Verdict::warn, "not locked", "LimitMEMLOCK=infinity"));
}

}  // namespace
}  // namespace hapticd::tools

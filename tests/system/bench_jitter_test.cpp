// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "rt/base/realtime_thread.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd {
namespace {

using nlohmann::json;
using test::exitedWith;
using test::Finished;

Finished jitter(std::vector<std::string> arguments, const test::ProgramOptions& options = {}) {
  arguments.insert(arguments.begin(), {HAPTICBENCH_PROGRAM, "jitter"});
  return test::runToEnd(arguments, options);
}

bool mayUseRealtime() {
  bool permitted = false;
  std::thread([&permitted] { permitted = rt::useRealtimeScheduling(80); }).join();
  return permitted;
}

bool isInstalled(const char* program) {
  return ::access(("/usr/bin/" + std::string(program)).c_str(), X_OK) == 0;
}

/// Returns the number of running processes of a process group.
int livingIn(pid_t group) {
  int living = 0;
  std::error_code gone;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream file(entry.path() / "stat");
    std::string line;
    if (!std::getline(file, line) || line.rfind(')') == std::string::npos) continue;
    std::istringstream fields(line.substr(line.rfind(')') + 1));
    char state = 'Z';
    pid_t parent = 0, its_group = 0;
    fields >> state >> parent >> its_group;
    living += its_group == group && state != 'Z' ? 1 : 0;
  }
  return living;
}

/// Returns the process group of stress-ng started by `parent`; 0 while there is none.
pid_t loadOf(pid_t parent) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream file(entry.path() / "stat");
    std::string line;
    if (!std::getline(file, line) || line.find("(stress-ng") == std::string::npos) continue;
    std::istringstream fields(line.substr(line.rfind(')') + 1));
    char state = 'Z';
    pid_t its_parent = 0, its_group = 0;
    fields >> state >> its_parent >> its_group;
    if (its_parent == parent) return its_group;
  }
  return 0;
}

TEST(BenchJitter, MeasuresBothLoopsOverTheSameNumberOfWakeUps) {
  if (!mayUseRealtime()) GTEST_SKIP() << "SCHED_FIFO is not permitted here";
  if (!isInstalled("cyclictest")) GTEST_SKIP() << "cyclictest is not installed (rt-tests)";
  const test::TemporaryFolder folder;
  const std::string report = folder.path() / "jitter.json";
  const Finished finished = jitter({"--seconds", "1", "--rounds", "2", "--loads", "idle", "--json", report});
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  EXPECT_NE(finished.output.find("p99.9, hapticd by cyclictest"), std::string::npos) << finished.output;

  std::ifstream file(report);
  const json load = json::parse(file).at("loads").at(0);
  for (const char* loop : {"hapticd", "cyclictest"}) {
    EXPECT_EQ(load.at(loop).at("wakeups"), 2000) << loop;
    std::uint64_t counted = 0;
    for (const json& wakeups : load.at(loop).at("histogram_us")) counted += wakeups.get<std::uint64_t>();
    EXPECT_EQ(counted, 2000U) << loop;
  }
  EXPECT_EQ(load.at("hapticd").at("lost_ticks"), 0);
  EXPECT_GT(load.at("hapticd").at("contact_ticks"), 0);  // the work of contact is done
}

TEST(BenchJitter, SaysWhatToInstall) {
  if (!mayUseRealtime()) GTEST_SKIP() << "SCHED_FIFO is not permitted here";
  const test::ProgramOptions nothing_installed{.environment = {"PATH=/nowhere"}};
  const Finished idle = jitter({"--seconds", "1", "--loads", "idle"}, nothing_installed);
  EXPECT_EQ(idle.ending, exitedWith(69));
  EXPECT_NE(idle.errors.find("apt install rt-tests"), std::string::npos) << idle.errors;
  const Finished stress = jitter({"--seconds", "1", "--loads", "stress"}, nothing_installed);
  EXPECT_EQ(stress.ending, exitedWith(69));
  EXPECT_NE(stress.errors.find("apt install stress-ng"), std::string::npos) << stress.errors;
}

TEST(BenchJitter, SaysWhichPermissionIsMissing) {
  if (::geteuid() != 0) GTEST_SKIP() << "takes root, to become a user without permissions";
  constexpr uid_t kNobody = 65534;
  const Finished finished = jitter({"--seconds", "1"}, {.user = kNobody});
  EXPECT_EQ(finished.ending, exitedWith(69));
  EXPECT_NE(finished.errors.find("SCHED_FIFO: priority 80 is not permitted (run as root"), std::string::npos)
      << finished.errors;
}

TEST(BenchJitter, LeavesNoLoadBehindWhenInterrupted) {
  if (!mayUseRealtime()) GTEST_SKIP() << "SCHED_FIFO is not permitted here";
  if (!isInstalled("stress-ng")) GTEST_SKIP() << "stress-ng is not installed";
  test::Program program({HAPTICBENCH_PROGRAM, "jitter", "--seconds", "1000", "--loads", "stress"});
  pid_t load = 0;
  ASSERT_TRUE(test::becomesTrue([&] {
    load = loadOf(program.pid());
    return load != 0 || !program.running();
  }));
  ASSERT_NE(load, 0) << program.errors();
  program.signal(SIGINT);
  EXPECT_EQ(program.wait(), exitedWith(130)) << program.errors();
  EXPECT_TRUE(test::becomesTrue([load] { return livingIn(load) == 0; }));
}

TEST(BenchJitter, RefusesACpuThatIsNotThere) {
  const Finished finished = jitter({"--cpu", "1023"});
  EXPECT_EQ(finished.ending, exitedWith(69));
  EXPECT_NE(finished.errors.find("--cpu: 1023 is not one of this process (allowed are 0"), std::string::npos)
      << finished.errors;
}

TEST(BenchJitter, RefusesWrongUsageWithTheRange) {
  for (const std::vector<std::string>& wrong : {std::vector<std::string>{"--rounds", "0"},
                                                {"--seconds", "0"},
                                                {"--priority", "99"},
                                                {"--period-us", "1"},
                                                {"--loads", "some"}}) {
    const Finished finished = jitter(wrong);
    EXPECT_EQ(finished.ending, exitedWith(64)) << wrong[0];
    EXPECT_NE(finished.errors.find(wrong[0]), std::string::npos) << finished.errors;
  }
}

}  // namespace
}  // namespace hapticd

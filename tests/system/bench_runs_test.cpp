// SPDX-License-Identifier: Apache-2.0
// Studies of hapticbench divided into parts and joined again, and the one that runs with a load beside it.

#include <gtest/gtest.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "rt/base/realtime_thread.h"
#include "tests/support/file_content.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

struct Study {
  const char* name;
  std::vector<std::string> options;
};

class BenchParts : public testing::TestWithParam<Study> {
 protected:
  std::string file(const std::string& name) const { return (folder_.path() / name).string(); }
  /// Runs the study with its options and `more`.
  Finished measured(std::vector<std::string> more) const {
    more.insert(more.begin(), GetParam().options.begin(), GetParam().options.end());
    return run(std::move(more));
  }
  /// Runs the study with `arguments` only.
  static Finished run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {HAPTICBENCH_PROGRAM, GetParam().name});
    return runToEnd(arguments);
  }

 private:
  const TemporaryFolder folder_;
};

TEST_P(BenchParts, JoinToTheBytesOfTheUndividedRun) {
  const Finished undivided = measured({"--json", file("undivided.json")});
  ASSERT_EQ(undivided.ending, exitedWith(0)) << undivided.errors;
  std::vector<std::string> join{"--join"};
  for (const std::string number : {"3", "1", "2"}) {
    join.push_back(file("part" + number + ".json"));
    const Finished part = measured({"--part", number + "/3", "--json", join.back()});
    ASSERT_EQ(part.ending, exitedWith(0)) << part.errors;
    EXPECT_TRUE(part.output.starts_with("part " + number + "/3: ")) << part.output;
  }
  join.insert(join.end(), {"--json", file("joined.json")});
  const Finished joined = run(join);
  ASSERT_EQ(joined.ending, exitedWith(0)) << joined.errors;
  EXPECT_EQ(joined.output, undivided.output);
  EXPECT_EQ(contentOf(file("joined.json")), contentOf(file("undivided.json")));

  const Finished alone = run({"--join", file("part1.json")});
  EXPECT_EQ(alone.ending, exitedWith(65));
  EXPECT_NE(alone.errors.find("missing: 2/3 3/3"), std::string::npos) << alone.errors;
}

INSTANTIATE_TEST_SUITE_P(
    Studies, BenchParts,
    testing::Values(Study{"accuracy",
                          {"--quick", "--noises", "none,harsh", "--laws", "nearest_springs,surface"}},
                    Study{"stability", {"--quick", "--delays", "0,2,5", "--laws", "reference,proxy"}}),
    [](const auto& parameter) { return std::string(parameter.param.name); });

}  // namespace
}  // namespace hapticd::test

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

}  // namespace
}  // namespace hapticd

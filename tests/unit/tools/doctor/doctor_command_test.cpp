// SPDX-License-Identifier: Apache-2.0
// The built hapticctl, on a simulated machine and on this one.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "made_up_machine.h"
#include "tests/support/program.h"

namespace hapticd::test {
namespace {

Finished doctor(std::vector<std::string> arguments, const ProgramOptions& options = {}) {
  arguments.insert(arguments.begin(), {HAPTICCTL_PROGRAM, "doctor"});
  return runToEnd(arguments, options);
}

nlohmann::json findingNamed(const std::string& printed, const std::string& name) {
  for (const nlohmann::json& finding : nlohmann::json::parse(printed)) {
    if (finding["name"] == name) return finding;
  }
  return {};
}

TEST(DoctorCommand, ExitsWith0WhenNothingFails) {
  const MadeUpMachine machine;
  fillWithAGoodBox(machine);
  const Finished finished = doctor({"--root", machine.root()});
  EXPECT_EQ(finished.ending, exitedWith(0)) << finished.output;
  EXPECT_EQ(finished.errors, "");
  EXPECT_TRUE(finished.output.starts_with("ok    kernel: 6.1.0-50-rt-amd64")) << finished.output;
}

TEST(DoctorCommand, ExitsWith1WhenSomethingFails) {
  const MadeUpMachine machine;
  fillWithAGoodBox(machine);
  machine.set("sys/bus/usb/devices/1-1.1/speed", "12");
  const Finished finished = doctor({"--root", machine.root()});
  EXPECT_EQ(finished.ending, exitedWith(1)) << finished.output;
  EXPECT_NE(finished.output.find("\nfail  kinect: 045e:02ae at 1-1.1, 12 Mbit/s"), std::string::npos)
      << finished.output;
}

TEST(DoctorCommand, PrintsJsonForPrograms) {
  const MadeUpMachine machine;
  fillWithAGoodBox(machine);
  const Finished finished = doctor({"--json", "--root", machine.root()});
  EXPECT_EQ(finished.ending, exitedWith(0));
  const nlohmann::json clock = findingNamed(finished.output, "clock");
  EXPECT_EQ(clock, nlohmann::json::parse(R"({"name":"clock","verdict":"ok","fact":"tsc","remedy":""})"));
}

TEST(DoctorCommand, LooksAtThisMachineWithoutADaemon) {
  const MadeUpMachine nothing;
  const std::string socket = (nothing.root() / "socket").string();
  const Finished finished = doctor({"--json", "--socket", socket});
  EXPECT_EQ(finished.errors, "");
  EXPECT_TRUE(finished.ending == exitedWith(0) || finished.ending == exitedWith(1)) << finished.output;
  EXPECT_EQ(findingNamed(finished.output, "daemon")["fact"],
            "does not respond: there is no socket " + socket);
}

TEST(DoctorCommand, WorksForAnyUser) {
  if (::geteuid() != 0) GTEST_SKIP() << "takes root, to become another user";
  const Finished finished = doctor({"--json"}, {.user = 65534});
  EXPECT_EQ(finished.errors, "");
  EXPECT_FALSE(findingNamed(finished.output, "daemon").is_null()) << finished.output;
}

TEST(DoctorCommand, RefusesARootThatIsNoFolder) {
  const Finished finished = doctor({"--root", "/nowhere/at/all"});
  EXPECT_EQ(finished.ending, exitedWith(2));
  EXPECT_NE(finished.errors.find("/nowhere/at/all"), std::string::npos) << finished.errors;
  EXPECT_EQ(finished.output, "");
}

}  // namespace
}  // namespace hapticd::test

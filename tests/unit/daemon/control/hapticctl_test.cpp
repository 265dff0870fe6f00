// SPDX-License-Identifier: Apache-2.0
// The built hapticctl as a process, against the real server in front of a fake box.
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "control_fixture.h"
#include "tests/support/program.h"

namespace hapticd::daemon::test {
namespace {

using hapticd::test::Finished;
using hapticd::test::ProgramOptions;
using nlohmann::json;
using testing::AssertionFailure;
using testing::AssertionResult;
using testing::AssertionSuccess;

AssertionResult contains(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return AssertionSuccess();
  return AssertionFailure() << "no '" << part << "' in:\n" << text;
}

class HapticctlTest : public ControlFixture {
 protected:
  /// Runs hapticctl on the control socket, unless the arguments name another.
  Finished run(std::vector<std::string> arguments, ProgramOptions options = {}) {
    options.environment.push_back("HAPTICD_SOCKET=" + controlPath());
    return runWithout(std::move(arguments), std::move(options));
  }
  Finished runWithout(std::vector<std::string> arguments, ProgramOptions options = {}) {
    arguments.insert(arguments.begin(), HAPTICCTL);
    return hapticd::test::runToEnd(arguments, options);
  }

  void expectSuccess(const Finished& result) {
    EXPECT_EQ(hapticd::test::exitedWith(0), result.ending) << result.errors;
    EXPECT_EQ("", result.errors);
  }
  void expectFailure(const Finished& result, int exit_code) {
    EXPECT_EQ(hapticd::test::exitedWith(exit_code), result.ending) << result.errors;
    EXPECT_EQ("", result.output);
  }
};

BoxStatus troubledStatus() {
  BoxStatus status;
  status.loop.tick.mode = rt::Mode::holding;
  status.loop.tick.cause = rt::Cause::depth_stale;
  status.loop.tick.command_force_n_in_world = {3, 0, 4};
  status.loop.tick.hip_m_in_world = {0.1, -0.02, -0.8};
  status.loop.tick.points_used = 57;
  status.loop.counters = {101, 102, 103, 104, 105, 106, 107, 108, 109, 110, 111, 132, 133, 134, 135};
  status.trace_ticks_dropped = 113;
  status.force_thread_page_faults = 131;
  status.rate_hz = 999.95;
  status.wakeup_latency = {3'100, 8'000, 12'000, 4'560'000};
  status.handle.scheduling = {79, 79};
  status.handle.last_hop = rt::LatencySummary{250'000, 500'000, 900'000, 1'230'000};
  status.camera = {drivers::CameraState::lost, "the recording has ended", "recording", 114, 115, 141, ""};
  status.scene = {116, 117, 118, 119, 120, 121, 122'000, 29.5, Ball{{0.1, 0.2, -0.3}, 0.08}};
  status.handle.state = drivers::HandlePresence::present;
  status.handle.identity = "simulated";
  status.warnings = {"camera lost: the recording has ended", "the memory is not locked (raise LimitMEMLOCK)"};
  status.uptime_s = 59;  // the fake box adds one
  return status;
}

TEST_F(HapticctlTest, StatusShowsWhatIsWrongFirst) {
  box.setStatus(troubledStatus());
  start();
  const Finished result = run({"status"});
  expectSuccess(result);
  EXPECT_TRUE(result.output.starts_with(
      "! camera lost: the recording has ended\n! the memory is not locked (raise LimitMEMLOCK)\n"
      "mode          holding: the newest depth frame is too old, up 60 s\n"))
      << result.output;
}

TEST_F(HapticctlTest, StatusSaysWhatIsLeftOfTheStiffnessAndWhy) {
  BoxStatus status = troubledStatus();
  status.law.hand_stiffness_n_per_m = 125;
  status.loop.tick.stiffness_gain = 0.25;
  status.loop.tick.stiffness_rule = rt::StiffnessRule::mass;
  status.loop.tick.contact_damping_n_s_per_m = 2.625;
  status.loop.tick.handle.delay_s = 0.011;
  box.setStatus(status);
  start();
  EXPECT_TRUE(
      contains(run({"status", "--all"}).output,
               "125 of 500 N/m at the hand (mass of the device at 11.0 ms delay), 2.62 N s/m in contact\n"));
  status.loop.tick.stiffness_rule = rt::StiffnessRule::delay;
  status.loop.tick.handle.damps = true;
  box.setStatus(status);
  EXPECT_TRUE(
      contains(run({"status", "--all"}).output,
               "125 of 500 N/m at the hand (damping of the hand at 11.0 ms delay), 2.62 N s/m in contact "
               "by the device\n"));
}

TEST_F(HapticctlTest, StatusShowsEveryCounterWithItsMeaningAndUnits) {
  box.setStatus(troubledStatus());
  start();
  const std::string output = run({"status", "--all"}).output;
  for (const char* part :
       {"101 ticks, 102 overruns, 103 skipped periods, 131 page faults\n",
        "104 ticks in contact, 106 slew limited, 107 clamped, 108 not finite\n",
        "105 ticks outside the model, 109 with stale depth\n",
        "110 ticks stale, 111 ticks invalid, 135 releases\n",
        "132 ticks damped for passivity, 133 warm, 134 softened for delay", "113 ticks dropped\n",
        "114 frames, 115 damaged, 141 lost\n",
        "116 frames, 121 skipped, 117 models, 118 of them remodelled, 120 points over capacity\n",
        "29.5 frames per second, 119 points, modelled in 122.0 us",
        "within 80 mm of (0.1000, 0.2000, -0.3000) m in the world\n",
        "p50 3.1 us, p99 8.0 us, p99.9 12.0 us, max 4.56 ms", "5.000 N (3.000, 0.000, 4.000)",
        "from 57 points", "at (0.1000, -0.0200, -0.8000) m in the world",
        "no real-time scheduling, memory not locked",
        "last hop      p50 250.0 us, p99 500.0 us, p99.9 900.0 us, max 1.23 ms, at priority 79\n"}) {
    EXPECT_TRUE(contains(output, part));
  }
}

TEST_F(HapticctlTest, StatusHasNothingToComplainAboutWhenAllIsWell) {
  start();
  EXPECT_EQ(std::string::npos, run({"status"}).output.find('!'));
}

TEST_F(HapticctlTest, StatusShowsTheLedsThatThereAreAndTheirPatterns) {
  BoxStatus status = troubledStatus();
  status.leds.panel = {drivers::LedState::lost, "the chip is gone", "gpiod box", drivers::LedSet("1011")};
  status.leds.patterns = {LedPattern::on, LedPattern::double_blink, LedPattern::slow_blink,
                          LedPattern::fast_blink};
  box.setStatus(status);
  start();
  EXPECT_TRUE(contains(run({"status"}).output,
                       "leds          lost, gpiod box: power on, camera double_blink, fault fast_blink\n"));
}

TEST_F(HapticctlTest, StatusSaysNothingOfLedsWhereThereAreNone) {
  start();
  EXPECT_EQ(std::string::npos, run({"status"}).output.find("leds"));
}

TEST_F(HapticctlTest, StatusAsJsonIsWhatTheDaemonAnswered) {
  box.setStatus(troubledStatus());
  start();
  const Finished result = run({"status", "--json"});
  expectSuccess(result);
  EXPECT_EQ(102, json::parse(result.output)["status"]["loop"]["counters"]["overruns"]);
}

TEST_F(HapticctlTest, ShowsNoControlCharactersOfTheOtherSide) {
  BoxStatus status = troubledStatus();
  status.camera.identity = "evil\033[2J\x07name";
  box.setStatus(status);
  start();
  const std::string output = run({"status"}).output;
  EXPECT_TRUE(contains(output, R"(evil\x1b[2J\x07name)"));
}

TEST_F(HapticctlTest, GetShowsValuesWithUnits) {
  start();
  const Finished some = run({"get", "force.radius_m", "force.max_points"});
  expectSuccess(some);
  EXPECT_EQ("force.radius_m = 0.04 m\nforce.max_points = 100\n", some.output);
  const Finished all = run({"get"});
  EXPECT_EQ(static_cast<std::ptrdiff_t>(config::parameterTable().size()),
            std::count(all.output.begin(), all.output.end(), '\n'));
  const Finished as_json = run({"--json", "get", "force.radius_m"});
  EXPECT_EQ(0.04, json::parse(as_json.output)["parameters"][0]["value"]);
}

TEST_F(HapticctlTest, GetOfAnUnknownNameShowsTheNearest) {
  start();
  const Finished result = run({"get", "force.radios_m"});
  expectFailure(result, 1);
  EXPECT_TRUE(contains(result.errors, "force.radios_m"));
  EXPECT_TRUE(contains(result.errors, "force.radius_m"));
}

TEST_F(HapticctlTest, ParamsShowsTheTable) {
  start();
  const Finished result = run({"params"});
  expectSuccess(result);
  for (const config::Parameter& parameter : config::parameterTable()) {
    EXPECT_TRUE(contains(result.output, std::string(parameter.name)));
    EXPECT_TRUE(contains(result.output, std::string(parameter.help)));
  }
  const json rows = json::parse(run({"params", "--json"}).output)["parameters"];
  EXPECT_EQ(config::parameterTable().size(), rows.size());
}

TEST_F(HapticctlTest, SetChangesAndShowsBeforeAndAfter) {
  start();
  const Finished result = run({"set", "force.stiffness_n_per_m=800", "force.min_points=7"});
  expectSuccess(result);
  EXPECT_EQ("force.stiffness_n_per_m: 500 -> 800 N/m\nforce.min_points: 10 -> 7\n", result.output);
  EXPECT_EQ(800, box.appliedSettings().live.springs.stiffness_n_per_m);
  EXPECT_EQ(7, box.appliedSettings().live.springs.min_points);

  const json document = json::parse(run({"--json", "set", "force.radius_m=3e-2"}).output);
  EXPECT_EQ(
      R"({"generation":2,"changes":[{"name":"force.radius_m","before":0.04,"after":0.03,"unit":"m"}]})"_json,
      document);
}

TEST_F(HapticctlTest, SetOfAWrongValueChangesNothingAndNamesTheRange) {
  start();
  const Finished result =
      run({"set", "force.stiffness_n_per_m=800", "force.radius_m=7", "force.min_points=many"});
  expectFailure(result, 1);
  EXPECT_TRUE(contains(result.errors, "nothing was changed"));
  for (const char* name : {"force.radius_m", "force.min_points"}) {
    EXPECT_TRUE(contains(result.errors, name));
    EXPECT_TRUE(contains(result.errors, config::findParameter(name)->range()));
  }
  EXPECT_EQ(0U, box.generation());
}

TEST_F(HapticctlTest, SetListsUnknownNamesAndWrongValuesTogether) {
  start();
  const Finished result = run({"set", "force.radios_m=0.03", "force.min_points=many"});
  expectFailure(result, 1);
  EXPECT_TRUE(contains(result.errors,
                       "force.radios_m: there is no parameter of this name (did you mean force.radius_m"));
  EXPECT_TRUE(contains(result.errors, "force.min_points: "));
}

TEST_F(HapticctlTest, SetOfARestartParameterSaysWhereItBelongs) {
  start();
  const Finished result = run({"set", "camera.near_m=0.5"});
  expectFailure(result, 1);
  EXPECT_TRUE(contains(result.errors, "camera.near_m"));
  EXPECT_TRUE(contains(result.errors, "configuration file"));
}

TEST_F(HapticctlTest, SetSaysSoWhenTheLoopDoesNotTakeTheChange) {
  service_options.apply_timeout = std::chrono::milliseconds(20);
  start();
  box.holdAcknowledgements();
  const Finished result = run({"set", "force.radius_m=0.03"});
  expectFailure(result, 1);
  EXPECT_TRUE(contains(result.errors, "the force loop has not taken over the change in time"));
}

TEST_F(HapticctlTest, EngageSaysWhyItWasRefusedAndHowToDoItAnyway) {
  BoxStatus inside;
  inside.loop.tick.points_used = 20;
  box.setStatus(inside);
  start();
  const Finished refused = run({"engage"});
  expectFailure(refused, 1);
  EXPECT_TRUE(contains(refused.errors, "the handle would be in contact at once"));
  EXPECT_TRUE(contains(refused.errors, "hapticctl engage --inside"));
  EXPECT_EQ("engaged\n", run({"engage", "--inside"}).output);
}

TEST_F(HapticctlTest, EngageAndDisengageShowTheMode) {
  start();
  const Finished engaged = run({"engage"});
  expectSuccess(engaged);
  EXPECT_EQ("engaged\n", engaged.output);
  EXPECT_EQ("engaged\nit was engaged already; nothing has changed\n", run({"engage"}).output);
  EXPECT_EQ(R"({"mode":"idle","cause":"requested"})"_json, json::parse(run({"disengage", "--json"}).output));
}

TEST_F(HapticctlTest, SaysWhoMaySeeTheDepthImage) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root to run it as another user";
  start();
  std::filesystem::permissions(folder.path(""), std::filesystem::perms(0711));
  const Finished denied =
      run({"--socket", statusPath(), "snapshot", "--png", "/nowhere/frame.png"}, {.user = 65534});
  expectFailure(denied, 1);
  EXPECT_TRUE(contains(denied.errors, "haptic-view")) << denied.errors;
}

TEST_F(HapticctlTest, WatchAsJsonPrintsOneObjectPerLine) {
  start();
  const Finished result = run({"--json", "watch", "--interval", "20", "--count", "2"});
  std::istringstream lines(result.output);
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) EXPECT_EQ(0, json::parse(line)["droppedCount"]);
  EXPECT_EQ(2, count);
}

TEST_F(HapticctlTest, PrefersTheSocketOfTheCommandLineToTheEnvironments) {
  start();
  expectSuccess(
      runWithout({"status", "--socket", statusPath()}, {.environment = {"HAPTICD_SOCKET=/nowhere"}}));
}

TEST_F(HapticctlTest, SaysSoWhenTheSocketIsAnotherPrograms) {
  for (const std::string& answer : {std::string(), std::string("SSH-2.0\r\n"), std::string("[1,2]\0", 6)}) {
    const TemporaryFolder place;
    const std::string path = place.path("s");
    const auto listener = ListeningSocket::open(
        {.access = Access::read, .path = path, .mode = 0600, .group = "", .descriptor = -1});
    ASSERT_TRUE(listener);
    std::thread other([&] {
      pollfd waiting{listener->descriptor(), POLLIN, 0};
      ::poll(&waiting, 1, -1);
      const config::Descriptor client(::accept(listener->descriptor(), nullptr, nullptr));
      char call[256];
      ::recv(client.get(), call, sizeof call, 0);
      ::send(client.get(), answer.data(), answer.size(), MSG_NOSIGNAL);
    });
    const Finished result = runWithout({"status", "--socket", path});
    other.join();
    expectFailure(result, 3);
    EXPECT_TRUE(contains(result.errors, "the socket may be another program's"));
  }
}

TEST_F(HapticctlTest, DoctorShowsEachWarningOfTheDaemonAndKnowsItsCpu) {
  BoxStatus status = troubledStatus();
  status.privileges.cpu = 3;
  box.setStatus(status);
  start();
  const TemporaryFolder machine;
  const std::filesystem::path cpus = machine.path("sys/devices/system/cpu");
  std::filesystem::create_directories(cpus);
  std::ofstream(cpus / "isolated") << "2\n";
  const Finished result = runWithout({"doctor", "--root", machine.path(""), "--socket", controlPath()});
  expectSuccess(result);
  EXPECT_TRUE(contains(result.output, "warn  daemon: camera lost: the recording has ended\n"));
  EXPECT_TRUE(contains(result.output, "warn  daemon: the memory is not locked (raise LimitMEMLOCK)\n"));
  EXPECT_TRUE(contains(result.output, "isolated: CPU 2, but the force loop runs on CPU 3"));
}

TEST_F(HapticctlTest, ExplainsWrongUsageWithExitStatus2) {
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{},
                                                    {"frobnicate"},
                                                    {"set"},
                                                    {"set", "force.radius_m"},
                                                    {"set", "=1"},
                                                    {"set", "a=1", "a=2"},
                                                    {"status", "--nope"},
                                                    {"watch", "--interval", "5"},
                                                    {"watch", "--count", "x"},
                                                    {"completion", "tcsh"}}) {
    const Finished result = run(arguments);
    expectFailure(result, 2);
    EXPECT_TRUE(contains(result.errors, "--help"));
  }
}

}  // namespace
}  // namespace hapticd::daemon::test

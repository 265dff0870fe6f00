// SPDX-License-Identifier: Apache-2.0
// The scenario of `tools/demo --fixtures`, and the tutorial of docs/fixtures.md, in the scene of
// config/demo-fixtures.yaml.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <regex>
#include <span>
#include <sstream>

#include "daemon/trace/reader/trace_reader.h"
#include "tests/support/file_content.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd {
namespace {

using test::DaemonHome;
using test::exitedWith;
using test::Finished;

/// The sockets and folders lie as tools/demo puts them. Time limits are wide, for busy machines.
std::vector<std::string> demoCommand(const DaemonHome& home) {
  return test::hapticdCommand({"--config", std::string(HAPTICD_SOURCE_FOLDER) + "/config/demo-fixtures.yaml",
                               "--set=control.status_socket=" + home.statusSocket(),
                               "--set=control.control_socket=" + home.controlSocket(),
                               "--set=state.folder=" + home.stateFolder().string(),
                               "--set=safety.handle_timeout_s=1", "--set=safety.depth_timeout_s=5",
                               "--set=safety.overrun_burst=65"});
}

/// Runs a command of a shell in the folder of the daemon, with the environment of the tutorial's reader.
Finished shell(const DaemonHome& home, const std::string& command) {
  const std::string programs = std::filesystem::path(HAPTICCTL_PROGRAM).parent_path();
  return test::runToEnd({"/bin/bash", "-c",
                         fmt::format("cd '{}' && PATH='{}':$PATH HAPTICD_SOCKET='{}' && export PATH "
                                     "HAPTICD_SOCKET && {}",
                                     home.path().string(), programs, home.controlSocket(), command)});
}

std::vector<rt::Tick> ticksOf(const std::filesystem::path& folder) {
  std::vector<rt::Tick> ticks;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".mcap") continue;
    EXPECT_TRUE(trace::readTrace(entry.path(), {.tick = [&](const rt::Tick& tick) {
                                   ticks.push_back(tick);
                                   return true;
                                 }}));
  }
  return ticks;
}

std::vector<rt::Tick> those(const std::vector<rt::Tick>& ticks, auto condition) {
  std::vector<rt::Tick> found;
  std::ranges::copy_if(ticks, std::back_inserter(found), condition);
  return found;
}

double meanY(const std::vector<rt::Tick>& ticks) {
  double sum = 0;
  for (const rt::Tick& tick : ticks) sum += tick.hip_m_in_world.y;
  return sum / static_cast<double>(ticks.size());
}

/// From the surface of the ball of config/demo-fixtures.yaml.
double heightOf(const rt::Tick& tick) {
  return norm(tick.hip_m_in_world - rt::Vec3{0, 0, -1}) - 0.15;
}

class FixtureDemo : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(daemon.answers()); }

  const DaemonHome home;
  test::Daemon daemon{home, demoCommand(home)};
};

TEST_F(FixtureDemo, HoldsTheHandOffGuidesItAndLetsItMeetTheNodule) {
  ASSERT_EQ(home.control({"trace", "start"}).ending, exitedWith(0));
  const Finished tour =
      shell(home, fmt::format(". '{}/tools/lib/fixture_tour.bash'; fixture_tour '{}' '{}' 7",
                              HAPTICD_SOURCE_FOLDER, HAPTICCTL_PROGRAM, home.controlSocket()));
  EXPECT_EQ(tour.ending, exitedWith(0)) << tour.output << tour.errors;
  for (const char* words : {"1. A stand-off", "nearest keep-off", "2. A guided path", "3. A nodule"})
    EXPECT_TRUE(test::contains(tour.output, words));
  ASSERT_EQ(home.control({"trace", "stop"}).ending, exitedWith(0));
  const std::vector<rt::Tick> ticks = ticksOf(home.traceFolder());
  ASSERT_GT(ticks.size(), 10'000U);

  // Where the stand-off finds the hand inside, it grows out from under it at 5 mm/s, so that the hand, which
  // comes down while the daemon starts, is not thrown off. The largest force of the hand is 1.5 N and a
  // tremor of friction, so 300 N/m give way by 5.2 mm; the sensor's noise is below 2 mm. In the first half
  // the hand is still being slowed down.
  const auto held = those(ticks, [](const rt::Tick& tick) { return (tick.fixtures_in_contact & 1U) != 0; });
  ASSERT_GT(held.size(), 1000U);
  for (const rt::Tick& tick : std::span(held).subspan(held.size() / 2)) {
    const double grown_m = 0.005 * 0.001 * static_cast<double>(tick.number - held.front().number);
    const double boundary_m = std::min(0.02, heightOf(held.front()) + grown_m);
    ASSERT_GT(heightOf(tick), boundary_m - 0.0072);
    ASSERT_LT(heightOf(tick), 0.0220);
    ASSERT_EQ(norm(tick.law_force_n_in_world), 0);
  }

  // The path leads to y = 0.02 m at x = -0.015 m and back to -0.02 m at 0.015 m; nothing else moves the hand
  // along y.
  const auto guided = those(ticks, [](const rt::Tick& tick) {
    return (tick.fixtures_in_contact & 2U) != 0 && tick.contact != rt::ContactState::free;
  });
  const auto near = [](double x_m) {
    return [x_m](const rt::Tick& tick) { return std::abs(tick.hip_m_in_world.x - x_m) < 0.005; };
  };
  ASSERT_GT(those(guided, near(-0.015)).size(), 100U);
  ASSERT_GT(those(guided, near(0.015)).size(), 100U);
  EXPECT_GT(meanY(those(guided, near(-0.015))), 0.002);
  EXPECT_LT(meanY(those(guided, near(0.015))), -0.002);
  for (const rt::Tick& tick : guided) ASSERT_LT(norm(tick.guidance_force_n_in_world), 1.0 + 1e-9);

  // Region 1 is the nodule, at x = 0.015 m with a radius of 10 mm and half a transition of 5 mm around it.
  const auto met = those(ticks, [](const rt::Tick& tick) { return tick.tissue_region == 1; });
  ASSERT_GT(met.size(), 200U);
  EXPECT_TRUE(
      std::ranges::any_of(met, [](const rt::Tick& tick) { return norm(tick.cue_force_n_in_world) > 0.02; }));
  for (const rt::Tick& tick : met) ASSERT_LT(std::abs(tick.proxy_m_in_world.x - 0.015), 0.016);
}

/// A command of the tutorial and what it prints there.
struct Step {
  std::string command;
  std::vector<std::string> output;
};

/// Returns the commands of all blocks of the kind `console` in the tutorial.
std::vector<Step> tutorial() {
  std::istringstream lines(test::contentOf(std::string(HAPTICD_SOURCE_FOLDER) + "/docs/fixtures.md"));
  std::vector<Step> steps;
  bool inside = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("```")) {
      inside = line == "```console";
    } else if (inside && line.starts_with("$ ")) {
      steps.push_back({line.substr(2), {}});
    } else if (inside && !steps.empty() && steps.back().command.ends_with('\\')) {
      steps.back().command.pop_back();
      steps.back().command += line;
    } else if (inside && !steps.empty()) {
      steps.back().output.push_back(line);
    }
  }
  return steps;
}

/// With `#` for each number and one space for several: the part that is the same in each run.
std::string withoutNumbers(const std::string& text) {
  const std::string marked = std::regex_replace(text, std::regex("[-+]?[0-9]+([.:-][0-9]+)*"), "#");
  return std::regex_replace(marked, std::regex("[ -]{2,}| +$"), " ");
}

/// Whether the output has the lines of the tutorial, in this order; `...` stands for any lines.
bool shows(const std::string& output, const std::vector<std::string>& expected) {
  const std::string text = withoutNumbers(output);
  std::size_t begin = 0;
  for (const std::string& line : expected) {
    if (line == "...") continue;
    begin = text.find(withoutNumbers(line), begin);
    if (begin == std::string::npos) return false;
  }
  return true;
}

/// What such a command shows depends on where the hand is, so it may be repeated.
bool onlyReads(const std::string& command) {
  const std::regex reading("hapticctl (status|(fixture|region) (list|show)).*");
  return std::regex_match(command, reading);
}

TEST_F(FixtureDemo, TheTutorialsCommandsDoWhatItSays) {
  std::filesystem::create_directory(home.path() / "config");
  std::filesystem::copy_file(std::string(HAPTICD_SOURCE_FOLDER) + "/config/demo-fixtures.yaml",
                             home.path() / "config/demo-fixtures.yaml");
  std::filesystem::create_directories(home.path() / "docs/examples");
  std::filesystem::copy_file(std::string(HAPTICD_SOURCE_FOLDER) + "/docs/examples/phantom.py",
                             home.path() / "docs/examples/phantom.py");
  std::size_t run = 0;
  for (const Step& step : tutorial()) {
    if (step.command.starts_with("tools/demo") || step.command.starts_with("export ")) continue;
    Finished finished;
    EXPECT_TRUE(test::becomesTrue(
        [&] {
          finished = shell(home, step.command);
          return shows(finished.output + finished.errors, step.output) || !onlyReads(step.command);
        },
        std::chrono::milliseconds(200)));
    EXPECT_TRUE(shows(finished.output + finished.errors, step.output)) << step.command << "\n"
                                                                       << finished.output << finished.errors;
    const bool refused = !step.output.empty() && step.output.front().starts_with("hapticctl: ");
    EXPECT_EQ(finished.ending, exitedWith(refused ? 1 : 0)) << step.command;
    ++run;
  }
  EXPECT_GE(run, 20U);
}

}  // namespace
}  // namespace hapticd

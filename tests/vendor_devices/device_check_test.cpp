// SPDX-License-Identifier: Apache-2.0
// The guided check of a device, with a model of a handle in a loose hand and a person who follows a script,
// in time of their own.
#include "tools/lib/device_check/device_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <random>

#include "rt/base/pose.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

class ScriptedClock final : public CheckClock {
 public:
  std::int64_t now_ns() override { return now_; }
  void sleepUntil(std::int64_t when_ns) override { now_ = std::max(now_, when_ns); }

 private:
  std::int64_t now_ = 1'000'000'000;
};

/// A mass that a force moves after a latency, and that a dead man of 20 ms lets go.
class LooseHandle final : public Device {
 public:
  struct Settings {
    std::int64_t latency_ns = 4'000'000;
    double mass_kg = 0.15;
    double sign = 1;  ///< of the force that it exerts
    bool dead_man = true;
    bool calibrated = true;
    double noise_m = 0;
    bool measures_orientation = false;
    bool turns_forces = false;  ///< with the tool
    bool turns_back = false;    ///< against it
  };

  LooseHandle(ScriptedClock& clock, const Settings& settings)
      : clock_(clock), settings_(settings), moved_ns_(clock.now_ns()) {}

  DeviceReading read() override {
    constexpr std::int64_t kStep_ns = 100'000;
    for (; moved_ns_ + kStep_ns <= clock_.now_ns(); moved_ns_ += kStep_ns) step(1e-9 * kStep_ns);
    DeviceReading reading;
    // a fixed pattern stands for the encoder's steps
    const double noise_m = settings_.noise_m * std::sin(1e-6 * 7.3 * static_cast<double>(moved_ns_));
    reading.position_m = place_m_ + Vec3{noise_m, -noise_m, noise_m};
    reading.calibrated = settings_.calibrated;
    if (settings_.measures_orientation) reading.orientation = orientation;
    reading.latency_ns = 1'500'000;
    return reading;
  }
  void exert(const DeviceCommand& command) override {
    most_n_ = std::max(most_n_, norm(command.force_n));
    commands_.push_back({clock_.now_ns() + settings_.latency_ns, command.force_n});
  }
  DeviceLimits limits() const override { return {.force_n = 3.3}; }

  void putAt(const Vec3& place_m) {
    place_m_ = place_m;
    velocity_ = {};
  }
  const Vec3& place() const { return place_m_; }
  rt::Quaternion orientation;  ///< of the tool
  double most_n() const { return most_n_; }

 private:
  struct Command {
    std::int64_t acts_ns;
    Vec3 force_n;
  };

  void step(double step_s) {
    while (commands_.size() > 1 && commands_[1].acts_ns <= moved_ns_) commands_.pop_front();
    Vec3 force_n;
    if (!commands_.empty() && commands_.front().acts_ns <= moved_ns_) {
      const bool old = settings_.dead_man && moved_ns_ - commands_.front().acts_ns >= kDeadManNs;
      if (!old) force_n = settings_.sign * commands_.front().force_n;
      if (settings_.turns_forces) force_n = rotated(orientation, force_n);
      if (settings_.turns_back) force_n = rotated(inverse(orientation), force_n);
    }
    velocity_ = velocity_ + (step_s / settings_.mass_kg) * force_n;
    place_m_ = place_m_ + step_s * velocity_;
  }

  ScriptedClock& clock_;
  Settings settings_;
  std::int64_t moved_ns_;
  Vec3 place_m_;
  Vec3 velocity_;
  std::deque<Command> commands_;
  double most_n_ = 0;
};

/// Sits in front of a device whose axes are turned: x towards the person, y to the right, z up.
class ScriptedPerson final : public Person {
 public:
  explicit ScriptedPerson(LooseHandle& handle) : handle_(handle) {}

  void say(const std::string& text) override { said += text + "\n"; }
  bool isReady(const std::string& request) override {
    said += request + "\n";
    if (++requests > patience) return false;
    if (request.starts_with("Hold the handle in the middle")) handle_.putAt({});
    if (request.starts_with("The device will")) handle_.putAt(handle_.place());  // stops it
    if (request.starts_with("Turn the tool") && !turns.empty()) {
      handle_.orientation = turns.front();
      turns.pop_front();
    }
    for (const auto& [words, move] : moves) {
      if (request.starts_with("Move") && request.find(words) != std::string::npos) handle_.putAt(move);
    }
    return true;
  }
  std::optional<bool> answer(const std::string& /*question*/) override { return agrees; }

  std::vector<std::pair<std::string, Vec3>> moves{{"to your right", {0.004, 0.05, -0.002}},
                                                  {"up", {0, 0.003, 0.047}},
                                                  {"towards you", {0.052, 0, 0.004}}};
  std::deque<rt::Quaternion> turns;
  int patience = 1000;
  int requests = 0;
  bool agrees = true;
  std::string said;

 private:
  LooseHandle& handle_;
};

struct Checked {
  base::Result<void> result;
  CheckReport report;
  double most_n = 0;
  std::string said;
};

Checked check(const LooseHandle::Settings& settings,
              const std::function<void(ScriptedPerson&)>& change = {}) {
  ScriptedClock clock;
  LooseHandle handle(clock, settings);
  ScriptedPerson person(handle);
  if (change) change(person);
  Checked checked;
  checked.report.kind = "openhaptics";
  checked.result = DeviceCheck(handle, person, clock, /*turns_tool=*/true).run(checked.report);
  checked.most_n = handle.most_n();
  checked.said = person.said;
  return checked;
}

TEST(DeviceCheck, FindsAxesSignsLatencyAndDeadMan) {
  for (const double latency_ms : {0.0, 2.0, 10.0, 25.0}) {
    const Checked checked = check({.latency_ns = std::llround(latency_ms * 1e6), .noise_m = 2e-5});
    ASSERT_TRUE(checked.result) << checked.result.error().text();
    const CheckReport& report = checked.report;
    EXPECT_TRUE(report.problems.empty()) << textOf(report);
    EXPECT_EQ(report.rotation_world_handle, (std::array<double, 9>{0, 1, 0, 0, 0, 1, 1, 0, 0}));
    for (const CheckedAxis& axis : report.axes) EXPECT_TRUE(axis.yields && axis.confirmed == true);
    ASSERT_TRUE(report.latency_ms && report.dead_man_ms) << textOf(report);
    EXPECT_NEAR(*report.latency_ms, latency_ms, 2);
    EXPECT_NEAR(*report.dead_man_ms, 20 + latency_ms, 4);
    EXPECT_EQ(report.stated_latency_ms, 1.5);
    EXPECT_EQ(checked.most_n, DeviceCheck::kForce_n);
  }
}

TEST(DeviceCheck, NamesAForceOfTheWrongSignAndAPersonWhoDisagrees) {
  const Checked wrong = check({.sign = -1});
  ASSERT_TRUE(wrong.result);
  ASSERT_FALSE(wrong.report.problems.empty());
  EXPECT_NE(wrong.report.problems.front().find("do not use this device"), std::string::npos);
  EXPECT_FALSE(wrong.report.axes[0].yields);
  const Checked disagreed = check({}, [](ScriptedPerson& person) { person.agrees = false; });
  EXPECT_EQ(disagreed.report.problems.size(), 3U) << textOf(disagreed.report);
}

TEST(DeviceCheck, FindsAlongWhichAxesForcesActWhereTheToolIsTurned) {
  const auto turning = [](ScriptedPerson& person) {
    // the second one is not far enough from the first
    person.turns = {rt::quaternionOf(Vec3{M_PI, 0, 0}), rt::quaternionOf(Vec3{M_PI - 0.5, 0, 0}),
                    rt::quaternionOf(Vec3{0.2, M_PI / 2, 0.1})};
  };
  for (const auto& [with, against] : {std::pair{false, false}, {true, false}, {false, true}}) {
    const Checked checked =
        check({.noise_m = 2e-5, .measures_orientation = true, .turns_forces = with, .turns_back = against},
              turning);
    ASSERT_TRUE(checked.result) << checked.result.error().text();
    const bool turned = with || against;
    EXPECT_EQ(checked.report.force_axes, turned ? ForceAxes::turned : ForceAxes::as_commanded)
        << textOf(checked.report);
    EXPECT_EQ(checked.report.problems.size(), turned ? 1U : 0U) << textOf(checked.report);
  }
  const Checked unturned = check({.measures_orientation = true});
  EXPECT_EQ(unturned.report.force_axes, ForceAxes::unknown);
  EXPECT_NE(textOf(unturned.report).find("was not turned far enough"), std::string::npos);
}

TEST(ForceAxes, AreThoseOfMostOrientationsAndNeverOthersForAHandThatMoves) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const auto anyVector = [&] { return Vec3{normal(random), normal(random), normal(random)}; };
  int found = 0;
  constexpr int kTries = 3000;
  for (int i = 0; i < kTries; ++i) {
    std::array<rt::Quaternion, 3> turned;
    const auto isNear = [](const rt::Quaternion& a, const rt::Quaternion& b) {
      return norm(rotationVectorOf(inverse(a) * b)) < 1.2;
    };
    do {
      for (rt::Quaternion& q : turned)
        q = rt::normalised({normal(random), normal(random), normal(random), normal(random)});
    } while (isNear(turned[0], turned[1]) || isNear(turned[0], turned[2]) || isNear(turned[1], turned[2]));
    const ForceAxes axes = i % 3 == 0 ? ForceAxes::as_commanded : ForceAxes::turned;
    std::vector<Push> pushes;
    for (const rt::Quaternion& q : turned) {
      for (const Vec3& direction : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
        const rt::Quaternion way = i % 3 == 0 ? rt::Quaternion{} : i % 3 == 1 ? q : inverse(q);
        // 5 mm by the push and about 1.7 mm by the hand
        pushes.push_back({direction, 5e-3 * rotated(way, direction) + 1e-3 * anyVector(), q});
      }
    }
    const ForceAxes said = forceAxesOf(pushes);
    EXPECT_TRUE(said == axes || said == ForceAxes::unclear) << i;
    if (said == axes) ++found;
  }
  EXPECT_GT(found, kTries * 9 / 10);
}

TEST(DeviceCheck, NamesADeviceThatKeepsTheLastForce) {
  const Checked checked = check({.dead_man = false});
  ASSERT_TRUE(checked.result);
  EXPECT_FALSE(checked.report.dead_man_ms);
  ASSERT_EQ(checked.report.problems.size(), 1U) << textOf(checked.report);
  EXPECT_NE(checked.report.problems[0].find("the dead man of 20 ms does not act"), std::string::npos);
}

TEST(DeviceCheck, ExertsNothingUntilTheAxesAreKnown) {
  const Checked confused = check({}, [](ScriptedPerson& person) { person.moves.clear(); });
  ASSERT_TRUE(confused.result);
  EXPECT_EQ(confused.most_n, 0);
  EXPECT_EQ(confused.report.problems.size(), 1U);
  EXPECT_NE(confused.said.find("do not show the three axes"), std::string::npos);
  const Checked mirrored = check({}, [](ScriptedPerson& person) { person.moves[1].second = {0, 0, -0.05}; });
  EXPECT_EQ(mirrored.most_n, 0) << "left-handed";
}

TEST(DeviceCheck, EndsWhereThePersonGivesUpOrTheDeviceIsNotReady) {
  for (int patience = 0; patience < 9; ++patience) {
    const Checked checked = check({}, [&](ScriptedPerson& person) { person.patience = patience; });
    EXPECT_FALSE(checked.result) << patience;
  }
  const Checked uncalibrated = check({.calibrated = false});
  ASSERT_FALSE(uncalibrated.result);
  EXPECT_NE(uncalibrated.result.error().text().find("was not ready within 120 s"), std::string::npos);
  EXPECT_EQ(uncalibrated.most_n, 0);
}

TEST(CheckLog, IsReadAsItWasWritten) {
  Checked checked = check({});
  CheckReport& report = checked.report;
  report.model = "Touch \"X\"";
  report.serial = "17";
  report.version = "0.1.0";
  report.axes[1].confirmed.reset();
  report.dead_man_ms.reset();
  report.force_axes = ForceAxes::turned;
  report.problems = {"One.", "Two."};
  const auto read = reportIn(logOf(report));
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(logOf(*read), logOf(report));
  EXPECT_EQ(textOf(*read), textOf(report));
  EXPECT_NE(textOf(*read).find("PROBLEM: Two."), std::string::npos);
}

TEST(CheckLog, IsRefusedWhereAMemberIsMissingOrOfAnotherType) {
  const std::string good = logOf(check({}).report);
  ASSERT_TRUE(reportIn(good));
  EXPECT_FALSE(reportIn(""));
  EXPECT_FALSE(reportIn("[]"));
  EXPECT_FALSE(reportIn("{}"));
  EXPECT_FALSE(reportIn(good.substr(0, good.size() / 2)));
  std::size_t members = 0;
  for (std::size_t at = good.find('"'); at != std::string::npos; at = good.find("\n  \"", at + 1)) {
    const std::size_t name = good.find('"', at);
    const std::size_t colon = good.find(':', name);
    if (name == std::string::npos || colon == std::string::npos) break;
    std::string renamed = good;
    renamed[name + 1] = '_';
    const auto missing = reportIn(renamed);
    EXPECT_FALSE(missing) << good.substr(name, colon - name);
    std::string other = good;
    other.insert(colon + 1, " {}, \"x\":");
    EXPECT_FALSE(reportIn(other)) << good.substr(name, colon - name);
    ++members;
  }
  EXPECT_GE(members, 14U);
}

TEST(AnglesOf, GivesTheRotationAgain) {
  for (const double roll : {-2.5, -0.3, 0.0, 1.2}) {
    for (const double pitch : {-M_PI / 2, -0.8, 0.0, 1.1, M_PI / 2}) {
      for (const double yaw : {-3.0, 0.0, 0.4, 2.0}) {
        const auto rotation =
            rt::rotationOf({.position_m = {}, .roll_rad = roll, .pitch_rad = pitch, .yaw_rad = yaw});
        const auto [r, p, y] = anglesOf(rotation);
        const auto again = rt::rotationOf({.position_m = {}, .roll_rad = r, .pitch_rad = p, .yaw_rad = y});
        for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(again[i], rotation[i], 1e-7);
      }
    }
  }
}

}  // namespace
}  // namespace hapticd::tools

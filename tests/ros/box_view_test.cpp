// SPDX-License-Identifier: Apache-2.0
// How a box is seen from ROS 2: states, the choice of ticks, frames, diagnostics.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

#include "rt/base/clock.h"
#include "rt/base/rate_choice.h"
#include "tools/hapticd-ros/box/box_view.h"
#include "tools/lib/ros/tick_messages.h"
#include "tools/lib/ros/utc_clock.h"

namespace hapticd::tools::ros {
namespace {

constexpr std::int64_t kNow_ns = 5'000'000'000;

rt::Tick tickIn(rt::Mode mode) {
  rt::Tick tick;
  tick.mode = mode;
  tick.planned_ns = kNow_ns;
  tick.handle.sequence = 7;
  tick.handle.time_ns = kNow_ns - 300'000;
  return tick;
}

TEST(OperatingState, IsThatOfCrtkForEachMode) {
  using State = OperatingState;
  EXPECT_EQ(operatingStateOf(tickIn(rt::Mode::starting)), (State{"DISABLED", true, true}));
  EXPECT_EQ(operatingStateOf(tickIn(rt::Mode::idle)), (State{"DISABLED", true, false}));
  EXPECT_EQ(operatingStateOf(tickIn(rt::Mode::engaged)), (State{"ENABLED", true, false}));
  EXPECT_EQ(operatingStateOf(tickIn(rt::Mode::holding)), (State{"PAUSED", true, false}));
  EXPECT_EQ(operatingStateOf(tickIn(rt::Mode::faulted)), (State{"FAULT", true, false}));
}

TEST(OperatingState, IsHomedOnlyWhereTheHandleKnowsWhereItIs) {
  rt::Tick tick = tickIn(rt::Mode::idle);
  tick.handle.condition = rt::HandleCondition::not_calibrated;
  EXPECT_EQ(operatingStateOf(tick), (OperatingState{"DISABLED", false, true}));
  tick = tickIn(rt::Mode::idle);
  tick.handle.sequence = 0;  // nothing measured yet
  EXPECT_EQ(operatingStateOf(tick), (OperatingState{"DISABLED", false, false}));
  tick = tickIn(rt::Mode::holding);
  tick.handle.time_ns = kNow_ns - kMeasurementLife_ns;  // the handle is gone
  EXPECT_EQ(operatingStateOf(tick), (OperatingState{"PAUSED", false, false}));
}

TEST(Measurement, IsNotPublishedWhereItMeansNothing) {
  EXPECT_TRUE(isMeasured(tickIn(rt::Mode::idle)));
  rt::Tick clutched = tickIn(rt::Mode::holding);
  clutched.handle.condition = rt::HandleCondition::clutched;
  EXPECT_TRUE(isMeasured(clutched));
  rt::Tick none = tickIn(rt::Mode::idle);
  none.handle.sequence = 0;
  EXPECT_FALSE(isMeasured(none));
  rt::Tick uncalibrated = tickIn(rt::Mode::idle);
  uncalibrated.handle.condition = rt::HandleCondition::not_calibrated;
  EXPECT_FALSE(isMeasured(uncalibrated));
  rt::Tick infinite = tickIn(rt::Mode::engaged);
  infinite.handle.velocity_m_per_s_in_world.y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(isMeasured(infinite));
}

/// Numbers of the ticks that are chosen of `count` with a period of 1 ms.
std::vector<int> chosen(int rate_hz, int count) {
  rt::RateChoice choice(rate_hz);
  std::vector<int> numbers;
  // a box that has been on for a year, at an odd phase
  const std::int64_t start_ns = std::int64_t{365} * 86400 * rt::kNsPerSecond + 123'456;
  for (int i = 0; i < count; ++i) {
    if (choice.takes(start_ns + std::int64_t{i} * 1'000'000)) numbers.push_back(i);
  }
  return numbers;
}

TEST(RateChoice, TakesEachTickAtTheirRate) {
  EXPECT_EQ(chosen(1000, 5000).size(), 5000U);
}

TEST(RateChoice, TakesEachFourthAtAQuarterOfIt) {
  const std::vector<int> numbers = chosen(250, 4000);
  ASSERT_EQ(numbers.size(), 1000U);
  for (std::size_t i = 1; i < numbers.size(); ++i) EXPECT_EQ(numbers[i] - numbers[i - 1], 4);
}

TEST(RateChoice, KeepsARateThatDoesNotDivideItOnAverage) {
  const std::vector<int> numbers = chosen(300, 10'000);
  EXPECT_NEAR(static_cast<double>(numbers.size()), 3000, 1);
  for (std::size_t i = 1; i < numbers.size(); ++i) {
    EXPECT_GE(numbers[i] - numbers[i - 1], 3);
    EXPECT_LE(numbers[i] - numbers[i - 1], 4);
  }
}

Json parameterRow(const char* name, double value) {
  return {{"name", name}, {"value", value}};
}

TEST(FixedFrames, AreThoseOfCameraAndHandleInTheWorld) {
  const double quarter = std::numbers::pi / 2;
  const Json calibration{{"calibration",
                          {{"cameraPose",
                            {{"xM", 1.0},
                             {"yM", 2.0},
                             {"zM", 3.0},
                             {"rollRad", 0.0},
                             {"pitchRad", 0.0},
                             {"yawRad", quarter}}}}}};
  const Json parameters{
      {"parameters",
       Json::array({parameterRow("handle.position_x_m", 0.1), parameterRow("handle.position_y_m", 0.2),
                    parameterRow("handle.position_z_m", 0.3), parameterRow("handle.roll_rad", quarter),
                    parameterRow("handle.pitch_rad", 0), parameterRow("handle.yaw_rad", 0)})}};
  const std::vector<FixedFrame> frames = fixedFrames(calibration, parameters, "left/");
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[0].parent, "left/world");
  EXPECT_EQ(frames[0].name, "left/camera");
  EXPECT_EQ(frames[0].T_parent_frame.position_m_in_world, (rt::Vec3{1, 2, 3}));
  // a quarter turn about z: the camera's x is the world's y
  EXPECT_NEAR(frames[0].T_parent_frame.orientation.z, std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(frames[0].T_parent_frame.orientation.w, std::sqrt(0.5), 1e-15);
  EXPECT_EQ(frames[2].name, "left/handle");
  EXPECT_EQ(frames[2].T_parent_frame.position_m_in_world, (rt::Vec3{0.1, 0.2, 0.3}));
  EXPECT_NEAR(frames[2].T_parent_frame.orientation.x, std::sqrt(0.5), 1e-15);
}

TEST(FixedFrames, HoldTheOpticalFrameOfTheCameraInItsOwn) {
  const Json calibration{
      {"calibration",
       {{"cameraPose",
         {{"xM", 1}, {"yM", 2}, {"zM", 3}, {"rollRad", 0.1}, {"pitchRad", 0.2}, {"yawRad", 0.3}}}}}};
  const std::vector<FixedFrame> frames = fixedFrames(calibration, Json::object(), "left/");
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[1].parent, "left/camera");
  EXPECT_EQ(frames[1].name, "left/camera_optical");
  // right stays right, down is -y, forward -z
  const rt::RigidPose& pose = frames[1].T_parent_frame;
  EXPECT_EQ(rt::placed(pose, {1, 0, 0}), (rt::Vec3{1, 0, 0}));
  EXPECT_EQ(rt::placed(pose, {0, 1, 0}), (rt::Vec3{0, -1, 0}));
  EXPECT_EQ(rt::placed(pose, {0, 0, 1}), (rt::Vec3{0, 0, -1}));
}

TEST(FixedFrames, AreLeftOutWhereAReplyDoesNotTell) {
  EXPECT_TRUE(fixedFrames(Json::object(), Json::object(), "").empty());
  const Json calibration{{"calibration", {{"cameraPose", {{"xM", "near"}}}}}};
  EXPECT_TRUE(fixedFrames(calibration, Json{{"parameters", "none"}}, "").empty());
}

TEST(Diagnostics, SayWhatIsWrongWithEachPart) {
  const Json status{
      {"mode", "faulted"},
      {"cause", "energy_debt"},
      {"warnings", {"the disk is full"}},
      {"version", "1"},
      {"uptimeS", 12.0},
      {"loop", {{"rateHz", 1000.0}}},
      {"camera", {{"state", "lost"}, {"detail", "no frames (plug it in)"}, {"identity", "synthetic"}}},
      {"handle", {{"state", "present"}, {"advice", "it is late"}}}};
  const auto parts = diagnosticsOf(
      status, "", {.messages = 3, .messages_failed = 0, .ticks_lost = 1, .ticks_late = 0}, "left");
  ASSERT_EQ(parts.size(), 5U);
  EXPECT_EQ(parts[0].name, "left: box");
  EXPECT_EQ(parts[0].level, Diagnostic::Level::error);
  EXPECT_EQ(parts[0].message, "faulted (energy_debt); the disk is full");
  EXPECT_EQ(parts[2].name, "left: camera");
  EXPECT_EQ(parts[2].level, Diagnostic::Level::error);
  EXPECT_EQ(parts[2].message, "lost: no frames (plug it in)");
  EXPECT_EQ(parts[2].hardware_id, "synthetic");
  EXPECT_EQ(parts[3].level, Diagnostic::Level::warning);
  EXPECT_EQ(parts[3].message, "present: it is late");
  EXPECT_EQ(parts[4].values.at(2), (std::pair<std::string, std::string>{"ticks_lost", "1"}));
}

TEST(Diagnostics, AreStaleWhileHapticdDoesNotAnswer) {
  const auto parts = diagnosticsOf(Json(), "there is no socket", {}, "hapticd");
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0].level, Diagnostic::Level::stale);
  EXPECT_EQ(parts[0].message, "hapticd does not answer: there is no socket");
}

}  // namespace
}  // namespace hapticd::tools::ros

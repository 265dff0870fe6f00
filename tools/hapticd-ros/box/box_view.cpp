// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/box/box_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "daemon/trace/ros/scene_picture.h"
#include "rt/base/pose.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::ros {
namespace {

constexpr std::size_t kNumbers = 6;  // of a pose: x, y, z, roll, pitch, yaw
constexpr std::array<std::string_view, kNumbers> kHandle{"handle.position_x_m", "handle.position_y_m",
                                                         "handle.position_z_m", "handle.roll_rad",
                                                         "handle.pitch_rad",    "handle.yaw_rad"};
constexpr std::array<std::string_view, kNumbers> kCamera{
    "calibration.cameraPose.xM",      "calibration.cameraPose.yM",       "calibration.cameraPose.zM",
    "calibration.cameraPose.rollRad", "calibration.cameraPose.pitchRad", "calibration.cameraPose.yawRad"};

/// Nothing where a number is not known.
std::optional<rt::RigidPose> poseOf(const std::array<double, kNumbers>& numbers) {
  if (!std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); })) return std::nullopt;
  const auto& [x, y, z, roll, pitch, yaw] = numbers;
  const rt::PoseParameters pose{{x, y, z}, roll, pitch, yaw};
  return rt::RigidPose{pose.position_m, rt::quaternionOf(rt::rotationOf(pose))};
}

}  // namespace

Json handleFrameParameters() {
  return {{"names", kHandle}};
}

std::vector<FixedFrame> fixedFrames(const Json& calibration, const Json& parameters,
                                    const std::string& prefix) {
  std::array<double, kNumbers> camera;
  for (std::size_t i = 0; i < kNumbers; ++i) camera[i] = numberAt(calibration, kCamera[i]);
  std::array<double, kNumbers> handle;
  handle.fill(std::nan(""));
  for (const Json& row : listAt(parameters, "parameters")) {
    const std::string name = textAt(row, "name");
    for (std::size_t i = 0; i < kNumbers; ++i) {
      if (name == kHandle[i]) handle[i] = numberAt(row, "value");
    }
  }
  std::vector<FixedFrame> frames;
  if (const auto pose = poseOf(camera)) frames = trace::ros::cameraFrames(prefix, *pose);
  if (const auto pose = poseOf(handle)) frames.push_back({prefix + "world", prefix + "handle", *pose});
  return frames;
}

namespace {

using Level = Diagnostic::Level;

/// The text at `path`; empty if there is none.
std::string optionalText(const Json& status, const char* path) {
  const Json* const text = fieldAt(status, path);
  return text != nullptr && text->is_string() ? printable(text->get<std::string>()) : std::string();
}

Diagnostic boxOf(const Json& status) {
  const std::string mode = textAt(status, "mode");
  Diagnostic box{Level::ok, "box", fmt::format("{} ({})", mode, textAt(status, "cause")), "", {}};
  for (const Json& warning : listAt(status, "warnings")) {
    if (warning.is_string()) box.message += "; " + printable(warning.get<std::string>());
    box.level = Level::warning;
  }
  if (mode == "faulted") box.level = Level::error;
  box.values = {{"mode", mode},
                {"cause", textAt(status, "cause")},
                {"version", textAt(status, "version")},
                {"uptime_s", fixed(numberAt(status, "uptimeS"), 0)}};
  return box;
}

Diagnostic loopOf(const Json& status) {
  const std::string rate = fixed(numberAt(status, "loop.rateHz"), 1);
  return {Level::ok,
          "force loop",
          rate + " ticks per second",
          "",
          {{"rate_hz", rate},
           {"overruns", countAt(status, "loop.counters.overruns")},
           {"wakeup_latency_p99_ns", countAt(status, "loop.wakeupLatency.p99Ns")},
           {"compute_time_p99_ns", countAt(status, "loop.computeTime.p99Ns")}}};
}

/// A device with its state; `good` and `passing`: the words for one that works and one that will.
Diagnostic deviceOf(const Json& status, const std::string& device, std::string_view good,
                    std::string_view passing) {
  const std::string state = textAt(status, device + ".state");
  const std::string detail = optionalText(status, (device + ".detail").c_str());
  const std::string advice = optionalText(status, (device + ".advice").c_str());
  const bool works = state == good;
  Diagnostic part{Level::error, device, state, optionalText(status, (device + ".identity").c_str()), {}};
  if (state == passing) part.level = Level::warning;
  if (works) part.level = advice.empty() ? Level::ok : Level::warning;
  for (const std::string& more : {detail, advice}) {
    if (!more.empty()) part.message += ": " + more;
  }
  return part;
}

Diagnostic bridgeOf(const BridgeCounters& counters) {
  return {Level::ok,
          "hapticd-ros",
          fmt::format("{} messages", counters.messages),
          "",
          {{"messages", std::to_string(counters.messages)},
           {"messages_failed", std::to_string(counters.messages_failed)},
           {"ticks_lost", std::to_string(counters.ticks_lost)},
           {"ticks_late", std::to_string(counters.ticks_late)}}};
}

}  // namespace

std::vector<Diagnostic> diagnosticsOf(const Json& status, const std::string& problem,
                                      const BridgeCounters& counters, const std::string& name_space) {
  std::vector<Diagnostic> parts;
  if (status.is_null()) {
    parts.push_back({Level::stale, "box", "hapticd does not answer: " + problem, "", {}});
  } else {
    parts = {boxOf(status), loopOf(status), deviceOf(status, "camera", "streaming", ""),
             deviceOf(status, "handle", "present", "calibrating")};
    parts[2].values = {{"frames", countAt(status, "camera.frames")}};
    parts[3].values = {{"measurements", countAt(status, "handle.measurements")}};
  }
  parts.push_back(bridgeOf(counters));
  for (Diagnostic& part : parts) part.name = name_space + ": " + part.name;
  return parts;
}

namespace {

/// Between two batches of ticks: as short as hapticd sends them where the rate asks for that, else with some
/// ticks in each batch, because every batch costs a wake-up and the names of the fields.
int intervalMs(int rate_hz) {
  constexpr int kHighRate_hz = 250;
  return std::max(rate_hz > kHighRate_hz ? 5 : 10, 1000 / rate_hz);
}

Json tickFields() {
  return Json::array({"number", "planned_ns", "mode", "cause", "handle_position_m_in_world",
                      "handle_velocity_m_per_s_in_world", "handle_sequence", "handle_time_ns",
                      "handle_condition", "handle_buttons", "handle_has_orientation", "handle_has_gripper",
                      "handle_orientation_in_world_x", "handle_orientation_in_world_y",
                      "handle_orientation_in_world_z", "handle_orientation_in_world_w", "handle_gripper_rad",
                      "command_force_n_in_world"});
}

}  // namespace

ClientResult<BoxLink> BoxLink::open(const std::string& socket, int rate_hz, int interrupt) {
  auto ticks = VarlinkClient::connect(socket);
  if (!ticks) return std::unexpected(ticks.error());
  auto calls = VarlinkClient::connect(socket);
  if (!calls) return std::unexpected(calls.error());
  ticks->interruptBy(interrupt);
  calls->interruptBy(interrupt);
  const auto subscribed = ticks->subscribe("io.hapticd.Status.Ticks",
                                           {{"fields", tickFields()},
                                            {"intervalMs", intervalMs(rate_hz)},
                                            {"rateHz", rate_hz},
                                            {"orChanged", {"mode", "handle_buttons", "handle_condition"}}});
  if (!subscribed) return std::unexpected(subscribed.error());
  return BoxLink(std::move(*ticks), std::move(*calls));
}

ClientResult<Json> BoxLink::call(const std::string& method, const Json& parameters) {
  return calls_.call("io.hapticd.Status." + method, parameters, kSilence);
}

}  // namespace hapticd::tools::ros

// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/commands/box_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "rt/base/clock.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::ros {
namespace {

constexpr std::array<std::string_view, 3> kAxes{"x", "y", "z"};
/// A rotation whose quaternion differs more from a unit is none; `ros2 topic pub` writes few digits.
constexpr double kUnitTolerance = 1e-3;

double along(const rt::Vec3& v, std::size_t axis) {
  return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

bool isZero(const rt::Vec3& v) {
  return v == rt::Vec3{};
}

std::string nameOf(std::size_t axis, bool positive) {
  return fmt::format("ros-{}-{}", kAxes[axis], positive ? "positive" : "negative");
}

/// Why a side of the springs for positions is no passive fixture; nothing: it is one.
std::optional<std::string> problemOf(const ImpedanceSide& side) {
  if (!isFinite(side.p) || !isFinite(side.d) || !isFinite(side.bias) || !isFinite(side.deadband))
    return "a gain is not finite";
  if (!isZero(side.bias)) return "a bias is a force without a displacement, which no fixture exerts (send 0)";
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    if (along(side.p, axis) > 0) return "p must be 0 or negative: a spring with a positive one pushes away";
    if (along(side.d, axis) > 0) return "d must be 0 or negative: with a positive one motion grows";
    if (along(side.d, axis) != 0 && along(side.p, axis) == 0)
      return "d without p is a medium, which is a fixture of its own (effect: slow)";
  }
  return std::nullopt;
}

std::optional<std::string> problemOf(const Impedance& impedance) {
  for (const ImpedanceSide* side : {&impedance.orientation_positive, &impedance.orientation_negative}) {
    if (!isZero(side->p) || !isZero(side->d) || !isZero(side->bias))
      return "the box exerts no torques (set the gains of the orientation to 0)";
  }
  for (const ImpedanceSide* side : {&impedance.position_positive, &impedance.position_negative}) {
    if (auto problem = problemOf(*side)) return problem;
  }
  const double length = std::sqrt(dot(impedance.force_orientation, impedance.force_orientation));
  if (!(std::abs(length - 1) <= kUnitTolerance))
    return "force_orientation is no unit quaternion (w is 1 for no rotation)";
  if (!isFinite(impedance.force_position_m)) return "force_position is not finite";
  return std::nullopt;
}

Json planeOf(const Impedance& impedance, const ImpedanceSide& side, std::size_t axis, bool positive) {
  const rt::Vec3 of_axis{axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0};
  const rt::Vec3 outwards =
      (positive ? 1.0 : -1.0) * rotated(rt::normalised(impedance.force_orientation), of_axis);
  const rt::Vec3 place = impedance.force_position_m + std::abs(along(side.deadband, axis)) * outwards;
  return {{"name", nameOf(axis, positive)},
          {"kind", "plane"},
          {"position_m", {place.x, place.y, place.z}},
          {"normal", {-outwards.x, -outwards.y, -outwards.z}},
          {"stiffness_n_per_m", -along(side.p, axis)},
          {"damping_n_s_per_m", -along(side.d, axis)}};
}

}  // namespace

std::vector<std::string> impedanceFixtureNames() {
  std::vector<std::string> names;
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    for (const bool positive : {true, false}) names.push_back(nameOf(axis, positive));
  }
  return names;
}

std::expected<Json, std::string> fixturesOf(const Impedance& impedance) {
  if (auto problem = problemOf(impedance)) return std::unexpected(*problem);
  Json fixtures = Json::array();
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    for (const bool positive : {true, false}) {
      const ImpedanceSide& side = positive ? impedance.position_positive : impedance.position_negative;
      if (along(side.p, axis) != 0) fixtures.push_back(planeOf(impedance, side, axis, positive));
    }
  }
  return fixtures;
}

namespace {

std::string textOf(const ClientError& error) {
  if (error.kind != ClientError::Kind::error_reply)
    return error.remedy.empty() ? error.what : fmt::format("{} ({})", error.what, error.remedy);
  for (const char* const explanation : {"reason", "cause"}) {
    const Json* const found = fieldAt(error.parameters, explanation);
    if (found != nullptr && found->is_string())
      return fmt::format("hapticd refuses it: {}", found->get<std::string>());
  }
  return fmt::format("hapticd refuses it: {}", error.what);
}

std::string textAt(const Json& reply, const char* name) {
  const Json* const found = fieldAt(reply, name);
  return found != nullptr && found->is_string() ? found->get<std::string>() : "";
}

bool isActive(rt::Mode mode) {
  return mode == rt::Mode::engaged || mode == rt::Mode::holding;
}

}  // namespace

std::expected<Json, std::string> BoxCommands::call(const std::string& method, const Json& parameters) {
  if (!client_) {
    auto connected = VarlinkClient::connect(control_socket_);
    if (!connected) return std::unexpected(textOf(connected.error()));
    client_.emplace(std::move(*connected));
  }
  auto reply = client_->call("io.hapticd." + method, parameters, kLimit);
  if (reply) return *reply;
  // A late reply would be taken for that to the next call.
  if (reply.error().kind != ClientError::Kind::error_reply) {
    client_.reset();
    fixtures_.reset();  // hapticd may be another one next time
  }
  return std::unexpected(textOf(reply.error()));
}

BoxCommands::Refusal BoxCommands::done(const std::expected<Json, std::string>& reply) const {
  return reply ? std::nullopt : Refusal(reply.error());
}

BoxCommands::Refusal BoxCommands::changeState(std::string_view command) {
  const bool paused = state_.paused_since_ns != 0 || state_.mode == rt::Mode::holding;
  if (command == "enable") {
    if (paused) return "the state is PAUSED, which resume ends";
    return enable();
  }
  if (command == "resume") {
    if (!paused) return "the state is not PAUSED";
    return enable();
  }
  if (command == "pause") return pause();
  if (command != "disable") return "the commands are enable, disable, pause and resume";
  state_.paused_since_ns = 0;
  return done(call("Control.Disengage"));
}

BoxCommands::Refusal BoxCommands::enable() {
  auto reply = call("Control.Engage");
  if (reply && textAt(*reply, "mode") == rt::wordOf(rt::Mode::faulted)) {
    if (auto cleared = call("Control.ClearFault"); !cleared) return cleared.error();
    reply = call("Control.Engage");
  }
  return done(reply);
}

BoxCommands::Refusal BoxCommands::pause() {
  if (!isActive(state_.mode)) return "the state is not ENABLED";
  state_.paused_since_ns = BoxState::kPausing;
  const auto reply = call("Control.Disengage");
  state_.paused_since_ns = reply ? rt::monotonicNow_ns() : 0;
  return done(reply);
}

BoxCommands::Refusal BoxCommands::addForce(const rt::Vec3& force_n_in_world, std::int64_t time_ns) {
  const rt::Vec3& f = force_n_in_world;
  return done(call("Control.FeedForce", {{"forceNInWorld", {f.x, f.y, f.z}}, {"timeNs", time_ns}}));
}

BoxCommands::Refusal BoxCommands::setImpedance(const Impedance& impedance) {
  const auto fixtures = fixturesOf(impedance);
  if (!fixtures) return fixtures.error();
  if (fixtures_ == *fixtures) return std::nullopt;
  const auto known = call("Status.ListFixtures");
  if (!known) return known.error();
  Json remove = Json::array();
  const std::vector<std::string> own = impedanceFixtureNames();
  if (const Json* const list = fieldAt(*known, "fixtures"); list != nullptr && list->is_array()) {
    for (const Json& fixture : *list) {
      if (std::ranges::find(own, textAt(fixture, "name")) != own.end())
        remove.push_back(textAt(fixture, "name"));
    }
  }
  if (auto refusal = done(call("Control.ChangeFixtures", {{"remove", remove}, {"add", *fixtures}})))
    return refusal;
  fixtures_ = *fixtures;
  return std::nullopt;
}

BoxCommands::Refusal BoxCommands::feedPose(const std::string& frame, const rt::RigidPose& T_world_frame,
                                           std::int64_t time_ns) {
  const rt::Vec3& p = T_world_frame.position_m_in_world;
  const rt::Quaternion& q = T_world_frame.orientation;
  return done(call("Control.FeedPose", {{"frame", frame},
                                        {"positionM", {p.x, p.y, p.z}},
                                        {"orientationXyzw", {q.x, q.y, q.z, q.w}},
                                        {"timeNs", time_ns}}));
}

}  // namespace hapticd::tools::ros

// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/commands/impedance_fixtures.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

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

}  // namespace hapticd::tools::ros

// SPDX-License-Identifier: Apache-2.0
#include "config/settings/settings.h"

#include <algorithm>
#include <cstdlib>

#include "config/settings/driver_rows.h"

namespace hapticd::config {
namespace {

// Computed by libfreenect's freenect_raw_to_mm() from the constants that the cameras report: Z = 9 /
// (28.379075 - 0.02605 d).
constexpr double kFactoryAPerM = -0.02605 / 9;
constexpr double kFactoryBPerM = 28.379075 / 9;

/// Only a mistake of the program sets another word: those from outside are checked.
template <typename Row>
const Row& rowOf(std::span<const Row> rows, std::string_view word) {
  const auto found = std::ranges::find(rows, word, &Row::word);
  if (found == rows.end()) std::abort();
  return *found;
}

}  // namespace

rt::LiveParameters Settings::effectiveLive() const {
  rt::LiveParameters effective = live;
  effective.law = namedLaw();
  effective.standoff_clearance_m = standoffClearance_m(additions.fixtures);
  if (effective.standoff_clearance_m > 0) effective.standoff_clearance_m += live.tool.radius_m;
  return effective;
}

const FixtureSettings* widestStandoff(const std::vector<FixtureSettings>& fixtures) {
  const FixtureSettings* widest = nullptr;
  for (const FixtureSettings& fixture : fixtures) {
    if (fixture.kind != rt::FixtureKind::standoff || !fixture.enabled) continue;
    if (widest == nullptr || beginning_m(fixture) > beginning_m(*widest)) widest = &fixture;
  }
  return widest;
}

double standoffClearance_m(const std::vector<FixtureSettings>& fixtures) {
  const FixtureSettings* const widest = widestStandoff(fixtures);
  return widest != nullptr ? beginning_m(*widest) : 0;
}

const CameraDriver& driverOf(const CameraSettings& settings) {
  return rowOf(cameraDrivers(), settings.driver);
}

const HandleDriver& driverOf(const HandleSettings& settings) {
  return rowOf(handleDrivers(), settings.driver);
}

double HandleSettings::effectiveDeviceMass_kg() const {
  return device_mass_kg > 0 ? device_mass_kg : driverOf(*this).device_mass_kg(*this);
}

double HandleSettings::effectivePositionStep_m() const {
  return position_step_m > 0 ? position_step_m : driverOf(*this).position_step_m;
}

bool CameraSettings::deliversDepth() const {
  return driverOf(*this).depth_model(*this).has_value();
}

rt::DepthModelParameters CameraSettings::configuredDepthModel() const {
  rt::DepthModelParameters model;
  model.near_m = near_m;
  model.far_m = far_m;
  model.fx_px = fx_px;
  model.fy_px = fy_px;
  model.cx_px = cx_px;
  model.cy_px = cy_px;
  model.noise = noise();
  return model;
}

rt::DepthModelParameters CameraSettings::effectiveDepthModel() const {
  if (stated_model) return *stated_model;
  if (const auto of_driver = driverOf(*this).depth_model(*this)) return *of_driver;
  rt::DepthModelParameters model = configuredDepthModel();
  switch (depth_law) {
    case DepthLaw::paper:  // Table I, which the defaults are
      break;
    case DepthLaw::factory:
      model.a_per_m = kFactoryAPerM;
      model.b_per_m = kFactoryBPerM;
      break;
    case DepthLaw::custom:
      model.a_per_m = depth_a_per_m;
      model.b_per_m = depth_b_per_m;
      break;
  }
  return model;
}

}  // namespace hapticd::config

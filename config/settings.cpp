// SPDX-License-Identifier: Apache-2.0
#include "config/settings.h"

namespace hapticd::config {
namespace {

// Computed by libfreenect's freenect_raw_to_mm() from the constants that the cameras report: Z = 9 /
// (28.379075 - 0.02605 d).
constexpr double kFactoryAPerM = -0.02605 / 9;
constexpr double kFactoryBPerM = 28.379075 / 9;

// Apparent mass of the lightest desktop styluses (Phantom Omni).
constexpr double kLightestDevice_kg = 0.045;

}  // namespace

rt::LiveParameters Settings::effectiveLive() const {
  rt::LiveParameters effective = live;
  effective.law = force.namedLaw();
  effective.handle.device_mass_kg = handle.effectiveDeviceMass_kg();
  effective.standoff_clearance_m = standoffClearance_m(additions.fixtures);
  return effective;
}

const FixtureSettings* widestStandoff(const std::vector<FixtureSettings>& fixtures) {
  const FixtureSettings* widest = nullptr;
  for (const FixtureSettings& fixture : fixtures) {
    if (fixture.kind != rt::FixtureKind::standoff || !fixture.enabled) continue;
    if (widest == nullptr || fixture.clearance_m > widest->clearance_m) widest = &fixture;
  }
  return widest;
}

double standoffClearance_m(const std::vector<FixtureSettings>& fixtures) {
  const FixtureSettings* const widest = widestStandoff(fixtures);
  return widest != nullptr ? widest->clearance_m : 0;
}

double HandleSettings::effectiveDeviceMass_kg() const {
  if (device_mass_kg > 0) return device_mass_kg;
  switch (driver) {
    case HandleDriver::simulated:
      return simulated.mass_kg;
    case HandleDriver::udp:  // any device may be behind a bridge or a controller
    case HandleDriver::hid:
    case HandleDriver::falcon:  // no mass of it is known to be published; it is certainly larger
      break;
  }
  return kLightestDevice_kg;
}

rt::DepthModelParameters CameraSettings::effectiveDepthModel() const {
  rt::DepthModelParameters model = depth_model;
  if (driver == CameraDriver::v4l2) {
    model.width_px = v4l2.width_px;
    model.height_px = v4l2.height_px;
    model.law = rt::DepthLawKind::linear;
    if (v4l2.unit_um > 0) model.unit_m = v4l2.unit_um * 1e-6;
    model.raw_no_measurement = 0;
    model.raw_values = 65536;
    model.principle = rt::DepthPrinciple::active_stereo;
    return model;
  }
  switch (depth_law) {
    case DepthLaw::paper:  // Table I, which the defaults are
      model.a_per_m = rt::DepthModelParameters{}.a_per_m;
      model.b_per_m = rt::DepthModelParameters{}.b_per_m;
      break;
    case DepthLaw::factory:
      model.a_per_m = kFactoryAPerM;
      model.b_per_m = kFactoryBPerM;
      break;
    case DepthLaw::custom:
      break;
  }
  return model;
}

}  // namespace hapticd::config

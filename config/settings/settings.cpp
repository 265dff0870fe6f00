// SPDX-License-Identifier: Apache-2.0
#include "config/settings/settings.h"

#include "config/settings/depth_cameras.h"

namespace hapticd::config {
namespace {

// Computed by libfreenect's freenect_raw_to_mm() from the constants that the cameras report: Z = 9 /
// (28.379075 - 0.02605 d).
constexpr double kFactoryAPerM = -0.02605 / 9;
constexpr double kFactoryBPerM = 28.379075 / 9;

// Apparent mass of the lightest desktop styluses (Phantom Omni).
constexpr double kLightestDevice_kg = 0.045;

/// The configured size of the frames, and what of it is left open from the usual one of the camera.
FrameSize sizeOf(const V4l2Settings& v4l2, FrameSize usual) {
  return {v4l2.width_px > 0 ? v4l2.width_px : usual.width_px,
          v4l2.height_px > 0 ? v4l2.height_px : usual.height_px};
}

/// The camera that the driver `synthetic` plays, unless that is a Kinect v1: what the configuration leaves
/// open is that of the usual camera of its kind.
rt::DepthModelParameters playedModel(const CameraSettings& camera) {
  const V4l2Settings& v4l2 = camera.v4l2;
  const bool is_stereo = camera.played == PlayedCamera::stereo;
  const FrameSize size = sizeOf(v4l2, is_stereo ? kStereoSize : kFlightSize);
  rt::DepthModelParameters model =
      is_stereo ? stereoCamera(size, kD435FieldOfView_deg, kD435Baseline_m) : timeOfFlightCamera(size);
  model.near_m = camera.near_m;
  model.far_m = camera.far_m;
  if (v4l2.intrinsics == IntrinsicsSource::configured) {
    model.fx_px = camera.fx_px;
    model.fy_px = camera.fy_px;
    model.cx_px = camera.cx_px;
    model.cy_px = camera.cy_px;
  }
  if (v4l2.unit_um > 0) {
    model.unit_m = v4l2.unit_um * 1e-6;
  } else if (is_stereo && model.far_m <= kFineUnit_m * (model.raw_values - 1)) {
    model.unit_m = kFineUnit_m;
  }
  if (camera.noise().isKnown()) model.noise = camera.noise();
  return model;
}

}  // namespace

rt::LiveParameters Settings::effectiveLive() const {
  rt::LiveParameters effective = live;
  effective.law = namedLaw();
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

bool CameraSettings::deliversDepth() const {
  return driver == CameraDriver::v4l2 ||
         (driver == CameraDriver::synthetic && played != PlayedCamera::kinect);
}

rt::DepthModelParameters CameraSettings::effectiveDepthModel() const {
  if (stated_model) return *stated_model;
  if (driver == CameraDriver::synthetic && played != PlayedCamera::kinect) return playedModel(*this);
  rt::DepthModelParameters model;
  model.near_m = near_m;
  model.far_m = far_m;
  model.fx_px = fx_px;
  model.fy_px = fy_px;
  model.cx_px = cx_px;
  model.cy_px = cy_px;
  model.noise = noise();
  if (driver == CameraDriver::v4l2) {
    const FrameSize size = sizeOf(v4l2, kStereoSize);
    model.width_px = size.width_px;
    model.height_px = size.height_px;
    model.law = rt::DepthLawKind::linear;
    if (v4l2.unit_um > 0) model.unit_m = v4l2.unit_um * 1e-6;
    model.raw_no_measurement = 0;
    model.raw_values = 65536;
    model.principle = rt::DepthPrinciple::active_stereo;
    return model;
  }
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

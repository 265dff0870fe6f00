// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "config/settings/depth_cameras.h"
#include "config/settings/driver_rows.h"
#include "config/settings/row_of_member.h"
#include "drivers/base/stop_signal.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/camera_worker.h"
#include "drivers/camera/synthetic/analytic_scene.h"

namespace hapticd::drivers {

/// Films an AnalyticScene at its frame rate; the scene's time starts at 0. A frame that cannot be rendered in
/// time is skipped, so that the scene keeps moving with the clock.
class SyntheticCamera final : public Camera {
 public:
  SyntheticCamera(const SyntheticSettings& settings, const rt::DepthModelParameters& depth_model)
      : frame_rate_hz_(settings.frame_rate_hz), scene_(settings, depth_model) {}
  ~SyntheticCamera() override { stop(); }

  /// Errors: the frame rate is not above zero.
  base::Result<void> start(FrameSink& sink) override;
  void stop() override;
  CameraStatus status() const override { return board_.snapshot(); }

 private:
  void film(FrameSink& sink);

  double frame_rate_hz_;
  AnalyticScene scene_;
  CameraStatusBoard board_;
  StopSignal stop_signal_;
  std::thread thread_;
};

// Columns: as those of the table (config/settings/parameter_table.cpp).
// clang-format off
inline constexpr auto kSyntheticRows = std::to_array<config::Parameter>({
    config::row<HAPTICD_OWN_MEMBER(camera, SyntheticSettings, played)>(
        "synthetic.camera", config::Effect::restart, "", {}, "",
        "camera that the driver synthetic plays: a Kinect v1, a stereo camera or a time-of-flight camera"),
    config::row<HAPTICD_OWN_MEMBER(camera, SyntheticSettings, scene)>(
        "synthetic.scene", config::Effect::restart, "", {}, "",
        "scene shown by the driver synthetic"),
    config::row<HAPTICD_OWN_MEMBER(camera, SyntheticSettings, noise)>(
        "synthetic.noise", config::Effect::restart, "", {}, "",
        "noise of its depth: none, random rounding to raw units, that of a usual sensor, or that of a noisier one"),
    config::row<HAPTICD_OWN_MEMBER(camera, SyntheticSettings, distance_m)>(
        "synthetic.distance_m", config::Effect::restart, "m", {0.1, 10}, "",
        "distance from the camera to the plane or to the sphere's centre"),
    config::row<HAPTICD_OWN_MEMBER(camera, SyntheticSettings, tilt_rad)>(
        "synthetic.tilt_rad", config::Effect::restart, "rad", {-1.4, 1.4}, "",
        "tilt of the plane about the camera's x axis"),
    config::row<HAPTICD_OWN_MEMBER(camera, SyntheticSettings, sphere_radius_m)>(
        "synthetic.sphere_radius_m", config::Effect::restart, "m", {0.005, 2}, "",
        "radius of the sphere"),
    config::row<HAPTICD_OWN_MEMBER(camera, SyntheticSettings, motion_amplitude_m)>(
        "synthetic.motion_amplitude_m", config::Effect::restart, "m", {0, 2}, "",
        "amplitude of the moving sphere along x"),
    config::row<HAPTICD_OWN_MEMBER(camera, SyntheticSettings, motion_period_s)>(
        "synthetic.motion_period_s", config::Effect::restart, "s", {0.1, 600}, "",
        "period of the moving sphere"),
    config::row<HAPTICD_OWN_MEMBER(camera, SyntheticSettings, frame_rate_hz)>(
        "synthetic.frame_rate_hz", config::Effect::restart, "Hz", {1, 120}, "",
        "frames per second"),
    config::row<HAPTICD_OWN_MEMBER(camera, SyntheticSettings, seed)>(
        "synthetic.seed", config::Effect::restart, "", {0, 2147483647}, "",
        "seed of the noise; the same seed gives the same noise"),
});
// clang-format on

/// Returns the camera that the driver plays, unless that is a Kinect v1: what the configuration leaves open
/// is that of the usual camera of its kind.
inline std::optional<rt::DepthModelParameters> playedModel(const config::CameraSettings& camera) {
  const PlayedCamera played = camera.of<SyntheticSettings>().played;
  if (played == PlayedCamera::kinect) return std::nullopt;
  const config::DepthFormat& format = camera;
  const rt::DepthModelParameters configured = camera.configuredDepthModel();
  const bool is_stereo = played == PlayedCamera::stereo;
  const config::FrameSize size =
      config::sizeOf(format, is_stereo ? config::kStereoSize : config::kFlightSize);
  rt::DepthModelParameters model =
      is_stereo ? config::stereoCamera(size, config::kD435FieldOfView_deg, config::kD435Baseline_m)
                : config::timeOfFlightCamera(size);
  model.near_m = configured.near_m;
  model.far_m = configured.far_m;
  if (format.intrinsics == config::IntrinsicsSource::configured) {
    model.fx_px = configured.fx_px;
    model.fy_px = configured.fy_px;
    model.cx_px = configured.cx_px;
    model.cy_px = configured.cy_px;
  }
  if (format.unit_um > 0) {
    model.unit_m = format.unit_um * 1e-6;
  } else if (is_stereo && model.far_m <= config::kFineUnit_m * (model.raw_values - 1)) {
    model.unit_m = config::kFineUnit_m;
  }
  if (configured.noise.isKnown()) model.noise = configured.noise;
  return model;
}

inline constexpr config::CameraDriver kSyntheticCamera{
    .word = "synthetic",
    .help = "a computed scene whose true surface is known, seen by a Kinect v1 or another camera",
    .parameters = kSyntheticRows,
    .stands_in = true,
    .depth_model = playedModel,
    .source = [](const config::CameraSettings&) { return std::string("a computed scene"); }};

std::unique_ptr<Camera> makeSyntheticCamera(const config::CameraSettings& settings);

}  // namespace hapticd::drivers

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <thread>

#include "config/settings/settings.h"
#include "drivers/base/stop_signal.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/camera_status_board.h"
#include "drivers/camera/synthetic/analytic_scene.h"

namespace hapticd::drivers {

/// Films an AnalyticScene at its frame rate; the scene's time starts at 0. A frame that cannot be rendered in
/// time is skipped, so that the scene keeps moving with the clock.
class SyntheticCamera final : public Camera {
 public:
  SyntheticCamera(const config::SyntheticSettings& settings, const rt::DepthModelParameters& depth_model)
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

}  // namespace hapticd::drivers

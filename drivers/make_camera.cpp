// SPDX-License-Identifier: Apache-2.0
#include "drivers/make_camera.h"

#include "drivers/camera/freenect/freenect_camera.h"
#include "drivers/camera/recorded/recorded_camera.h"
#include "drivers/camera/synthetic/synthetic_camera.h"
#include "drivers/camera/v4l2/v4l2_camera.h"

namespace hapticd::drivers {

std::unique_ptr<Camera> makeCamera(const config::CameraSettings& settings,
                                   const config::SyntheticSettings& synthetic) {
  switch (settings.driver) {
    case config::CameraDriver::freenect:
      return std::make_unique<FreenectCamera>(settings.serial);
    case config::CameraDriver::recorded:
      return std::make_unique<RecordedCamera>(
          settings.recording, settings.loop, settings.speed,
          DepthLimits{settings.depth_model.near_m, settings.depth_model.far_m});
    case config::CameraDriver::synthetic:
      return std::make_unique<SyntheticCamera>(synthetic, settings.effectiveDepthModel());
    case config::CameraDriver::v4l2:
      return std::make_unique<V4l2Camera>(settings);
  }
  return nullptr;  // the configuration accepts no other value
}

}  // namespace hapticd::drivers

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>

#include "config/settings/driver_rows.h"
#include "drivers/camera/freenect/freenect_camera.h"
#include "drivers/camera/recorded/recorded_camera.h"
#include "drivers/camera/synthetic/synthetic_camera.h"
#include "drivers/camera/v4l2/v4l2_camera.h"
#include "drivers/handle/falcon/falcon_handle.h"
#include "drivers/handle/hid/hid_handle.h"
#include "drivers/handle/simulated/simulated_handle.h"
#include "drivers/handle/udp/udp_handle.h"
#include "drivers/led/led_panel.h"

/// The table of drivers: what each states of itself, and how it is made.
namespace hapticd::drivers {

struct CameraRow {
  config::CameraDriver driver;
  std::unique_ptr<Camera> (*make)(const config::CameraSettings& settings);
};

// clang-format off
inline constexpr std::array kCameras{
    CameraRow{kFreenectCamera, makeFreenectCamera},
    CameraRow{kRecordedCamera, makeRecordedCamera},
    CameraRow{kSyntheticCamera, makeSyntheticCamera},
    CameraRow{kV4l2Camera, makeV4l2Camera},
};
// clang-format on

struct HandleRow {
  config::HandleDriver driver;
  std::unique_ptr<Handle> (*make)(const config::HandleSettings& settings,
                                  const rt::HandleScaleParameters& scale, const HandleThreadPolicy& policy);
};

// clang-format off
inline constexpr std::array kHandles{
    HandleRow{kSimulatedHandle, makeSimulatedHandle},
    HandleRow{kUdpHandle, makeUdpHandle},
    HandleRow{kHidHandle, makeHidHandle},
    HandleRow{kFalconHandle, makeFalconHandle},
};
// clang-format on

/// Creates the camera driver selected by the settings; it is not started.
std::unique_ptr<Camera> makeCamera(const config::CameraSettings& settings);

/// Creates the handle driver selected by the settings; it is not started.
std::unique_ptr<Handle> makeHandle(const config::HandleSettings& settings,
                                   const rt::HandleScaleParameters& scale,
                                   const HandleThreadPolicy& policy = {});

/// Creates the LED driver selected by the settings; it is not started.
std::unique_ptr<LedPanel> makeLedPanel(const config::LedSettings& settings);

}  // namespace hapticd::drivers

// SPDX-License-Identifier: Apache-2.0
#include "drivers/make_devices.h"

#include "drivers/camera/freenect/freenect_camera.h"
#include "drivers/camera/recorded/recorded_camera.h"
#include "drivers/camera/synthetic/synthetic_camera.h"
#include "drivers/camera/v4l2/v4l2_camera.h"
#include "drivers/handle/falcon/falcon_handle.h"
#include "drivers/handle/hid/hid_handle.h"
#include "drivers/handle/hid/hidapi_port.h"
#include "drivers/handle/simulated/simulated_handle.h"
#include "drivers/handle/udp/udp_handle.h"
#include "drivers/led/gpiod/gpiod_leds.h"
#include "drivers/led/led_panel.h"

namespace hapticd::drivers {

std::unique_ptr<Camera> makeCamera(const config::CameraSettings& settings,
                                   const config::SyntheticSettings& synthetic) {
  switch (settings.driver) {
    case config::CameraDriver::freenect:
      return std::make_unique<FreenectCamera>(settings.serial);
    case config::CameraDriver::recorded:
      return std::make_unique<RecordedCamera>(settings.recording, settings.loop, settings.speed,
                                              DepthLimits{settings.near_m, settings.far_m});
    case config::CameraDriver::synthetic:
      return std::make_unique<SyntheticCamera>(synthetic, settings.effectiveDepthModel());
    case config::CameraDriver::v4l2:
      return std::make_unique<V4l2Camera>(settings);
  }
  return nullptr;  // the configuration accepts no other value
}

std::unique_ptr<Handle> makeHandle(const config::HandleSettings& settings,
                                   const rt::HandleScaleParameters& scale, const HandleThreadPolicy& policy) {
  switch (settings.driver) {
    case config::HandleDriver::simulated:
      return std::make_unique<SimulatedHandle>(settings.simulated, policy);
    case config::HandleDriver::udp:
      return std::make_unique<UdpHandle>(settings, scale, policy);
    case config::HandleDriver::hid:
      return std::make_unique<HidHandle>(settings, scale, openThroughHidapi, policy);
    case config::HandleDriver::falcon:
      return std::make_unique<FalconHandle>(settings, scale, policy);
  }
  return nullptr;  // the configuration accepts no other value
}

std::unique_ptr<LedPanel> makeLedPanel(const config::LedSettings& settings) {
  switch (settings.driver) {
    case config::LedDriver::none:
      return std::make_unique<NoLeds>();
    case config::LedDriver::gpiod:
      return std::make_unique<GpiodLeds>(settings);
  }
  return nullptr;  // the configuration accepts no other value
}

}  // namespace hapticd::drivers

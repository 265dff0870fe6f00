// SPDX-License-Identifier: Apache-2.0
#include "drivers/make_handle.h"

#include "drivers/handle/falcon/falcon_handle.h"
#include "drivers/handle/hid/hid_handle.h"
#include "drivers/handle/hid/hidapi_port.h"
#include "drivers/handle/simulated/simulated_handle.h"
#include "drivers/handle/udp/udp_handle.h"

namespace hapticd::drivers {

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

}  // namespace hapticd::drivers

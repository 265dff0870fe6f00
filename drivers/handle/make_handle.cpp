#include "drivers/handle/make_handle.h"

#include "drivers/handle/simulated/simulated_handle.h"

namespace hapticd::drivers {

std::unique_ptr<Handle> makeHandle(const config::HandleSettings& settings,
                                   [[maybe_unused]] const rt::HandleScaleParameters& scale) {
  switch (settings.driver) {
    case config::HandleDriver::simulated:
      return std::make_unique<SimulatedHandle>(settings.simulated);
    case config::HandleDriver::udp:
    case config::HandleDriver::hid:
    case config::HandleDriver::falcon:
      break;
  }
  return nullptr;  // no other value passes the configuration
}

}  // namespace hapticd::drivers

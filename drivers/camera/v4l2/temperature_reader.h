// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <thread>

#include "drivers/base/stop_signal.h"
#include "drivers/camera/v4l2/system_calls.h"

namespace hapticd::drivers {

/// Asks a camera for its temperature once in a while. In a thread of its own, because the kernel waits up to
/// 5 s for a control that a camera does not answer, and frames must not wait for it.
class TemperatureReader {
 public:
  using Report = std::function<void(std::optional<double> temperature_c)>;

  /// `device`: outlives the reader. `report`: is called in the reader's thread, only for cameras that state
  /// their temperature.
  TemperatureReader(const OpenDevice& device, std::uint16_t vendor, Report report);
  /// Waits for the control that is being asked.
  ~TemperatureReader();
  TemperatureReader(const TemperatureReader&) = delete;
  TemperatureReader& operator=(const TemperatureReader&) = delete;

 private:
  StopSignal stop_signal_;
  std::thread thread_;  // not joinable: there is nothing to ask, or no thread
};

}  // namespace hapticd::drivers

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "tools/haptic-bridge/open_haptics/hd.h"
#include "tools/haptic-bridge/open_haptics/servo_loop.h"
#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools {

/// Limits of a model, those of the weakest one where it is unknown. `nominal_max_force_n`: what the library
/// says, which is never exceeded; not above zero: it says nothing. `output_degrees`: of freedom, driven ones.
DeviceLimits limitsOfHdModel(std::string_view model, double nominal_max_force_n, int output_degrees);

/// Drives the Touch, Touch X and Phantom devices by OpenHaptics' libHD.so, which is loaded when it is first
/// used and never unloaded. The force is carried by the thread of the library's scheduler.
class OpenHapticsDriver final : public DeviceDriver {
 public:
  /// `library`: path; empty: the one that the system's loader finds. `device`: name; empty: the default one.
  OpenHapticsDriver(std::string library, std::string device)
      : library_(std::move(library)), device_(std::move(device)) {}

  base::Result<void> drive(DeviceSession& session) override;

 private:
  base::Result<void> run(DeviceSession& session, const DeviceAbout& about, unsigned int style);
  base::Result<void> watch(DeviceSession& session, const DeviceAbout& about, unsigned int style);

  std::string library_;
  std::string device_;
  std::optional<Hd> hd_;
  HdHandle handle_ = kNoHdHandle;
  ServoLoop loop_;  // outlives a callback that the library calls late
};

}  // namespace hapticd::tools

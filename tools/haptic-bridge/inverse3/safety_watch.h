// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>

#include "tools/haptic-bridge/inverse3/service_messages.h"

namespace hapticd::tools::inverse3 {

/// What an event or a state means for the person at the device.
struct Finding {
  std::string text;   ///< in words; empty: nothing to say
  bool ends = false;  ///< the device cannot be used any longer in this opening
};

/// Knows from events and states why the device must exert nothing at the moment. Thread: one.
class SafetyWatch {
 public:
  explicit SafetyWatch(std::string device_id) : device_id_(std::move(device_id)) {}

  /// Events of other devices mean nothing, except that grips fall asleep or are lost.
  Finding takeEvent(const ServiceEvent& event);
  /// Returns what has changed.
  Finding takeState(const DeviceState& state);

  /// No force now.
  bool holds() const { return braked_ || danger_ || !ready_ || !powered_; }
  bool calibrated() const { return calibrated_; }
  /// A grip fell asleep or was lost since the last call.
  bool takeGripLost() { return std::exchange(grip_lost_, false); }

 private:
  Finding takeSafety(const ServiceEvent& event);

  std::string device_id_;
  bool braked_ = false;
  bool danger_ = false;
  bool ready_ = true;
  bool powered_ = true;
  bool calibrated_ = true;
  bool grip_lost_ = false;
};

}  // namespace hapticd::tools::inverse3

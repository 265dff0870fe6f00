// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/inverse3/safety_watch.h"

#include <utility>

#include "config/base/error.h"

namespace hapticd::tools::inverse3 {
namespace {

/// With what the service itself says about it; printable.
std::string inWords(const std::string& text, const ServiceEvent& event) {
  std::string detail = event.reason;
  if (!event.message.empty()) detail += (detail.empty() ? "" : ": ") + event.message;
  return base::Error{"", text, detail}.text();
}

}  // namespace

Finding SafetyWatch::takeEvent(const ServiceEvent& event) {
  const bool ours = event.device_id.empty() || event.device_id == device_id_;
  if (!ours) {
    if (event.name == "device-sleep" || event.name == "device-disconnected") grip_lost_ = true;
    return {};
  }
  if (event.name == "device-safety-triggered") return takeSafety(event);
  if (event.name == "device-disconnected")
    return {inWords("the device was unplugged or does not answer the service", event), true};
  if (event.name == "device-busy") return {inWords("another session uses the device", event), true};
  if (event.name == "device-connection-loop")
    return {inWords("the device connects and disconnects again and again: check cable and power", event),
            true};
  if (event.name == "device-calibration-failed") return {inWords("calibration failed", event), true};
  return {};
}

Finding SafetyWatch::takeSafety(const ServiceEvent& event) {
  if (event.safety_type == "ebrake_triggered") {
    braked_ = true;
    return {inWords("the emergency brake is engaged: no force until it is released", event)};
  }
  if (event.safety_type == "ebrake_released") {
    braked_ = false;
    return {inWords("the emergency brake is released", event)};
  }
  if (event.safety_type == "fod_stage_changed") {
    danger_ = event.level != "info" && event.level != "notice";
    return {inWords(danger_ ? "a safety stage of the device (fod): no force until it is left"
                            : "the safety stage of the device (fod) is left",
                    event)};
  }
  if (event.safety_type == "stall_detected")
    return {inWords("a motor of the device is stalled", event), true};
  if (event.safety_type == "stability_ceiling")
    return {inWords("the device has reached the limit of its stability: lower the stiffness", event), true};
  return {inWords("the device reports a safety event " + event.safety_type, event), true};
}

Finding SafetyWatch::takeState(const DeviceState& state) {
  const bool powered = state.powered.value_or(true);
  const bool ready = state.ready.value_or(true);
  const bool calibrated = state.calibrated.value_or(true);
  Finding finding;
  const auto add = [&finding](bool& known, bool now, const char* lost, const char* back) {
    if (std::exchange(known, now) == now) return;
    finding.text += (finding.text.empty() ? "" : "; ") + std::string(now ? back : lost);
  };
  add(powered_, powered, "the device has no power: no force", "the device has power");
  add(ready_, ready, "the device is not ready: no force", "the device is ready");
  add(calibrated_, calibrated,
      "the device is not calibrated: calibrate it as its vendor says; no force until then",
      "the device is calibrated");
  return finding;
}

}  // namespace hapticd::tools::inverse3

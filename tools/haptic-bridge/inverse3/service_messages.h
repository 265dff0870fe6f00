// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"

/// The JSON texts of the Inverse Service, version 3.1 and newer. Lengths are metres, forces newtons, axes
/// those of the service. No text from outside makes these functions fail except as they say.
namespace hapticd::tools::inverse3 {

/// The member of `set_cursor_force` that holds the force.
enum class KeyForm {
  values,  ///< up to 3.4
  vector,  ///< since 3.5
};
std::string_view nameOf(KeyForm form);
constexpr KeyForm otherThan(KeyForm form) {
  return form == KeyForm::vector ? KeyForm::values : KeyForm::vector;
}

/// The version of a service.
struct ServiceVersion {
  int major = 0;
  int minor = 0;
  std::string text;  ///< as the service writes it
};
/// Reads the answer to GET /version, with or without the envelope {"ok", "data"}.  Errors: it names none.
base::Result<ServiceVersion> versionFrom(std::string_view body);
/// Errors: older than 3.1, or a major version that nobody has described yet.
base::Result<KeyForm> keyFormOf(const ServiceVersion& version);

/// What the service does to forces and positions; nothing: it does not say.
struct ServiceFilters {
  std::optional<double> force_gate_gain = {};
  std::optional<double> damping_scalar = {};
  std::optional<bool> gravity_compensation = {};
  std::optional<double> gravity_scaling = {};
  std::string handedness = {};
  std::string preset = {};
  std::string basis = {};  ///< order of axes, "XYZ": its own
  bool scaled = false;     ///< a transform of the service stretches positions
  bool displaced = false;  ///< a transform of the service moves or turns positions
};

/// A device in the first message.
struct InventoryEntry {
  std::string device_id;
  std::string type;  ///< inverse3, inverse3x, minverse; empty: it does not say
  ServiceFilters filters;
};
/// The devices of the first message.  Errors: it is no such message.
base::Result<std::vector<InventoryEntry>> inventoryFrom(std::string_view text);

/// What a message says about one device and the grips.
struct DeviceState {
  rt::Vec3 position_m;
  std::optional<rt::Vec3> velocity_m_per_s;
  rt::Vec3 echoed_force_n;  ///< current_cursor_force
  std::optional<bool> calibrated;
  std::optional<bool> ready;
  std::optional<bool> powered;
  std::size_t grips = 0;
  std::optional<rt::Quaternion> orientation;  ///< of the first grip that has one; unit
  std::uint32_t buttons = 0;                  ///< of that grip, in the order of their names
};
enum class StateFault {
  malformed,  ///< no JSON, or what is needed is missing or no finite number
  absent,     ///< the device is not among those of the message
};
std::expected<DeviceState, StateFault> stateFrom(std::string_view text, const std::string& device_id);

/// A message of the event channel.
struct ServiceEvent {
  std::string name = {};
  std::string level = {};
  std::string device_id = {};    ///< empty: it names none
  std::string safety_type = {};  ///< of device-safety-triggered
  std::string reason = {};       ///< of device-calibration-failed
  std::string message = {};      ///< for people
};
std::optional<ServiceEvent> eventFrom(std::string_view text);

/// Writes the frames for one device.
class FrameWriter {
 public:
  FrameWriter(const std::string& device_id, KeyForm form);
  /// `force_n`: finite.
  std::string force(const rt::Vec3& force_n) const;
  /// Ends commands that the service may keep.
  const std::string& clear() const { return clear_; }

 private:
  std::string before_;
  std::string clear_;
};

}  // namespace hapticd::tools::inverse3

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/base/error.h"
#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"

namespace hapticd::tools::inverse3 {

/// The JSON texts of the Inverse Service, version 3.1 and newer. Lengths are metres, forces newtons, axes
/// those of the service. No text from outside makes these functions fail except as they say.
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

/// Whether the force that the service says it exerts follows the one that it was given. A service that does
/// not know the member in which a force is written ignores it without a word, and one that keeps an old force
/// pushes although nothing is commanded.
///
/// Filters of the service weaken a force and delay it by a few frames, so only the direction, a share of
/// kLeastShare to kMostShare, and zero for zero are expected, each within kLag frames.
/// Thread: one.  RT: safe.
class EchoCheck {
 public:
  static constexpr std::size_t kLag = 8;      ///< frames after which an answer shows a command
  static constexpr double kUnproven_n = 0.1;  ///< most that may be commanded before the proof
  static constexpr double kLeast_n = 0.05;    ///< shorter commands prove nothing
  static constexpr double kZero_n = 0.01;     ///< a shorter answer counts as none
  static constexpr double kLeastShare = 0.1;  ///< gain of the force gate 0.3, scale 0.5, and a margin
  static constexpr double kMostShare = 1.5;   ///< damping of the service adds to the force
  static constexpr double kMostAcross = 0.5;  ///< of the command's length
  static constexpr int kNeeded = 10;          ///< answers in a row that follow
  static constexpr int kPatience = 50;        ///< answers in a row that do not

  enum class Verdict {
    unproven,  ///< not enough was commanded yet
    proven,
    ignored,  ///< forces are commanded, and the answers do not follow
    pushes,   ///< zero is commanded, and the answers are not
  };

  /// Takes what was commanded in a frame, and what its answer said. `damping_n`: what the service's own
  /// damping may exert at most at this velocity.
  void add(const rt::Vec3& commanded_n, const rt::Vec3& echoed_n, double damping_n);
  Verdict verdict() const { return verdict_; }
  /// Whether the service exerts nothing while nothing is commanded, which comes before any force.
  bool isQuiet() const { return quiet_ >= kNeeded; }
  /// Most that may be commanded now.
  double most_n(double limit_n) const;

 private:
  bool followsOne(const rt::Vec3& echoed_n, double tolerance_n) const;

  std::array<rt::Vec3, kLag> commanded_n_{};
  std::size_t next_ = 0;
  int quiet_ = 0;
  int follows_ = 0;
  int ignores_ = 0;
  int pushes_ = 0;
  Verdict verdict_ = Verdict::unproven;
};

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

/// Most force of a device of that type, N.
double forceLimitOf(const std::string& type);
/// The delay of the service's force gate, if it is a filter of first order per millisecond, which nobody has
/// measured; 0: it says nothing about it.
std::int64_t gateDelayEstimateNs(const ServiceFilters& filters);

}  // namespace hapticd::tools::inverse3

// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/inverse3/service_messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "config/base/error.h"
#include "config/base/value_text.h"

namespace hapticd::tools::inverse3 {
namespace {

using nlohmann::json;

/// The member of that name; null: there is none.
const json& member(const json& parent, const char* name) {
  static const json kNone;
  if (!parent.is_object()) return kNone;
  const auto found = parent.find(name);
  return found == parent.end() ? kNone : *found;
}

std::string textIn(const json& parent, const char* name) {
  const json& found = member(parent, name);
  return found.is_string() ? found.get<std::string>() : std::string();
}

std::optional<double> numberIn(const json& parent, const char* name) {
  const json& found = member(parent, name);
  if (!found.is_number()) return std::nullopt;
  const double number = found.get<double>();
  return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

std::optional<bool> truthIn(const json& parent, const char* name) {
  const json& found = member(parent, name);
  return found.is_boolean() ? std::optional(found.get<bool>()) : std::nullopt;
}

std::optional<rt::Vec3> vectorIn(const json& parent, const char* name) {
  const json& found = member(parent, name);
  const auto x = numberIn(found, "x");
  const auto y = numberIn(found, "y");
  const auto z = numberIn(found, "z");
  if (!x || !y || !z) return std::nullopt;
  return rt::Vec3{*x, *y, *z};
}

std::optional<rt::Quaternion> rotationIn(const json& parent, const char* name) {
  const auto vector = vectorIn(parent, name);
  const auto w = numberIn(member(parent, name), "w");
  if (!vector || !w) return std::nullopt;
  const rt::Quaternion read{vector->x, vector->y, vector->z, *w};
  constexpr double kLengthTolerance = 0.05;  // sensors send 16-bit components
  if (!(std::abs(std::sqrt(dot(read, read)) - 1) < kLengthTolerance)) return std::nullopt;
  return normalised(read);
}

json parsed(std::string_view text) {
  return json::parse(text, nullptr, false);
}

/// "3.5.0-2-gce34c39e", "v3.5".
std::optional<ServiceVersion> versionIn(const std::string& text) {
  std::string_view rest = text;
  if (rest.starts_with('v')) rest.remove_prefix(1);
  ServiceVersion version;
  version.text = text;
  const char* const end = rest.data() + rest.size();
  const auto major = std::from_chars(rest.data(), end, version.major);
  if (major.ec != std::errc() || major.ptr == end || *major.ptr != '.') return std::nullopt;
  const auto minor = std::from_chars(major.ptr + 1, end, version.minor);
  if (minor.ec != std::errc() || version.major < 0 || version.minor < 0) return std::nullopt;
  return version;
}

bool isAbout(double value, double expected) {
  constexpr double kTolerance = 1e-3;
  return std::abs(value - expected) < kTolerance;
}

void noteTransform(const json& transform, ServiceFilters& filters) {
  if (const auto scale = vectorIn(transform, "scale"))
    filters.scaled |= !isAbout(scale->x, 1) || !isAbout(scale->y, 1) || !isAbout(scale->z, 1);
  if (const auto place = vectorIn(transform, "position")) filters.displaced |= !isAbout(norm(*place), 0);
  if (const auto turn = rotationIn(transform, "rotation"))
    filters.displaced |= !isAbout(std::abs(turn->w), 1);
}

ServiceFilters filtersOf(const json& device) {
  const json& config = member(device, "config");
  const json& filters = member(config, "filters");
  const json& gravity = member(config, "gravity_compensation");
  ServiceFilters read;
  read.force_gate_gain = numberIn(member(filters, "force_gate"), "gain");
  read.damping_scalar = numberIn(member(filters, "damping"), "scalar");
  read.gravity_compensation = truthIn(gravity, "enabled");
  read.gravity_scaling = numberIn(gravity, "scaling_factor");
  read.handedness = textIn(config, "handedness");
  read.preset = textIn(config, "preset");
  read.basis = textIn(member(config, "basis"), "permutation");
  noteTransform(member(config, "mount"), read);
  noteTransform(member(member(device, "state"), "transform"), read);
  return read;
}

std::uint32_t buttonsOf(const json& grip_state) {
  std::uint32_t pressed = truthIn(grip_state, "button").value_or(false) ? 1U : 0U;
  const json& buttons = member(grip_state, "buttons");
  if (!buttons.is_object()) return pressed;
  unsigned bit = 0;
  for (const json& button : buttons) {  // nlohmann keeps members in the order of their names
    if (bit == 32) break;
    if (button.is_boolean() && button.get<bool>()) pressed |= 1U << bit;
    ++bit;
  }
  return pressed;
}

void readGrips(const json& grips, DeviceState& state) {
  if (!grips.is_array()) return;
  for (const json& grip : grips) {
    const json& grip_state = member(grip, "state");
    const auto orientation = rotationIn(grip_state, "orientation");
    if (!orientation) continue;
    if (++state.grips > 1) continue;
    state.orientation = orientation;
    state.buttons = buttonsOf(grip_state);
  }
}

}  // namespace

std::string_view nameOf(KeyForm form) {
  return form == KeyForm::vector ? "vector" : "values";
}

base::Result<ServiceVersion> versionFrom(std::string_view body) {
  const json answer = parsed(body);
  const json& data = member(answer, "data").is_null() ? answer : member(answer, "data");
  if (data.is_string()) {
    if (auto version = versionIn(data.get<std::string>())) return *version;
  }
  for (const char* name : {"project_version", "git_tag", "git_describe", "version"}) {
    if (auto version = versionIn(textIn(data, name))) return *version;
  }
  return std::unexpected(base::Error{"Inverse Service",
                                     "GET /version names no version: " + base::inQuotes(body),
                                     "is --address that of the Inverse Service?"});
}

base::Result<KeyForm> keyFormOf(const ServiceVersion& version) {
  if (version.major == 3 && version.minor >= 5) return KeyForm::vector;
  if (version.major == 3 && version.minor >= 1) return KeyForm::values;
  const bool old = version.major < 3 || (version.major == 3 && version.minor < 1);
  return std::unexpected(
      base::Error{"Inverse Service",
                  fmt::format("its version {} is {}", base::inQuotes(version.text),
                              old ? "too old: forces are understood from 3.1 on"
                                  : "not known: how it takes forces may have changed"),
                  old ? "install a newer Inverse Service" : "install an Inverse Service 3.5"});
}

base::Result<std::vector<InventoryEntry>> inventoryFrom(std::string_view text) {
  const json message = parsed(text);
  if (!message.is_object())
    return std::unexpected(base::Error{"Inverse Service", "its first message is no list of devices", ""});
  std::vector<InventoryEntry> entries;
  const json& devices = member(message, "inverse3");
  if (!devices.is_array()) return entries;
  for (const json& device : devices) {
    const std::string device_id = textIn(device, "device_id");
    if (device_id.empty()) continue;
    entries.push_back({device_id, textIn(member(device, "config"), "type"), filtersOf(device)});
  }
  return entries;
}

std::expected<DeviceState, StateFault> stateFrom(std::string_view text, const std::string& device_id) {
  const json message = parsed(text);
  if (!message.is_object()) return std::unexpected(StateFault::malformed);
  const json& devices = member(message, "inverse3");
  if (!devices.is_array()) return std::unexpected(StateFault::absent);
  for (const json& device : devices) {
    if (textIn(device, "device_id") != device_id) continue;
    const json& read = member(device, "state");
    const auto position = vectorIn(read, "cursor_position");
    const auto force = vectorIn(read, "current_cursor_force");
    if (!position || !force) return std::unexpected(StateFault::malformed);
    const json& status = member(device, "status");
    DeviceState state;
    state.position_m = *position;
    state.velocity_m_per_s = vectorIn(read, "cursor_velocity");
    state.echoed_force_n = *force;
    state.calibrated = truthIn(status, "calibrated");
    state.ready = truthIn(status, "ready");
    state.powered = truthIn(status, "power_supply");
    readGrips(member(message, "verse_grip"), state);
    readGrips(member(message, "wireless_verse_grip"), state);
    return state;
  }
  return std::unexpected(StateFault::absent);
}

std::optional<ServiceEvent> eventFrom(std::string_view text) {
  const json message = parsed(text);
  ServiceEvent event;
  event.name = textIn(message, "name");
  if (event.name.empty()) return std::nullopt;
  const json& data = member(message, "data");
  event.level = textIn(message, "level");
  event.message = textIn(message, "message");
  event.device_id = textIn(data, "device_id");
  event.safety_type = textIn(data, "safety_type");
  event.reason = textIn(data, "reason");
  return event;
}

FrameWriter::FrameWriter(const std::string& device_id, KeyForm form) {
  // device_id comes from outside: bytes that are no UTF-8 are replaced instead of thrown at
  const std::string name = json(device_id).dump(-1, ' ', false, json::error_handler_t::replace);
  before_ = fmt::format(R"({{"inverse3":[{{"device_id":{},"commands":{{"set_cursor_force":{{"{}":)", name,
                        nameOf(form));
  clear_ = fmt::format(R"({{"inverse3":[{{"device_id":{},"commands":{{"clear":{{}}}}}}]}})", name);
}

std::string FrameWriter::force(const rt::Vec3& force_n) const {
  return fmt::format(R"({}{{"x":{},"y":{},"z":{}}}}}}}}}]}})", before_, force_n.x, force_n.y, force_n.z);
}

namespace {

bool follows(const rt::Vec3& commanded_n, const rt::Vec3& echoed_n, double tolerance_n) {
  const double squared = dot(commanded_n, commanded_n);
  const double share = dot(echoed_n, commanded_n) / squared;
  const double across_n = norm(echoed_n - share * commanded_n);
  const double length_n = norm(commanded_n);
  return share >= EchoCheck::kLeastShare &&
         share * length_n <= EchoCheck::kMostShare * length_n + tolerance_n &&
         across_n <= EchoCheck::kMostAcross * length_n + tolerance_n;
}

}  // namespace

double EchoCheck::most_n(double limit_n) const {
  if (!isQuiet() || verdict_ == Verdict::ignored || verdict_ == Verdict::pushes) return 0;
  return verdict_ == Verdict::proven ? limit_n : std::min(limit_n, kUnproven_n);
}

bool EchoCheck::followsOne(const rt::Vec3& echoed_n, double tolerance_n) const {
  return std::ranges::any_of(
      commanded_n_, [&](const rt::Vec3& commanded_n) { return follows(commanded_n, echoed_n, tolerance_n); });
}

void EchoCheck::add(const rt::Vec3& commanded_n, const rt::Vec3& echoed_n, double damping_n) {
  commanded_n_[next_] = commanded_n;
  next_ = (next_ + 1) % kLag;
  const auto [shortest, longest] =
      std::ranges::minmax(commanded_n_, {}, [](const rt::Vec3& command) { return norm(command); });
  const double tolerance_n = kZero_n + damping_n;
  // a command that is neither none nor long enough says nothing about either
  if (norm(longest) == 0) {
    const bool silent = norm(echoed_n) <= tolerance_n;
    quiet_ = silent ? std::min(quiet_ + 1, kNeeded) : isQuiet() ? quiet_ : 0;
    pushes_ = silent ? 0 : pushes_ + 1;
  } else if (norm(shortest) >= kLeast_n) {
    const bool one = followsOne(echoed_n, tolerance_n);
    follows_ = one ? std::min(follows_ + 1, kNeeded) : 0;
    ignores_ = one ? 0 : ignores_ + 1;
  }
  if (follows_ >= kNeeded && verdict_ == Verdict::unproven) verdict_ = Verdict::proven;
  if (ignores_ >= kPatience) verdict_ = Verdict::ignored;
  if (pushes_ >= kPatience) verdict_ = Verdict::pushes;
}

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

double forceLimitOf(const std::string& type) {
  constexpr double kInverse3N = 10;
  constexpr double kUnknownN = 2;  // at which other programs clip
  return type.empty() || type == "inverse3" || type == "inverse3x" ? kInverse3N : kUnknownN;
}

std::int64_t gateDelayEstimateNs(const ServiceFilters& filters) {
  const double gain = filters.force_gate_gain.value_or(1);
  constexpr double kLeastGain = 0.01;  // 100 ms
  constexpr double kTickNs = 1e6;
  if (!(gain < 1)) return 0;
  return static_cast<std::int64_t>((1 / std::max(gain, kLeastGain) - 1) * kTickNs);
}

}  // namespace hapticd::tools::inverse3

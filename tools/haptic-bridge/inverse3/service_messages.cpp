// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/inverse3/service_messages.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

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

}  // namespace hapticd::tools::inverse3

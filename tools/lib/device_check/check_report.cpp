// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/device_check/check_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace hapticd::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kFormat = "haptic-vendor-bridge check 1";
constexpr std::array<const char*, 3> kAxisNames{"right", "up", "towards the person"};
constexpr std::array<std::string_view, 4> kForceAxes{"unknown", "as commanded", "turned", "unclear"};

std::string wordOf(ForceAxes axes) {
  return std::string(kForceAxes[static_cast<std::size_t>(axes)]);
}

Json jsonOf(const rt::Vec3& v) {
  return Json::array({v.x, v.y, v.z});
}

template <typename Value>
Json jsonOf(const std::optional<Value>& value) {
  return value ? Json(*value) : Json();
}

/// Reads members of an object and keeps the first error.
class Members {
 public:
  explicit Members(const Json& object) : object_(object) {}

  template <typename Value>
  void read(const char* name, Value& value) {
    const auto member = object_.find(name);
    if (member == object_.end()) return fail(name, "is missing");
    take(name, *member, value);
  }
  const std::string& error() const { return error_; }
  void fail(const std::string& name, const char* what) {
    if (error_.empty()) error_ = fmt::format("{} {}", name, what);
  }

 private:
  template <typename Value>
  void take(const char* name, const Json& json, std::optional<Value>& value) {
    if (json.is_null()) return value.reset();
    take(name, json, value.emplace());
  }
  void take(const char* name, const Json& json, double& value) {
    if (!json.is_number()) return fail(name, "is not a number");
    value = json.get<double>();
  }
  void take(const char* name, const Json& json, bool& value) {
    if (!json.is_boolean()) return fail(name, "is neither true nor false");
    value = json.get<bool>();
  }
  void take(const char* name, const Json& json, std::string& value) {
    if (!json.is_string()) return fail(name, "is not a text");
    value = json.get<std::string>();
  }
  void take(const char* name, const Json& json, ForceAxes& value) {
    const auto* const found = std::ranges::find(kForceAxes, json.is_string() ? json.get<std::string>() : "");
    if (found == kForceAxes.end()) return fail(name, "is no way in which axes are turned");
    value = static_cast<ForceAxes>(found - kForceAxes.begin());
  }
  void take(const char* name, const Json& json, std::vector<std::string>& value) {
    if (!json.is_array()) return fail(name, "is not a list");
    for (const Json& item : json) take(name, item, value.emplace_back());
  }
  template <std::size_t kCount>
  void take(const char* name, const Json& json, std::array<double, kCount>& value) {
    if (!json.is_array() || json.size() != kCount) return fail(name, "is not a list of so many numbers");
    for (std::size_t i = 0; i < kCount; ++i) take(name, json[i], value[i]);
  }
  void take(const char* name, const Json& json, rt::Vec3& value) {
    std::array<double, 3> numbers{};
    take(name, json, numbers);
    value = {numbers[0], numbers[1], numbers[2]};
  }

  const Json& object_;
  std::string error_;
};

base::Error unreadable(const std::string& what) {
  return {"log", what, "send the whole file that the check wrote"};
}

std::string readAxes(const Json& log, std::array<CheckedAxis, 3>& axes) {
  const auto list = log.find("axes");
  if (list == log.end() || !list->is_array() || list->size() != axes.size())
    return "axes is not a list of three";
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const Json& entry = (*list)[i];
    if (!entry.is_object()) return "an entry of axes is not an object";
    Members members(entry);
    members.read("movedM", axes[i].moved_m);
    members.read("pushedM", axes[i].pushed_m);
    members.read("yields", axes[i].yields);
    members.read("confirmed", axes[i].confirmed);
    if (!members.error().empty()) return "axes: " + members.error();
  }
  return {};
}

bool isKnown(const std::array<double, 9>& rotation) {
  return std::ranges::any_of(rotation, [](double number) { return number != 0; });
}

}  // namespace

std::array<double, 3> anglesOf(const std::array<double, 9>& r) {
  const double pitch = std::asin(std::clamp(-r[6], -1.0, 1.0));
  // pointing straight up or down, only the sum of roll and yaw counts
  constexpr double kVertical = 0.9999;
  if (std::abs(r[6]) > kVertical) return {0, pitch, std::atan2(-r[1], r[4])};
  return {std::atan2(r[7], r[8]), pitch, std::atan2(r[3], r[0])};
}

std::string logOf(const CheckReport& report) {
  Json axes = Json::array();
  for (const CheckedAxis& axis : report.axes) {
    axes.push_back({{"movedM", jsonOf(axis.moved_m)},
                    {"pushedM", jsonOf(axis.pushed_m)},
                    {"yields", axis.yields},
                    {"confirmed", jsonOf(axis.confirmed)}});
  }
  return Json{{"format", kFormat},
              {"version", report.version},
              {"kind", report.kind},
              {"model", report.model},
              {"serial", report.serial},
              {"maxForceN", report.max_force_n},
              {"measuresOrientation", report.measures_orientation},
              {"measuresGripper", report.measures_gripper},
              {"statedLatencyMs", report.stated_latency_ms},
              {"axes", axes},
              {"rotationWorldHandle", report.rotation_world_handle},
              {"forceAxes", wordOf(report.force_axes)},
              {"latencyMs", jsonOf(report.latency_ms)},
              {"deadManMs", jsonOf(report.dead_man_ms)},
              {"problems", report.problems}}
             .dump(2, ' ', false, Json::error_handler_t::replace) +
         "\n";
}

base::Result<CheckReport> reportIn(std::string_view log) {
  const Json json = Json::parse(log, nullptr, false);
  if (!json.is_object()) return std::unexpected(unreadable("is not a JSON object"));
  if (json.value("format", Json()) != kFormat)
    return std::unexpected(unreadable(fmt::format("its format is not \"{}\"", kFormat)));
  CheckReport report;
  Members members(json);
  members.read("version", report.version);
  members.read("kind", report.kind);
  members.read("model", report.model);
  members.read("serial", report.serial);
  members.read("maxForceN", report.max_force_n);
  members.read("measuresOrientation", report.measures_orientation);
  members.read("measuresGripper", report.measures_gripper);
  members.read("statedLatencyMs", report.stated_latency_ms);
  members.read("rotationWorldHandle", report.rotation_world_handle);
  members.read("forceAxes", report.force_axes);
  members.read("latencyMs", report.latency_ms);
  members.read("deadManMs", report.dead_man_ms);
  members.read("problems", report.problems);
  if (!members.error().empty()) return std::unexpected(unreadable(members.error()));
  if (const std::string wrong = readAxes(json, report.axes); !wrong.empty())
    return std::unexpected(unreadable(wrong));
  return report;
}

std::string textOf(const CheckReport& report) {
  std::string text = fmt::format(
      "{}: {}{}, at most {:.1f} N\n", report.kind, report.model.empty() ? "a device" : report.model,
      report.serial.empty() ? "" : ", serial number " + report.serial, report.max_force_n);
  text += fmt::format("measures position{}{}\n", report.measures_orientation ? ", orientation" : "",
                      report.measures_gripper ? ", gripper" : "");
  for (std::size_t i = 0; i < report.axes.size(); ++i) {
    const CheckedAxis& axis = report.axes[i];
    text += fmt::format("{:<19} moved {:.0f}, {:.0f}, {:.0f} mm; a force there {}\n", kAxisNames[i],
                        1e3 * axis.moved_m.x, 1e3 * axis.moved_m.y, 1e3 * axis.moved_m.z,
                        axis.yields ? "moves the handle along" : "does not move the handle along");
  }
  if (report.force_axes != ForceAxes::unknown)
    text += fmt::format("forces where the tool is turned: {}\n", wordOf(report.force_axes));
  const auto inMs = [](const std::optional<double>& ms) {
    return ms ? fmt::format("{:.1f} ms", *ms) : std::string("not measured");
  };
  text += fmt::format(
      "latency of the force {} (the driver states {:.1f} ms); force ends {} after the last command\n",
      inMs(report.latency_ms), report.stated_latency_ms, inMs(report.dead_man_ms));
  if (isKnown(report.rotation_world_handle)) {
    const auto [roll, pitch, yaw] = anglesOf(report.rotation_world_handle);
    text +=
        fmt::format("handle: {{roll_rad: {:.4f}, pitch_rad: {:.4f}, yaw_rad: {:.4f}}}\n", roll, pitch, yaw);
  }
  for (const std::string& problem : report.problems) text += "PROBLEM: " + problem + "\n";
  return text + (report.problems.empty() ? "nothing was found wrong\n" : "");
}

}  // namespace hapticd::tools

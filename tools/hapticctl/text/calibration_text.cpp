// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/calibration_text.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "tools/hapticctl/text/printer.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

struct Rule {
  const char* name;
  const char* path;
  const char* remedy;  ///< what would raise its limit
};
constexpr Rule kRules[]{
    {"ceiling", "stiffness.ceilingNPerM", "raise force.stiffness_ceiling_n_per_m"},
    {"stability", "stiffness.stabilityNPerM",
     "a faster link to the handle, a higher safety.force_filter_hz, or the true mass and damping of the "
     "device"},
    {"device", "stiffness.deviceNPerM",
     "a stronger device: safety.continuous_force_n is exerted at 10 mm; or smaller scales of the handle"},
    {"noise", "stiffness.noiseNPerM",
     "a camera nearer to the scene, law surface with more surface.fusion_frames, or more "
     "filter.temporal_frames"},
    {"slew", "stiffness.slewNPerM", "a surface at rest, or a higher safety.max_slew_n_per_s"}};

Json numberOrNull(double number) {
  return std::isfinite(number) ? Json(number) : Json();
}

bool isInContact(const Json& status) {
  const std::string contact = textAt(status, "tick.contact");
  return contact == "contact" || contact == "entrenched";
}

}  // namespace

std::string calibrationNeeds(const Json& status) {
  if (isInContact(status)) return "the HIP to leave the surface: lift the handle a little";
  if (!(numberAt(status, "stiffness.noiseFrames") > 0))
    return "a resting surface near the HIP: hold the HIP still within 5 cm of the surface";
  if (numberAt(status, "stiffness.noiseFrames") < kFramesOfCalibration)
    return "more frames: keep the HIP and the scene still";
  return "";
}

Json calibrationOf(const Json& status, std::optional<double> ceiling_n_per_m) {
  Json rules = Json::array();
  double least = std::numeric_limits<double>::infinity();
  double next = least;
  std::string bound;
  for (const Rule& rule : kRules) {
    double limit = numberAt(status, rule.path);
    if (ceiling_n_per_m && std::string_view(rule.name) == "ceiling") limit = *ceiling_n_per_m;
    rules.push_back({{"name", rule.name}, {"nPerM", numberOrNull(limit)}, {"remedy", rule.remedy}});
    if (std::isnan(limit)) continue;
    if (limit < least) {
      next = least;
      least = limit;
      bound = rule.name;
    } else {
      next = std::min(next, limit);
    }
  }
  for (Json& rule : rules) rule["binds"] = rule["name"] == bound;
  return {{"rules", rules},
          {"stiffnessNPerM", numberOrNull(least)},
          {"bound", bound},
          {"margin", numberOrNull(next / least)},
          {"distanceM", numberOrNull(numberAt(status, "law.distanceM"))},
          {"surfaceNoiseM", numberOrNull(numberAt(status, "tick.surfaceNoiseM"))},
          {"noiseFrames", numberOrNull(numberAt(status, "stiffness.noiseFrames"))},
          {"latencyS", numberOrNull(numberAt(status, "deviceLatency.latencyS"))},
          {"hiddenLatencyS", numberOrNull(numberAt(status, "tick.hiddenLatencyS"))},
          {"massKg", numberOrNull(numberAt(status, "deviceLatency.massKg"))}};
}

std::string calibrationText(const Json& calibration, std::size_t columns) {
  Table table({{"RULE"}, {"N/M", true}, {""}, {"RAISED BY"}});
  for (const Json& rule : listAt(calibration, "rules")) {
    const double limit = numberAt(rule, "nPerM");
    table.add({textAt(rule, "name"), std::isnan(limit) ? "-" : fixed(limit, 0),
               flagAt(rule, "binds") ? "binds" : "", textAt(rule, "remedy")});
  }
  std::string text = table.text(columns);
  const auto say = [&](const char* known, const char* pattern) {
    if (!std::isnan(numberAt(calibration, known))) text += filled(calibration, pattern);
  };
  text += filled(calibration, "\nlargest stiffness {stiffnessNPerM:.0} N/m, limited by {bound}");
  say("margin", "; the next rule allows {margin:.1} times as much");
  text += filled(calibration, "\nsurface noise {surfaceNoiseM:.2*1000} mm");
  say("distanceM", " at {distanceM:.2} m");
  text += filled(calibration, ", from {noiseFrames:.0} frames\n");
  say("latencyS",
      "forces act {latencyS:.0*1000} ms after their command, {hiddenLatencyS:.0*1000} ms of which the driver "
      "cannot tell; device and hand move as {massKg:.0*1000} g\n");
  return text;
}

}  // namespace hapticd::tools

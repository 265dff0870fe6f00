// SPDX-License-Identifier: Apache-2.0
#include "config/conflicts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <optional>
#include <type_traits>
#include <utility>
#include <variant>

#include "config/additions/addition_checks.h"
#include "config/additions/addition_fields.h"
#include "config/base/value_text.h"
#include "config/settings/depth_cameras.h"
#include "config/settings/law_choice.h"
#include "config/settings/line_address.h"
#include "config/settings/parameter_table.h"
#include "rt/laws/law_table.h"
#include "rt/modelling/scene_builder.h"

namespace hapticd::config {
namespace {

// sizeof(sockaddr_un::sun_path) without the terminating NUL.
constexpr std::size_t kMaxSocketPathLength = 107;

bool hasValidRawValue(const rt::DepthModelParameters& model) {
  for (int raw = 0; raw < model.raw_no_measurement; ++raw) {
    const double inverse_depth = model.a_per_m * raw + model.b_per_m;
    const double depth = inverse_depth > 0 ? 1 / inverse_depth : 0;
    if (depth >= model.near_m && depth <= model.far_m) return true;
  }
  return false;
}

struct LedLine {
  std::string_view parameter;
  const std::string& text;
};

std::array<LedLine, 4> linesOf(const LedSettings& leds) {
  return {{{"leds.power_line", leds.power_line},
           {"leds.camera_line", leds.camera_line},
           {"leds.contact_line", leds.contact_line},
           {"leds.fault_line", leds.fault_line}}};
}

bool isSameLine(const LineAddress& a, const LineAddress& b) {
  return a.name == b.name && (!a.name.empty() || a.offset == b.offset);
}

/// Judges settings as a whole.
class Rules {
 public:
  explicit Rules(const Settings& settings) : settings_(settings) {}

  std::vector<Conflict> violated() && {
    checkPointCounts();
    checkDepth();
    checkFrameSize();
    checkConfiguredIntrinsics();
    checkDepthUnit();
    for (const CameraDriver& driver : cameraDrivers()) driver.check(settings_, found_);
    checkReachInUnits();
    checkStandoff();
    checkLabelImage();
    checkFrames();
    checkTool();
    for (const HandleDriver& driver : handleDrivers()) driver.check(settings_, found_);
    checkLeds();
    checkSockets();
    return std::move(found_);
  }

 private:
  /// The first of the parameters is the place of the error.
  void add(std::vector<std::string_view> parameters, std::string what, std::string remedy) {
    const std::string where(parameters.front());
    found_.push_back({std::move(parameters), {where, std::move(what), std::move(remedy)}});
  }

  void checkPointCounts() {
    const rt::SpringParameters& springs = settings_.live.force;
    if (springs.min_points <= springs.max_points) return;
    add({"force.min_points", "force.max_points"},
        fmt::format("{} is above force.max_points, {}", springs.min_points, springs.max_points),
        fmt::format("set force.min_points to at most {} or force.max_points to at least {}",
                    springs.max_points, springs.min_points));
  }

  void checkDepth() {
    const rt::DepthModelParameters model = settings_.camera.effectiveDepthModel();
    if (!(model.near_m < model.far_m)) {
      add({"camera.near_m", "camera.far_m"},
          fmt::format("{} m is not below camera.far_m, {} m", base::numberText(model.near_m),
                      base::numberText(model.far_m)),
          "set camera.near_m below camera.far_m");
      return;
    }
    if (settings_.camera.deliversDepth() || hasValidRawValue(model)) return;
    add({"camera.depth_law", "camera.depth_a_per_m", "camera.depth_b_per_m", "camera.near_m", "camera.far_m"},
        fmt::format(
            "Z = 1 / ({} d + {}) lies between camera.near_m, {} m, and camera.far_m, {} m, for no raw "
            "value d of 0..{}",
            base::numberText(model.a_per_m), base::numberText(model.b_per_m), base::numberText(model.near_m),
            base::numberText(model.far_m), model.raw_no_measurement - 1),
        settings_.camera.depth_law == DepthLaw::custom
            ? "correct camera.depth_a_per_m and camera.depth_b_per_m: about -0.003 and 3.3 for a Kinect v1"
            : "move camera.near_m and camera.far_m further apart");
  }

  /// Kinect's intrinsics must not be taken for those of another camera.
  void checkConfiguredIntrinsics() {
    const CameraSettings& camera = settings_.camera;
    if (!camera.deliversDepth() || camera.intrinsics != IntrinsicsSource::configured) return;
    const rt::DepthModelParameters model = camera.effectiveDepthModel();
    const rt::DepthModelParameters kinect;
    if (model.fx_px == kinect.fx_px && model.fy_px == kinect.fy_px) {
      add({"camera.intrinsics", "camera.fx_px", "camera.fy_px"},
          "configured takes camera.fx_px and camera.fy_px, which are still those of a Kinect v1",
          "set camera.fx_px, camera.fy_px, camera.cx_px and camera.cy_px for the chosen size of the frames");
    } else if (model.cx_px >= model.width_px || model.cy_px >= model.height_px) {
      add({"camera.cx_px", "camera.cy_px", "camera.width_px", "camera.height_px"},
          fmt::format("the optical centre ({}, {}) lies outside the frame of {} x {} pixels",
                      base::numberText(model.cx_px), base::numberText(model.cy_px), model.width_px,
                      model.height_px),
          "set camera.cx_px and camera.cy_px for the chosen size of the frames");
    }
  }

  /// The ranges of width and height begin at 0, which stands for the usual size.
  void checkFrameSize() {
    constexpr int kMinWidth_px = 160;
    constexpr int kMinHeight_px = 100;
    const auto check = [this](const char* name, int value_px, int least_px) {
      if (value_px == 0 || value_px >= least_px) return;
      add({name}, fmt::format("{} px is below {} px", value_px, least_px),
          fmt::format("set {} to at least {}, or to 0 for the usual size of the camera", name, least_px));
    };
    check("camera.width_px", settings_.camera.width_px, kMinWidth_px);
    check("camera.height_px", settings_.camera.height_px, kMinHeight_px);
  }

  /// Raw depth has 16 bits.
  void checkDepthUnit() {
    const CameraSettings& camera = settings_.camera;
    constexpr double kMaxRaw = 65535;
    const double farthest_m = kMaxRaw * camera.unit_um * 1e-6;
    if (!camera.deliversDepth() || camera.unit_um == 0) return;
    if (camera.near_m <= farthest_m) return;
    add({"camera.unit_um", "camera.near_m"},
        fmt::format("16 bits of {} um end at {} m, nearer than camera.near_m, {} m", camera.unit_um,
                    base::numberText(farthest_m), base::numberText(camera.near_m)),
        "set camera.unit_um to 100 or 1000, or to 0");
  }

  /// The raw values within the reach of a law on points must fit into a scene.
  void checkReachInUnits() {
    const CameraSettings& camera = settings_.camera;
    if (!camera.deliversDepth()) return;
    // The unit that a real camera has of its own is known only when it has been opened.
    const bool open = driverOf(camera).unit_is_open(camera);
    const double unit_m = open ? kFineUnit_m : camera.effectiveDepthModel().unit_m;
    const double holds_m = rt::largestReachOfUnit_m(unit_m);
    const std::vector<rt::LiveParameters> laws = lawsThatMayAct(settings_);
    const auto reachOf = [this](const rt::LiveParameters& live) {
      const rt::SceneNeeds needs = rt::SceneNeeds::of(live);
      return needs.points ? rt::reachOfModel_m(needs, settings_.grid) : 0;
    };
    const rt::LiveParameters& farthest = *std::ranges::max_element(laws, {}, reachOf);
    const double reach_m = reachOf(farthest);
    if (reach_m <= holds_m) return;
    add({"camera.unit_um", "camera.driver", "synthetic.camera", "force.law", "force.radius_m",
         "force.max_error_n", "force.stiffness_n_per_m", "safety.max_force_n"},
        fmt::format("a scene holds {:.4g} m of depth in units of {:.4g} um, but the law {}{} needs {:.4g} m: "
                    "{:.4g} m "
                    "on each side that it looks at, and what the HIP moves until the next frame",
                    2 * holds_m, unit_m * 1e6, nameOf(farthest.law),
                    settings_.live.force.law ? "" : ", which auto may choose,", 2 * reach_m,
                    rt::rowOf(farthest.law).reach_m(farthest)),
        fmt::format("set camera.unit_um to at least {:.0f}, or lower force.radius_m",
                    std::ceil(1e6 * reach_m / rt::largestReachOfUnit_m(1))));
  }

  void checkStandoff() {
    const FixtureSettings* const standoff = widestStandoff(settings_.additions.fixtures);
    if (standoff == nullptr || rt::rowOf(settings_.namedLaw()).carries_standoffs) return;
    add({"force.law", "fixtures"},
        fmt::format("{} has no surface from which the stand-off fixture {} could keep its clearance",
                    rt::wordOf(settings_.namedLaw()), standoff->name),
        fmt::format("set force.law to {} or auto, or disable the fixture {}",
                    nameOf(rt::lawThat(&rt::ForceLawRow::carries_standoffs)), standoff->name));
  }

  void checkTool() {
    if (auto problem = toolProblem(settings_.additions, settings_.live.tool.radius_m))
      found_.push_back({{"tool.radius_m", "fixtures"}, std::move(problem->error)});
  }

  void checkLabelImage() {
    if (auto problem = labelImageProblem(settings_.additions)) {
      found_.push_back({{"regions", "label_image"}, std::move(problem->error)});
    }
  }

  void checkFrames() {
    for (AdditionError& unknown : unknownFrames(settings_.additions))
      found_.push_back({{"frames", "fixtures"}, std::move(unknown.error)});
  }

  void checkLedLines(const LedSettings& leds) {
    std::vector<std::pair<std::string_view, LineAddress>> seen;
    for (const auto& [parameter, text] : linesOf(leds)) {
      if (text.empty()) continue;
      const base::Result<LineAddress> line = lineAddressFrom(text);
      if (!line) {
        add({parameter}, line.error().what, line.error().remedy);
        continue;
      }
      for (const auto& [other, its_line] : seen) {
        if (!isSameLine(*line, its_line)) continue;
        add({parameter, other}, fmt::format("{} is also {}", textOf(*line), other),
            "give each LED a line of its own, or leave one of the two empty");
        break;
      }
      seen.emplace_back(parameter, *line);
    }
  }

  void checkLeds() {
    const LedSettings& leds = settings_.leds;
    checkLedLines(leds);
    if (leds.driver != LedDriver::gpiod) return;
    if (leds.chip.empty()) {
      add({"leds.chip", "leds.driver"}, "is empty, and the leds.driver gpiod needs it",
          "set leds.chip to the label, the name or the path of a chip (gpiodetect lists them)");
    }
    if (std::ranges::all_of(linesOf(leds), [](const LedLine& line) { return line.text.empty(); })) {
      add({"leds.driver"}, "gpiod has no LED to switch",
          "set at least one of leds.power_line, leds.camera_line, leds.contact_line and leds.fault_line, or "
          "leds.driver to none");
    }
  }

  void checkSocketPath(std::string_view name, const std::string& path) {
    if (path.empty()) {
      add({name}, "is empty", "give the path of the socket");
    } else if (path.ends_with('/')) {
      add({name}, fmt::format("{} names a folder", base::inQuotes(path)), "give the path of the socket");
    } else if (path.size() > kMaxSocketPathLength) {
      add({name},
          fmt::format("{} has {} bytes, a socket's path at most {}", base::inQuotes(path), path.size(),
                      kMaxSocketPathLength),
          "choose a shorter path, or one relative to the working directory");
    }
  }

  void checkSockets() {
    const ControlSettings& control = settings_.control;
    checkSocketPath("control.status_socket", control.status_socket);
    checkSocketPath("control.control_socket", control.control_socket);
    const std::filesystem::path status(control.status_socket);
    if (control.status_socket.empty() ||
        status.lexically_normal() != std::filesystem::path(control.control_socket).lexically_normal()) {
      return;
    }
    add({"control.control_socket", "control.status_socket"},
        fmt::format("{} is also control.status_socket", base::inQuotes(control.control_socket)),
        "give the two sockets different paths");
  }

  const Settings& settings_;
  std::vector<Conflict> found_;
};

}  // namespace

std::vector<Conflict> conflictsIn(const Settings& settings) {
  return Rules(settings).violated();
}

std::vector<base::Error> checkTogether(const Settings& settings) {
  std::vector<base::Error> errors;
  for (Conflict& conflict : conflictsIn(settings)) errors.push_back(std::move(conflict.error));
  return errors;
}

namespace {

bool isLooser(Looser looser, double before, double after) {
  switch (looser) {
    case Looser::never:
      return false;
    case Looser::higher:
      return after > before;
    case Looser::lower:
      return after < before;
    case Looser::higher_or_zero:
      return before != 0 && (after == 0 || after > before);
  }
  return false;
}

/// The place of a value, of a parameter or a member, among those of its row.
double rankOf(const Row& row, const Value& value) {
  if (const bool* const truth = std::get_if<bool>(&value)) return *truth ? 1 : 0;
  if (const auto* const integer = std::get_if<std::int64_t>(&value)) return static_cast<double>(*integer);
  if (const double* const number = std::get_if<double>(&value)) return *number;
  return static_cast<double>(std::ranges::find(row.choices, std::get<std::string>(value)) -
                             row.choices.begin());
}

std::string withUnit(std::string text, std::string_view unit) {
  return unit.empty() ? text : fmt::format("{} {}", text, unit);
}

/// How one member of a fixture protects less; nothing: it does not. Both are of the same kind, or the member
/// is part of either.
std::optional<std::string> weaknessOf(const AdditionField& field, const Addition& before,
                                      const Addition& after) {
  if (isSameIn(field, before, after)) return std::nullopt;
  if (!field.looser) return fmt::format("{} changes", field.name);
  const double from = rankOf(field, before.get(field));
  const double to = rankOf(field, after.get(field));
  if (!isLooser(*field.looser, from, to)) return std::nullopt;
  return fmt::format("{} from {} to {}", field.name, base::numberText(from),
                     withUnit(base::numberText(to), field.unit));
}

/// Why `after` protects less than `before`; empty: it does not.
std::string weakness(const FixtureSettings& before, const FixtureSettings& after) {
  if (!before.enabled) return "";
  if (!after.enabled) return "is disabled";
  if (isGuidance(before.kind)) return "";
  std::vector<std::string> members;
  const Addition was(before), is(after);
  for (const AdditionField& field : was.fields()) {
    if (!was.has(field) && !is.has(field)) continue;
    if (auto text = weaknessOf(field, was, is)) members.push_back(std::move(*text));
  }
  return members.empty() ? "" : fmt::format("may protect less: {}", fmt::join(members, ", "));
}

/// A region says what contact is like, which is neither weaker nor stronger.
std::string weakness(const RegionSettings&, const RegionSettings&) {
  return "";
}

/// What a frame's rules protect from depends on its source, so that every change may protect less.
std::string weakness(const FrameSettings& before, const FrameSettings& after) {
  return before == after ? "" : "may protect less: its rules change";
}

void addLoosenings(const auto& before, const auto& after, std::vector<Loosening>& found) {
  for (const auto& item : before) {
    const auto now = std::ranges::find(after, item.name, &std::decay_t<decltype(item)>::name);
    const std::string why = now == after.end() ? "is removed" : weakness(item, *now);
    if (why.empty()) continue;
    const std::string name = fmt::format("{} {}", typeOf(item).noun, item.name);
    found.push_back({name, fmt::format("{} {}", name, why)});
  }
}

/// `result` with what is missing in it where it was, and what is weaker in it as it was.
template <typename Item>
std::vector<Item> kept(const std::vector<Item>& before, std::vector<Item> result) {
  auto place = result.begin();
  for (const Item& item : before) {
    const auto now = std::ranges::find(result, item.name, &Item::name);
    if (now == result.end()) {
      place = std::next(result.insert(place, item));
      continue;
    }
    if (!weakness(item, *now).empty()) *now = item;
    place = std::next(now);
  }
  return result;
}

}  // namespace

bool isLooser(const Parameter& parameter, const Value& before, const Value& after) {
  return isLooser(parameter.looser, rankOf(parameter, before), rankOf(parameter, after));
}

std::vector<Loosening> looseningsOf(const Settings& before, const Settings& after) {
  std::vector<Loosening> found;
  for (const Parameter& parameter : parameterTable()) {
    if (parameter.effect != Effect::live) continue;
    const Value old_value = parameter.get(before);
    const Value new_value = parameter.get(after);
    if (!isLooser(parameter, old_value, new_value)) continue;
    found.push_back(
        {std::string(parameter.name), fmt::format("{} from {} to {}", parameter.name, toText(old_value),
                                                  withUnit(toText(new_value), parameter.unit))});
  }
  forEachList([&found](const auto& was, const auto& is) { addLoosenings(was, is, found); }, before.additions,
              after.additions);
  return found;
}

Settings withoutLoosening(const Settings& before, const Settings& after) {
  Settings result = after;
  for (const Parameter& parameter : parameterTable()) {
    const Value value = parameter.get(before);
    if (parameter.effect == Effect::live && isLooser(parameter, value, parameter.get(after)))
      parameter.set(result, value);
  }
  forEachList([](const auto& was, auto& is) { is = kept(was, is); }, before.additions, result.additions);
  return result;
}

}  // namespace hapticd::config

// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/camera_description.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "config/base/file_content.h"
#include "config/base/value_text.h"
#include "config/yaml/yaml_reader.h"
#include "rt/base/words.h"
#include "rt/depth/depth_frame.h"
#include "rt/depth/depth_model.h"

namespace hapticd::drivers {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxBytes = 64 << 10;
constexpr int kVersion = 1;
constexpr std::uint32_t kAllRaws = 65536;
constexpr std::string_view kForm = "drivers/camera/recorded/README.md describes the file";

std::unexpected<base::Error> refuse(std::string where, std::string what, std::string remedy) {
  return std::unexpected(base::Error{std::move(where), std::move(what), std::move(remedy)});
}

/// What a file must or may state about a name.
enum class Presence { required, optional };

/// Takes the entries of a file by their names, and remembers the first error.
class Entries {
 public:
  Entries(fs::path file, const config::YamlFile& content) : file_(std::move(file)), content_(content) {}

  void takeNumber(std::string_view group, std::string_view name, double& number, Presence presence) {
    const config::YamlEntry* const entry = take(group, name, presence);
    if (entry == nullptr) return;
    const auto read = base::yamlNumberFrom(entry->value);
    if (!read || entry->quoted)
      return fail(*entry, "is not a number", fmt::format("set {} to a number", name));
    if (!std::isfinite(*read))
      return fail(*entry, "is not a finite number", fmt::format("set {} to a number", name));
    number = *read;
  }
  void takeNumber(std::string_view group, std::string_view name, std::optional<double>& number) {
    double read = std::nan("");
    takeNumber(group, name, read, Presence::optional);
    if (!std::isnan(read)) number = read;
  }
  template <typename Integer>
  void takeInteger(std::string_view group, std::string_view name, Integer& integer, double least, double most,
                   Presence presence) {
    double number = integer;
    takeNumber(group, name, number, presence);
    if (error_) return;
    if (number != std::floor(number) || number < least || number > most) {
      const config::YamlEntry* const entry = find(group, name);
      return fail(*entry, fmt::format("is not an integer from {:.0f} to {:.0f}", least, most),
                  fmt::format("set {} to such an integer", name));
    }
    integer = static_cast<Integer>(number);
  }
  template <typename Word>
  void takeWord(std::string_view group, std::string_view name, Word& word, Presence presence) {
    const config::YamlEntry* const entry = take(group, name, presence);
    if (entry == nullptr) return;
    if (const auto known = rt::withWord<Word>(entry->value)) {
      word = *known;
      return;
    }
    fail(*entry, fmt::format("is none of: {}", fmt::join(rt::kWords<Word>, ", ")),
         fmt::format("set {} to one of them", name));
  }
  void takeText(std::string_view group, std::string_view name, std::string& text) {
    const config::YamlEntry* const entry = take(group, name, Presence::optional);
    if (entry != nullptr) text = entry->value;
  }
  bool has(std::string_view group, std::string_view name) const { return find(group, name) != nullptr; }

  /// Refuses every entry that has not been taken.
  void refuseOthers() {
    for (const config::YamlEntry& entry : content_.entries) {
      const std::string name = entry.group + "." + entry.name;
      if (std::ranges::find(known_, name) == known_.end()) {
        const std::vector<std::string_view> names(known_.begin(), known_.end());
        const std::string guess = base::didYouMean(name, names);
        return fail(entry, "is not known", guess.empty() ? std::string(kForm) : guess);
      }
    }
    for (const config::YamlGroup& group : content_.groups) {
      if (group.name == "recording" || group.name == "camera" || group.name == "noise") continue;
      return fail(fmt::format("{}:{}", file_.string(), group.line),
                  fmt::format("there is no group {}", base::inQuotes(group.name)), std::string(kForm));
    }
  }
  void fail(std::string where, std::string what, std::string remedy) {
    if (!error_) error_ = base::Error{std::move(where), std::move(what), std::move(remedy)};
  }
  const std::optional<base::Error>& error() const { return error_; }

 private:
  const config::YamlEntry* find(std::string_view group, std::string_view name) const {
    const auto found = std::ranges::find_if(content_.entries, [&](const config::YamlEntry& entry) {
      return entry.group == group && entry.name == name;
    });
    return found == content_.entries.end() ? nullptr : &*found;
  }
  const config::YamlEntry* take(std::string_view group, std::string_view name, Presence presence) {
    known_.push_back(fmt::format("{}.{}", group, name));
    const config::YamlEntry* const entry = find(group, name);
    if (entry == nullptr && presence == Presence::required) {
      fail(file_.string(), fmt::format("does not state {}.{}", group, name),
           fmt::format("add it; {}", kForm));
    }
    return entry;
  }
  void fail(const config::YamlEntry& entry, std::string_view what, std::string remedy) {
    fail(fmt::format("{}:{}: {}.{}", file_.string(), entry.line, entry.group, entry.name),
         fmt::format("{} {}", base::inQuotes(entry.value), what), std::move(remedy));
  }

  fs::path file_;
  const config::YamlFile& content_;
  std::vector<std::string> known_;
  std::optional<base::Error> error_;
};

base::Result<config::YamlFile> contentOf(const fs::path& file) {
  const auto text = base::fileContent(file, {.longest = kMaxBytes});
  if (!text) return refuse(file.string(), text.error().text(), std::string(kForm));
  config::YamlFile content = config::readYaml(*text);
  if (content.problems.empty()) return content;
  const config::YamlProblem& first = content.problems.front();
  const std::string line = first.line > 0 ? fmt::format(":{}", first.line) : "";
  const std::string member = first.where.empty() ? "" : ": " + first.where;
  return refuse(file.string() + line + member, first.what, first.remedy);
}

void takeLaw(Entries& entries, rt::DepthModelParameters& camera) {
  entries.takeWord("camera", "law", camera.law, Presence::required);
  const bool linear = camera.law == rt::DepthLawKind::linear;
  const auto of = [](bool used) { return used ? Presence::required : Presence::optional; };
  entries.takeNumber("camera", "unit_m", camera.unit_m, of(linear));
  entries.takeNumber("camera", "a_per_m", camera.a_per_m, of(!linear));
  entries.takeNumber("camera", "b_per_m", camera.b_per_m, of(!linear));
  camera.raw_values = kAllRaws;
  camera.raw_no_measurement = 0;
  entries.takeInteger("camera", "raw_values", camera.raw_values, 2, kAllRaws, Presence::optional);
  entries.takeInteger("camera", "raw_no_measurement", camera.raw_no_measurement, 0, kAllRaws - 1.0,
                      Presence::required);
}

void takeNoise(Entries& entries, rt::DepthNoiseParameters& noise) {
  for (const auto& [name, number] : {std::pair{"c0_m", &noise.c0_m},
                                     {"c1", &noise.c1},
                                     {"c2_per_m", &noise.c2_per_m},
                                     {"standing_share", &noise.standing_share},
                                     {"correlation_px", &noise.correlation_px}}) {
    entries.takeNumber("noise", name, *number, Presence::optional);
  }
}

/// Returns the remedy for a fault of the whole camera.
std::string remedyFor(rt::CameraFault fault) {
  switch (fault) {
    case rt::CameraFault::size:
      return fmt::format("frames have at most {} x {} pixels", rt::kMaxFrameWidth, rt::kMaxFrameHeight);
    case rt::CameraFault::intrinsics:
      return "fx_px and fy_px are focal lengths in pixels, above 0";
    case rt::CameraFault::limits:
      return "0 < near_m < far_m";
    case rt::CameraFault::noise:
      return "no coefficient is below 0, standing_share is 0 to 1, correlation_px at least 1";
    case rt::CameraFault::depth_law:
      return "unit_m is the depth of one raw unit in metres, above 0; a_per_m is not 0; some raw value has a "
             "depth within near_m and far_m";
    case rt::CameraFault::none:
      break;
  }
  return "";
}

/// Refuses what no DepthModel can be made of, with any depth accepted that the description does not exclude.
base::Result<CameraDescription> checked(const fs::path& file, CameraDescription description) {
  rt::DepthModelParameters camera = description.camera;
  constexpr double kNearest_m = 1e-6;
  constexpr double kFarthest_m = 1e6;
  camera.near_m = description.near_m.value_or(kNearest_m);
  camera.far_m = description.far_m.value_or(kFarthest_m);
  if (camera.raw_no_measurement >= camera.raw_values) {
    return refuse(file.string(),
                  fmt::format("raw_no_measurement {} is none of the {} raw values", camera.raw_no_measurement,
                              camera.raw_values),
                  "raw values are 0 to raw_values - 1, the one for no measurement included");
  }
  const rt::CameraFault fault = rt::faultOf(camera);
  if (fault == rt::CameraFault::none) return description;
  return refuse(file.string(), fmt::format("the camera has a wrong {}", rt::wordOf(fault)), remedyFor(fault));
}

}  // namespace

base::Result<CameraDescription> readCameraDescription(const fs::path& file) {
  const auto content = contentOf(file);
  if (!content) return std::unexpected(content.error());
  Entries entries(file, *content);
  CameraDescription description;
  rt::DepthModelParameters& camera = description.camera;
  camera.principle = rt::DepthPrinciple::active_stereo;
  int version = 0;
  entries.takeInteger("recording", "version", version, kVersion, kVersion, Presence::required);
  entries.takeText("recording", "serial", description.serial);
  entries.takeInteger("camera", "width_px", camera.width_px, 1, rt::kMaxFrameWidth, Presence::required);
  entries.takeInteger("camera", "height_px", camera.height_px, 1, rt::kMaxFrameHeight, Presence::required);
  entries.takeNumber("camera", "fx_px", camera.fx_px, Presence::required);
  entries.takeNumber("camera", "fy_px", camera.fy_px, Presence::required);
  entries.takeNumber("camera", "cx_px", camera.cx_px, Presence::required);
  entries.takeNumber("camera", "cy_px", camera.cy_px, Presence::required);
  takeLaw(entries, camera);
  entries.takeWord("camera", "principle", camera.principle, Presence::optional);
  entries.takeNumber("camera", "near_m", description.near_m);
  entries.takeNumber("camera", "far_m", description.far_m);
  takeNoise(entries, camera.noise);
  entries.refuseOthers();
  if (entries.error()) return std::unexpected(*entries.error());
  return checked(file, std::move(description));
}

std::string textOf(const CameraDescription& description) {
  const rt::DepthModelParameters& camera = description.camera;
  std::string text = fmt::format("recording:\n  version: {}\n", kVersion);
  if (!description.serial.empty()) {
    // single quotes, so that no character of it is an escape or ends the text
    std::string serial;
    for (const char each : description.serial)
      serial += each == '\'' ? std::string("''") : std::string(1, each);
    text += fmt::format("  serial: '{}'\n", serial);
  }
  text += "camera:\n";
  const auto add = [&text](std::string_view name, double number) {
    text += fmt::format("  {}: {}\n", name, base::numberText(number));
  };
  add("width_px", camera.width_px);
  add("height_px", camera.height_px);
  add("fx_px", camera.fx_px);
  add("fy_px", camera.fy_px);
  add("cx_px", camera.cx_px);
  add("cy_px", camera.cy_px);
  text += fmt::format("  law: {}\n", rt::wordOf(camera.law));
  if (camera.law == rt::DepthLawKind::linear) {
    add("unit_m", camera.unit_m);
  } else {
    add("a_per_m", camera.a_per_m);
    add("b_per_m", camera.b_per_m);
  }
  add("raw_no_measurement", camera.raw_no_measurement);
  add("raw_values", camera.raw_values);
  text += fmt::format("  principle: {}\n", rt::wordOf(camera.principle));
  if (description.near_m) add("near_m", *description.near_m);
  if (description.far_m) add("far_m", *description.far_m);
  text += "noise:\n";
  add("c0_m", camera.noise.c0_m);
  add("c1", camera.noise.c1);
  add("c2_per_m", camera.noise.c2_per_m);
  add("standing_share", camera.noise.standing_share);
  add("correlation_px", camera.noise.correlation_px);
  return text;
}

}  // namespace hapticd::drivers

// SPDX-License-Identifier: Apache-2.0
#include "daemon/state/start_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <tuple>
#include <utility>

#include "config/base/value_text.h"
#include "config/settings/yaml_text.h"
#include "config/settings_summary.h"
#include "config/yaml_loader.h"
#include "daemon/state/profile_folder.h"
#include "daemon/state/state_file.h"

namespace hapticd::daemon {
namespace {

constexpr std::array<std::string_view, 6> kPoseParameters{"camera.position_x_m", "camera.position_y_m",
                                                          "camera.position_z_m", "camera.roll_rad",
                                                          "camera.pitch_rad",    "camera.yaw_rad"};
// What is not a parameter is in comments, so that the file has the form of any other settings file.
constexpr std::string_view kTimeLine = "# time: ";
constexpr std::string_view kResidualLine = "# residual_m: ";

std::filesystem::path fileIn(const std::filesystem::path& state_folder) {
  return state_folder / "registration.yaml";
}

auto valuesOf(const rt::PoseParameters& pose) {
  return std::tuple(pose.position_m.x, pose.position_m.y, pose.position_m.z, pose.roll_rad, pose.pitch_rad,
                    pose.yaw_rad);
}

/// The rest of the line that starts with `beginning`; nothing if there is no such line.
std::optional<std::string_view> restOfLine(std::string_view text, std::string_view beginning) {
  const std::size_t begin = text.find(beginning);
  if (begin == std::string_view::npos || (begin != 0 && text[begin - 1] != '\n')) return std::nullopt;
  const std::string_view rest = text.substr(begin + beginning.size());
  return rest.substr(0, rest.find('\n'));
}

/// Whether `text` has the form "2026-03-04T05:06:07Z".
bool isTime(std::string_view text) {
  constexpr std::string_view kForm = "0000-00-00T00:00:00Z";
  return std::ranges::equal(text, kForm, [](char character, char form) {
    return form == '0' ? character >= '0' && character <= '9' : character == form;
  });
}

}  // namespace

bool same(const rt::PoseParameters& a, const rt::PoseParameters& b) {
  return valuesOf(a) == valuesOf(b);
}

bool isCameraPose(const config::Parameter& parameter) {
  return std::ranges::find(kPoseParameters, parameter.name) != kPoseParameters.end();
}

std::vector<base::Error> problemsOf(const rt::PoseParameters& T_world_camera,
                                    const config::Settings& settings) {
  config::Settings posed = settings;
  posed.camera.setPose(T_world_camera);
  std::vector<base::Error> problems;
  for (const std::string_view name : kPoseParameters) {
    const config::Parameter& parameter = *config::findParameter(name);
    if (auto checked = parameter.check(parameter.get(posed)); !checked) problems.push_back(checked.error());
  }
  return problems.empty() ? config::checkTogether(posed) : problems;
}

std::expected<std::optional<Registration>, std::vector<base::Error>> readRegistration(
    const std::filesystem::path& state_folder) {
  const std::filesystem::path file = fileIn(state_folder);
  const auto content = readStateFile(file);
  if (!content) return std::unexpected(std::vector{content.error()});
  if (!*content) return std::nullopt;
  const auto assignments = config::assignmentsFromText(**content, file.string(), isCameraPose);
  if (!assignments) return std::unexpected(assignments.error());
  if (assignments->size() != kPoseParameters.size()) {
    return std::unexpected(
        std::vector{base::Error{file.string(),
                                fmt::format("names {} of the {} values of the camera's pose",
                                            assignments->size(), kPoseParameters.size()),
                                "register the camera again, or remove the file"}});
  }
  config::Settings settings;
  for (const auto& [parameter, value] : *assignments) parameter->set(settings, value);
  Registration registration{settings.camera.pose(), {}, {}};
  if (const auto residual = restOfLine(**content, kResidualLine))
    registration.residual_m = base::numberFrom<double>(*residual);
  if (const auto time = restOfLine(**content, kTimeLine); time && isTime(*time)) registration.time = *time;
  return registration;
}

base::Result<void> writeRegistration(const std::filesystem::path& state_folder,
                                     const std::optional<Registration>& registration) {
  if (!registration) return removeFile(fileIn(state_folder));
  config::Settings settings;
  settings.camera.setPose(registration->T_world_camera);
  std::string text = "# The camera's pose as it was registered; it goes before that of the configuration.\n";
  if (!registration->time.empty()) text += fmt::format("{}{}\n", kTimeLine, registration->time);
  if (registration->residual_m) {
    text += fmt::format("{}{}\n", kResidualLine, base::numberText(*registration->residual_m));
  }
  return replaceFile(fileIn(state_folder),
                     config::withMarks(text + config::yamlText(settings, isCameraPose)));
}

std::string textOf(const rt::PoseParameters& pose) {
  return fmt::format("({}, {}, {}) m, ({}, {}, {}) rad", pose.position_m.x, pose.position_m.y,
                     pose.position_m.z, pose.roll_rad, pose.pitch_rad, pose.yaw_rad);
}

namespace {

using Assignments = std::vector<config::Assignment>;

/// The settings of the file and the overrides, with the layers that are inserted between the two.
class Layers {
 public:
  Layers(StartSettings& start, std::span<const std::string> overrides) : start_(start) {
    for (const std::string& assignment : overrides) {
      overridden_.push_back(assignment.substr(0, assignment.find('=')));
    }
  }

  /// Sets those parameters that no override sets, and the fixtures and regions. If that breaks a rule between
  /// parameters, it sets none, adds a notice and returns false.
  bool add(const std::string& layer, const config::SettingsPart& part) {
    config::Settings settings = start_.settings;
    part.additions.applyTo(settings.additions, config::Origin::profile);
    for (const auto& [parameter, value] : part.assignments) {
      if (std::ranges::find(overridden_, parameter->name) == overridden_.end())
        parameter->set(settings, value);
    }
    if (const auto errors = config::checkTogether(settings); !errors.empty()) {
      leaveOut(layer, errors);
      return false;
    }
    start_.settings = settings;
    return true;
  }

  void leaveOut(const std::string& layer, const std::vector<base::Error>& errors) {
    start_.notices.push_back(fmt::format("{} is not used: {}", layer, textOf(errors)));
  }

 private:
  StartSettings& start_;
  std::vector<std::string> overridden_;
};

Assignments poseAssignments(const rt::PoseParameters& pose) {
  config::Settings settings;
  settings.camera.setPose(pose);
  Assignments assignments;
  for (const config::Parameter& parameter : config::parameterTable()) {
    if (isCameraPose(parameter)) assignments.push_back({&parameter, parameter.get(settings)});
  }
  return assignments;
}

void addRegistration(StartSettings& start, Layers& layers, const std::filesystem::path& folder) {
  constexpr const char* kLayer = "the registration of the camera's pose";
  auto registration = readRegistration(folder);
  if (!registration) return layers.leaveOut(kLayer, registration.error());
  if (!*registration) return;
  if (layers.add(kLayer, {poseAssignments((*registration)->T_world_camera), {}})) {
    start.registration = std::move(*registration);
  }
}

void addBootProfile(StartSettings& start, Layers& layers, const ProfileFolder& profiles) {
  const auto name = profiles.boot();
  if (!name) return layers.leaveOut("the boot profile", {name.error()});
  if (!*name) return;
  const std::string layer = "the boot profile " + **name;
  const auto part = profiles.load(**name);
  if (!part) return layers.leaveOut(layer, part.error());
  if (layers.add(layer, *part)) start.boot_profile = **name;
}

}  // namespace

std::expected<StartSettings, std::vector<base::Error>> startSettings(const std::filesystem::path& file,
                                                                     std::span<const std::string> overrides,
                                                                     base::FileKind kind) {
  auto loaded = config::loadConfiguration(file, overrides, kind);
  if (!loaded) return std::unexpected(std::move(loaded.error()));
  const config::Settings& configured = loaded->settings;
  StartSettings start{configured,       configured.camera.pose(), {}, {}, {}, config::summaryOf(*loaded),
                      loaded->has_marks};
  Layers layers(start, overrides);
  addRegistration(start, layers, configured.state.folder);
  addBootProfile(start, layers, ProfileFolder(configured.state.folder));
  for (const base::Error& warning : config::warningsOf(start.settings))
    start.notices.push_back(warning.text());
  return start;
}

void SettingsReader::begin(Clock::time_point now) {
  deadline_ = now + kPatience;
  reading_ = worker_.run(read_);
}

std::optional<SettingsReader::Outcome> SettingsReader::outcome(Clock::time_point now) {
  if (!reading_.valid()) return std::nullopt;
  if (reading_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) return reading_.get();
  if (now < deadline_) return std::nullopt;
  reading_ = {};
  return std::unexpected(std::vector{base::Error{
      name_, fmt::format("has not been read after {} s: the disk does not answer", kPatience.count()),
      "check the disk or the network file system, and reload again"}});
}

}  // namespace hapticd::daemon

// SPDX-License-Identifier: Apache-2.0
#include "daemon/state/registration.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <tuple>

#include "config/base/value_text.h"
#include "config/settings/yaml_text.h"
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

}  // namespace hapticd::daemon

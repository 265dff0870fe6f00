// SPDX-License-Identifier: Apache-2.0
#include "daemon/state/start_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "config/settings_summary.h"
#include "config/yaml_loader.h"
#include "daemon/state/profile_folder.h"

namespace hapticd::daemon {
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

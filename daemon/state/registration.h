// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/error.h"
#include "config/settings.h"
#include "config/yaml_loader.h"

namespace hapticd::daemon {

/// Where the camera stands, as somebody has measured it.
struct Registration {
  rt::PoseParameters T_world_camera;
  std::optional<double> residual_m;  ///< what was left over of the measurements, as far as known
  std::string time;                  ///< of the measurement, UTC, "2026-03-04T05:06:07Z"; empty: not known
};

bool same(const rt::PoseParameters& a, const rt::PoseParameters& b);

/// True for the six parameters of the camera's pose.
bool isCameraPose(const config::Parameter& parameter);
/// Of `settings` with that pose: the first of the six that is not in its range, or rules between
/// parameters that are broken; none if all is well.
std::vector<config::Error> problemsOf(const rt::PoseParameters& T_world_camera,
                                      const config::Settings& settings);

/// The registration below a state folder; nothing: there is none.
/// Errors: every problem of the file; less than the whole pose.
/// Thread: any.  Progress: blocking.
std::expected<std::optional<Registration>, std::vector<config::Error>> readRegistration(
    const std::filesystem::path& state_folder);

/// Replaces it, or removes it. Errors: what the disk says; it is as it was then.
/// Thread: any.  Progress: blocking.
config::Result<void> writeRegistration(const std::filesystem::path& state_folder,
                                       const std::optional<Registration>& registration);

/// "(x, y, z) m, (roll, pitch, yaw) rad", for people.
std::string textOf(const rt::PoseParameters& pose);

}  // namespace hapticd::daemon

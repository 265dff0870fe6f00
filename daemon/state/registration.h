// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"
#include "config/yaml_loader.h"

namespace hapticd::daemon {

/// The pose of the camera, as somebody has measured it.
struct Registration {
  rt::PoseParameters T_world_camera;
  std::optional<double> residual_m;  ///< RMS residual of the measurements; nothing: not known
  std::string time;  ///< time of the measurement, UTC, "2026-03-04T05:06:07Z"; empty: not known
};

bool same(const rt::PoseParameters& a, const rt::PoseParameters& b);

/// Whether a parameter is one of the six of the camera's pose.
bool isCameraPose(const config::Parameter& parameter);
/// Checks `settings` with that pose. Returns the first of the six parameters that is out of its range, or the
/// rules between parameters that are broken; nothing if the settings are valid.
std::vector<base::Error> problemsOf(const rt::PoseParameters& T_world_camera,
                                    const config::Settings& settings);

/// Reads the registration in a state folder; nothing: there is none.
/// Errors: every problem of the file, and a pose that is not complete.
/// Thread: any.  Progress: blocking.
std::expected<std::optional<Registration>, std::vector<base::Error>> readRegistration(
    const std::filesystem::path& state_folder);

/// Replaces the registration in a state folder, or removes it. Errors: a failure of the disk, after which it
/// is unchanged. Thread: any.  Progress: blocking.
base::Result<void> writeRegistration(const std::filesystem::path& state_folder,
                                     const std::optional<Registration>& registration);

/// A pose for people: "(x, y, z) m, (roll, pitch, yaw) rad".
std::string textOf(const rt::PoseParameters& pose);

}  // namespace hapticd::daemon

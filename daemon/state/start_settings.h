// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"
#include "config/settings_summary.h"
#include "daemon/state/registration.h"

namespace hapticd::daemon {

/// The settings at the start of the daemon, and where they came from.
struct StartSettings {
  config::Settings settings;
  rt::PoseParameters configured_T_world_camera;  ///< the pose without the registration
  std::optional<Registration> registration;      ///< the registration in `settings`
  std::optional<std::string> boot_profile;       ///< the profile in `settings`
  /// What was left out, with the reason and the remedy, and settings that are allowed but hardly intended.
  std::vector<std::string> notices;
  config::SettingsSummary summary;  ///< summary of the file and the overrides
  bool has_marks = false;           ///< the file has marks that show whether it was cut
};

/// Reads the settings: the configuration file and, each over what comes before, the registration, the boot
/// profile and `overrides` ("group.name=value"). `kind`: of the configuration file; the others are regular
/// files. A registration or profile that is damaged or contradicts the other settings is left out completely.
/// Errors: those of the file and the overrides, as from config::loadConfiguration(). Thread: any.  Progress:
/// blocking.
std::expected<StartSettings, std::vector<base::Error>> startSettings(
    const std::filesystem::path& file, std::span<const std::string> overrides,
    base::FileKind kind = base::FileKind::any);

}  // namespace hapticd::daemon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/error.h"
#include "config/settings.h"
#include "config/settings_summary.h"
#include "daemon/state/registration.h"

namespace hapticd::daemon {

/// What the daemon starts with.
struct StartSettings {
  config::Settings settings;
  rt::PoseParameters configured_T_world_camera;  ///< without the registration
  std::optional<Registration> registration;      ///< that `settings` follow
  std::optional<std::string> boot_profile;       ///< that `settings` follow
  /// What was left out, why, and what to do; and what is allowed, but hardly meant.
  std::vector<std::string> notices;
  config::SettingsSummary summary;  ///< of the file and the overrides
};

/// The configuration file, on top of it the registration, the boot profile, and `overrides`
/// ("group.name=value"). `kind`: of the configuration file; the others are regular ones. A registration or
/// profile that is damaged or contradicts the others is left out as a whole. Errors: those of file and
/// overrides, as config::loadConfiguration() has them. Thread: any.  Progress: blocking.
std::expected<StartSettings, std::vector<config::Error>> startSettings(
    const std::filesystem::path& file, std::span<const std::string> overrides,
    config::FileKind kind = config::FileKind::any);

}  // namespace hapticd::daemon

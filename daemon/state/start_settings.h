// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <expected>
#include <filesystem>
#include <functional>
#include <future>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"
#include "config/settings_summary.h"
#include "config/yaml_loader.h"
#include "daemon/state/state_file.h"

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

/// Reads the settings again on a thread of its own, so that the caller never waits for the disk.
/// Thread: one caller.
class SettingsReader {
 public:
  using Clock = std::chrono::steady_clock;
  using Outcome = std::expected<StartSettings, std::vector<base::Error>>;

  /// `read` may block, and may refer only to objects that live as long as the process. `name`: describes for
  /// people what it reads.
  SettingsReader(std::function<Outcome()> read, std::string name)
      : read_(std::move(read)), name_(std::move(name)) {}

  /// Starts to read; not to be called while reading().
  void begin(Clock::time_point now);
  bool reading() const noexcept { return reading_.valid(); }
  /// Returns what was read, once; nothing while reading or before begin(). After kPatience the result is an
  /// error, and what is read later is discarded.
  std::optional<Outcome> outcome(Clock::time_point now);

  static constexpr std::chrono::seconds kPatience{10};

 private:
  std::function<Outcome()> read_;
  std::string name_;
  std::future<Outcome> reading_;
  Clock::time_point deadline_;
  StateWorker worker_{std::chrono::seconds(1)};  // a job that only reads may be abandoned soon
};

}  // namespace hapticd::daemon

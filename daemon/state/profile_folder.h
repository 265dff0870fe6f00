// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <expected>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "config/base/whole_file.h"
#include "config/settings/settings.h"
#include "config/yaml_loader.h"

namespace hapticd::daemon {

/// Whether a name is one for a profile: 1 to 64 letters, digits, '_' and '-'.
bool isProfileName(std::string_view name);

struct ProfileEntry {
  std::string name;
  bool boot = false;         ///< applied when the daemon starts
  std::int64_t time_ns = 0;  ///< CLOCK_REALTIME of the last change
};

/// The profiles in a state folder: named sets of live parameters, fixtures and tissue regions, one of which
/// may be applied at the start.
/// Errors of all functions: an invalid name, a failure of the disk.
/// Thread: any, one at a time.  Progress: blocking.
class ProfileFolder {
 public:
  static constexpr std::size_t kMaxProfiles = 256;

  explicit ProfileFolder(const std::filesystem::path& state_folder);

  /// All profiles, sorted by name; none if there is no such folder.
  base::Result<std::vector<ProfileEntry>> list() const;
  /// Saves the live parameters and the additions of `settings`.
  /// Errors: also a profile of that name that is not to be replaced, and more than kMaxProfiles.
  base::Result<void> save(const std::string& name, const config::Settings& settings,
                          base::IfExists if_exists = base::IfExists::replace) const;
  /// Loads a profile; one without fixtures or regions leaves them as they are. Errors: also no such profile,
  /// and every problem in it.
  std::expected<config::SettingsPart, std::vector<base::Error>> load(const std::string& name) const;
  /// Deletes a profile. Errors: also no such profile, and that it is the boot profile.
  base::Result<void> remove(const std::string& name) const;

  /// The name of the boot profile; nothing: there is none. Errors: also a file without a valid name.
  base::Result<std::optional<std::string>> boot() const;
  /// Chooses the boot profile. Errors: also a profile that cannot be loaded; nothing changes then.
  base::Result<void> setBoot(const std::optional<std::string>& name) const;

 private:
  std::filesystem::path fileOf(const std::string& name) const;
  std::filesystem::path bootFile() const { return folder_ / "boot"; }
  bool has(const std::string& name) const;
  base::Result<void> checkNamed(const std::string& name) const;

  std::filesystem::path folder_;
};

/// The first ten problems as one text for people, with the number of the others.
std::string textOf(const std::vector<base::Error>& errors);

}  // namespace hapticd::daemon

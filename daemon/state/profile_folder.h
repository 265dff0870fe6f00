// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <expected>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/error.h"
#include "config/settings.h"
#include "config/yaml_loader.h"

namespace hapticd::daemon {

/// 1 to 64 letters, digits, '_' and '-'.
bool isProfileName(std::string_view name);

struct ProfileEntry {
  std::string name;
  bool boot = false;         ///< applied at the start
  std::int64_t time_ns = 0;  ///< CLOCK_REALTIME of its last change
};

/// The profiles below a state folder: sets of live parameters by name, and which of them is applied at the
/// start. Errors of all functions: a name that is none, what the disk says.
/// Thread: any, one at a time.  Progress: blocking.
class ProfileFolder {
 public:
  static constexpr std::size_t kMostProfiles = 256;

  explicit ProfileFolder(const std::filesystem::path& state_folder);

  /// Sorted by name. None where there is no such folder.
  config::Result<std::vector<ProfileEntry>> list() const;
  /// Saves the live parameters of `settings`, also over an older profile.
  /// Errors: also more than kMostProfiles.
  config::Result<void> save(const std::string& name, const config::Settings& settings) const;
  /// Errors: also no such profile, every problem in it.
  std::expected<std::vector<config::Assignment>, std::vector<config::Error>> load(
      const std::string& name) const;
  /// Errors: also no such profile, it is the boot profile.
  config::Result<void> remove(const std::string& name) const;

  /// The name of the boot profile; nothing: there is none. Errors: also a file that holds no name.
  config::Result<std::optional<std::string>> boot() const;
  /// Errors: also a profile that cannot be loaded; nothing changes then.
  config::Result<void> setBoot(const std::optional<std::string>& name) const;

 private:
  std::filesystem::path fileOf(const std::string& name) const;
  std::filesystem::path bootFile() const { return folder_ / "boot"; }
  bool has(const std::string& name) const;
  config::Result<void> checkNamed(const std::string& name) const;

  std::filesystem::path folder_;
};

/// The first ten problems in one text, and how many more there are, for people.
std::string textOf(const std::vector<config::Error>& errors);

}  // namespace hapticd::daemon

// SPDX-License-Identifier: Apache-2.0
#include "daemon/state/profile_folder.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <system_error>

#include "config/base/value_text.h"
#include "config/settings/yaml_text.h"
#include "daemon/state/state_file.h"

namespace hapticd::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxNameLength = 64;

bool isLive(const config::Parameter& parameter) {
  return parameter.effect == config::Effect::live;
}

std::int64_t changeTime_ns(const fs::path& file) {
  std::error_code error;
  const auto time = fs::last_write_time(file, error);
  if (error) return 0;
  const auto since_epoch = std::chrono::file_clock::to_sys(time).time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since_epoch).count();
}

}  // namespace

bool isProfileName(std::string_view name) {
  return !name.empty() && name.size() <= kMaxNameLength &&
         name.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-") ==
             std::string_view::npos;
}

ProfileFolder::ProfileFolder(const fs::path& state_folder) : folder_(state_folder / "profiles") {}

fs::path ProfileFolder::fileOf(const std::string& name) const {
  return folder_ / (name + ".yaml");
}

bool ProfileFolder::has(const std::string& name) const {
  std::error_code ignored;
  return fs::symlink_status(fileOf(name), ignored).type() == fs::file_type::regular;
}

base::Result<void> ProfileFolder::checkNamed(const std::string& name) const {
  if (!isProfileName(name)) {
    return base::failure("profile " + base::inQuotes(name), "is not a valid profile name",
                         fmt::format("take 1 to {} letters, digits, '_' and '-'", kMaxNameLength));
  }
  return {};
}

base::Result<std::vector<ProfileEntry>> ProfileFolder::list() const {
  const auto boot_name = boot();
  std::vector<ProfileEntry> entries;
  std::error_code error;
  fs::directory_iterator files(folder_, error);
  for (; !error && files != fs::directory_iterator() && entries.size() < kMaxProfiles;
       files.increment(error)) {
    const fs::path file = files->path();
    const std::string name = file.stem().string();
    if (file.extension() != ".yaml" || !isProfileName(name) || !has(name)) continue;
    entries.push_back({name, boot_name && *boot_name == name, changeTime_ns(file)});
  }
  if (error && error != std::errc::no_such_file_or_directory) {
    return base::failure(folder_.string(), "cannot be read: " + error.message(),
                         "give the user of hapticd the right to read it");
  }
  std::ranges::sort(entries, {}, &ProfileEntry::name);
  return entries;
}

base::Result<void> ProfileFolder::save(const std::string& name, const config::Settings& settings,
                                       base::IfExists if_exists) const {
  if (auto named = checkNamed(name); !named) return named;
  if (has(name)) {
    if (if_exists == base::IfExists::refuse) {
      return base::failure("profile " + name, "exists already",
                           fmt::format("'hapticctl save --force {}' replaces it", name));
    }
  } else {
    const auto entries = list();
    if (entries && entries->size() >= kMaxProfiles) {
      return base::failure(folder_.string(),
                           fmt::format("holds {} profiles, no more are possible", kMaxProfiles),
                           "delete one that is not needed");
    }
  }
  return replaceFile(fileOf(name), config::withMarks(config::yamlText(settings, isLive) +
                                                     config::textOf(settings.additions)));
}

std::expected<config::SettingsPart, std::vector<base::Error>> ProfileFolder::load(
    const std::string& name) const {
  if (auto named = checkNamed(name); !named) return std::unexpected(std::vector{named.error()});
  if (!has(name)) {
    return std::unexpected(std::vector{base::Error{"profile " + name, "there is no such profile",
                                                   "hapticctl profiles shows those that there are"}});
  }
  const auto content = readStateFile(fileOf(name));
  if (!content) return std::unexpected(std::vector{content.error()});
  auto part = config::partFromText(content->value_or(""), fileOf(name).string(), isLive);
  if (part && part->assignments.empty() && part->additions.empty()) {
    return std::unexpected(std::vector{
        base::Error{fileOf(name).string(), "names no parameter", "save the profile again, or delete it"}});
  }
  return part;
}

base::Result<void> ProfileFolder::remove(const std::string& name) const {
  if (auto named = checkNamed(name); !named) return named;
  if (!has(name)) {
    return base::failure("profile " + name, "there is no such profile",
                         "hapticctl profiles shows those that there are");
  }
  if (const auto boot_name = boot(); boot_name && *boot_name == name) {
    return base::failure("profile " + name, "is the boot profile",
                         "choose another boot profile first, or none");
  }
  return removeFile(fileOf(name));
}

base::Result<std::optional<std::string>> ProfileFolder::boot() const {
  auto content = readStateFile(bootFile());
  if (!content || !*content) return content;
  std::string name = **content;
  if (name.ends_with('\n')) name.pop_back();
  if (!isProfileName(name)) {
    return base::failure(bootFile().string(), base::inQuotes(name) + " is not a valid profile name",
                         "choose the boot profile again");
  }
  return name;
}

base::Result<void> ProfileFolder::setBoot(const std::optional<std::string>& name) const {
  if (!name) return removeFile(bootFile());
  if (const auto loaded = load(*name); !loaded) {
    return base::failure("", textOf(loaded.error()), "");
  }
  return replaceFile(bootFile(), *name + "\n");
}

std::string textOf(const std::vector<base::Error>& errors) {
  constexpr std::size_t kMaxShown = 10;
  std::vector<std::string> texts;
  for (const base::Error& error : errors) {
    if (texts.size() == kMaxShown) {
      texts.push_back(fmt::format("{} more problems", errors.size() - kMaxShown));
      break;
    }
    texts.push_back(error.text());
  }
  return fmt::format("{}", fmt::join(texts, "; "));
}

}  // namespace hapticd::daemon

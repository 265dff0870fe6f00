// SPDX-License-Identifier: Apache-2.0
#include "daemon/state/solid_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <string_view>
#include <system_error>
#include <tuple>

#include "config/base/sha256.h"
#include "config/base/value_text.h"
#include "daemon/state/state_file.h"

namespace hapticd::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEnding = ".solid";
/// Of the solids that have been sent, and that no fixture uses yet.
constexpr std::size_t kMaxOffered = 4;

/// The names of the solids in a folder.
std::set<std::string> solidsIn(const fs::path& folder) {
  std::set<std::string> found;
  std::error_code error;
  for (fs::directory_iterator file(folder, error); !error && file != fs::directory_iterator();
       file.increment(error)) {
    std::string name = file->path().stem().string();
    if (file->path().extension() == kEnding && base::isSha256(name)) found.insert(std::move(name));
  }
  return found;
}

/// All profiles as one text.
std::string textOfProfiles(const fs::path& folder) {
  std::string text;
  std::error_code error;
  for (fs::directory_iterator file(folder, error); !error && file != fs::directory_iterator();
       file.increment(error)) {
    if (const auto content = readStateFile(file->path()); content && *content) text += **content;
  }
  return text;
}

/// Names those of too many files that may make room, the oldest first. Errors: all are in use.
base::Result<void> findReplaceable(const fs::path& folder, const fs::path& profiles,
                                   const std::set<std::string>& in_use, StoredSolid& stored) {
  const std::set<std::string> found = solidsIn(folder);
  if (found.size() <= SolidStore::kMaxFiles) return {};
  stored.too_many = found.size() - SolidStore::kMaxFiles;
  const std::string named = textOfProfiles(profiles);
  std::vector<std::pair<fs::file_time_type, std::string>> replaceable;
  for (const std::string& sha256 : found) {
    if (sha256 == stored.solid->sha256() || in_use.contains(sha256) || named.contains(sha256)) continue;
    std::error_code ignored;
    replaceable.emplace_back(fs::last_write_time(folder / config::solidFileName(sha256), ignored), sha256);
  }
  std::ranges::sort(replaceable);
  for (auto& [time, sha256] : replaceable) stored.replaceable.push_back(std::move(sha256));
  if (!stored.replaceable.empty()) return {};
  return base::failure(
      folder.string(),
      fmt::format("holds {} solids, and fixtures or profiles use all of them", SolidStore::kMaxFiles),
      "delete profiles or fixtures that are not needed any more");
}

base::Result<StoredSolid> stored(const base::Descriptor& memory, const fs::path& folder,
                                 const fs::path& profiles, const std::set<std::string>& in_use) {
  base::HeldBytes bytes = base::mappedMemory(memory, config::kMaxSolidBytes);
  if (!bytes)
    return base::failure(
        "solid", "is not in a memory file that is sealed against writing, shrinking and growing",
        fmt::format("send one of at most {} bytes, made by memfd_create() with F_SEAL_WRITE, F_SEAL_SHRINK "
                    "and F_SEAL_GROW",
                    config::kMaxSolidBytes));
  auto solid = config::solidFrom(std::move(bytes), "solid");
  if (!solid) return std::unexpected(solid.error());
  StoredSolid result{std::move(*solid)};
  const fs::path file = folder / config::solidFileName(result.solid->sha256());
  std::error_code ignored;
  const bool existed = fs::exists(file, ignored);
  if (auto written = replaceFile(file, result.solid->file()); !written)
    return std::unexpected(written.error());
  if (auto room = findReplaceable(folder, profiles, in_use, result); !room && !existed) {
    (void)removeFile(file);
    return std::unexpected(room.error());
  }
  return result;
}

bool isSolid(const config::FixtureSettings& fixture) {
  return fixture.kind == rt::FixtureKind::solid;
}

}  // namespace

SolidStore::SolidStore(const fs::path& state_folder, std::size_t max_bytes)
    : max_bytes_(max_bytes),
      folder_(state_folder / config::kSolidFolder),
      profiles_(state_folder / "profiles"),
      known_(solidsIn(folder_)) {}

std::future<base::Result<StoredSolid>> SolidStore::store(base::Descriptor memory) {
  auto shared = std::make_shared<base::Descriptor>(std::move(memory));
  std::set<std::string> in_use = in_use_;
  in_use.insert(offered_.begin(), offered_.end());
  return worker_.run([shared, in_use = std::move(in_use), folder = folder_, profiles = profiles_] {
    return stored(*shared, folder, profiles, in_use);
  });
}

base::Result<void> SolidStore::take(StoredSolid stored) {
  const std::string sha256 = stored.solid->sha256();
  known_.insert(sha256);
  // Decided here, where no fixture can come to use one meanwhile.
  std::size_t too_many = stored.too_many;
  for (const std::string& old : stored.replaceable) {
    if (too_many == 0) break;
    if (in_use_.contains(old) || std::ranges::find(offered_, old) != offered_.end()) continue;
    --too_many;
    if (known_.erase(old) == 0) continue;  // made room for another one already
    (void)worker_.run([file = folder_ / config::solidFileName(old)] { return removeFile(file); });
  }
  const bool present = table_.contains(sha256);
  if (auto kept = keep(sha256, std::move(stored.solid)); !kept) return kept;
  if (in_use_.contains(sha256)) {
    completed_ = completed_ || !present;
    return {};
  }
  std::erase(offered_, sha256);
  offered_.push_back(sha256);
  if (offered_.size() > kMaxOffered) forgetOldestOffer();
  return {};
}

/// Puts a solid into table(), unless it is there: the force loop may be reading that one.
base::Result<void> SolidStore::keep(const std::string& sha256, std::shared_ptr<const config::Solid> solid) {
  const std::size_t more = table_.contains(sha256) ? 0 : solid->bytes();
  while (more > 0 && bytes() + more > max_bytes_ && !offered_.empty()) forgetOldestOffer();
  base::Result<void> kept;
  if (more > 0 && bytes() + more > max_bytes_) {
    kept = base::failure(
        "solid",
        fmt::format("needs {} MB more, and all solids together may take {} MB", more >> 20, max_bytes_ >> 20),
        "remove other fixtures, or add it again with a larger tolerance");
  } else {
    table_.try_emplace(sha256, solid);
    failed_.erase(sha256);
  }
  discard(std::move(solid));
  return kept;
}

void SolidStore::forgetOldestOffer() {
  if (auto forgotten = table_.extract(offered_.front())) discard(std::move(forgotten.mapped()));
  offered_.pop_front();
}

void SolidStore::discard(std::shared_ptr<const config::Solid> solid) {
  (void)worker_.run([solid = std::move(solid)]() -> base::Result<void> { return {}; });
}

std::size_t SolidStore::bytes() const {
  std::size_t sum = 0;
  for (const auto& [sha256, solid] : table_) sum += solid->bytes();
  for (const Retired& retired : retired_) sum += retired.solid->bytes();
  return sum;
}

void SolidStore::use(const std::vector<config::FixtureSettings>& fixtures, std::uint64_t generation) {
  const std::set<std::string> before = std::exchange(in_use_, {});
  for (const config::FixtureSettings& fixture : fixtures) {
    if (!isSolid(fixture)) continue;
    const std::string& sha256 = fixture.solid;
    in_use_.insert(sha256);
    std::erase(offered_, sha256);
    if (table_.contains(sha256) || loading_.contains(sha256)) continue;
    failed_.erase(sha256);
    loading_[sha256] = worker_.run([folder = folder_, sha256] { return config::loadSolid(folder, sha256); });
  }
  for (const std::string& sha256 : before) {
    const auto unused = in_use_.contains(sha256) ? table_.end() : table_.find(sha256);
    if (unused == table_.end()) continue;
    retired_.push_back({generation, std::move(unused->second)});
    table_.erase(unused);
  }
}

void SolidStore::load(const std::vector<config::FixtureSettings>& fixtures) {
  use(fixtures, 0);
  for (auto& [sha256, future] : std::exchange(loading_, {})) takeOne(sha256, future.get());
}

void SolidStore::takeOne(const std::string& sha256, Loaded loaded) {
  if (!in_use_.contains(sha256)) {  // the fixture has gone meanwhile
    if (loaded) discard(std::move(*loaded));
    return;
  }
  const base::Result<void> kept = loaded ? keep(sha256, std::move(*loaded)) : std::unexpected(loaded.error());
  if (!kept && !table_.contains(sha256)) failed_.insert_or_assign(sha256, kept.error());
}

bool SolidStore::takeLoaded() {
  bool changed = std::exchange(completed_, false);
  for (auto entry = loading_.begin(); entry != loading_.end();) {
    if (entry->second.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
      ++entry;
      continue;
    }
    takeOne(entry->first, entry->second.get());
    changed = changed || table_.contains(entry->first);
    entry = loading_.erase(entry);
  }
  return changed;
}

std::shared_ptr<const config::Solid> SolidStore::inMemory(const std::string& sha256) const {
  const auto found = table_.find(sha256);
  return found == table_.end() ? nullptr : found->second;
}

void SolidStore::release(std::uint64_t generation_in_use) {
  std::erase_if(retired_, [=, this](Retired& retired) {
    const bool unused = retired.generation <= generation_in_use;
    if (unused) discard(std::move(retired.solid));
    return unused;
  });
}

std::string SolidStore::problemOf(const std::vector<config::FixtureSettings>& fixtures) const {
  for (const config::FixtureSettings& fixture : fixtures) {
    if (!isSolid(fixture) || !fixture.enabled || table_.contains(fixture.solid)) continue;
    const std::string name = base::printable(fixture.name);
    const auto failed = failed_.find(fixture.solid);
    if (failed == failed_.end())
      return fmt::format("fixture {} does not act yet: its shape is being read from the disk", name);
    return fmt::format("fixture {} does not act: {}", name, failed->second.text());
  }
  return {};
}

}  // namespace hapticd::daemon

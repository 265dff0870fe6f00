// SPDX-License-Identifier: Apache-2.0
#include "daemon/state/solid_store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>

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

/// A sealed memory file, mapped for reading: it can neither change nor become shorter.
class SealedMemory {
 public:
  explicit SealedMemory(const base::Descriptor& memory) {
    constexpr int kSeals = F_SEAL_WRITE | F_SEAL_SHRINK | F_SEAL_GROW;
    const int seals = ::fcntl(memory.get(), F_GET_SEALS);
    struct stat status {};
    if (seals < 0 || (seals & kSeals) != kSeals || ::fstat(memory.get(), &status) != 0 ||
        status.st_size <= 0 || static_cast<std::uint64_t>(status.st_size) > config::kMaxSolidBytes)
      return;
    size_ = static_cast<std::size_t>(status.st_size);
    data_ = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, memory.get(), 0);
  }
  SealedMemory(const SealedMemory&) = delete;
  SealedMemory& operator=(const SealedMemory&) = delete;
  ~SealedMemory() {
    if (data_ != MAP_FAILED) ::munmap(data_, size_);
  }

  std::optional<std::string_view> bytes() const {
    if (data_ == MAP_FAILED) return std::nullopt;
    return std::string_view(static_cast<const char*>(data_), size_);
  }

 private:
  void* data_ = MAP_FAILED;
  std::size_t size_ = 0;
};

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

/// Removes the oldest solids that nobody uses until there is room for one more. Returns which.
base::Result<std::vector<std::string>> makeRoom(const fs::path& folder, const fs::path& profiles,
                                                const std::set<std::string>& in_use) {
  std::vector<std::string> removed;
  std::set<std::string> found = solidsIn(folder);
  if (found.size() < SolidStore::kMaxFiles) return removed;
  const std::string named = textOfProfiles(profiles);
  while (found.size() >= SolidStore::kMaxFiles) {
    std::optional<std::pair<fs::file_time_type, std::string>> oldest;
    for (const std::string& sha256 : found) {
      if (in_use.contains(sha256) || named.contains(sha256)) continue;
      std::error_code ignored;
      const auto time = fs::last_write_time(folder / config::solidFileName(sha256), ignored);
      if (!oldest || time < oldest->first) oldest = {time, sha256};
    }
    if (!oldest)
      return std::unexpected(
          base::Error{folder.string(),
                      fmt::format("holds {} solids, and fixtures or profiles use all of them", found.size()),
                      "delete profiles or fixtures that are not needed any more"});
    if (auto gone = removeFile(folder / config::solidFileName(oldest->second)); !gone)
      return std::unexpected(gone.error());
    found.erase(oldest->second);
    removed.push_back(oldest->second);
  }
  return removed;
}

base::Result<StoredSolid> stored(const base::Descriptor& memory, const fs::path& folder,
                                 const fs::path& profiles, const std::set<std::string>& in_use) {
  const SealedMemory sealed(memory);
  const auto bytes = sealed.bytes();
  if (!bytes)
    return std::unexpected(base::Error{
        "solid", "is not in a memory file that is sealed against writing, shrinking and growing",
        fmt::format("send one of at most {} bytes, made by memfd_create() with F_SEAL_WRITE, F_SEAL_SHRINK "
                    "and F_SEAL_GROW",
                    config::kMaxSolidBytes)});
  auto solid = config::solidFrom(*bytes, "solid");
  if (!solid) return std::unexpected(solid.error());
  StoredSolid result{std::move(*solid)};
  const fs::path file = folder / config::solidFileName(result.solid->sha256());
  std::error_code ignored;
  if (!fs::exists(file, ignored)) {
    auto room = makeRoom(folder, profiles, in_use);
    if (!room) return std::unexpected(room.error());
    result.removed = std::move(*room);
  }
  if (auto written = replaceFile(file, *bytes); !written) return std::unexpected(written.error());
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

base::Result<void> SolidStore::take(const StoredSolid& stored) {
  const std::string& sha256 = stored.solid->sha256();
  for (const std::string& removed : stored.removed) known_.erase(removed);
  known_.insert(sha256);
  const bool present = table_.contains(sha256);
  if (auto kept = keep(sha256, stored.solid); !kept) return kept;
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
  const bool present = table_.contains(sha256);
  while (!present && bytes() + solid->bytes() > max_bytes_ && !offered_.empty()) forgetOldestOffer();
  if (!present && bytes() + solid->bytes() > max_bytes_)
    return std::unexpected(base::Error{"solid",
                                       fmt::format("needs {} MB more, and all solids together may take {} MB",
                                                   solid->bytes() >> 20, max_bytes_ >> 20),
                                       "remove other fixtures, or add it again with a larger tolerance"});
  table_.try_emplace(sha256, std::move(solid));
  failed_.erase(sha256);
  return {};
}

void SolidStore::forgetOldestOffer() {
  table_.erase(offered_.front());
  offered_.pop_front();
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
  if (!in_use_.contains(sha256)) return;  // the fixture has gone meanwhile
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
  std::erase_if(retired_, [=](const Retired& retired) { return retired.generation <= generation_in_use; });
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

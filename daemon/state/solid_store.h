// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <future>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "config/base/descriptor.h"
#include "config/base/error.h"
#include "config/settings/fixture_settings.h"
#include "config/solids/solid_file.h"
#include "daemon/base/stored_solid.h"
#include "daemon/state/state_file.h"

namespace hapticd::daemon {

/// The solids that fixtures refer to: in the state folder as `solids/SHA256.solid`, one file for each
/// content, and in memory those that are in use. What the force loop reads stays in memory until it reads
/// something else.
/// Thread: one; files are read and written by a worker, because the disk may not respond.
class SolidStore {
 public:
  /// Files that are kept; beyond it the oldest that no fixture and no profile names makes room, as soon as
  /// take() has decided which.
  static constexpr std::size_t kMaxFiles = 64;
  /// Memory of all solids together: that of the fixtures, and of those that the next change may name.
  static constexpr std::size_t kMaxBytes = std::size_t{256} << 20;

  explicit SolidStore(const std::filesystem::path& state_folder, std::size_t max_bytes = kMaxBytes);

  /// Whether there is a file of this content, or was when it was looked for last.
  bool knows(const std::string& sha256) const { return known_.contains(sha256); }

  /// Checks a file and stores it. `memory`: a memory file that is sealed against changes.
  /// Errors: it is not sealed, damaged or too large; a failure of the disk; too many files are in use.
  std::future<base::Result<StoredSolid>> store(base::Descriptor memory);
  /// To be called with the result of store(): the next fixtures may refer to it, and those that do act.
  /// Errors: the solids in use leave no memory for it.
  base::Result<void> take(StoredSolid stored);

  /// The solids of `fixtures`: those that are in memory are in table(); the others are read from now on.
  /// `generation`: of the fixture set that is made with them; what only older sets use may be released.
  void use(const std::vector<config::FixtureSettings>& fixtures, std::uint64_t generation);
  /// use(), and waits for the files.
  void load(const std::vector<config::FixtureSettings>& fixtures);
  /// Takes what has been read meanwhile. Returns whether table() has solids of these fixtures that it had not
  /// at the last call.
  bool takeLoaded();
  /// Releases what only sets older than this one use.
  void release(std::uint64_t generation_in_use);

  const config::SolidTable& table() const { return table_; }
  /// One of table(); null: it is not there.
  std::shared_ptr<const config::Solid> inMemory(const std::string& sha256) const;
  /// Whether a file is being read, or takeLoaded() has not returned what came meanwhile.
  bool loading() const { return completed_ || !loading_.empty(); }
  /// Why a solid of these fixtures, if they are enabled, is not in memory, with the name of the fixture;
  /// empty: all are.
  std::string problemOf(const std::vector<config::FixtureSettings>& fixtures) const;

 private:
  using Loaded = base::Result<std::shared_ptr<const config::Solid>>;

  struct Retired {
    std::uint64_t generation;  ///< of the first set that does not use it
    std::shared_ptr<const config::Solid> solid;
  };

  std::size_t bytes() const;
  base::Result<void> keep(const std::string& sha256, std::shared_ptr<const config::Solid> solid);
  void forgetOldestOffer();
  /// Has the worker let go of a solid: to return tens of megabytes to the system takes a while.
  void discard(std::shared_ptr<const config::Solid> solid);
  void takeOne(const std::string& sha256, Loaded loaded);

  const std::size_t max_bytes_;
  const std::filesystem::path folder_, profiles_;
  std::set<std::string> known_;
  config::SolidTable table_;
  std::set<std::string> in_use_;     // by the newest set
  std::deque<std::string> offered_;  // the newest that no set has used yet
  std::vector<Retired> retired_;
  std::map<std::string, std::future<Loaded>> loading_;
  std::map<std::string, base::Error> failed_;
  bool completed_ = false;  // a solid in use was sent that table_ lacked
  StateWorker worker_;
};

}  // namespace hapticd::daemon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <expected>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "config/settings/settings.h"
#include "daemon/base/box.h"
#include "daemon/base/journal_entry.h"
#include "daemon/state/start_settings.h"

namespace hapticd::daemon {

/// What a configuration that was read again asks for.
struct Reload {
  config::Settings
      settings;  ///< the current ones, with the live parameters, fixtures and regions of the file
  std::vector<std::string_view>
      waiting;  ///< parameters that differ in the file, but only take effect at the next start
  /// "fixture nerve": what the file defines and what is not in use, because a client or a profile has given
  /// the name to another one.
  std::vector<std::string> hidden;
};

/// Compares the settings in use (`running`) with those of the file (`loaded`). All live parameters take the
/// file's values, including those that a client has set in the meantime. Of the fixtures and regions only
/// those of the configuration change: they become what the file says, also where a client has changed or
/// removed them, and those that it no longer has go; what profiles and clients have added stays.
/// Errors: the file's live parameters contradict parameters that only a restart can change, or there would be
/// more fixtures or regions than are possible.
std::expected<Reload, std::vector<base::Error>> reloaded(const config::Settings& running,
                                                         const config::Settings& loaded);

/// The sources of the settings, needed to read them again.
struct ConfigurationSource {
  std::filesystem::path file;
  std::vector<std::string> overrides;  ///< "group.name=value", as on the command line
};

/// Reads the configuration again on request and applies it. While the box is engaged, limits that would
/// become looser and fixtures and regions that would go or protect less stay as they are, and the rest is
/// applied; they follow when the reload is confirmed, or when the box is disengaged.
/// Thread: control thread, unless stated otherwise.
class Reloader final : public Reloads {
 public:
  using Clock = std::chrono::steady_clock;
  using Report = std::function<void(const JournalEntry&)>;

  /// `start`: what the box was started with. `report`: logs an entry.
  Reloader(Box& box, const StartSettings& start, ConfigurationSource source, Report report);

  /// Requests a reload. All requests that arrive during a reload cause one more reload after it.
  /// Thread: any, and signal handlers.
  void requestFromSignal() noexcept { requested_ = true; }

  std::uint64_t request() override;
  std::optional<Outcome> outcome(std::uint64_t number) const override;
  const std::optional<PendingReload>& pending() const override { return pending_; }
  Outcome confirm() override;

  /// To be called every few milliseconds. `on_begin` and `on_end` are called at the beginning and the end of
  /// each reload; another thread waits for the disk.
  void periodic(Clock::time_point now, const std::function<void()>& on_begin,
                const std::function<void()>& on_end);
  /// The warnings of the last start or reload, and that something waits.
  std::vector<std::string> warnings() const;
  /// Logs what the settings of the file are.
  void reportSummary(const config::SettingsSummary& summary) const;

 private:
  Outcome apply(const StartSettings& loaded);
  /// Hands `target` to the box and logs what changes.
  ReloadReport change(const Reload& reload, const config::Settings& target);
  Outcome refuse(std::vector<base::Error> errors);
  /// `target` without what it loosens; nothing: that would contradict itself, so that all of it has to wait.
  std::optional<config::Settings> applicable(const config::Settings& target) const;
  std::vector<config::Loosening> heldOf(const config::Settings& target) const;
  void noteWhatIsNotInUse(const Reload& reload);
  void logReload(const ReloadReport& report) const;
  void logLoosening(const std::vector<config::Loosening>& loosenings) const;
  /// Follows changes by clients in what waits, and applies it when the box is disengaged.
  void followPending();
  config::Settings comparable(const StartSettings& loaded) const;

  Box& box_;
  const ConfigurationSource source_;
  const bool pose_registered_;  // the pose in use comes from the registration, not from the configuration
  const Report report_;
  SettingsReader reader_;
  std::vector<std::string> notices_;
  std::optional<StartSettings> held_;  // what was loaded, while something of it waits
  std::optional<PendingReload> pending_;
  std::uint64_t begun_ = 0;     // number of the newest reload
  std::uint64_t finished_ = 0;  // number of the one that has ended last
  Outcome last_;                // its outcome
  std::atomic<bool> requested_{false};
};

}  // namespace hapticd::daemon

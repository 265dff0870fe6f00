// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/control/control_service.h"
#include "daemon/control/varlink_server.h"
#include "daemon/event_log.h"
#include "daemon/running_box.h"
#include "daemon/service_manager.h"
#include "daemon/state/settings_reader.h"
#include "daemon/state/start_settings.h"
#include "daemon/state/state_lock.h"

namespace hapticd::daemon {

/// Where the settings came from, to read them again.
struct ConfigurationSource {
  std::filesystem::path file;
  std::vector<std::string> overrides;  ///< "group.name=value", as on the command line
};

/// The daemon between its start and its end: the box, its control API and its service manager.
/// Thread: control thread, where nothing else is said.
class Service {
 public:
  /// `faults`: to be made up; null: none.
  Service(const StartSettings& start, ConfigurationSource source,
          std::unique_ptr<FaultInjector> faults = nullptr);

  /// Opens the sockets, starts the box, serves until requestStop() and brings the force to zero.
  /// Returns the exit status of the process (sysexits.h).
  int run();

  /// Ends run(), also one that has not begun yet.
  /// Thread: any, and signal handlers.
  void requestStop() noexcept;
  /// Has the configuration file read again: its live parameters are applied, the others are reported.
  /// Requests that come while it is read are one more reading afterwards. Thread: any, and signal handlers.
  void requestReload() noexcept { reload_requested_ = true; }

 private:
  using Clock = std::chrono::steady_clock;

  config::Result<void> openSockets();
  std::expected<void, RunningBox::StartFailure> startBox();
  /// To the journal, the clients and the trace.
  void tell(const JournalEntry& entry);
  void periodic();
  /// How the control thread keeps its period, for the status.
  void noteControl(Clock::time_point now);
  /// Begins and ends a reading of the settings; the disk is waited for elsewhere.
  void reload(Clock::time_point now);
  void tellSummary(const config::SettingsSummary& summary);
  void applyReload(const StartSettings& loaded);
  void refuseReload(const std::vector<config::Error>& errors);
  void lookAround(Clock::time_point now);
  /// Has the status warn of what is not the box's own.
  void showNotices();

  ConfigurationSource source_;
  bool pose_registered_;              ///< the camera's pose in use is not the configuration's
  std::vector<std::string> notices_;  ///< of the last start or reload
  SettingsReader reader_;
  ServiceManager manager_;
  std::optional<StateLock> state_lock_;  // held until the box and the control service write no more
  RunningBox box_;
  ControlService control_;
  EventLog events_;
  std::unique_ptr<VarlinkServer> server_;
  Clock::time_point next_look_;
  Clock::time_point last_period_;
  ControlStatus control_status_;

  // Between the control thread and signal handlers.
  std::atomic<bool> stop_requested_{false};
  std::atomic<bool> reload_requested_{false};
  std::atomic<VarlinkServer*> serving_{nullptr};
  static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<VarlinkServer*>::is_always_lock_free);
};

}  // namespace hapticd::daemon

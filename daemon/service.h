// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/control/control_service.h"
#include "daemon/control/server/varlink_server.h"
#include "daemon/event_log.h"
#include "daemon/reloader.h"
#include "daemon/running_box.h"
#include "daemon/service_manager.h"
#include "daemon/state/start_settings.h"
#include "daemon/state/state_file.h"

namespace hapticd::daemon {

/// The running daemon: the box, its control API, and what it reports to the service manager.
/// Thread: control thread, unless stated otherwise.
class Service {
 public:
  /// `faults`: the faults to inject; null: none.
  Service(const StartSettings& start, ConfigurationSource source,
          std::unique_ptr<FaultInjector> faults = nullptr);

  /// Opens the sockets, starts the box, serves until requestStop() and brings the force to zero.
  /// Returns the exit status of the process (sysexits.h).
  int run();

  /// Ends run(), even if it has not started yet.
  /// Thread: any, and signal handlers.
  void requestStop() noexcept;
  /// Requests a reload (reloader.h).
  /// Thread: any, and signal handlers.
  void requestReload() noexcept { reloader_.requestFromSignal(); }

 private:
  using Clock = std::chrono::steady_clock;

  base::Result<void> openSockets();
  std::expected<void, RunningBox::StartFailure> startBox();
  /// Sends an entry to the journal, to the clients and to the trace.
  void report(const JournalEntry& entry);
  void periodic();
  /// How well the control thread keeps its period, for the status.
  void noteControl(Clock::time_point now);
  void checkForChanges(Clock::time_point now);
  /// Passes the warnings that the box itself does not know to its status.
  void showNotices();

  ServiceManager manager_;
  std::optional<StateLock> state_lock_;  // released after the last write by the box and the control service
  RunningBox box_;
  Reloader reloader_;
  ControlService control_;
  EventLog events_;
  std::unique_ptr<VarlinkServer> server_;
  Clock::time_point next_look_;
  Clock::time_point last_period_;
  ControlStatus control_status_;

  // Shared by the control thread and signal handlers.
  std::atomic<bool> stop_requested_{false};
  std::atomic<VarlinkServer*> serving_{nullptr};
  static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<VarlinkServer*>::is_always_lock_free);
};

}  // namespace hapticd::daemon

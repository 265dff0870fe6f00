// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/base/descriptor.h"
#include "daemon/control/control_service.h"
#include "daemon/control/server/varlink_server.h"
#include "daemon/journal.h"
#include "daemon/reloader.h"
#include "daemon/running_box.h"
#include "daemon/state/start_settings.h"
#include "daemon/state/state_file.h"

namespace hapticd::daemon {

/// The connection to the service manager (sd_listen_fds(3), sd_notify(3)). All functions do nothing if there
/// is no service manager or it did not request notifications. None waits for the service manager, as
/// sd_notify() would: a notification that it does not take is sent again by feedWatchdog().
/// Thread: control thread only.
class ServiceManager {
 public:
  using Clock = std::chrono::steady_clock;

  /// Takes over the sockets that the service manager passed, and removes the environment variables that
  /// describe them.
  ServiceManager();

  /// The listening socket of that name (FileDescriptorName= of the socket unit), or -1. The caller owns it.
  int takeSocket(const std::string& name);

  void ready();
  void reloading();
  void stopping();
  /// Sends a line for `systemctl status` if it differs from the last one.
  void showState(const std::string& line);

  /// Feeds the watchdog if `heartbeat` has changed since the last time, so that a force loop that has
  /// stopped ends the daemon, whatever else still runs. To be called at least every quarter of the watchdog's
  /// time.
  void feedWatchdog(std::uint64_t heartbeat, Clock::time_point now);

  /// Notifications that were dropped and times at which the watchdog could not be fed when due, since the
  /// start.
  std::uint64_t lost() const noexcept { return lost_; }

 private:
  enum class Sent { done, full, failed };

  void connectTo(std::string address);
  Sent trySend(const std::string& message) const;
  void send(std::string message);
  void sendWaiting();

  std::map<std::string, int> sockets_;
  base::Descriptor socket_;  // none: there is no service manager
  sockaddr_un address_{};
  socklen_t address_bytes_ = 0;
  std::deque<std::string> waiting_;  // oldest first
  std::uint64_t lost_ = 0;
  std::string state_;
  Clock::duration feed_period_{};  // 0: there is no watchdog
  Clock::time_point last_fed_;
  bool feed_failed_ = false;  // the one that is due
  std::uint64_t last_heartbeat_ = 0;
};

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

// SPDX-License-Identifier: Apache-2.0
#include "daemon/stop_guard.h"

#include <fmt/format.h>
#include <sysexits.h>

#include <cstdlib>

#include "daemon/journal.h"
#include "drivers/base/start_thread.h"
#include "drivers/base/stop_signal.h"

namespace hapticd::daemon {

void endWithout(const std::string& part, std::chrono::milliseconds limit) {
  writeToJournal({JournalEntry::Priority::error,
                  fmt::format("{} does not stop within {:g} s: the daemon ends without it", part,
                              static_cast<double>(limit.count()) * 1e-3),
                  config::EventKind::stop,
                  {{"PART", part}}});
  flushJournal(JournalThread::kEndPatience);
  std::_Exit(EX_SOFTWARE);  // destructors would wait for the part that hangs
}

void stopWithin(const std::string& part, std::chrono::milliseconds limit, const std::function<void()>& stop,
                const std::function<void(const std::string&, std::chrono::milliseconds)>& give_up) {
  drivers::StopSignal stopped;
  const auto end = std::chrono::steady_clock::now() + limit;
  // If no thread can be started, only the service manager's own limit applies.
  auto watch = drivers::startThread("stop-watch", [&] {
    if (!stopped.waitUntil(end)) give_up(part, limit);
  });
  stop();
  stopped.raise();
  if (watch) watch->join();
}

}  // namespace hapticd::daemon

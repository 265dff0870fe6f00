// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder/crash_recovery.h"

#include <fmt/format.h>

#include "daemon/trace/mcap/trace_file.h"
#include "daemon/trace/recovery/trace_recovery.h"
#include "drivers/base/start_thread.h"

namespace hapticd::daemon {

base::Result<void> CrashRecovery::begin() {
  const std::vector<std::string> left_open = trace::openTraces(folder_);
  if (left_open.empty()) return {};
  auto thread = drivers::startThread("trace-recovery", [this, left_open] { finish(left_open); });
  if (!thread) return std::unexpected(thread.error());
  thread_ = std::move(*thread);
  return {};
}

void CrashRecovery::stop() {
  stops_ = true;
  if (thread_.joinable()) thread_.join();
}

CrashRecovery::Status CrashRecovery::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void CrashRecovery::finish(const std::vector<std::string>& names) {
  using Outcome = trace::RecoveredTrace::Outcome;
  for (const std::string& name : names) {
    const auto finished =
        trace::finishTrace(trace::partOf(folder_ / (name + ".mcap")), [this](double) { return !stops_; });
    if (!finished && stops_) return;  // the next start goes on
    const bool holds_nothing =
        finished && (finished->outcome == Outcome::empty || finished->outcome == Outcome::hopeless);
    if (holds_nothing) {
      news_(
          {0, true, "lose", name,
           fmt::format("trace {} was cut off by a crash before its first ticks were on the disk: nothing of "
                       "it could be recovered",
                       name)});
    }
    changed_();
    const std::lock_guard lock(mutex_);
    auto& [recovered, problems] = status_;
    if (!finished) {
      problems.push_back("recovery: " + finished.error().text());
    } else if (finished->outcome == Outcome::hopeless) {
      problems.push_back(
          fmt::format("recovery: nothing whole is in {} (hapticctl trace delete {} deletes it)",
                      finished->original.string(), finished->original.filename().string()));
    } else if (!holds_nothing) {
      ++recovered;
      if (finished->outcome != Outcome::rewritten) continue;
      problems.push_back(
          fmt::format("recovery: {} was damaged: {} bytes of it could not be kept in {} (hapticctl "
                      "trace delete {} deletes the damaged original)",
                      finished->original.string(), finished->bytes_lost, finished->file.string(),
                      finished->original.filename().string()));
    }
  }
}

}  // namespace hapticd::daemon

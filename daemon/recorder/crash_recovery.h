// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "config/base/error.h"
#include "daemon/base/box.h"

namespace hapticd::daemon {

/// Finishes the traces that a crash has left open, once, in a thread of its own.
class CrashRecovery {
 public:
  /// What has been done so far.
  struct Status {
    std::uint64_t recovered = 0;
    std::vector<std::string> problems;  ///< each with its remedy
  };

  /// `news` and `changed` (a trace of the folder has changed) are called in the thread.
  CrashRecovery(std::filesystem::path folder, std::function<void(TraceNews)> news,
                std::function<void()> changed)
      : folder_(std::move(folder)), news_(std::move(news)), changed_(std::move(changed)) {}
  ~CrashRecovery() { stop(); }
  CrashRecovery(const CrashRecovery&) = delete;
  CrashRecovery& operator=(const CrashRecovery&) = delete;

  /// To be called before there is a trace of this process.  Errors: no thread can be started.
  base::Result<void> begin();
  /// Ends within a chunk; the next start of the daemon goes on.
  void stop();

  /// Thread: any.
  Status status() const;

 private:
  void finish(const std::vector<std::string>& names);

  const std::filesystem::path folder_;
  const std::function<void(TraceNews)> news_;
  const std::function<void()> changed_;
  mutable std::mutex mutex_;  // protects the next member
  Status status_;
  std::atomic<bool> stops_ = false;
  std::thread thread_;
};

}  // namespace hapticd::daemon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <expected>
#include <functional>
#include <future>
#include <optional>
#include <string>
#include <vector>

#include "daemon/state/start_settings.h"
#include "daemon/state/state_worker.h"

namespace hapticd::daemon {

/// Reads the settings again on a thread of its own, so that the caller never waits for the disk.
/// Thread: one caller.
class SettingsReader {
 public:
  using Clock = std::chrono::steady_clock;
  using Outcome = std::expected<StartSettings, std::vector<base::Error>>;

  /// `read` may block, and may refer only to objects that live as long as the process. `name`: describes for
  /// people what it reads.
  SettingsReader(std::function<Outcome()> read, std::string name)
      : read_(std::move(read)), name_(std::move(name)) {}

  /// Starts to read; not to be called while reading().
  void begin(Clock::time_point now);
  bool reading() const noexcept { return reading_.valid(); }
  /// Returns what was read, once; nothing while reading or before begin(). After kPatience the result is an
  /// error, and what is read later is discarded.
  std::optional<Outcome> outcome(Clock::time_point now);

  static constexpr std::chrono::seconds kPatience{10};

 private:
  std::function<Outcome()> read_;
  std::string name_;
  std::future<Outcome> reading_;
  Clock::time_point deadline_;
  StateWorker worker_{std::chrono::seconds(1)};  // a job that only reads may be abandoned soon
};

}  // namespace hapticd::daemon

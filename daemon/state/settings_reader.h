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

/// Reads the settings again on a thread of its own, so that whoever asks never waits for the disk.
/// Thread: one caller.
class SettingsReader {
 public:
  using Clock = std::chrono::steady_clock;
  using Outcome = std::expected<StartSettings, std::vector<config::Error>>;

  /// `read` may block; it refers to nothing that ends before the process. `name`: of what it reads, for
  /// people.
  SettingsReader(std::function<Outcome()> read, std::string name)
      : read_(std::move(read)), name_(std::move(name)) {}

  /// Not while reading().
  void begin(Clock::time_point now);
  bool reading() const noexcept { return reading_.valid(); }
  /// What has been read, once; nothing while it goes on, and when nobody has begun. After kPatience it is an
  /// error: what comes later is thrown away.
  std::optional<Outcome> outcome(Clock::time_point now);

  static constexpr std::chrono::seconds kPatience{10};

 private:
  std::function<Outcome()> read_;
  std::string name_;
  std::future<Outcome> reading_;
  Clock::time_point deadline_;
  StateWorker worker_{std::chrono::seconds(1)};  // the end need not wait long for what is only read
};

}  // namespace hapticd::daemon

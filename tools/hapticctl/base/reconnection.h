// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <utility>

#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {

/// Whether waiting may help: the daemon is away or starting, as during a restart, or has no room for another
/// client. Other errors are refusals, which a repeated call would meet again.
bool mayPass(const ClientError& error);

/// The waiting between attempts to reach a daemon again: 0.25 s at first, twice as long each time, 5 s at
/// most, so that a restart is noticed soon and a daemon that stays away costs next to nothing.
class Reconnection {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kFirstWait{250};
  static constexpr std::chrono::milliseconds kMaxWait{5000};

  /// signals: the descriptor of takeSignals(). goesOn: called for each signal that has arrived; false: give
  /// up. deadline: when to give up at the latest.
  Reconnection(int signals, std::function<bool()> goesOn, Clock::time_point deadline)
      : signals_(signals), goesOn_(std::move(goesOn)), deadline_(deadline) {}

  /// Waits, then calls `attempt`, until it succeeds or fails with an error that cannot pass (mayPass).
  /// Returns nothing if it was given up.
  template <typename T>
  std::optional<ClientResult<T>> retry(const std::function<ClientResult<T>()>& attempt) {
    for (auto wait = kFirstWait; waited(wait); wait = std::min(2 * wait, kMaxWait)) {
      ClientResult<T> result = attempt();
      if (result || !mayPass(result.error())) return result;
    }
    return std::nullopt;
  }

 private:
  /// Waits; returns false if it was given up meanwhile.
  bool waited(std::chrono::milliseconds wait) const;

  int signals_;
  std::function<bool()> goesOn_;
  Clock::time_point deadline_;
};

}  // namespace hapticd::tools

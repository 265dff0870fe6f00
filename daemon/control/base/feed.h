// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "config/base/rate_limit.h"
#include "daemon/control/server/varlink_connection.h"
#include "daemon/control/server/varlink_message.h"

namespace hapticd::daemon {

/// A stream into the box that one program may feed at a time: the first that feeds something usable has it,
/// until its connection ends or nothing has come from it for a while. What has become unusable keeps it, as
/// of a tracker that has lost its marker: another program may track another body. Thread: control thread
/// only.
class Feed {
 public:
  using Clock = base::RateLimit::Clock;

  /// what: "poses of frame phantom".
  Feed(std::string what, int most_per_second);

  /// To be asked first: why the caller may not feed now, because another one has it and has sent something
  /// within `patience`; empty: it may.
  std::string refusal(const Caller& caller, Clock::time_point now, Clock::duration patience);
  /// Whether one more may be taken.
  bool allows(Clock::time_point now) { return rate_.allows(now); }
  /// The error where it may not.
  Reply limited() const { return {"io.hapticd.Control.FeedLimited", {{"limit", most_per_second_}}}; }
  /// Notes that something from the caller is used. Returns whether a feed begins with it, which is logged.
  bool used(const Caller& caller, Clock::time_point now);
  void closed(ConnectionId connection);

  const std::string& what() const { return what_; }
  /// Adds what is wrong with its clients, with the remedy.
  void addWarnings(Clock::time_point now, std::vector<std::string>& list) const;

 private:
  std::string what_;
  int most_per_second_;
  base::RateLimit rate_;
  Caller owner_;
  Clock::time_point heard_;  // something from the owner
  Clock::time_point used_;   // likewise
  Caller refused_;           // the newest other one
  Clock::time_point refused_at_;
};

}  // namespace hapticd::daemon

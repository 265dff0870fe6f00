// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <utility>

#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::ros {

/// A running hapticd: the stream of its ticks, and calls beside it. Every wait has a time limit, and ends
/// when the descriptor for interruption becomes readable. Thread: one at a time.
class BoxLink {
 public:
  /// rate_hz: of the ticks, 1..1000; ticks in which the mode, the buttons or the handle's condition change
  /// come in addition.
  static ClientResult<BoxLink> open(const std::string& socket, int rate_hz, int interrupt);

  /// The next reply of io.hapticd.Status.Ticks, with the fields that hapticd-ros reads.
  ClientResult<Json> nextTicks() { return ticks_.next(kSilence); }
  /// Of the interface io.hapticd.Status.
  ClientResult<Json> call(const std::string& method, const Json& parameters = Json::object());

 private:
  /// After which hapticd hangs: ticks come in batches without end, and calls are answered at once.
  static constexpr std::chrono::milliseconds kSilence{3000};

  BoxLink(VarlinkClient ticks, VarlinkClient calls) : ticks_(std::move(ticks)), calls_(std::move(calls)) {}

  VarlinkClient ticks_;
  VarlinkClient calls_;
};

}  // namespace hapticd::tools::ros

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/control/base/method_context.h"
#include "rt/base/rate_choice.h"
#include "rt/loop/loop_state.h"

namespace hapticd::daemon {

/// The streams of Ticks: the ticks of the force loop, all or at a rate, in batches. The newest kTicksKept
/// ticks wait for clients; a tick that a client has not taken by then is lost to its stream, and counted
/// there. Thread: control thread only.
class TickStreams {
 public:
  static constexpr std::size_t kTicksKept = 4096;  ///< about 4 s at 1 kHz
  static constexpr std::size_t kMaxStreams = 8;    ///< bounds the time that they take from other clients
  static constexpr std::size_t kMaxFields = 80;    ///< and kMaxPerReply: a reply stays below kMaxReplyBytes
  static constexpr std::size_t kMaxPerReply = 80;
  static constexpr std::size_t kMaxChanges = 16;

  std::vector<Method> methods();

  void onTick(const rt::Tick& tick);
  void feed(Replies& replies);
  void closed(ConnectionId connection);

 private:
  using Clock = std::chrono::steady_clock;

  /// Which ticks a stream gets.
  struct Choice {
    std::optional<rt::RateChoice> rate = {};  // nothing: all ticks
    std::vector<std::size_t> changes = {};    // places of fields whose change chooses a tick, too
    std::string values = {};                  // of those, as bytes, in the newest tick

    bool takes(const rt::Tick& tick);
  };
  struct Stream {
    ConnectionId connection = 0;
    Clock::duration interval{};
    Clock::time_point due;
    std::vector<std::size_t> fields;  // places in the order of visitFields()
    Choice choice;
    std::uint64_t next = 0;         // index of the next tick among all received, from 0
    std::uint64_t next_number = 0;  // the number expected of the next tick; 0: any
    std::uint64_t lost = 0;
  };

  void ticks(const Call& call, const Caller& caller, Replies& replies);
  bool send(Stream& stream, Replies& replies) const;
  const rt::Tick& at(std::uint64_t place) const { return kept_[place % kTicksKept]; }

  std::vector<rt::Tick> kept_;  // allocated with the first stream
  std::uint64_t count_ = 0;     // ticks received while there was a stream
  std::vector<Stream> streams_;
};

}  // namespace hapticd::daemon

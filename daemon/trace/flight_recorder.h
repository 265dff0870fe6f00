// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "config/error.h"
#include "drivers/trace/trace_writer.h"

namespace hapticd::daemon {

/// The newest ticks, with what belongs to them, in memory.
/// Thread: trace thread.
class FlightRecorder {
 public:
  /// Holds `duration_s` of ticks at `rate_hz`; 0: nothing.  RT: not safe (allocates it all).
  FlightRecorder(double duration_s, double rate_hz);

  void add(const rt::Tick& tick);
  void add(const drivers::ModelRecord& model);
  void add(const drivers::DirectiveRecord& directive);
  void add(const drivers::EventRecord& event);

  bool empty() const noexcept { return held_ == 0; }
  /// Of ticks that are held.
  double duration_s() const noexcept { return static_cast<double>(held_) / rate_hz_; }

  /// Everything that is held, in the order of time within each channel; it stays held.
  /// Errors: the writer's.
  config::Result<void> writeTo(drivers::TraceWriter& writer) const;

 private:
  const rt::Tick& oldest() const { return ticks_[(next_ + ticks_.size() - held_) % ticks_.size()]; }
  void forgetOldRecords();

  double rate_hz_;
  std::vector<rt::Tick> ticks_;  // a ring
  std::size_t next_ = 0;
  std::size_t held_ = 0;
  std::deque<drivers::ModelRecord> models_;
  std::deque<drivers::DirectiveRecord> directives_;  // from the one that the oldest tick obeyed on
  std::deque<drivers::EventRecord> events_;
};

}  // namespace hapticd::daemon

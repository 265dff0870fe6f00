// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "config/error.h"
#include "drivers/trace/trace_writer.h"

namespace hapticd::daemon {

/// Keeps the newest ticks, and the records that belong to them, in memory.
/// Thread: trace thread.
class FlightRecorder {
 public:
  /// Holds `duration_s` of ticks at `rate_hz`; 0: nothing.  RT: not safe (allocates all memory).
  FlightRecorder(double duration_s, double rate_hz);

  void add(const rt::Tick& tick);
  void add(const drivers::ModelRecord& model);
  void add(const drivers::DirectiveRecord& directive);
  void add(const drivers::AdditionsRecord& additions);
  void add(const drivers::EventRecord& event);

  bool empty() const noexcept { return held_ == 0; }
  /// The duration of the ticks that it holds.
  double duration_s() const noexcept { return static_cast<double>(held_) / rate_hz_; }

  /// Writes everything that it holds, in the order of time within each channel, and keeps it.
  /// Errors: those of the writer.
  config::Result<void> writeTo(drivers::TraceWriter& writer) const;

 private:
  const rt::Tick& oldest() const { return ticks_[(next_ + ticks_.size() - held_) % ticks_.size()]; }
  void forgetOldRecords();
  void forgetOldestAdditions();

  double rate_hz_;
  std::vector<rt::Tick> ticks_;  // a ring buffer
  std::size_t next_ = 0;
  std::size_t held_ = 0;
  std::deque<drivers::ModelRecord> models_;
  std::deque<drivers::DirectiveRecord> directives_;  // starts with the one that the oldest tick obeyed
  std::deque<drivers::AdditionsRecord> additions_;   // the same for fixtures and regions
  std::size_t additions_bytes_ = 0;
  std::deque<drivers::EventRecord> events_;
};

}  // namespace hapticd::daemon

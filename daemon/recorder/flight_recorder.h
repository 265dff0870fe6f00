// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "config/base/error.h"
#include "daemon/trace/writer/trace_writer.h"
#include "rt/loop/loop_state.h"

namespace hapticd::daemon {

/// When the flight recorder is written out after a fault or a burst of overruns: a second after it, so that
/// the dump has what follows. A burst soon after a dump waits until the flight recorder holds nothing that is
/// in that dump, so that a machine that is late again and again writes each tick once. A fault does not wait,
/// because it takes a person to end it.
/// All times are of CLOCK_MONOTONIC.  Thread: one.
class DumpSchedule {
 public:
  /// `held_s`: duration of what the flight recorder holds, in seconds; 0: no dump is ever due.
  explicit DumpSchedule(double held_s);

  /// Takes each tick in the order of their numbers.
  void add(const rt::Tick& tick);
  /// Returns the label of the dump that is due at `now_ns`, once.
  std::optional<std::string> takeDue(std::int64_t now_ns);
  /// The same for a dump that need not be due, at the end of the daemon.
  std::optional<std::string> takeWaiting();

 private:
  struct Dump {
    std::int64_t due_ns;
    std::string label;
  };

  std::int64_t held_ns_;
  rt::Mode last_mode_ = rt::Tick{}.mode;
  rt::Cause last_cause_ = rt::Tick{}.cause;
  std::optional<Dump> waiting_;
  std::optional<std::int64_t> last_dump_ns_;
};

/// Keeps the newest ticks, and the records that belong to them, in memory.
/// Thread: trace thread.
class FlightRecorder {
 public:
  /// Holds `duration_s` of ticks at `rate_hz`; 0: nothing.  RT: not safe (allocates all memory).
  FlightRecorder(double duration_s, double rate_hz);

  void add(const rt::Tick& tick);
  /// `record`: of a model, directive, fixtures and regions, pose or event.
  template <typename Record>
  void add(const Record& record);

  bool empty() const noexcept { return held_ == 0; }
  /// The duration of the ticks that it holds.
  double duration_s() const noexcept { return static_cast<double>(held_) / rate_hz_; }

  /// Writes everything that it holds, in the order of time within each channel, and keeps it.
  /// Errors: those of the writer.
  base::Result<void> writeTo(trace::TraceWriter& writer) const;

 private:
  const rt::Tick& oldest() const { return ticks_[(next_ + ticks_.size() - held_) % ticks_.size()]; }
  void forgetOldRecords();
  void forgetOldestAdditions();
  template <typename Record>
  std::deque<Record>& held() {
    return std::get<std::deque<Record>>(records_);
  }

  double rate_hz_;
  std::vector<rt::Tick> ticks_;  // a ring buffer
  std::size_t next_ = 0;
  std::size_t held_ = 0;
  // directives, and fixtures and regions, start with those that the oldest tick obeyed
  std::tuple<std::deque<trace::DirectiveRecord>, std::deque<trace::AdditionsRecord>,
             std::deque<trace::ModelRecord>, std::deque<trace::PoseRecord>, std::deque<trace::EventRecord>>
      records_;
  std::size_t additions_bytes_ = 0;
};

}  // namespace hapticd::daemon

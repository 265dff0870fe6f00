// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "rt/loop_state.h"

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

}  // namespace hapticd::daemon

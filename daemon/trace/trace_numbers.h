// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

#include "drivers/trace/wall_clock.h"

namespace hapticd::daemon {

/// Numbers the traces of a box in the order in which they begin, from one start of the daemon to the next.
/// The wall clock cannot order them: without a battery it starts in the past. Thread: one.
class TraceNumbers {
 public:
  struct Next {
    std::uint64_t number = 0;
    bool clock_is_set = false;
  };

  /// Keeps the count in the state folder, in the file trace_count.yaml.
  explicit TraceNumbers(std::filesystem::path state_folder) : folder_(std::move(state_folder)) {}

  /// Counts a trace that begins now. Where the file is missing or damaged, or cannot be written, the count
  /// goes on from the largest number in the folder of the traces.
  Next next(const drivers::WallClock& clock);

 private:
  struct Count {
    std::uint64_t number = 0;    ///< of the last trace
    std::int64_t latest_ns = 0;  ///< CLOCK_REALTIME of the last trace that began while it was set
  };
  std::optional<Count> fromFile() const;
  Count fromTraces() const;

  std::filesystem::path folder_;
  std::optional<Count> last_;    ///< nothing: not read yet
  bool traces_counted_ = false;  ///< it is not less than in the folder of the traces
};

}  // namespace hapticd::daemon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "config/error.h"
#include "drivers/trace/fields.h"
#include "drivers/trace/messages.h"
#include "drivers/trace/trace_reader.h"
#include "tools/lib/trace/columns.h"
#include "tools/lib/trace/trace_selection.h"

namespace hapticd::tools {

/// The records of a trace within a selected time.
class SelectedTrace {
 public:
  /// Errors: those of readTrace(), a selection that is empty or impossible.
  static config::Result<SelectedTrace> open(const std::filesystem::path& file,
                                            const TraceSelection& selection);

  const std::filesystem::path& file() const { return file_; }
  /// Errors: the trace has no channel of ticks, because another program filtered it.
  config::Result<void> requireTicks() const {
    return info_.require(file_, drivers::kChannelName<rt::Tick>.topic);
  }
  /// The time, CLOCK_MONOTONIC, from which seconds() counts.
  std::int64_t start_ns() const { return start_ns_; }
  /// CLOCK_REALTIME minus CLOCK_MONOTONIC.
  std::int64_t realtimeOffset_ns() const { return info_.realtime_offset_ns; }
  template <typename Record>
  bool lacks(std::string_view field) const {
    return info_.lacks(drivers::kChannelName<Record>.topic, field);
  }
  /// Like visitFields(), but without the fields that the trace lacks.
  template <typename Record>
  void visitKnown(const Record& record, auto&& visit) const {
    if (info_.missing.empty()) return drivers::visitFields(record, visit);
    drivers::visitFields(record, [&](std::string_view name, const auto& field) {
      if (!lacks<Record>(name)) visit(name, field);
    });
  }
  /// Like applies(); if the trace does not record the law of its ticks, every field applies.
  template <typename Record>
  bool fieldApplies(const Record& record, std::string_view field) const {
    return applies(record, field) || lacks<Record>("law");
  }
  double seconds(std::int64_t time_ns) const;
  /// Seconds since 1970 in UTC; a double resolves tenths of microseconds.
  double realtimeSeconds(std::int64_t time_ns) const;

  /// The number of ticks in the selected time.
  config::Result<std::uint64_t> countTicks(const Progress& progress) const;
  /// Reads the records in the selected time, with at most as many ticks as are selected.
  config::Result<drivers::TraceInfo> read(drivers::TraceVisitor visitor, const Progress& progress) const;
  /// Reads the records in the selected time, with all ticks.
  config::Result<drivers::TraceInfo> readAll(drivers::TraceVisitor visitor, const Progress& progress) const;

  /// Whether that time, CLOCK_MONOTONIC, is selected.
  bool holds(std::int64_t time_ns) const;

 private:
  SelectedTrace(std::filesystem::path file, const TraceSelection& selection)
      : file_(std::move(file)), selection_(selection) {}

  std::filesystem::path file_;
  TraceSelection selection_;
  std::int64_t start_ns_ = 0;
  drivers::TraceInfo info_;  ///< of the part up to the first tick; of the whole trace if it has no ticks
};

}  // namespace hapticd::tools

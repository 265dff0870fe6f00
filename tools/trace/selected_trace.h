// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "config/error.h"
#include "drivers/trace/fields.h"
#include "drivers/trace/messages.h"
#include "drivers/trace/trace_reader.h"
#include "tools/trace/columns.h"
#include "tools/trace/trace_selection.h"

namespace hapticd::tools {

/// What a selection leaves of a trace.
class SelectedTrace {
 public:
  /// Errors: those of readTrace(), a selection that is none.
  static config::Result<SelectedTrace> open(const std::filesystem::path& file,
                                            const TraceSelection& selection);

  const std::filesystem::path& file() const { return file_; }
  /// Errors: the trace has no channel of ticks, as one that was filtered.
  config::Result<void> requireTicks() const {
    return info_.require(file_, drivers::kChannelName<rt::Tick>.topic);
  }
  /// CLOCK_MONOTONIC that times in seconds count from.
  std::int64_t start_ns() const { return start_ns_; }
  /// CLOCK_REALTIME minus CLOCK_MONOTONIC.
  std::int64_t realtimeOffset_ns() const { return info_.realtime_offset_ns; }
  template <typename Record>
  bool lacks(std::string_view field) const {
    return info_.lacks(drivers::kChannelName<Record>.topic, field);
  }
  /// visitFields() without the fields that the trace lacks.
  template <typename Record>
  void visitKnown(const Record& record, auto&& visit) const {
    if (info_.missing.empty()) return drivers::visitFields(record, visit);
    drivers::visitFields(record, [&](std::string_view name, const auto& field) {
      if (!lacks<Record>(name)) visit(name, field);
    });
  }
  /// applies(); of ticks that do not say their law, every field does.
  template <typename Record>
  bool says(const Record& record, std::string_view field) const {
    return applies(record, field) || lacks<Record>("law");
  }
  double seconds(std::int64_t time_ns) const;
  /// UTC since 1970; a floating-point number tells tenths of microseconds apart.
  double realtimeSeconds(std::int64_t time_ns) const;

  /// Ticks in the selected time, whatever their number.
  config::Result<std::uint64_t> countTicks(const Progress& progress) const;
  /// What is in the selected time, and no more ticks than are wanted.
  config::Result<drivers::TraceInfo> read(drivers::TraceVisitor visitor, const Progress& progress) const;
  /// The same with all ticks of that time.
  config::Result<drivers::TraceInfo> readAll(drivers::TraceVisitor visitor, const Progress& progress) const;

 private:
  SelectedTrace(std::filesystem::path file, const TraceSelection& selection)
      : file_(std::move(file)), selection_(selection) {}
  bool holds(std::int64_t time_ns) const;

  std::filesystem::path file_;
  TraceSelection selection_;
  std::int64_t start_ns_ = 0;
  drivers::TraceInfo info_;  ///< up to the first tick; of all of a trace without ticks
};

}  // namespace hapticd::tools

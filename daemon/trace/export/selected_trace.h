// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "config/base/error.h"
#include "daemon/trace/format/messages.h"
#include "daemon/trace/format/records.h"
#include "daemon/trace/reader/trace_reader.h"
#include "rt/laws/law_table.h"
#include "rt/loop/loop_state.h"

namespace hapticd::trace {

/// The part of a trace to use.
struct TraceSelection {
  double from_s = 0;  ///< since the first tick; in a trace without ticks since its first message
  double to_s = std::numeric_limits<double>::infinity();
  /// Use at most that many ticks, at least 2; 0: all. The ticks are divided into stretches of equal length,
  /// and of each the ticks with the least and the largest |command force| are used, so that no peak is lost.
  std::size_t most_ticks = 0;
};

/// Called now and then with the share of the work that is done, 0..1; may be empty.
using Progress = std::function<void(double)>;

/// Reduces `count` items to at most `most`, in their order: of each stretch it keeps the items with the least
/// and the largest value. NaN counts as the largest value. If there are no more than `most` items, it keeps
/// all.
template <typename Item>
class Peaks {
 public:
  using Emit = std::function<void(const Item&)>;

  /// `most` >= 2.
  Peaks(std::uint64_t count, std::size_t most, Emit emit)
      : count_(count), stretches_(count <= most ? 0 : most / 2), emit_(std::move(emit)) {}

  void add(double value, const Item& item) {
    const std::uint64_t index = index_++;
    if (stretches_ == 0) return emit_(item);
    // in floating point, because the product may exceed any integer; rounding may move a border by one item
    const auto stretch = static_cast<std::uint64_t>(static_cast<double>(index) / static_cast<double>(count_) *
                                                    static_cast<double>(stretches_));
    if (stretch != stretch_) finish();
    stretch_ = stretch;
    const double key = std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
    if (!least_ || key < least_->value) least_ = {index, key, item};
    if (!largest_ || key > largest_->value) largest_ = {index, key, item};
  }

  /// To be called after the last item.
  void finish() {
    if (least_) {
      const auto& [first, second] = std::minmax(*least_, *largest_, earlier);
      emit_(first.item);
      if (second.index != first.index) emit_(second.item);
    }
    least_.reset();
    largest_.reset();
  }

 private:
  struct Found {
    std::uint64_t index;
    double value;
    Item item;
  };
  static bool earlier(const Found& a, const Found& b) { return a.index < b.index; }

  std::uint64_t count_;
  std::uint64_t stretches_;
  Emit emit_;
  std::uint64_t index_ = 0;
  std::uint64_t stretch_ = 0;
  std::optional<Found> least_;
  std::optional<Found> largest_;
};

/// Whether laws without a proxy lack that field of ticks.
constexpr bool needsProxy(std::string_view field) {
  return field == "contact" || field == "proxy_m_in_world";
}

/// The records of a trace within a selected time.
class SelectedTrace {
 public:
  /// Errors: those of readTrace(), a selection that is empty or impossible.
  static base::Result<SelectedTrace> open(const std::filesystem::path& file, const TraceSelection& selection);

  const std::filesystem::path& file() const { return file_; }
  /// What it says of itself, with its attachments; the counts are those up to its first tick.
  const TraceInfo& info() const { return info_; }
  /// Errors: the trace has no channel of ticks, because another program filtered it.
  base::Result<void> requireTicks() const { return info_.require(file_, kChannelName<rt::Tick>.topic); }
  /// The time, CLOCK_MONOTONIC, from which seconds() counts.
  std::int64_t start_ns() const { return start_ns_; }
  /// CLOCK_REALTIME minus CLOCK_MONOTONIC.
  std::int64_t realtimeOffset_ns() const { return info_.realtime_offset_ns; }
  template <typename Record>
  bool lacks(std::string_view field) const {
    return info_.lacks(kChannelName<Record>.topic, field);
  }
  /// Whether a field of a tick has a meaning. If the trace does not record the law of its ticks, every one
  /// has.
  bool fieldApplies(const rt::Tick& tick, std::string_view field) const {
    return rt::hasProxy(tick.law) || !needsProxy(field) || lacks<rt::Tick>("law");
  }
  double seconds(std::int64_t time_ns) const;
  /// Seconds since 1970 in UTC; a double resolves tenths of microseconds.
  double realtimeSeconds(std::int64_t time_ns) const;

  /// Reads the records in the selected time, with at most as many ticks as are selected.
  base::Result<TraceInfo> read(TraceVisitor visitor, const Progress& progress) const;
  /// Reads the records in the selected time, with all ticks.
  base::Result<TraceInfo> readAll(TraceVisitor visitor, const Progress& progress) const;

  /// Whether that time, CLOCK_MONOTONIC, is selected.
  bool holds(std::int64_t time_ns) const;

 private:
  SelectedTrace(std::filesystem::path file, const TraceSelection& selection)
      : file_(std::move(file)), selection_(selection) {}

  std::filesystem::path file_;
  TraceSelection selection_;
  std::int64_t start_ns_ = 0;
  TraceInfo info_;  ///< of the part up to the first tick; of the whole trace if it has no ticks
};

}  // namespace hapticd::trace

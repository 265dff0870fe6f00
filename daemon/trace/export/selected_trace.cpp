// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/export/selected_trace.h"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "rt/base/clock.h"

namespace hapticd::trace {

namespace {

base::Result<void> check(const TraceSelection& selection) {
  if (!(selection.from_s <= selection.to_s)) {
    return base::failure(
        "time", fmt::format("from {} s to {} s is not a time range", selection.from_s, selection.to_s),
        "begin before the end; seconds since the first tick");
  }
  if (selection.most_ticks == 1) {
    return base::failure("rows", "1 is too few", "give 2 or more, or 0 for all");
  }
  return {};
}

Progress partOf(const Progress& progress, double begin, double end) {
  if (!progress) return {};
  return [progress, begin, end](double share) { progress(begin + share * (end - begin)); };
}

}  // namespace

base::Result<SelectedTrace> SelectedTrace::open(const std::filesystem::path& file,
                                                const TraceSelection& selection) {
  if (auto checked = check(selection); !checked) return std::unexpected(checked.error());
  SelectedTrace trace(file, selection);
  std::optional<std::int64_t> first_ns;
  const auto note = [&first_ns](const auto& record) {
    if (!first_ns) first_ns = timeOf(record);
    return true;
  };
  const auto stopAtTick = [&first_ns](const rt::Tick& tick) {
    first_ns = timeOf(tick);
    return false;
  };
  auto info = readTrace(
      file, {.tick = stopAtTick, .model = note, .directive = note, .event = note, .snapshot = note});
  if (!info) return std::unexpected(info.error());
  trace.start_ns_ = first_ns.value_or(0);
  trace.info_ = std::move(*info);
  return trace;
}

double SelectedTrace::seconds(std::int64_t time_ns) const {
  return (static_cast<double>(time_ns) - static_cast<double>(start_ns_)) /
         static_cast<double>(rt::kNsPerSecond);
}

double SelectedTrace::realtimeSeconds(std::int64_t time_ns) const {
  return (static_cast<double>(time_ns) + static_cast<double>(info_.realtime_offset_ns)) /
         static_cast<double>(rt::kNsPerSecond);
}

bool SelectedTrace::holds(std::int64_t time_ns) const {
  const double time_s = seconds(time_ns);
  // records before the first tick belong to the beginning
  return (selection_.from_s <= time_s || selection_.from_s <= 0) && time_s <= selection_.to_s;
}

base::Result<TraceInfo> SelectedTrace::readAll(TraceVisitor visitor, const Progress& progress) const {
  const auto keepSelected = [this]<typename Record>(std::function<bool(const Record&)>& visit) {
    if (!visit) return;
    visit = [this, visit](const Record& record) { return !holds(timeOf(record)) || visit(record); };
  };
  keepSelected(visitor.tick);
  keepSelected(visitor.model);
  keepSelected(visitor.directive);
  keepSelected(visitor.event);
  keepSelected(visitor.depth);
  visitor.progress = progress;
  return readTrace(file_, visitor);
}

base::Result<TraceInfo> SelectedTrace::read(TraceVisitor visitor, const Progress& progress) const {
  if (!visitor.tick || selection_.most_ticks == 0) return readAll(std::move(visitor), progress);
  std::uint64_t ticks = 0;
  auto counted =
      readAll({.tick = [&ticks](const rt::Tick&) { return ++ticks > 0; }}, partOf(progress, 0, 0.5));
  if (!counted) return counted;
  bool goes_on = true;
  Peaks<rt::Tick> peaks(ticks, selection_.most_ticks, [&goes_on, visit = visitor.tick](const rt::Tick& tick) {
    goes_on = goes_on && visit(tick);
  });
  visitor.tick = [&peaks, &goes_on](const rt::Tick& tick) {
    peaks.add(norm(tick.command_force_n_in_world), tick);
    return goes_on;
  };
  auto info = readAll(std::move(visitor), partOf(progress, 0.5, 1));
  if (info) peaks.finish();
  return info;
}

}  // namespace hapticd::trace

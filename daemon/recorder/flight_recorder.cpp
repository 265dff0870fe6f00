// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder/flight_recorder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <limits>
#include <set>
#include <utility>

#include "daemon/trace/format/records.h"
#include "daemon/trace/reader/trace_folder.h"
#include "rt/base/clock.h"

namespace hapticd::daemon {
namespace {

using rt::kNsPerSecond;

constexpr std::int64_t kAfterFault_ns = kNsPerSecond;

}  // namespace

DumpSchedule::DumpSchedule(double held_s)
    : held_ns_(static_cast<std::int64_t>(held_s * static_cast<double>(kNsPerSecond))) {}

void DumpSchedule::add(const rt::Tick& tick) {
  const bool faulted = std::exchange(last_mode_, tick.mode) != tick.mode && tick.mode == rt::Mode::faulted;
  const bool burst =
      std::exchange(last_cause_, tick.cause) != tick.cause && tick.cause == rt::Cause::overrun_burst;
  if (held_ns_ <= 0 || !(faulted || burst)) return;
  std::int64_t due_ns = tick.planned_ns + kAfterFault_ns;
  if (!faulted && last_dump_ns_) due_ns = std::max(due_ns, *last_dump_ns_ + held_ns_);
  if (waiting_ && waiting_->due_ns <= due_ns) return;
  waiting_ = Dump{due_ns, std::string(faulted ? trace::kFaultLabel : trace::kOverrunBurstLabel)};
}

std::optional<std::string> DumpSchedule::takeDue(std::int64_t now_ns) {
  if (!waiting_ || now_ns < waiting_->due_ns) return std::nullopt;
  last_dump_ns_ = now_ns;
  return takeWaiting();
}

std::optional<std::string> DumpSchedule::takeWaiting() {
  if (!waiting_) return std::nullopt;
  return std::exchange(waiting_, std::nullopt)->label;
}

namespace {

/// Capacity for the other records, which are rare; of a flood of changes only the newest are kept.
constexpr std::size_t kMaxRecords = 10'000;

/// The same for poses: those of all frames at the largest rate for longer than the recorder's usual 10 s.
constexpr std::size_t kMaxPoses = 60'000;

/// The same for fixtures and tissue regions, which a program may change many times a second and of which a
/// record with a label image holds some hundred kilobytes.
constexpr std::size_t kMaxAdditionsBytes = std::size_t{32} << 20;

/// Without its solids, which records share.
std::size_t bytesOf(const trace::AdditionsRecord& additions) {
  return sizeof additions + additions.text.size() + additions.labels.bytes.size();
}

/// Memory of the solids that only older records than the newest hold: those of the newest are in use.
std::size_t bytesOfOldSolids(const std::deque<trace::AdditionsRecord>& additions) {
  std::set<const config::Solid*> counted;
  for (const auto& solid : additions.back().solids) counted.insert(solid.get());
  std::size_t bytes = 0;
  for (const trace::AdditionsRecord& record : additions) {
    for (const auto& solid : record.solids) bytes += counted.insert(solid.get()).second ? solid->bytes() : 0;
  }
  return bytes;
}

/// Whether the tick was computed with these fixtures and regions or with newer ones.
bool reached(const rt::Tick& tick, const trace::AdditionsRecord& additions) {
  return additions.fixture_generation <= tick.fixture_generation &&
         additions.tissue_generation <= tick.tissue_generation;
}

}  // namespace

FlightRecorder::FlightRecorder(double duration_s, double rate_hz)
    : rate_hz_(rate_hz), ticks_(static_cast<std::size_t>(std::llround(duration_s * rate_hz))) {}

void FlightRecorder::add(const rt::Tick& tick) {
  if (ticks_.empty()) return;
  ticks_[next_] = tick;
  next_ = (next_ + 1) % ticks_.size();
  if (held_ < ticks_.size()) ++held_;
}

template <typename Record>
void FlightRecorder::add(const Record& record) {
  if (ticks_.empty()) return;
  forgetOldRecords();
  std::deque<Record>& records = held<Record>();
  records.push_back(record);
  if constexpr (std::same_as<Record, trace::AdditionsRecord>) {
    additions_bytes_ += bytesOf(record);
    while (records.size() > 1 && additions_bytes_ + bytesOfOldSolids(records) > kMaxAdditionsBytes)
      forgetOldestAdditions();
  } else {
    constexpr std::size_t kMost = std::same_as<Record, trace::PoseRecord> ? kMaxPoses : kMaxRecords;
    while (records.size() > kMost) records.pop_front();
  }
}
template void FlightRecorder::add(const trace::ModelRecord&);
template void FlightRecorder::add(const trace::DirectiveRecord&);
template void FlightRecorder::add(const trace::AdditionsRecord&);
template void FlightRecorder::add(const trace::PoseRecord&);
template void FlightRecorder::add(const trace::EventRecord&);

void FlightRecorder::forgetOldestAdditions() {
  auto& additions = held<trace::AdditionsRecord>();
  additions_bytes_ -= bytesOf(additions.front());
  additions.pop_front();
}

void FlightRecorder::forgetOldRecords() {
  if (held_ == 0) return;
  const rt::Tick& oldest = this->oldest();
  auto& [directives, additions, models, poses, events] = records_;
  while (!models.empty() && models.front().model < oldest.scene_model) models.pop_front();
  while (directives.size() > 1 && directives[1].generation <= oldest.directive_generation) {
    directives.pop_front();
  }
  while (additions.size() > 1 && reached(oldest, additions[1])) forgetOldestAdditions();
  while (!poses.empty() && poses.front().number <= oldest.frame_pose) poses.pop_front();
  while (!events.empty() && events.front().time_ns < oldest.planned_ns) events.pop_front();
}

base::Result<void> FlightRecorder::writeTo(trace::TraceWriter& writer) const {
  base::Result<void> result;
  std::array<std::size_t, std::tuple_size_v<decltype(records_)>> written{};  // records, by kind
  // in the order of time, so that the chunks of the trace do not overlap
  const auto writeBefore = [&](const auto& records, std::size_t& next, std::int64_t time_ns) {
    for (; next < records.size() && trace::timeOf(records[next]) <= time_ns && result; ++next)
      result = writer.write(records[next]);
  };
  const auto writeRecordsBefore = [&](std::int64_t time_ns) {
    std::size_t kind = 0;
    std::apply([&](const auto&... kinds) { (writeBefore(kinds, written[kind++], time_ns), ...); }, records_);
  };
  for (std::size_t i = 0; i < held_ && result; ++i) {
    const rt::Tick& tick = ticks_[(next_ + ticks_.size() - held_ + i) % ticks_.size()];
    writeRecordsBefore(tick.planned_ns);
    if (result) result = writer.write(tick);
  }
  writeRecordsBefore(std::numeric_limits<std::int64_t>::max());
  return result;
}

}  // namespace hapticd::daemon

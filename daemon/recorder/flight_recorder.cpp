// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder/flight_recorder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "daemon/trace/format/fields.h"
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

template <typename Record>
void limit(std::deque<Record>& records) {
  while (records.size() > kMaxRecords) records.pop_front();
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

void FlightRecorder::add(const trace::ModelRecord& model) {
  if (ticks_.empty()) return;
  forgetOldRecords();
  models_.push_back(model);
  limit(models_);
}

void FlightRecorder::add(const trace::DirectiveRecord& directive) {
  if (ticks_.empty()) return;
  forgetOldRecords();
  directives_.push_back(directive);
  limit(directives_);
}

void FlightRecorder::add(const trace::AdditionsRecord& additions) {
  if (ticks_.empty()) return;
  forgetOldRecords();
  additions_.push_back(additions);
  additions_bytes_ += bytesOf(additions);
  while (additions_.size() > 1 && additions_bytes_ + bytesOfOldSolids(additions_) > kMaxAdditionsBytes)
    forgetOldestAdditions();
}

void FlightRecorder::add(const trace::PoseRecord& pose) {
  if (ticks_.empty()) return;
  forgetOldRecords();
  poses_.push_back(pose);
  while (poses_.size() > kMaxPoses) poses_.pop_front();
}

void FlightRecorder::add(const trace::EventRecord& event) {
  if (ticks_.empty()) return;
  forgetOldRecords();
  events_.push_back(event);
  limit(events_);
}

void FlightRecorder::forgetOldestAdditions() {
  additions_bytes_ -= bytesOf(additions_.front());
  additions_.pop_front();
}

void FlightRecorder::forgetOldRecords() {
  if (held_ == 0) return;
  const rt::Tick& oldest = this->oldest();
  while (!models_.empty() && models_.front().model < oldest.scene_model) models_.pop_front();
  while (directives_.size() > 1 && directives_[1].generation <= oldest.directive_generation) {
    directives_.pop_front();
  }
  while (additions_.size() > 1 && reached(oldest, additions_[1])) forgetOldestAdditions();
  while (!poses_.empty() && poses_.front().number <= oldest.frame_pose) poses_.pop_front();
  while (!events_.empty() && events_.front().time_ns < oldest.planned_ns) events_.pop_front();
}

base::Result<void> FlightRecorder::writeTo(trace::TraceWriter& writer) const {
  base::Result<void> result;
  // in the order of time, so that the chunks of the trace do not overlap
  const auto writeBefore = [&](const auto& records, auto& next, std::int64_t time_ns) {
    for (; next != records.end() && trace::timeOf(*next) <= time_ns && result; ++next) {
      result = writer.write(*next);
    }
  };
  auto directive = directives_.begin();
  auto additions = additions_.begin();
  auto model = models_.begin();
  auto pose = poses_.begin();
  auto event = events_.begin();
  const auto writeRecordsBefore = [&](std::int64_t time_ns) {
    writeBefore(directives_, directive, time_ns);
    writeBefore(additions_, additions, time_ns);
    writeBefore(models_, model, time_ns);
    writeBefore(poses_, pose, time_ns);
    writeBefore(events_, event, time_ns);
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

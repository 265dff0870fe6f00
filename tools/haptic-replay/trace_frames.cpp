// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-replay/trace_frames.h"

#include <utility>

namespace hapticd::tools {

void FramesInTrace::add(const drivers::DepthRecord& record, std::int64_t needed_ns) {
  kept_.erase(kept_.begin(), kept_.lower_bound(needed_ns));
  if (record.header.arrival_ns >= needed_ns) kept_.insert_or_assign(record.header.arrival_ns, record);
}

TraceFrames::State FramesInTrace::stateOf(std::int64_t arrival_ns) const {
  if (kept_.contains(arrival_ns)) return State::here;
  return arrivals_ns_.contains(arrival_ns) && arrival_ns > newest_read_ns_ ? State::ahead : State::missing;
}

config::Result<void> FramesInTrace::read(std::int64_t arrival_ns, rt::DepthFrame& frame) {
  kept_.erase(kept_.begin(), kept_.lower_bound(arrival_ns));
  newest_read_ns_ = arrival_ns;
  const std::string wrong = decoder_.decode(kept_.at(arrival_ns), frame);
  if (wrong.empty()) return {};
  return std::unexpected(config::Error{trace_.string(), wrong, "hapticctl trace info checks the whole file"});
}

FramesInFolder::FramesInFolder(drivers::RecordingReader recording, std::int64_t realtime_offset_ns)
    : recording_(std::move(recording)) {
  const auto& frames = recording_.frames();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames_.emplace(frames[i].realtime_ns - realtime_offset_ns, i);
  }
}

TraceFrames::State FramesInFolder::stateOf(std::int64_t arrival_ns) const {
  return frames_.contains(arrival_ns) ? State::here : State::missing;
}

config::Result<void> FramesInFolder::read(std::int64_t arrival_ns, rt::DepthFrame& frame) {
  const std::size_t index = frames_.at(arrival_ns);
  auto read = recording_.read(index, frame);
  if (recording_.frames()[index].exposure_ns) frame.exposure_ns += arrival_ns - frame.arrival_ns;
  frame.arrival_ns = arrival_ns;
  return read;
}

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-replay/trace_frames.h"

namespace hapticd::tools {

void TraceFrames::add(const drivers::DepthRecord& record, std::int64_t needed_ns) {
  kept_.erase(kept_.begin(), kept_.lower_bound(needed_ns));
  if (record.header.arrival_ns >= needed_ns) kept_.insert_or_assign(record.header.arrival_ns, record);
}

TraceFrames::State TraceFrames::stateOf(std::int64_t arrival_ns) const {
  if (kept_.contains(arrival_ns)) return State::here;
  return arrivals_ns_.contains(arrival_ns) && arrival_ns > newest_read_ns_ ? State::ahead : State::missing;
}

config::Result<void> TraceFrames::read(std::int64_t arrival_ns, rt::DepthFrame& frame) {
  kept_.erase(kept_.begin(), kept_.lower_bound(arrival_ns));
  newest_read_ns_ = arrival_ns;
  const std::string wrong = decoder_.decode(kept_.at(arrival_ns), frame);
  if (wrong.empty()) return {};
  return std::unexpected(config::Error{trace_.string(), wrong, "hapticctl trace info checks the whole file"});
}

}  // namespace hapticd::tools

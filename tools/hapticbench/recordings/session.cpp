// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/recordings/session.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace hapticd::tools {
namespace {

constexpr double kDeviceTicksPerTick = 60000;  // 60 MHz, of a Kinect
constexpr double kTick_ns = 1e6;
constexpr long kUsualPeriod = 33;
constexpr long kLongestPeriod = 500;  // longer ones are a recording that was interrupted

/// Ticks from one frame of the session to the next.
long ticksBetween(const rt::DepthFrame& frame, const rt::DepthFrame& next, bool is_kinect) {
  if (!is_kinect) return std::lround(static_cast<double>(next.arrival_ns - frame.arrival_ns) / kTick_ns);
  // in 32 bits, so that a counter that wraps around goes on
  const std::uint32_t passed = next.device_ticks - frame.device_ticks;
  return std::lround(passed / kDeviceTicksPerTick);
}

}  // namespace

std::vector<long> arrivalTicks(const BenchSequence& session) {
  std::vector<long> ticks{0};
  for (std::size_t i = 1; i < session.frames.size(); ++i) {
    const long period = ticksBetween(*session.frames[i - 1], *session.frames[i], isKinect(session.camera()));
    ticks.push_back(ticks.back() + (period >= 1 && period <= kLongestPeriod ? period : kUsualPeriod));
  }
  return ticks;
}

PlayedSession::PlayedSession(const BenchSequence& session, int first)
    : session_(session), first_(first), arrival_ticks_(arrivalTicks(session)) {
  for (auto& buffer : shown_) buffer = std::make_unique<rt::DepthFrame>();
}

int PlayedSession::frameOfSession(int index) const {
  const int last = static_cast<int>(session_.frames.size()) - 1;
  const int place = (first_ + index) % (2 * last);
  return place <= last ? place : 2 * last - place;
}

long PlayedSession::arrivalTick(int index) const {
  const int last = static_cast<int>(session_.frames.size()) - 1;
  const auto since = [this, last](int played) {
    const long turns = played / (2 * last);
    const int place = played % (2 * last);
    const long once = arrival_ticks_.back();
    const long within = place <= last ? arrival_ticks_[static_cast<std::size_t>(place)]
                                      : 2 * once - arrival_ticks_[static_cast<std::size_t>(2 * last - place)];
    return turns * 2 * once + within;
  };
  return since(first_ + index) - since(first_);
}

const rt::DepthFrame& PlayedSession::frame(int index) {
  rt::DepthFrame& shown = *shown_[static_cast<std::size_t>(index % kBuffers)];
  shown = *session_.frames[static_cast<std::size_t>(frameOfSession(index))];
  shown.sequence = static_cast<std::uint64_t>(index) + 1;
  shown.arrival_ns = arrivalTick(index) * 1'000'000;
  return shown;
}

FrameStream PlayedSession::stream() {
  return {[this](int index) -> const rt::DepthFrame& { return frame(index); },
          [this](int index) { return arrivalTick(index); }};
}

}  // namespace hapticd::tools

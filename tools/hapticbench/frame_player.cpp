// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/frame_player.h"

#include <array>
#include <memory>

namespace hapticd::tools {
namespace {

constexpr double kTickPeriod_s = 0.001;
constexpr std::int64_t kTickPeriod_ns = 1'000'000;

}  // namespace

FrameStream renderedStream(
    const std::function<void(long tick, std::uint64_t number, rt::DepthFrame& frame)>& render) {
  const auto frames = std::make_shared<std::array<rt::DepthFrame, 2>>();
  return {[frames, render](int index) -> const rt::DepthFrame& {
            rt::DepthFrame& frame = (*frames)[static_cast<std::size_t>(index % 2)];
            render(tickOfRegularFrame(index), static_cast<std::uint64_t>(index) + 1, frame);
            frame.arrival_ns = tickOfRegularFrame(index) * kTickPeriod_ns;
            return frame;
          },
          tickOfRegularFrame};
}

rt::Tick FramePlayer::tick(const rt::Vec3& hip_m_in_world) {
  frame_is_new_ = false;
  while (stream_.arrival_tick(frame_ + 1) <= next_tick_) {
    ++frame_;
    box_.show(stream_.frame(frame_), next_tick_ * kTickPeriod_ns);
    frame_is_new_ = true;
  }
  const rt::Vec3 velocity =
      next_tick_ == 0 ? rt::Vec3{} : (1 / kTickPeriod_s) * (hip_m_in_world - hip_before_);
  hip_before_ = hip_m_in_world;
  ++next_tick_;
  return box_.tick(hip_m_in_world, kTickPeriod_s, velocity);
}

}  // namespace hapticd::tools

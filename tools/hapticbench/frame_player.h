// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "rt/depth_frame.h"
#include "rt/loop_state.h"
#include "rt/vec3.h"
#include "tools/lib/offline/offline_box.h"

namespace hapticd::tools {

/// Frames in the order of their arrival, as many as are requested.
struct FrameStream {
  /// Its arrival_ns is that of arrival_tick. Stays valid until the next but one is requested.
  std::function<const rt::DepthFrame&(int index)> frame;
  std::function<long(int index)> arrival_tick;  ///< 0 for the first, strictly increasing
};

/// The tick at which frame `index` of a camera with 30 frames per second arrives.
constexpr long tickOfRegularFrame(int index) {
  return (static_cast<long>(index) * 100 + 2) / 3;
}

/// Frames of a camera with 30 frames per second: `render` fills frame `number`, from 1 on, which shows the
/// scene at `tick`.
FrameStream renderedStream(
    const std::function<void(long tick, std::uint64_t number, rt::DepthFrame& frame)>& render);

/// Ticks of one millisecond, with each frame shown at the tick that it arrives at; ticks know its age.
/// Thread: one.  RT: not safe.
class FramePlayer {
 public:
  FramePlayer(OfflineBox& box, FrameStream stream) : box_(box), stream_(std::move(stream)) {}

  /// The next tick, with the HIP there and moving at the speed that brought it there.
  rt::Tick tick(const rt::Vec3& hip_m_in_world);

  /// The number of the next tick, from 0 on.
  long nextTick() const { return next_tick_; }
  /// The newest frame that was shown, -1 before the first.
  int frame() const { return frame_; }
  /// The last tick was the first one that could use the newest frame.
  bool frameIsNew() const { return frame_is_new_; }

 private:
  OfflineBox& box_;
  FrameStream stream_;
  long next_tick_ = 0;
  int frame_ = -1;
  bool frame_is_new_ = false;
  rt::Vec3 hip_before_;
};

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "rt/depth_frame.h"
#include "tools/hapticbench/bench_scene.h"
#include "tools/hapticbench/frame_player.h"

namespace hapticd::tools {

/// The tick at which each frame arrives, 0 for the first: by a Kinect's own counter, else by the times of
/// arrival, so that frames that were lost while recording leave a gap; where neither counts, 30 frames per
/// second.
std::vector<long> arrivalTicks(const BenchSequence& session);

/// A session that is played forwards and backwards in turn, without end: what is at rest never
/// jumps, what moves turns round. Each frame gets a number of its own.
/// Thread: one.  RT: not safe.
class PlayedSession {
 public:
  /// `session`: two frames or more, outlives the object. `first`: of the frames, where playing begins.
  explicit PlayedSession(const BenchSequence& session, int first = 0);

  /// Returns the frame of the session that is played with this index.
  int frameOfSession(int index) const;
  const rt::DepthFrame& frame(int index);
  long arrivalTick(int index) const;

  /// This session for a FramePlayer, which the object outlives.
  FrameStream stream();

 private:
  static constexpr int kBuffers = 4;  // a box keeps the newest frame alone

  const BenchSequence& session_;
  int first_;
  std::vector<long> arrival_ticks_;
  std::array<std::unique_ptr<rt::DepthFrame>, kBuffers> shown_;
};

}  // namespace hapticd::tools

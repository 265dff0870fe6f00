// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "config/base/error.h"
#include "daemon/trace/format/depth_codec.h"
#include "daemon/trace/format/records.h"
#include "daemon/trace/ros/depth_view.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::daemon {

/// A depth frame on its way into a trace.
struct RecordedFrame {
  trace::DepthRecord depth;
  trace::CloudRecord cloud;  ///< empty if clouds are not recorded
};

/// Carries raw depth from the scene thread to a trace. A thread of its own compresses it, about two
/// milliseconds per frame, and computes the points in the modelled ball if they are recorded, so that neither
/// the scene nor the ticks of the trace wait.
class DepthRecorder {
 public:
  /// Capacity for frames that wait for compression: a quarter of a second.
  static constexpr std::size_t kFrames = 8;
  /// Capacity for compressed frames that wait for the disk: several seconds, or a quarter of a second of
  /// frames that cannot be compressed.
  static constexpr std::size_t kMaxWaitingBytes = 8 << 20;

  /// `common`: the header fields that all frames of the camera share.
  /// `cloud`: record the points in the ball too.
  /// Errors: the system provides no more threads.
  static base::Result<std::unique_ptr<DepthRecorder>> start(const rt::DepthFrameHeader& common,
                                                            bool cloud = false);
  /// Ends the thread as finish() does.
  ~DepthRecorder();
  DepthRecorder(const DepthRecorder&) = delete;
  DepthRecorder& operator=(const DepthRecorder&) = delete;

  /// Copies the frame. While the disk is too slow it returns false and counts the frame in lost().
  /// Thread: scene thread.  Progress: blocking, for as long as a copy takes.
  bool offer(const rt::DepthFrame& frame);

  // The next three functions: trace thread.
  /// Sets the ball whose points are recorded from the next frame on: that of the newest model.
  void setBall(const trace::ros::ModelledBall& ball);
  /// Moves out the oldest compressed frame; false if there is none now.
  bool take(RecordedFrame& recorded);
  /// Compresses all offered frames and ends the thread. take() still returns what is left; offer() must not
  /// be called any more.
  void finish();

  /// Number of frames that offer() has refused.  Thread: any.
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

 private:
  DepthRecorder(const rt::DepthFrameHeader& common, bool cloud);
  void run();
  /// Waits for a frame to compress, and returns the ball for its points; false if there will be none.
  bool nextFrame(std::size_t& slot, trace::ros::ModelledBall& ball);

  const rt::DepthFrameHeader common_;
  const bool cloud_;
  trace::DepthEncoder encoder_;  // compression thread only, as the next one
  trace::ros::DepthView view_;
  std::vector<rt::DepthFrame> frames_;
  std::mutex mutex_;  // protects the next six members
  std::condition_variable wake_;
  std::vector<std::size_t> free_;
  std::deque<std::size_t> offered_;       // oldest first
  std::deque<RecordedFrame> compressed_;  // oldest first
  std::size_t compressed_bytes_ = 0;
  bool finishing_ = false;
  trace::ros::ModelledBall ball_;
  std::atomic<std::uint64_t> lost_{0};  // relaxed: no other data depends on it
  std::thread thread_;
};

}  // namespace hapticd::daemon

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

#include "config/error.h"
#include "drivers/trace/depth_codec.h"
#include "drivers/trace/records.h"
#include "rt/depth_frame.h"

namespace hapticd::daemon {

/// Raw depth on its way from the scene thread into a trace: compressed by a thread of its own, which takes
/// about two milliseconds a frame, so that neither the scene nor the ticks of the trace wait for it.
class DepthRecorder {
 public:
  /// Frames on their way to the compression: a quarter of a second.
  static constexpr std::size_t kFrames = 8;
  /// Compressed ones on their way to the disk: seconds, or a quarter of one if nothing can be compressed.
  static constexpr std::size_t kMostWaitingBytes = 8 << 20;

  /// `common`: what the frames of the camera have in common.
  /// Errors: the system gives no more threads.
  static config::Result<std::unique_ptr<DepthRecorder>> start(const rt::DepthFrameHeader& common);
  /// Like finish().
  ~DepthRecorder();
  DepthRecorder(const DepthRecorder&) = delete;
  DepthRecorder& operator=(const DepthRecorder&) = delete;

  /// Takes a copy of the frame. False, and one more in lost(), while the disk is too slow.
  /// Thread: scene thread.  Never blocks longer than copying takes.
  bool offer(const rt::DepthFrame& frame);

  // Thread: trace thread.
  /// The oldest compressed frame that was not taken yet. False: there is none now.
  bool take(drivers::DepthRecord& record);
  /// Compresses what was offered and ends the thread; take() still gives what is left. offer() is not called
  /// any more.
  void finish();

  /// Frames refused.  Thread: any.
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

 private:
  explicit DepthRecorder(const rt::DepthFrameHeader& common);
  void run();
  /// Waits for work. False when there is none any more.
  bool nextFrame(std::size_t& slot);

  const rt::DepthFrameHeader common_;
  drivers::DepthEncoder encoder_;  // the compressing thread only
  std::vector<rt::DepthFrame> frames_;
  std::mutex mutex_;  // of the next five
  std::condition_variable wake_;
  std::vector<std::size_t> free_;
  std::deque<std::size_t> offered_;              // the oldest first
  std::deque<drivers::DepthRecord> compressed_;  // the oldest first
  std::size_t compressed_bytes_ = 0;
  bool finishing_ = false;
  std::atomic<std::uint64_t> lost_{0};  // relaxed: it orders nothing
  std::thread thread_;
};

}  // namespace hapticd::daemon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "config/base/error.h"
#include "daemon/scene/scene_thread.h"
#include "daemon/trace/format/depth_codec.h"
#include "daemon/trace/format/records.h"
#include "daemon/trace/format/trace_format.h"
#include "daemon/trace/ros/depth_view.h"
#include "daemon/trace/writer/trace_writer.h"
#include "rt/depth/depth_frame.h"
#include "rt/loop/force_loop.h"

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

/// Numbers the traces of a box in the order in which they begin, from one start of the daemon to the next.
/// The wall clock cannot order them: without a battery it starts in the past. Thread: one.
class TraceNumbers {
 public:
  struct Next {
    std::uint64_t number = 0;
    bool clock_is_set = false;
  };

  /// Keeps the count in the state folder, in the file trace_count.yaml.
  explicit TraceNumbers(std::filesystem::path state_folder) : folder_(std::move(state_folder)) {}

  /// Counts a trace that begins now. Where the file is missing or damaged, or cannot be written, the count
  /// goes on from the largest number in the folder of the traces.
  Next next(const trace::WallClock& clock);

 private:
  struct Count {
    std::uint64_t number = 0;    ///< of the last trace
    std::int64_t latest_ns = 0;  ///< CLOCK_REALTIME of the last trace that began while it was set
  };
  std::optional<Count> fromFile() const;
  Count fromTraces() const;

  std::filesystem::path folder_;
  std::optional<Count> last_;    ///< nothing: not read yet
  bool traces_counted_ = false;  ///< it is not less than in the folder of the traces
};

/// A trace while it is written.
///
/// A trace with depth can be computed again: from the first recorded frame on, the scenes depend on recorded
/// frames only, and from the first snapshot of the core's memory after that, the ticks depend only on what
/// the trace contains. There is a snapshot every kSnapshotPeriod_ns, and soon after a frame that could not be
/// recorded, so that the replay can resume after a gap. Thread: trace thread.
class TraceSession {
 public:
  struct Plan {
    std::filesystem::path folder;
    std::string label;
    bool depth = false;
    trace::TraceOptions options;  ///< its `cloud` has an effect only with depth
  };
  static constexpr std::int64_t kSnapshotPeriod_ns = trace::kSnapshotPeriod_ns;
  static constexpr std::int64_t kMinSnapshotPeriod_ns = trace::kMinSnapshotPeriod_ns;

  /// Starts a trace, and creates a missing folder. `scene_thread` and `core_memory` outlive the session.
  /// Errors: the folder cannot be created or written, no space.
  static base::Result<std::unique_ptr<TraceSession>> begin(const Plan& plan, SceneThread& scene_thread,
                                                           rt::CoreMemoryChannel& core_memory);
  /// Leaves the trace unfinished, unless end() was called.
  ~TraceSession();
  TraceSession(const TraceSession&) = delete;
  TraceSession& operator=(const TraceSession&) = delete;

  // Errors of the next functions: a failure of the disk, after which nothing more is written.
  base::Result<void> write(const rt::Tick& tick);
  base::Result<void> write(const trace::ModelRecord& model);
  template <typename Record>
  base::Result<void> write(const Record& record) {
    return writer_->write(record);
  }
  /// Writes what other threads have ready: depth frames, and a requested snapshot.
  base::Result<void> writeWhatIsReady();

  /// Finishes the trace; may be called again if its end did not fit on the disk. Removes a trace that failed
  /// before any tick was on the disk, because it contains nothing.
  base::Result<void> end();

  /// Whether there is no unfinished file any more: it was finished, or somebody has removed it.
  bool vanished() const;
  /// Whether the trace has no file at all any more.
  bool hasNoFile() const;

  /// Number of ticks passed to write(); they may be in the file, in the open chunk, or lost.
  std::uint64_t ticksGiven() const noexcept { return ticks_given_; }

  std::string name() const { return writer_->file().stem().string(); }
  trace::TraceWriter& writer() noexcept { return *writer_; }
  std::uint64_t depthFrames() const noexcept { return depth_frames_; }  ///< number of frames written
  std::uint64_t depthFramesLost() const noexcept;                       ///< number of frames not written
  std::int64_t beginNs() const noexcept { return begin_ns_; }

 private:
  TraceSession(std::unique_ptr<trace::TraceWriter> writer, SceneThread& scene_thread,
               rt::CoreMemoryChannel& core_memory);
  /// Removes the files of the trace.
  void discard();
  base::Result<void> recordDepth(const trace::TraceOptions& options);
  base::Result<void> writeDepth();
  base::Result<void> writeSnapshot();
  void endDepth();

  std::unique_ptr<trace::TraceWriter> writer_;
  std::unique_ptr<DepthRecorder> depth_;  // null without depth
  bool depth_ended_ = false;
  bool cloud_ = false;  // record the points in the ball too
  std::uint64_t depth_frames_ = 0;
  std::uint64_t depth_frames_dropped_ = 0;  // number of frames compressed, but not written
  SceneThread& scene_thread_;
  rt::CoreMemoryChannel& core_memory_;
  std::int64_t begin_ns_;
  std::uint64_t ticks_given_ = 0;
  std::uint64_t first_model_ = 0;  // first model of a recorded frame since the last gap; 0: none yet
  std::uint64_t request_ = 0;      // number of the open request for a snapshot; 0: none
  std::int64_t next_snapshot_ns_ = 0;
  std::int64_t last_snapshot_ns_ = 0;
};

/// The newest of the records that hold until they are replaced, with which each trace starts.
struct RecordsInForce {
  std::optional<trace::DirectiveRecord> directive = {};
  std::optional<trace::AdditionsRecord> additions = {};  ///< fixtures and tissue regions

  /// Writes them with the present time: otherwise the trace would seem to start when they were issued.
  /// Errors: those of the session.
  base::Result<void> writeTo(TraceSession& session) const;
};

}  // namespace hapticd::daemon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "config/base/error.h"
#include "daemon/scene/scene_thread.h"
#include "daemon/trace/depth_recorder.h"
#include "drivers/trace/trace_volume.h"
#include "drivers/trace/trace_writer.h"
#include "rt/loop/force_loop.h"

namespace hapticd::daemon {

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
    drivers::TraceOptions options;  ///< its `cloud` has an effect only with depth
  };
  static constexpr std::int64_t kSnapshotPeriod_ns = drivers::kSnapshotPeriod_ns;
  static constexpr std::int64_t kMinSnapshotPeriod_ns = drivers::kMinSnapshotPeriod_ns;

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
  base::Result<void> write(const drivers::ModelRecord& model);
  base::Result<void> write(const drivers::DirectiveRecord& directive) { return writer_->write(directive); }
  base::Result<void> write(const drivers::AdditionsRecord& additions) { return writer_->write(additions); }
  base::Result<void> write(const drivers::EventRecord& event) { return writer_->write(event); }
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
  drivers::TraceWriter& writer() noexcept { return *writer_; }
  std::uint64_t depthFrames() const noexcept { return depth_frames_; }  ///< number of frames written
  std::uint64_t depthFramesLost() const noexcept;                       ///< number of frames not written
  std::int64_t beginNs() const noexcept { return begin_ns_; }

 private:
  TraceSession(std::unique_ptr<drivers::TraceWriter> writer, SceneThread& scene_thread,
               rt::CoreMemoryChannel& core_memory);
  /// Removes the files of the trace.
  void discard();
  base::Result<void> recordDepth(const drivers::TraceOptions& options);
  base::Result<void> writeDepth();
  base::Result<void> writeSnapshot();
  void endDepth();

  std::unique_ptr<drivers::TraceWriter> writer_;
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

}  // namespace hapticd::daemon

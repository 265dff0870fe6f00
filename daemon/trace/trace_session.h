// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "config/error.h"
#include "daemon/scene/scene_thread.h"
#include "daemon/trace/depth_recorder.h"
#include "drivers/trace/trace_writer.h"
#include "rt/force_loop.h"

namespace hapticd::daemon {

/// One trace while it is written.
///
/// With depth the trace can be computed again: from the first recorded frame on the scenes depend on recorded
/// frames alone, and from the first snapshot of the core's memory that follows the ticks depend on what the
/// trace holds. Snapshots follow every kSnapshotPeriod_ns, and soon after a frame that could not be recorded,
/// so that no gap ends that. Thread: trace thread.
class TraceSession {
 public:
  struct Plan {
    std::filesystem::path folder;
    std::string label;
    bool depth = false;
    drivers::TraceOptions options;
  };
  static constexpr std::int64_t kSnapshotPeriod_ns = 10'000'000'000;
  static constexpr std::int64_t kLeastSnapshotPeriod_ns = 1'000'000'000;

  /// Makes the folder where it is missing. `scene_thread` and `core_memory` outlive the session.
  /// Errors: the folder cannot be made or written, no space.
  static config::Result<std::unique_ptr<TraceSession>> begin(const Plan& plan, SceneThread& scene_thread,
                                                             rt::CoreMemoryChannel& core_memory);
  /// Leaves an unfinished trace.
  ~TraceSession();
  TraceSession(const TraceSession&) = delete;
  TraceSession& operator=(const TraceSession&) = delete;

  // Errors: the disk's; nothing more is written then.
  config::Result<void> write(const rt::Tick& tick);
  config::Result<void> write(const drivers::ModelRecord& model);
  config::Result<void> write(const drivers::DirectiveRecord& directive) { return writer_->write(directive); }
  config::Result<void> write(const drivers::EventRecord& event) { return writer_->write(event); }
  /// What other threads have ready: depth frames, and the answer to a request for a snapshot.
  config::Result<void> writeWhatIsReady();

  /// Finishes the trace. Where its end does not fit on the disk it may be called again. A trace that failed
  /// before any tick was on the disk is removed: it holds nothing.
  config::Result<void> end();

  /// Whether there is no unfinished file any more: it was finished, removed, or somebody has taken it away.
  bool vanished() const;
  /// Whether there is no file of it at all any more.
  bool gone() const;

  /// Ticks that write() was given; they may be in the file, in the open chunk, or lost.
  std::uint64_t ticksGiven() const noexcept { return ticks_given_; }

  std::string name() const { return writer_->file().stem().string(); }
  drivers::TraceWriter& writer() noexcept { return *writer_; }
  std::uint64_t depthFrames() const noexcept { return depth_frames_; }  ///< written
  std::uint64_t depthFramesLost() const noexcept;                       ///< not written
  std::int64_t beginNs() const noexcept { return begin_ns_; }

 private:
  TraceSession(std::unique_ptr<drivers::TraceWriter> writer, SceneThread& scene_thread,
               rt::CoreMemoryChannel& core_memory);
  /// Removes what it has made.
  void discard();
  config::Result<void> recordDepth(const rt::DepthFrameHeader& common);
  config::Result<void> writeDepth();
  config::Result<void> writeSnapshot();
  void endDepth();

  std::unique_ptr<drivers::TraceWriter> writer_;
  std::unique_ptr<DepthRecorder> depth_;  // null without depth
  bool depth_ended_ = false;
  std::uint64_t depth_frames_ = 0;
  std::uint64_t depth_frames_dropped_ = 0;  // compressed, but not written
  SceneThread& scene_thread_;
  rt::CoreMemoryChannel& core_memory_;
  std::int64_t begin_ns_;
  std::uint64_t ticks_given_ = 0;
  std::uint64_t first_model_ = 0;  // since the last gap that is of a recorded frame; 0: none yet
  std::uint64_t request_ = 0;      // for a snapshot, not answered yet; 0: none
  std::int64_t next_snapshot_ns_ = 0;
  std::int64_t last_snapshot_ns_ = 0;
};

}  // namespace hapticd::daemon

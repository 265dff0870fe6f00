// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "config/base/error.h"
#include "daemon/recorder/depth_recorder.h"
#include "daemon/scene/scene_thread.h"
#include "daemon/trace/format/records.h"
#include "daemon/trace/format/trace_format.h"
#include "daemon/trace/writer/trace_writer.h"
#include "rt/loop/force_loop.h"

namespace hapticd::daemon {

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
  base::Result<void> write(const trace::DirectiveRecord& directive) { return writer_->write(directive); }
  base::Result<void> write(const trace::AdditionsRecord& additions) { return writer_->write(additions); }
  base::Result<void> write(const trace::PoseRecord& pose) { return writer_->write(pose); }
  base::Result<void> write(const trace::EventRecord& event) { return writer_->write(event); }
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

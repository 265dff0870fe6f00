#include "daemon/trace/trace_session.h"

#include <sys/stat.h>

#include <system_error>
#include <utility>

#include "drivers/trace/trace_file.h"
#include "drivers/trace/trace_folder.h"
#include "rt/periodic_clock.h"

namespace hapticd::daemon {

namespace fs = std::filesystem;

config::Result<std::unique_ptr<TraceSession>> TraceSession::begin(const Plan& plan, SceneThread& scene_thread,
                                                                  rt::CoreMemoryChannel& core_memory) {
  std::error_code failure;
  fs::create_directories(plan.folder, failure);
  if (failure) {
    return std::unexpected(config::Error{plan.folder.string(), "cannot be made: " + failure.message(),
                                         "set state.folder to one that hapticd may write"});
  }
  const std::int64_t realtime_ns = rt::monotonicNow_ns() + plan.options.realtime_offset_ns;
  const std::string name = drivers::newTraceName(plan.folder, realtime_ns, plan.label);
  auto writer = drivers::TraceWriter::create(plan.folder / (name + ".mcap"), plan.options);
  if (!writer) return std::unexpected(writer.error());
  std::unique_ptr<TraceSession> session(new TraceSession(std::move(*writer), scene_thread, core_memory));
  if (!plan.depth) return session;
  if (auto recording = session->recordDepth(plan.options.realtime_offset_ns); !recording) {
    return std::unexpected(recording.error());
  }
  return session;
}

TraceSession::TraceSession(std::unique_ptr<drivers::TraceWriter> writer, SceneThread& scene_thread,
                           rt::CoreMemoryChannel& core_memory)
    : writer_(std::move(writer)),
      scene_thread_(scene_thread),
      core_memory_(core_memory),
      begin_ns_(rt::monotonicNow_ns()) {}

TraceSession::~TraceSession() {
  endRecording();
}

config::Result<void> TraceSession::recordDepth(std::int64_t realtime_offset_ns) {
  fs::path folder = writer_->file();
  folder.replace_extension(".depth");
  auto recording = drivers::RecordingWriter::create(folder, realtime_offset_ns);
  if (!recording) return std::unexpected(recording.error());
  recording_ = std::move(*recording);
  scene_thread_.setTap(
      [writer = recording_.get()](const rt::DepthFrame& frame) { return writer->offer(frame); });
  return {};
}

config::Result<void> TraceSession::write(const drivers::ModelRecord& model) {
  if (recording_ && model.forgot && model.depth_recorded && first_model_ == 0) first_model_ = model.model;
  return writer_->write(model);
}

config::Result<void> TraceSession::write(const rt::Tick& tick) {
  const bool reproducible = first_model_ != 0 && tick.scene_model >= first_model_;
  if (reproducible && request_ == 0 && tick.planned_ns >= next_snapshot_ns_) {
    request_ = core_memory_.request.fetch_add(1, std::memory_order_relaxed) + 1;
    next_snapshot_ns_ = tick.planned_ns + kSnapshotPeriod_ns;
  }
  return writer_->write(tick);
}

config::Result<void> TraceSession::writeSnapshot() {
  if (request_ == 0) return {};
  core_memory_.snapshot.refresh();
  const rt::CoreSnapshot& snapshot = core_memory_.snapshot.front();
  if (snapshot.request != request_) return {};
  request_ = 0;
  return writer_->write(drivers::SnapshotRecord{rt::monotonicNow_ns(), snapshot});
}

/// Once: the tap may be another session's by then.
config::Result<void> TraceSession::endRecording() {
  if (!recording_ || std::exchange(recording_ended_, true)) return {};
  scene_thread_.setTap({});
  return recording_->close();
}

config::Result<void> TraceSession::end() {
  const auto recorded = endRecording();
  if (auto closed = writer_->close(); !closed) return closed;
  return recorded;
}

bool TraceSession::vanished() const {
  struct stat file {};
  return ::stat(drivers::partOf(writer_->file()).c_str(), &file) != 0;
}

}  // namespace hapticd::daemon

// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder/trace_session.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <charconv>
#include <span>
#include <string>
#include <system_error>
#include <utility>

#include "config/yaml/yaml_reader.h"
#include "daemon/state/state_file.h"
#include "daemon/trace/mcap/trace_file.h"
#include "daemon/trace/reader/trace_folder.h"
#include "drivers/base/start_thread.h"
#include "rt/base/clock.h"

namespace hapticd::daemon {

namespace {

std::size_t bytesOf(const RecordedFrame& recorded) {
  return recorded.depth.image.bytes.size() + recorded.cloud.points_m_in_optical.size() * sizeof(float);
}

}  // namespace

base::Result<std::unique_ptr<DepthRecorder>> DepthRecorder::start(const rt::DepthFrameHeader& common,
                                                                  bool cloud) {
  std::unique_ptr<DepthRecorder> recorder(new DepthRecorder(common, cloud));
  auto thread = drivers::startThread("hapticd-depth", [self = recorder.get()] { self->run(); });
  if (!thread) return std::unexpected(thread.error());
  recorder->thread_ = std::move(*thread);
  return recorder;
}

DepthRecorder::DepthRecorder(const rt::DepthFrameHeader& common, bool cloud)
    : common_(common), cloud_(cloud), frames_(kFrames) {
  for (std::size_t slot = 0; slot < kFrames; ++slot) free_.push_back(slot);
}

DepthRecorder::~DepthRecorder() {
  finish();
}

bool DepthRecorder::offer(const rt::DepthFrame& frame) {
  std::size_t slot = 0;
  {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) {
      lost_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    slot = free_.back();
    free_.pop_back();
  }
  frames_[slot] = frame;
  {
    const std::lock_guard lock(mutex_);
    offered_.push_back(slot);
  }
  wake_.notify_one();
  return true;
}

bool DepthRecorder::nextFrame(std::size_t& slot, trace::ros::ModelledBall& ball) {
  std::unique_lock lock(mutex_);
  wake_.wait(lock,
             [this] { return finishing_ || (!offered_.empty() && compressed_bytes_ < kMaxWaitingBytes); });
  if (offered_.empty()) return false;
  slot = offered_.front();
  offered_.pop_front();
  ball = ball_;
  return true;
}

void DepthRecorder::run() {
  trace::ros::ModelledBall ball;
  for (std::size_t slot = 0; nextFrame(slot, ball);) {
    RecordedFrame recorded;
    const rt::DepthFrame& frame = frames_[slot];
    const rt::DepthFrameHeader header = trace::headerOf(common_, frame);
    const auto image = std::as_bytes(frame.image());
    encoder_.encode(header, image, recorded.depth);
    recorded.depth.image.bytes.shrink_to_fit();  // the record may stay in memory for a while
    if (cloud_) {
      recorded.cloud.time_ns = header.arrival_ns;
      view_.set(header, image);
      view_.pointsInBall(ball, recorded.cloud.points_m_in_optical);
      recorded.cloud.points_m_in_optical.shrink_to_fit();
    }
    const std::lock_guard lock(mutex_);
    free_.push_back(slot);
    compressed_bytes_ += bytesOf(recorded);
    compressed_.push_back(std::move(recorded));
  }
}

void DepthRecorder::setBall(const trace::ros::ModelledBall& ball) {
  const std::lock_guard lock(mutex_);
  ball_ = ball;
}

bool DepthRecorder::take(RecordedFrame& recorded) {
  {
    const std::lock_guard lock(mutex_);
    if (compressed_.empty()) return false;
    recorded = std::move(compressed_.front());
    compressed_.pop_front();
    compressed_bytes_ -= bytesOf(recorded);
  }
  wake_.notify_one();
  return true;
}

void DepthRecorder::finish() {
  {
    const std::lock_guard lock(mutex_);
    finishing_ = true;
  }
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
}

namespace {

constexpr const char* kFile = "trace_count.yaml";

template <typename Number>
bool take(const config::YamlFile& content, std::string_view name, Number& number) {
  const auto entry = std::ranges::find_if(content.entries, [name](const config::YamlEntry& one) {
    return one.group == "traces" && one.name == name;
  });
  if (entry == content.entries.end()) return false;
  const std::string& text = entry->value;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

std::optional<TraceNumbers::Count> TraceNumbers::fromFile() const {
  const auto text = readStateFile(folder_ / kFile);
  if (!text || !*text) return std::nullopt;
  const config::YamlFile content = config::readYaml(**text);
  Count count;
  const bool whole = take(content, "number", count.number) && take(content, "latest_ns", count.latest_ns);
  return whole ? std::optional(count) : std::nullopt;
}

TraceNumbers::Count TraceNumbers::fromTraces() const {
  Count count;
  const auto traces = trace::listTraces(folder_ / "traces");
  if (!traces) return count;  // where it cannot be read, no trace begins either
  for (const trace::TraceEntry& trace : *traces) {
    count.number = std::max(count.number, trace.number);
    if (trace.clock_is_set.value_or(true)) count.latest_ns = std::max(count.latest_ns, trace.begin_ns);
  }
  return count;
}

TraceNumbers::Next TraceNumbers::next(const trace::WallClock& clock) {
  if (!last_) last_ = fromFile();
  if (!last_) {
    last_ = fromTraces();
    traces_counted_ = true;
  }
  const bool is_set = clock.isSet(last_->latest_ns);
  Count count{last_->number + 1, is_set ? clock.realtime_ns : last_->latest_ns};
  const std::string text =
      fmt::format("traces: {{number: {}, latest_ns: {}}}\n", count.number, count.latest_ns);
  const bool kept = replaceFile(folder_ / kFile, text).has_value();
  if (!kept && !std::exchange(traces_counted_, true)) {
    count.number = std::max(count.number, fromTraces().number + 1);  // the file may have been kept for long
  }
  last_ = count;
  return {count.number, is_set};
}

namespace fs = std::filesystem;

base::Result<std::unique_ptr<TraceSession>> TraceSession::begin(const Plan& plan, SceneThread& scene_thread,
                                                                rt::CoreMemoryChannel& core_memory) {
  std::error_code failure;
  fs::create_directories(plan.folder, failure);
  if (failure) {
    return base::failure(plan.folder.string(), "cannot be made: " + failure.message(),
                         "set state.folder to one that hapticd may write");
  }
  const std::int64_t realtime_ns = rt::monotonicNow_ns() + plan.options.realtime_offset_ns;
  const std::string name = trace::newTraceName(plan.folder, realtime_ns, plan.label);
  trace::TraceOptions options = plan.options;
  options.depth = plan.depth;
  options.cloud = options.cloud && plan.depth;  // only then are frames offered
  auto writer = trace::TraceWriter::create(plan.folder / (name + ".mcap"), options);
  if (!writer) return std::unexpected(writer.error());
  std::unique_ptr<TraceSession> session(new TraceSession(std::move(*writer), scene_thread, core_memory));
  if (!plan.depth) return session;
  if (auto recording = session->recordDepth(options); !recording) {
    session->discard();
    return std::unexpected(recording.error());
  }
  return session;
}

TraceSession::TraceSession(std::unique_ptr<trace::TraceWriter> writer, SceneThread& scene_thread,
                           rt::CoreMemoryChannel& core_memory)
    : writer_(std::move(writer)),
      scene_thread_(scene_thread),
      core_memory_(core_memory),
      begin_ns_(rt::monotonicNow_ns()) {}

TraceSession::~TraceSession() {
  endDepth();
}

base::Result<void> TraceSession::recordDepth(const trace::TraceOptions& options) {
  auto recorder = DepthRecorder::start(options.depth_header, options.cloud);
  if (!recorder) return std::unexpected(recorder.error());
  depth_ = std::move(*recorder);
  cloud_ = options.cloud;
  scene_thread_.setTap(
      [recorder = depth_.get()](const rt::DepthFrame& frame) { return recorder->offer(frame); });
  return {};
}

base::Result<void> TraceSession::write(const trace::ModelRecord& model) {
  if (depth_) depth_->setBall({model.centre_m_in_world, model.radius_m});
  if (depth_ && !model.depth_recorded) first_model_ = 0;
  if (depth_ && model.depth_recorded && (first_model_ == 0 || model.forgot)) {
    first_model_ = model.model;
    next_snapshot_ns_ = std::min(next_snapshot_ns_, last_snapshot_ns_ + kMinSnapshotPeriod_ns);
  }
  return writer_->write(model);
}

base::Result<void> TraceSession::write(const rt::Tick& tick) {
  ++ticks_given_;
  const bool reproducible = first_model_ != 0 && tick.scene_model >= first_model_;
  if (reproducible && request_ == 0 && tick.planned_ns >= next_snapshot_ns_) {
    request_ = core_memory_.request.fetch_add(1, std::memory_order_relaxed) + 1;
    last_snapshot_ns_ = tick.planned_ns;
    next_snapshot_ns_ = tick.planned_ns + kSnapshotPeriod_ns;
  }
  return writer_->write(tick);
}

base::Result<void> TraceSession::writeWhatIsReady() {
  auto written = writeDepth();
  return written ? writeSnapshot() : written;
}

base::Result<void> TraceSession::writeDepth() {
  RecordedFrame recorded;
  while (depth_ && depth_->take(recorded)) {
    auto written = writer_->write(recorded.depth);
    ++(written ? depth_frames_ : depth_frames_dropped_);
    if (written && cloud_) written = writer_->write(recorded.cloud);
    if (!written) return written;
  }
  return {};
}

base::Result<void> TraceSession::writeSnapshot() {
  if (request_ == 0) return {};
  core_memory_.snapshot.refresh();
  const rt::CoreSnapshot& snapshot = core_memory_.snapshot.front();
  if (snapshot.request != request_) return {};
  request_ = 0;
  return writer_->write(trace::SnapshotRecord{rt::monotonicNow_ns(), snapshot});
}

/// Only once, because the tap may belong to another session later.
void TraceSession::endDepth() {
  if (!depth_ || std::exchange(depth_ended_, true)) return;
  scene_thread_.setTap({});
  depth_->finish();
}

/// Ends the recording of frames; failures do not prevent the trace from being finished.
base::Result<void> TraceSession::end() {
  endDepth();
  while (depth_ && !writeDepth()) {
  }
  if (auto flushed = writer_->flush(); !flushed && writer_->ticks() == 0) {
    discard();
    return flushed;
  }
  return writer_->close();
}

std::uint64_t TraceSession::depthFramesLost() const noexcept {
  return depth_ ? depth_->lost() + depth_frames_dropped_ : 0;
}

void TraceSession::discard() {
  endDepth();
  std::error_code ignored;
  fs::remove(trace::partOf(writer_->file()), ignored);
}

bool TraceSession::vanished() const {
  struct stat file {};
  return ::stat(trace::partOf(writer_->file()).c_str(), &file) != 0;
}

bool TraceSession::hasNoFile() const {
  std::error_code ignored;
  return vanished() && !fs::exists(writer_->file(), ignored);
}

namespace {

template <typename Record>
base::Result<void> write(TraceSession& session, std::optional<Record> record) {
  if (!record) return {};
  record->time_ns = rt::monotonicNow_ns();
  return session.write(*record);
}

}  // namespace

base::Result<void> RecordsInForce::writeTo(TraceSession& session) const {
  auto written = write(session, directive);
  return written ? write(session, additions) : written;
}

}  // namespace hapticd::daemon

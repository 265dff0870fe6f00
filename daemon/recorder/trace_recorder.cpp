// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder/trace_recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <system_error>

#include "config/settings/yaml_text.h"
#include "daemon/trace/mcap/trace_file.h"
#include "daemon/trace/writer/trace_writer.h"
#include "drivers/base/start_thread.h"
#include "rt/base/clock.h"

namespace hapticd::daemon {
namespace {

namespace fs = std::filesystem;
using rt::kNsPerSecond;

/// How often the rings are emptied, which hold several seconds.
constexpr std::chrono::milliseconds kPeriod{20};
/// The same while no trace is recorded, and only the flight recorder takes the ticks.
constexpr std::chrono::milliseconds kIdlePeriod{100};
constexpr std::int64_t kLookPeriod_ns = kNsPerSecond;
/// How long recording waits for the first list of the folder; the ring holds 16 s.
constexpr std::chrono::seconds kFirstListPatience{5};
/// A trace thread that has not reported for this long waits for the disk.
constexpr std::int64_t kStall_ns = 5 * kNsPerSecond;
/// The first chunk is short, so that a trace that is cut off within its first second still has some content.
constexpr std::int64_t kFirstChunk_ns = kNsPerSecond / 10;
/// Number of records from clients and events that may wait for the trace thread.
constexpr std::size_t kMaxWaitingRecords = 4096;

/// Number of traces kept open because their end did not fit on the disk.
constexpr std::size_t kMaxUnfinished = 16;

/// Number of news kept for the status.
constexpr std::size_t kMaxNews = 64;

std::string stallText(std::int64_t stalled_ns) {
  const double ring_s = static_cast<double>(rt::kTraceRingCapacity) / 1000;
  return fmt::format(
      "the disk has not answered for {} s: at 1 kHz {:.0f} s of ticks wait in memory, later ones are lost "
      "(look into the kernel's log, or put state.folder onto a faster disk)",
      stalled_ns / kNsPerSecond, ring_s);
}

}  // namespace

TraceRecorder::TraceRecorder(const config::Settings& settings, Sources sources)
    : folder_(fs::path(settings.state.folder) / "traces"),
      settings_(settings.trace),
      settings_yaml_(config::yamlText(settings)),
      sources_(std::move(sources)),
      requested_(settings.trace.at_start),
      request_{"", settings.trace.depth},
      flight_recorder_(settings.trace.flight_recorder_s, settings.loop.rate_hz),
      dumps_(settings.trace.flight_recorder_s),
      space_(settings.state.folder, settings.trace.min_free_mb),
      numbers_(settings.state.folder),
      retention_(folder_, settings.trace,
                 [this](const std::string& name, const std::string& reason) {
                   addNews({0, false, "delete", name, fmt::format("trace {} was deleted: {}", name, reason)});
                 }),
      recovery_(
          folder_, [this](TraceNews news) { addNews(std::move(news)); },
          [this] { retention_.requestList(); }) {}

TraceRecorder::~TraceRecorder() {
  stop();
}

base::Result<void> TraceRecorder::start() {
  if (auto started = retention_.start(); !started) return started;
  auto thread = drivers::startThread("hapticd-trace", [this] { run(); });
  if (!thread) return std::unexpected(thread.error());
  thread_ = std::move(*thread);
  return {};
}

void TraceRecorder::stop() {
  if (thread_.joinable()) {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_one();
    thread_.join();
  }
  recovery_.stop();
  retention_.stop();
}

void TraceRecorder::addNews(TraceNews news) {
  const std::lock_guard lock(news_mutex_);
  news.number = ++news_count_;
  news_.push_back(std::move(news));
  if (news_.size() > kMaxNews) news_.pop_front();
}

template <typename Record>
void TraceRecorder::add(Record record) {
  const std::lock_guard lock(mutex_);
  auto& waiting = std::get<std::deque<Record>>(waiting_);
  if (waiting.size() >= kMaxWaitingRecords) {
    ++records_refused_;
  } else {
    waiting.push_back(std::move(record));
  }
}
template void TraceRecorder::add(trace::DirectiveRecord);
template void TraceRecorder::add(trace::AdditionsRecord);
template void TraceRecorder::add(trace::PoseRecord);
template void TraceRecorder::add(trace::EventRecord);

template <typename T>
std::future<base::Result<T>> TraceRecorder::post(std::function<base::Result<T>()> work) {
  auto task = std::make_shared<std::packaged_task<base::Result<T>()>>(std::move(work));
  auto future = task->get_future();
  {
    const std::lock_guard lock(mutex_);
    work_.emplace_back([task] { (*task)(); });
  }
  wake_.notify_one();
  return future;
}

std::future<base::Result<std::string>> TraceRecorder::startTrace(const TraceRequest& request) {
  return post<std::string>([this, request]() -> base::Result<std::string> {
    if (requested_) {
      return base::failure("trace", "a trace is already being recorded", "stop it first");
    }
    countDrops(sources_.ticks.dropped());  // earlier ones belong to no trace
    request_ = request;
    if (auto begun = beginSession(); !begun) return std::unexpected(begun.error());
    requested_ = true;
    return session_->name();
  });
}

std::future<base::Result<std::string>> TraceRecorder::stopTrace() {
  return post<std::string>([this]() -> base::Result<std::string> {
    takeAll();
    countDrops(sources_.ticks.dropped());
    if (!std::exchange(requested_, false)) {
      return base::failure("trace", "none is being written", "start one first");
    }
    own_status_.detail.clear();
    if (session_) return endSession();
    return own_status_.name;
  });
}

std::future<base::Result<std::string>> TraceRecorder::dumpTrace() {
  return post<std::string>([this] {
    takeAll();
    return dump(std::string(trace::kDumpLabel));
  });
}

std::future<base::Result<std::vector<trace::TraceEntry>>> TraceRecorder::listTraces() {
  return lists_.run([this] { return trace::listTraces(folder_); });
}

std::future<base::Result<void>> TraceRecorder::deleteTrace(const std::string& name) {
  return deletions_.run([this, name] {
    auto deleted = trace::deleteTrace(folder_, name);
    retention_.requestList();
    return deleted;
  });
}

std::future<base::Result<void>> TraceRecorder::keepTrace(const std::string& name, bool keep) {
  return lists_.run([this, name, keep] {
    auto kept = trace::keepTrace(folder_, name, keep);
    retention_.requestList();
    return kept;
  });
}

std::future<base::Result<void>> TraceRecorder::noteTrace(const std::string& name, const std::string& text) {
  return lists_.run([this, name, text] { return trace::noteTrace(folder_, name, text); });
}

TraceStatus TraceRecorder::status() const {
  Published published;
  {
    const std::lock_guard lock(status_mutex_);
    published = published_;
  }
  TraceStatus& status = published.status;
  // Adds what the ring has dropped since, because the trace thread cannot report it while it waits for the
  // disk.
  if (published.requested) status.ticks_lost += sources_.ticks.dropped() - published.ring_drops;
  const std::int64_t silent_ns = rt::monotonicNow_ns() - published.time_ns;
  if (published.time_ns != 0 && silent_ns >= kStall_ns) status.problems.push_back(stallText(silent_ns));
  Retention::Status retention = retention_.status();
  status.folder_bytes = retention.folder_bytes;
  status.limit_bytes = retention.limit_bytes;
  status.next_deleted = std::move(retention.next);
  status.deleted = retention.deleted;
  std::ranges::move(retention.problems, std::back_inserter(status.problems));
  const std::lock_guard lock(news_mutex_);
  status.news.assign(news_.begin(), news_.end());
  return status;
}

void TraceRecorder::run() {
  publishStatus();  // from here on a disk that stalls is noticed
  note("recovery", recovery_.begin());
  retention_.awaitFirstList(kFirstListPatience);
  bool stopping = false;
  while (!stopping) {
    {
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, requested_ ? kPeriod : kIdlePeriod, [this] { return stop_ || !work_.empty(); });
      stopping = stop_;
    }
    step();
  }
  countDrops(sources_.ticks.dropped());
  if (const auto label = dumps_.takeWaiting()) note("flight recorder", dump(*label));
  if (session_) endSession();
  finishUnfinished();
  publishStatus();
  const std::lock_guard lock(status_mutex_);
  published_.time_ns = 0;
  published_.requested = false;
}

void TraceRecorder::step() {
  const std::int64_t now_ns = rt::monotonicNow_ns();
  if (now_ns >= next_look_ns_) checkDisk(now_ns);
  takeAll();
  if (session_) {
    if (auto written = session_->writeWhatIsReady(); !written) suspend(written.error());
  }
  if (const auto label = dumps_.takeDue(now_ns)) note("flight recorder", dump(*label));
  std::deque<std::function<void()>> work;
  {
    const std::lock_guard lock(mutex_);
    work = std::exchange(work_, {});
  }
  for (const auto& item : work) item();
  publishStatus();
}

/// Adds the record to the trace, if one is being written, and to the flight recorder.
template <typename Record>
void TraceRecorder::write(const Record& record) {
  flight_recorder_.add(record);
  if (!session_) return;
  if (auto written = session_->write(record); !written) suspend(written.error());
}

void TraceRecorder::takeRecords() {
  decltype(waiting_) taken;
  {
    const std::lock_guard lock(mutex_);
    std::swap(taken, waiting_);
    own_status_.records_lost = records_refused_ + sources_.scene_thread.models().dropped();
  }
  auto& [directives, additions, poses, events] = taken;
  for (const trace::DirectiveRecord& directive : directives) {
    in_force_.directive = directive;
    write(directive);
  }
  for (trace::AdditionsRecord& changed : additions) {
    write(changed);
    in_force_.additions = std::move(changed);
  }
  for (const trace::PoseRecord& pose : poses) write(pose);
  for (const trace::EventRecord& event : events) write(event);
  trace::ModelRecord model;
  while (sources_.scene_thread.models().pop(model)) {
    model.damaged_frames = sources_.damaged_frames();
    write(model);
  }
}

/// Takes what there is up to now.
void TraceRecorder::takeAll() {
  const std::int64_t now_ns = rt::monotonicNow_ns();
  takeRecords();
  takeTicks(now_ns);
}

/// Takes the ticks up to `until_ns`, of whose time the other records have been taken: while a write waits for
/// the disk, the loop goes on, and newer ticks would overtake their records.
void TraceRecorder::takeTicks(std::int64_t until_ns) {
  if (sources_.stalled != nullptr && sources_.stalled->load(std::memory_order_relaxed)) return;
  rt::Tick tick;
  // bounded, because the loop may push while this pops
  for (std::size_t i = 0; i < rt::kTraceRingCapacity; ++i) {
    if (early_) {
      tick = *early_;
    } else if (!sources_.ticks.pop(tick)) {
      return;
    }
    early_.reset();
    if (tick.planned_ns > until_ns) {
      early_ = tick;
      return;
    }
    take(tick);
  }
}

/// `drops`: number of ticks that the ring has dropped since the start.
void TraceRecorder::countDrops(std::uint64_t drops) {
  if (drops <= ring_drops_) return;  // the tick is older than the newest count
  if (requested_) own_status_.ticks_lost += drops - ring_drops_;
  ring_drops_ = drops;
}

void TraceRecorder::take(const rt::Tick& tick) {
  countDrops(tick.trace_dropped);
  if (requested_ && !session_) ++own_status_.ticks_lost;
  dumps_.add(tick);
  write(tick);
}

void TraceRecorder::checkDisk(std::int64_t now_ns) {
  next_look_ns_ = now_ns + kLookPeriod_ns;
  space_.measure();
  finishUnfinished();
  if (session_ && session_->vanished()) {
    suspend({session_->writer().file().string(), "was taken away while it was written", ""});
  }
  if (session_) {
    if (auto go_on = mayGoOn(); !go_on) suspend(go_on.error());
  }
  if (requested_ && !session_) {
    if (auto begun = beginSession(); !begun) own_status_.detail = begun.error().text();
  }
  rotateIfDue(now_ns);
}

base::Result<void> TraceRecorder::mayBegin() {
  space_.measure();
  if (auto space = space_.enoughToBegin(); !space) return space;
  return retention_.mayBegin();
}

base::Result<void> TraceRecorder::mayGoOn() const {
  if (auto space = space_.enoughToGoOn(); !space) return space;
  return retention_.mayGoOn();
}

void TraceRecorder::rotateIfDue(std::int64_t now_ns) {
  if (!session_) return;
  const auto age_s = static_cast<double>(now_ns - session_->beginNs()) / static_cast<double>(kNsPerSecond);
  if (session_->writer().bytes() < retention_.mostFileBytes() && age_s < trace::kMaxFile_s) return;
  note("end of the trace", endSession());
  if (auto begun = beginSession(); !begun) own_status_.detail = begun.error().text();
}

trace::TraceOptions TraceRecorder::options() {
  trace::TraceOptions options = sources_.describe();
  const auto [number, clock_is_set] = numbers_.next(trace::WallClock::read());
  options.number = number;
  options.clock_is_set = clock_is_set;
  options.compress = settings_.compression == config::TraceCompression::zstd;
  options.scene = settings_.scene != config::TraceScene::off;
  options.cloud = settings_.scene == config::TraceScene::cloud;
  options.realtime_offset_ns = rt::realtimeNow_ns() - rt::monotonicNow_ns();
  options.attachments.push_back({"settings.yaml", "application/yaml", settings_yaml_});
  return options;
}

base::Result<void> TraceRecorder::beginSession() {
  if (auto may_begin = mayBegin(); !may_begin) return may_begin;
  TraceSession::Plan plan{folder_, request_.label, request_.depth, options()};
  plan.options.first_chunk_ns = kFirstChunk_ns;
  auto session = TraceSession::begin(plan, sources_.scene_thread, sources_.core_memory);
  if (!session) return std::unexpected(session.error());
  session_ = std::move(*session);
  own_status_.detail.clear();
  own_status_.name = session_->name();
  auto written = in_force_.writeTo(*session_);
  if (!written) suspend(written.error());
  return written;
}

/// Ends the session; what is not in its file by then is lost.
base::Result<std::string> TraceRecorder::endSession() {
  std::unique_ptr<TraceSession> session = std::move(session_);
  const auto ended = session->end();
  own_status_.ticks_lost += session->ticksGiven() - session->writer().ticks();
  const std::string name = session->name();
  own_status_.depth_frames_lost += session->depthFramesLost();
  retention_.requestListAfter(name);
  if (!ended) {
    unfinished_.push_back(std::move(session));
    if (unfinished_.size() > kMaxUnfinished)
      unfinished_.pop_front();  // the next start of the daemon recovers it
    return std::unexpected(ended.error());
  }
  ++own_status_.traces;
  return name;
}

/// Tries again to finish traces whose end did not fit on the full disk.
void TraceRecorder::finishUnfinished() {
  std::erase_if(unfinished_, [this](const std::unique_ptr<TraceSession>& session) {
    if (!session->vanished() && !session->end()) return false;
    if (session->hasNoFile()) {
      own_status_.ticks_lost += session->writer().ticks();
    } else {
      ++own_status_.traces;
    }
    retention_.requestList();
    return true;
  });
}

void TraceRecorder::suspend(const base::Error& error) {
  endSession();
  own_status_.detail = error.text();
}

base::Result<std::string> TraceRecorder::dump(const std::string& label) {
  if (flight_recorder_.empty()) {
    return base::failure("flight recorder", "it holds nothing",
                         "set trace.flight_recorder_s above 0 and restart hapticd");
  }
  const TraceSession::Plan plan{folder_, label, false, options()};
  auto session = TraceSession::begin(plan, sources_.scene_thread, sources_.core_memory);
  if (!session) return std::unexpected(session.error());
  const auto written = flight_recorder_.writeTo((*session)->writer());
  const auto ended = (*session)->end();
  if (!written) return std::unexpected(written.error());
  if (!ended) return std::unexpected(ended.error());
  ++own_status_.dumps;
  own_status_.last_dump = (*session)->name();
  retention_.requestList();
  return own_status_.last_dump;
}

template <typename T>
void TraceRecorder::note(const std::string& what, const base::Result<T>& outcome) {
  if (outcome) {
    problems_.erase(what);
  } else {
    problems_[what] = outcome.error().text();
  }
}

void TraceRecorder::publishStatus() {
  TraceStatus status = own_status_;
  status.state = session_ ? TraceState::writing : requested_ ? TraceState::waiting : TraceState::off;
  if (session_) {
    const trace::TraceWriter& writer = session_->writer();
    status.ticks = writer.ticks() + writer.ticksPending();
    status.bytes = writer.bytes();
    status.duration_s = static_cast<double>(rt::monotonicNow_ns() - session_->beginNs()) * 1e-9;
    status.depth_frames = session_->depthFrames();
    status.depth_frames_lost += session_->depthFramesLost();
  } else {
    status.name.clear();
  }
  for (const auto& [what, problem] : problems_) status.problems.push_back(what + ": " + problem);
  CrashRecovery::Status recovery = recovery_.status();
  status.recovered = recovery.recovered;
  std::ranges::move(recovery.problems, std::back_inserter(status.problems));
  status.flight_recorder_s = flight_recorder_.duration_s();
  status.free_bytes = space_.freeBytes();
  const std::lock_guard lock(status_mutex_);
  published_ = {std::move(status), requested_, ring_drops_, rt::monotonicNow_ns()};
}

}  // namespace hapticd::daemon

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "config/settings/settings.h"
#include "daemon/base/box.h"
#include "daemon/recorder/flight_recorder.h"
#include "daemon/recorder/retention.h"
#include "daemon/recorder/trace_session.h"
#include "daemon/state/state_file.h"
#include "daemon/trace/reader/trace_folder.h"

namespace hapticd::daemon {

/// Records every tick of the force loop: in a trace if one was requested, and in memory, from where the
/// newest ticks are written out after a fault, after an overrun burst and on request.
///
/// A thread of normal priority does all this work, so that nothing else waits for the disk. Lists and
/// deletions have threads of their own, so that the rings do not wait for a large folder. When the disk is
/// full, or the folder is missing or cannot be written, the trace waits and later continues in another file
/// by itself. Each tick that is taken while a trace was requested is written to a file or counted as lost.
/// Thread: control thread, unless stated otherwise.
class TraceRecorder {
 public:
  /// Where records come from; all of it outlives the recorder.
  struct Sources {
    rt::TraceRing& ticks;
    SceneThread& scene_thread;
    rt::CoreMemoryChannel& core_memory;
    /// Describes the box for a trace that starts now: metadata and attachments.  Thread: trace thread.
    std::function<trace::TraceOptions()> describe;
    /// For fault injection, normally null: no ticks are taken while it is true.
    const std::atomic<bool>* stalled;
    /// The camera's count of damaged frames.  Thread: trace thread.
    std::function<std::uint64_t()> damaged_frames;
  };

  TraceRecorder(const config::Settings& settings, Sources sources);
  /// Ends the recording as stop() does.
  ~TraceRecorder();
  TraceRecorder(const TraceRecorder&) = delete;
  TraceRecorder& operator=(const TraceRecorder&) = delete;

  /// Starts the trace thread, which starts another one that finishes what a crash left in the folder.
  /// Errors: the system provides no more threads.
  base::Result<void> start();
  /// Takes the last ticks and finishes the trace; does nothing if it was not started.
  void stop();

  /// Records the parameters or the fixtures and tissue regions that apply from now on, a pose that has been
  /// handed to the force loop, or an event; leaves it to the trace thread.  Thread: any.
  template <typename Record>
  void add(Record record);

  // These do what the functions of Box (box.h) with the same names promise.
  std::future<base::Result<std::string>> startTrace(const TraceRequest& request);
  std::future<base::Result<std::string>> stopTrace();
  std::future<base::Result<std::string>> dumpTrace();
  std::future<base::Result<std::vector<trace::TraceEntry>>> listTraces();
  std::future<base::Result<void>> deleteTrace(const std::string& name);
  std::future<base::Result<void>> keepTrace(const std::string& name, bool keep);
  std::future<base::Result<void>> noteTrace(const std::string& name, const std::string& text);

  /// The current state. Never waits for the disk; ticks that are lost while the disk stalls are counted at
  /// once.
  TraceStatus status() const;

 private:
  template <typename T>
  std::future<base::Result<T>> post(std::function<base::Result<T>()> work);

  // All functions from here on: trace thread, unless stated otherwise.
  void run();
  void step();
  void takeAll();
  void takeRecords();
  void takeTicks(std::int64_t until_ns);
  void take(const rt::Tick& tick);
  void countDrops(std::uint64_t drops);
  /// Called once a second: checks the space, continues in another file, tries again after a failure.
  void checkDisk(std::int64_t now_ns);
  base::Result<void> mayBegin();
  base::Result<void> mayGoOn() const;
  void rotateIfDue(std::int64_t now_ns);
  base::Result<void> beginSession();
  base::Result<std::string> endSession();
  void finishUnfinished();
  /// Gives the session up; another one is started later.
  void suspend(const base::Error& error);
  template <typename Record>
  void write(const Record& record);
  base::Result<std::string> dump(const std::string& label);
  /// Keeps a failure apart from the recording itself in the status until the same action succeeds.
  template <typename T>
  void note(const std::string& what, const base::Result<T>& outcome);
  /// Describes a trace that begins now, with the next number.
  trace::TraceOptions options();
  void publishStatus();
  /// Adds to the news of the status. Thread: any.
  void addNews(TraceNews news);

  const std::filesystem::path folder_;
  const config::TraceSettings settings_;
  const std::string settings_yaml_;  // all settings at the start, for the traces
  Sources sources_;

  std::mutex mutex_;  // protects the next five members
  std::condition_variable wake_;
  std::deque<std::function<void()>> work_;
  std::tuple<std::deque<trace::DirectiveRecord>, std::deque<trace::AdditionsRecord>,
             std::deque<trace::PoseRecord>, std::deque<trace::EventRecord>>
      waiting_;
  bool stop_ = false;
  std::uint64_t records_refused_ = 0;

  bool requested_ = false;
  TraceRequest request_;
  std::unique_ptr<TraceSession> session_;
  std::deque<std::unique_ptr<TraceSession>> unfinished_;  // oldest first
  FlightRecorder flight_recorder_;
  DumpSchedule dumps_;
  RecordsInForce in_force_;
  std::optional<rt::Tick> early_;  // popped, but newer than the other records taken so far
  std::uint64_t ring_drops_ = 0;   // ticks dropped by the ring, as far as known
  std::int64_t next_look_ns_ = 0;
  DiskSpace space_;
  TraceNumbers numbers_;
  std::map<std::string, std::string> problems_;  // the key is the action that failed
  TraceStatus own_status_;

  /// The last report of the trace thread about itself.
  struct Published {
    TraceStatus status;
    bool requested = false;        // whether a trace was requested
    std::uint64_t ring_drops = 0;  // ticks dropped by the ring that status.ticks_lost includes
    std::int64_t time_ns = 0;      // CLOCK_MONOTONIC; 0: the thread has not started or has ended
  };
  mutable std::mutex status_mutex_;
  Published published_;

  mutable std::mutex news_mutex_;
  std::deque<TraceNews> news_;
  std::uint64_t news_count_ = 0;

  Retention retention_;
  CrashRecovery recovery_;
  std::thread thread_;
  // The workers are last, so that they end first: their jobs use all of the above.
  StateWorker lists_;
  StateWorker deletions_;
};

}  // namespace hapticd::daemon

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
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "config/settings.h"
#include "daemon/box.h"
#include "daemon/state/state_worker.h"
#include "daemon/trace/disk_space.h"
#include "daemon/trace/flight_recorder.h"
#include "daemon/trace/retention.h"
#include "daemon/trace/trace_session.h"
#include "drivers/trace/trace_folder.h"

namespace hapticd::daemon {

/// Takes every tick out of the force loop and writes it where it is wanted: into a trace, and into memory,
/// from where the newest ones are written out on a fault, on an overrun burst and on request.
///
/// A thread of normal priority does all of it, so nothing else ever waits for the disk; lists and deletions
/// have threads of their own, so that the rings do not wait for a large folder. When the disk is full, the
/// folder is gone or may not be written, the trace waits and goes on in another file by itself. Every tick
/// that is taken while a trace is wanted ends in a file or is counted as lost.
/// Thread: control thread, where nothing else is said.
class TraceRecorder {
 public:
  /// All of it outlives the recorder.
  struct Sources {
    rt::TraceRing& ticks;
    SceneThread& scene_thread;
    rt::CoreMemoryChannel& core_memory;
    /// What a trace that begins now says of the box: metadata, attachments.  Thread: trace thread.
    std::function<drivers::TraceOptions()> describe;
    /// Fault injection, normally null: while it is true no ticks are taken.
    const std::atomic<bool>* deaf;
    /// Counted by the camera.  Thread: trace thread.
    std::function<std::uint64_t()> damaged_frames;
  };

  TraceRecorder(const config::Settings& settings, Sources sources);
  /// Like stop().
  ~TraceRecorder();
  TraceRecorder(const TraceRecorder&) = delete;
  TraceRecorder& operator=(const TraceRecorder&) = delete;

  /// Starts the thread, and another one that finishes what a crash left in the folder.
  /// Errors: the system gives no more threads.
  config::Result<void> start();
  /// Takes the last ticks and finishes the trace. Harmless when not started.
  void stop();

  /// What is written from now on holds them.
  void add(drivers::DirectiveRecord directive);
  void add(drivers::EventRecord event);

  // The same functions of Box (box.h) say what these do.
  std::future<config::Result<std::string>> startTrace(const TraceRequest& request);
  std::future<config::Result<std::string>> stopTrace();
  std::future<config::Result<std::string>> dumpTrace();
  std::future<config::Result<std::vector<drivers::TraceEntry>>> listTraces();
  std::future<config::Result<void>> deleteTrace(const std::string& name);
  std::future<config::Result<void>> keepTrace(const std::string& name, bool keep);
  std::future<config::Result<void>> noteTrace(const std::string& name, const std::string& text);

  /// Never waits for the disk; ticks that are lost while that stalls are in it at once.
  TraceStatus status() const;

 private:
  template <typename T>
  std::future<config::Result<T>> post(std::function<config::Result<T>()> work);

  // Everything from here on: trace thread, where nothing else is said.
  void run();
  void step();
  void takeRecords();
  void takeTicks();
  void take(const rt::Tick& tick);
  void countDrops(std::uint64_t drops);
  void watchForFaults(const rt::Tick& tick);
  /// Once a second: space, rotation, a new attempt.
  void lookAtDisk(std::int64_t now_ns);
  config::Result<void> mayBegin();
  config::Result<void> mayGoOn() const;
  void rotateIfDue(std::int64_t now_ns);
  config::Result<void> beginSession();
  config::Result<std::string> endSession();
  void finishUnfinished();
  /// Gives the session up; another one is begun later.
  void suspend(const config::Error& error);
  template <typename Record>
  void write(const Record& record);
  config::Result<std::string> dump(const std::string& label);
  /// What went wrong beside the trace that is written stands in the status until the same succeeds.
  template <typename T>
  void note(const std::string& what, const config::Result<T>& outcome);
  drivers::TraceOptions options() const;
  void recoverLeftovers(const std::vector<std::string>& names);  // a thread of its own
  void publishStatus();
  /// Thread: any.
  void tell(TraceNews news);

  const std::filesystem::path folder_;
  const config::TraceSettings settings_;
  const std::string settings_yaml_;  // all settings at the start
  Sources sources_;

  std::mutex mutex_;  // of the next five
  std::condition_variable wake_;
  std::deque<std::function<void()>> work_;
  std::deque<drivers::DirectiveRecord> directives_;
  std::deque<drivers::EventRecord> events_;
  bool stop_ = false;
  std::uint64_t records_refused_ = 0;

  bool wanted_ = false;
  TraceRequest request_;
  std::unique_ptr<TraceSession> session_;
  std::deque<std::unique_ptr<TraceSession>> unfinished_;  // the oldest first
  FlightRecorder flight_recorder_;
  drivers::DirectiveRecord directive_;  // the newest one: each trace begins with it
  rt::Tick last_tick_;
  std::uint64_t ring_drops_ = 0;  // of the ring, as far as they are known
  std::int64_t dump_due_ns_ = 0;  // 0: none is
  std::string dump_label_;
  std::int64_t next_look_ns_ = 0;
  DiskSpace space_;
  std::map<std::string, std::string> problems_;  // by what was tried
  TraceStatus own_status_;

  /// What the trace thread last said of itself.
  struct Published {
    TraceStatus status;
    bool wanted = false;           // a trace
    std::uint64_t ring_drops = 0;  // of the ring, as far as status.ticks_lost has them
    std::int64_t time_ns = 0;      // CLOCK_MONOTONIC; 0: it has not begun or has ended
  };
  mutable std::mutex status_mutex_;
  Published published_;

  mutable std::mutex news_mutex_;
  std::deque<TraceNews> news_;
  std::uint64_t news_told_ = 0;

  /// What the thread of recoverLeftovers() has done.
  struct Recovery {
    std::uint64_t recovered = 0;
    std::vector<std::string> problems;
  };
  std::mutex recovery_mutex_;
  Recovery recovery_outcome_;

  Retention retention_;
  std::thread thread_;
  std::thread recovery_;
  // They end first, as their jobs use all of the above.
  StateWorker lists_;
  StateWorker deletions_;
};

}  // namespace hapticd::daemon

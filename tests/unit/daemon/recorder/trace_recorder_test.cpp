// SPDX-License-Identifier: Apache-2.0
// Every tick is accounted for when the disk fails: written, counted as lost, or still in the ring.
#include "daemon/recorder/trace_recorder.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <future>
#include <memory>
#include <mutex>

#include "daemon/trace/reader/trace_folder.h"
#include "daemon/trace/reader/trace_reader.h"
#include "daemon/trace/writer/trace_writer.h"
#include "rt/base/clock.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;
using daemon::TraceRecorder;
using daemon::TraceState;
using daemon::TraceStatus;

/// While the object exists, no file of this process grows beyond this size: a disk that is full for every
/// trace.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() { lift(); }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;
  void lift() { ::setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

/// A recorder whose force loop is the test.
class TraceRecorderTest : public testing::Test {
 protected:
  TraceRecorderTest() {
    settings.state.folder = folder.path() / "state";
    settings.trace.compression = config::TraceCompression::none;
    settings.trace.min_free_mb = 0;
    settings.trace.max_file_mb = 1;
    settings.trace.flight_recorder_s = 1;
  }

  void start() {
    recorder = std::make_unique<TraceRecorder>(
        settings, TraceRecorder::Sources{*ring, scene_thread, *memory,
                                         [this] {
                                           std::shared_future<void> release;
                                           {
                                             const std::lock_guard lock(mutex);
                                             release = stall;
                                           }
                                           if (release.valid()) {
                                             stalled = true;
                                             release.wait();
                                           }
                                           return trace::TraceOptions{};
                                         },
                                         nullptr, [] { return std::uint64_t{0}; }});
    ASSERT_TRUE(recorder->start());
  }

  void push(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      rt::Tick tick;
      tick.number = ++pushed;
      tick.planned_ns = static_cast<std::int64_t>(pushed) * 1'000'000;
      tick.trace_dropped = ring->dropped();
      ring->push(tick);
    }
  }
  /// Waits until the trace thread has taken every tick: it does that before it replies.
  void settle() const { (void)recorder->startTrace({}).get(); }

  fs::path traces() const { return folder.path() / "state/traces"; }

  /// Returns the number of ticks in all finished traces except dumps, which repeat ticks; each must hold
  /// some.
  std::uint64_t ticksInFiles() const {
    std::uint64_t ticks = 0;
    const auto entries = trace::listTraces(traces());
    EXPECT_TRUE(entries) << entries.error().text();
    for (const trace::TraceEntry& entry : *entries) {
      EXPECT_FALSE(entry.open) << entry.name << " was left open";
      if (entry.open || trace::isDumpName(entry.name)) continue;
      const auto info = trace::readTrace(traces() / (entry.name + ".mcap"));
      EXPECT_TRUE(info && info->complete) << entry.name;
      if (!info) continue;
      EXPECT_GT(info->ticks, 0U) << entry.name << " is an empty trace";
      ticks += info->ticks;
    }
    return ticks;
  }

  TemporaryFolder folder;
  config::Settings settings;
  std::unique_ptr<rt::SceneChannel> scenes = std::make_unique<rt::SceneChannel>();
  rt::TripleBuffer<rt::Vec3> focus;
  daemon::SceneThread scene_thread{settings.camera.effectiveDepthModel(),
                                   settings.camera.pose(),
                                   settings.grid,
                                   rt::SceneNeeds::of(settings.effectiveLive()),
                                   *scenes,
                                   focus};
  std::unique_ptr<rt::TraceRing> ring = std::make_unique<rt::TraceRing>();
  std::unique_ptr<rt::CoreMemoryChannel> memory = std::make_unique<rt::CoreMemoryChannel>();
  std::mutex mutex;
  std::shared_future<void> stall;  ///< while it exists and is not ready, the start of a trace waits
  std::atomic<bool> stalled{false};
  std::uint64_t pushed = 0;
  std::unique_ptr<TraceRecorder> recorder;
};

class TraceRecorderOnAFullDisk : public TraceRecorderTest, public testing::WithParamInterface<int> {};

TEST_P(TraceRecorderOnAFullDisk, EveryTickIsInAFileOrCountedAsLost) {
  start();
  ASSERT_TRUE(recorder->startTrace({}).get());
  push(1500);
  settle();
  FileSizeLimit limit(static_cast<rlim_t>(GetParam()) * 1000);
  // the end of the first trace, and of some that are tried after it
  const bool suspended = becomesTrue([&] {
    push(500);
    settle();
    return recorder->status().state == TraceState::waiting;
  });
  ASSERT_TRUE(suspended);
  for (int attempt = 0; attempt < 2; ++attempt) {
    ASSERT_TRUE(becomesTrue([&] { return recorder->status().state == TraceState::writing; }));
    EXPECT_TRUE(becomesTrue([&] {
      push(500);
      settle();
      return recorder->status().state == TraceState::waiting;
    }));
  }
  limit.lift();
  ASSERT_TRUE(becomesTrue([&] { return recorder->status().state == TraceState::writing; }));
  push(700);
  (void)recorder->stopTrace().get();
  ASSERT_TRUE(becomesTrue([&] {
    const auto entries = trace::listTraces(traces());
    return entries && std::ranges::none_of(*entries, &trace::TraceEntry::open);
  })) << "a trace whose end did not fit is ended when there is room";
  recorder->stop();
  EXPECT_EQ(ticksInFiles() + recorder->status().ticks_lost, pushed);
  EXPECT_GT(recorder->status().ticks_lost, 0U);
  EXPECT_EQ(ring->dropped(), 0U) << "the test is no force loop that is too fast";
}

// Thousands of bytes that a file may have: less than a chunk; chunks fit, but not all; the end does not fit.
INSTANTIATE_TEST_SUITE_P(Limits, TraceRecorderOnAFullDisk, testing::Values(100, 1000, 1700, 2300));

TEST_F(TraceRecorderTest, TicksOfATraceThatIsTakenAwayAreCountedAsLost) {
  start();
  ASSERT_TRUE(recorder->startTrace({}).get());
  push(2500);
  settle();
  fs::rename(traces(), folder.path() / "away");
  std::ofstream(traces()) << "no folder";
  ASSERT_TRUE(becomesTrue([&] { return recorder->status().state == TraceState::waiting; }));
  push(1000);
  settle();
  fs::remove(traces());
  ASSERT_TRUE(becomesTrue([&] { return recorder->status().state == TraceState::writing; }));
  push(1200);
  ASSERT_TRUE(recorder->stopTrace().get());
  recorder->stop();
  EXPECT_EQ(ticksInFiles() + recorder->status().ticks_lost, pushed);
}

TEST_F(TraceRecorderTest, ShowsTheTicksThatAStalledDiskLosesWhileItStalls) {
  start();
  ASSERT_TRUE(recorder->startTrace({}).get());
  push(100);
  settle();
  std::promise<void> release;
  {
    const std::lock_guard lock(mutex);
    stall = release.get_future().share();
  }
  auto dump = recorder->dumpTrace();  // the trace thread waits in it, as it does for a disk
  ASSERT_TRUE(becomesTrue([&] { return stalled.load(); }));
  push(static_cast<int>(rt::kTraceRingCapacity) + 300);
  EXPECT_EQ(recorder->status().ticks_lost, 300U);
  push(11);
  EXPECT_EQ(recorder->status().ticks_lost, 311U);
  EXPECT_TRUE(becomesTrue([&] {
    const TraceStatus status = recorder->status();
    return std::ranges::any_of(status.problems, [](const std::string& problem) {
      return problem.find("the disk has not answered for") != std::string::npos;
    });
  })) << "a stall is reported while it lasts";
  release.set_value();
  ASSERT_TRUE(dump.get());
  settle();  // the ring has room again
  push(1);   // notifies the recorder of what was dropped
  settle();
  EXPECT_EQ(recorder->status().ticks_lost, 311U);
  EXPECT_TRUE(recorder->status().problems.empty());
  ASSERT_TRUE(recorder->stopTrace().get());
  recorder->stop();
  EXPECT_EQ(ticksInFiles() + recorder->status().ticks_lost, pushed);
}

TEST_F(TraceRecorderTest, ListsMarksAndDeletesWhileTheTraceThreadWaitsForTheDisk) {
  start();
  ASSERT_TRUE(recorder->startTrace({}).get());
  push(100);
  const auto name = recorder->stopTrace().get();
  ASSERT_TRUE(name);
  std::promise<void> release;
  {
    const std::lock_guard lock(mutex);
    stall = release.get_future().share();
  }
  auto begun = recorder->startTrace({});
  ASSERT_TRUE(becomesTrue([&] { return stalled.load(); }));
  const auto isDone = [](auto future) {
    return future.wait_for(maxPatience()) == std::future_status::ready && future.get().has_value();
  };
  EXPECT_TRUE(isDone(recorder->listTraces()));
  EXPECT_TRUE(isDone(recorder->keepTrace(*name, true)));
  EXPECT_TRUE(isDone(recorder->keepTrace(*name, false)));
  EXPECT_TRUE(isDone(recorder->deleteTrace(*name)));
  EXPECT_FALSE(fs::exists(traces() / (*name + ".mcap")));
  release.set_value();
  EXPECT_TRUE(begun.get());
}

TEST_F(TraceRecorderTest, TicksDroppedAtTheVeryEndAreCounted) {
  start();
  ASSERT_TRUE(recorder->startTrace({}).get());
  push(10);
  settle();
  std::promise<void> release;
  {
    const std::lock_guard lock(mutex);
    stall = release.get_future().share();
  }
  auto dump = recorder->dumpTrace();
  ASSERT_TRUE(becomesTrue([&] { return stalled.load(); }));
  push(static_cast<int>(rt::kTraceRingCapacity) + 5);
  auto stopped = recorder->stopTrace();
  release.set_value();
  ASSERT_TRUE(stopped.get());
  recorder->stop();
  EXPECT_EQ(recorder->status().ticks_lost, 5U);
}

TEST_F(TraceRecorderTest, ADumpThatWaitsIsWrittenBeforeTheDaemonEnds) {
  settings.trace.flight_recorder_s = 60;
  start();
  // bursts of overruns that began so long ago that the dump of the first is due; that of the second waits
  rt::Tick tick;
  tick.planned_ns = rt::monotonicNow_ns() - 2 * rt::kNsPerSecond;
  for (const rt::Cause cause :
       {rt::Cause::overrun_burst, rt::Cause::none, rt::Cause::overrun_burst, rt::Cause::none}) {
    tick.number = ++pushed;
    tick.mode = cause == rt::Cause::none ? rt::Mode::engaged : rt::Mode::holding;
    tick.cause = cause;
    ring->push(tick);
    settle();
  }
  const auto dumps = [&] {
    return std::ranges::count_if(fs::directory_iterator(traces()), [](const fs::directory_entry& entry) {
      return entry.path().extension() == ".mcap" && trace::isDumpName(entry.path().stem().string());
    });
  };
  EXPECT_EQ(dumps(), 1);
  recorder->stop();
  EXPECT_EQ(dumps(), 2);
}

}  // namespace
}  // namespace hapticd::test

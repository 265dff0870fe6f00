// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <random>
#include <span>

#include "daemon/recorder/trace_session.h"
#include "daemon/trace/reader/trace_folder.h"
#include "daemon/trace/reader/trace_reader.h"
#include "daemon/trace/writer/trace_writer.h"
#include "drivers/camera/kinect_image.h"
#include "rt/base/clock.h"
#include "tests/support/made_up_pixel.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::daemon {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// A session whose scene thread and force loop are the test.
class SessionWithDepth : public testing::Test {
 protected:
  SessionWithDepth() {
    auto session = TraceSession::begin({folder_.path(), "", true, {}}, scene_thread_, core_memory_);
    EXPECT_TRUE(session) << session.error().text();
    if (session) session_ = std::move(*session);
  }

  void writeModel(std::uint64_t number, bool recorded, bool forgot = false) {
    trace::ModelRecord model;
    model.model = number;
    model.depth_recorded = recorded;
    model.forgot = forgot;
    EXPECT_TRUE(session_->write(model));
  }
  /// Writes a tick whose force comes from that scene; provides the snapshot that the session requests.
  void writeTick(std::uint64_t model, std::int64_t time_ns) {
    rt::Tick tick;
    tick.number = ++ticks_;
    tick.planned_ns = time_ns;
    tick.scene_model = model;
    EXPECT_TRUE(session_->write(tick));
    core_memory_.snapshot.back().request = core_memory_.request.load();
    core_memory_.snapshot.publish();
    EXPECT_TRUE(session_->writeWhatIsReady());
  }
  std::uint64_t snapshots() const { return core_memory_.request.load(); }

  const test::TemporaryFolder folder_;
  rt::SceneChannel scenes_;
  rt::TripleBuffer<rt::Vec3> focus_;
  SceneThread scene_thread_{{}, {}, {}, {}, scenes_, focus_};
  rt::CoreMemoryChannel core_memory_;
  std::unique_ptr<TraceSession> session_;
  std::uint64_t ticks_ = 0;
};

TEST_F(SessionWithDepth, TakesASnapshotOfTheCoreFromTheFirstRecordedSceneOnAndAgainSoonAfterAGap) {
  const std::int64_t begin_ns = 100 * kSecond_ns;
  writeModel(1, false);
  writeTick(1, begin_ns);
  EXPECT_EQ(snapshots(), 0U) << "nothing is recorded yet";
  writeModel(2, true, true);
  writeTick(1, begin_ns);
  EXPECT_EQ(snapshots(), 0U) << "the loop still feels the scene before";
  writeTick(2, begin_ns);
  EXPECT_EQ(snapshots(), 1U);
  writeTick(2, begin_ns + 3 * kSecond_ns);
  EXPECT_EQ(snapshots(), 1U) << "the next one would be due after 10 s";
  writeModel(3, false);
  writeTick(3, begin_ns + 4 * kSecond_ns);
  EXPECT_EQ(snapshots(), 1U) << "it would be of no use";
  writeModel(4, true, true);
  writeTick(4, begin_ns + 5 * kSecond_ns);
  EXPECT_EQ(snapshots(), 2U);
  writeModel(5, false);
  writeModel(6, true);
  writeTick(6, begin_ns + 5 * kSecond_ns + 1);
  EXPECT_EQ(snapshots(), 2U) << "no more than one a second";
  writeTick(6, begin_ns + 6 * kSecond_ns);
  EXPECT_EQ(snapshots(), 3U);

  ASSERT_TRUE(session_->end());
  const auto info = trace::readTrace(folder_.path() / (session_->name() + ".mcap"));
  ASSERT_TRUE(info) << info.error().text();
  EXPECT_EQ(info->snapshots, 3U);
}

}  // namespace

namespace {

std::unique_ptr<rt::DepthFrame> madeUpFrame(std::uint64_t number) {
  auto frame = std::make_unique<rt::DepthFrame>();
  for (std::size_t pixel = 0; pixel < drivers::kKinectPixels; ++pixel) {
    frame->raw[pixel] = test::madeUpPixel(static_cast<std::uint32_t>(number), pixel);
  }
  frame->sequence = number;
  frame->arrival_ns = static_cast<std::int64_t>(number) * 33'000'000;
  return frame;
}

TEST(DepthRecorder, GivesEveryFrameInItsOrderWithTheCamerasHeader) {
  rt::DepthFrameHeader common;
  common.device_tick_hz = 594;
  const auto recorder = DepthRecorder::start(common);
  ASSERT_TRUE(recorder) << recorder.error().text();
  trace::DepthDecoder decoder;
  RecordedFrame recorded;
  const auto back = std::make_unique<rt::DepthFrame>();
  std::uint64_t taken = 0;
  const auto take = [&] {
    while ((*recorder)->take(recorded)) {
      ASSERT_EQ(decoder.decode(recorded.depth, *back), "");
      const auto expected = madeUpFrame(++taken);
      EXPECT_EQ(back->sequence, expected->sequence);
      EXPECT_EQ(std::memcmp(back->raw, expected->raw, back->image().size_bytes()), 0) << taken;
      EXPECT_EQ(recorded.depth.header.device_tick_hz, 594U);
      EXPECT_TRUE(recorded.cloud.points_m_in_optical.empty());
    }
  };
  for (std::uint64_t number = 1; number <= 20; ++number) {
    const auto frame = madeUpFrame(number);
    while (!(*recorder)->offer(*frame)) take();
    take();
  }
  (*recorder)->finish();
  take();
  EXPECT_EQ(taken, 20U);
}

TEST(DepthRecorder, RefusesAndCountsWhatASlowDiskHasNoRoomForAndLosesNothingThatItTook) {
  const auto recorder = DepthRecorder::start({});
  ASSERT_TRUE(recorder) << recorder.error().text();
  std::mt19937_64 random(1);
  const auto noise = std::make_unique<rt::DepthFrame>();  // it cannot be compressed
  for (std::uint16_t& raw : noise->image()) raw = static_cast<std::uint16_t>(random() % 65'536);
  std::uint64_t offered = 0;
  // nobody takes any: it must come to an end
  ASSERT_TRUE(test::becomesTrue([&] {
    if ((*recorder)->offer(*noise)) ++offered;
    return offered > DepthRecorder::kFrames && (*recorder)->lost() > 50;
  }));
  EXPECT_LE(offered * noise->image().size_bytes(),
            DepthRecorder::kMaxWaitingBytes + (DepthRecorder::kFrames + 1) * noise->image().size_bytes());
  (*recorder)->finish();
  std::uint64_t taken = 0;
  for (RecordedFrame recorded; (*recorder)->take(recorded);) ++taken;
  EXPECT_EQ(taken, offered);
}

TEST(DepthRecorder, GivesThePointsInTheNewestBallWithTheTimeOfTheirFrame) {
  rt::DepthFrameHeader common;
  common.depth_law_coefficients = {-0.003071102, 3.330949516};
  common.fx_px = common.fy_px = 594;
  common.cx_px = 320;
  common.cy_px = 240;
  common.rotation_world_camera = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const auto recorder = DepthRecorder::start(common, true);
  ASSERT_TRUE(recorder) << recorder.error().text();
  const trace::ros::ModelledBall ball{{0, 0, -1}, 0.3};
  auto frame = madeUpFrame(3);
  std::ranges::fill(frame->image(), std::uint16_t{760});  // 1.003 m
  const auto take = [&] {
    RecordedFrame recorded;
    EXPECT_TRUE(test::becomesTrue([&] { return (*recorder)->take(recorded); }));
    return recorded;
  };
  ASSERT_TRUE((*recorder)->offer(*frame));
  EXPECT_TRUE(take().cloud.points_m_in_optical.empty()) << "no ball is known yet";
  (*recorder)->setBall(ball);
  ASSERT_TRUE((*recorder)->offer(*frame));
  const RecordedFrame recorded = take();
  EXPECT_EQ(recorded.cloud.time_ns, frame->arrival_ns);
  trace::ros::DepthView view;
  const rt::DepthFrameHeader header = trace::headerOf(common, *frame);
  view.set(header, std::as_bytes(frame->image()));
  std::vector<float> expected;
  view.pointsInBall(ball, expected);
  EXPECT_GT(expected.size(), 3000U);
  EXPECT_EQ(recorded.cloud.points_m_in_optical, expected);
}

}  // namespace
}  // namespace hapticd::daemon

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;
using daemon::TraceNumbers;
using trace::WallClock;

constexpr std::int64_t kDay_ns = 86'400 * rt::kNsPerSecond;
constexpr std::int64_t kToday_ns = 1'790'000'000 * rt::kNsPerSecond;  // in 2026

WallClock clockAt(std::int64_t time_ns, bool synchronised = false) {
  return {.realtime_ns = time_ns, .synchronised = synchronised, .kept_by_battery = true};
}

class TraceNumbersTest : public testing::Test {
 protected:
  void addTrace(const std::string& name, const trace::TraceOptions& options) const {
    fs::create_directories(folder.path() / "traces");
    auto writer = trace::TraceWriter::create(folder.path() / "traces" / (name + ".mcap"), options);
    ASSERT_TRUE(writer && (*writer)->close());
  }
  TraceNumbers::Next next(const WallClock& clock) const { return TraceNumbers(folder.path()).next(clock); }

  const TemporaryFolder folder;
};

TEST_F(TraceNumbersTest, CountOnFromOneStartToTheNext) {
  TraceNumbers numbers(folder.path());
  EXPECT_EQ(numbers.next(clockAt(kToday_ns)).number, 1U);
  EXPECT_EQ(numbers.next(clockAt(kToday_ns)).number, 2U);
  EXPECT_EQ(next(clockAt(0)).number, 3U);
  EXPECT_EQ(next(clockAt(kToday_ns)).number, 4U);
}

TEST_F(TraceNumbersTest, GoOnFromTheTracesWhereTheCountIsLost) {
  addTrace("a", {.number = 41});
  addTrace("b", {.number = 7});
  addTrace("c", {});
  for (const char* damaged : {"", "traces: {number: 3", "traces: {number: -1, latest_ns: 0}",
                              "traces: {number: 3}", "\xff", "number: 3"}) {
    folder.write("trace_count.yaml", damaged);
    EXPECT_EQ(next(clockAt(kToday_ns)).number, 42U) << damaged;
  }
  fs::remove(folder.path() / "trace_count.yaml");
  EXPECT_EQ(next(clockAt(kToday_ns)).number, 42U);
  EXPECT_EQ(next(clockAt(kToday_ns)).number, 43U) << "from the file, although there is no trace 42";
}

TEST_F(TraceNumbersTest, AClockThatIsBehindTheLastTraceIsNotSet) {
  EXPECT_TRUE(next(clockAt(kToday_ns)).clock_is_set);
  EXPECT_FALSE(next(clockAt(kToday_ns - kDay_ns)).clock_is_set);
  EXPECT_FALSE(next(clockAt(0)).clock_is_set);
  EXPECT_TRUE(next(clockAt(kToday_ns + 1)).clock_is_set);
  EXPECT_TRUE(next(clockAt(kToday_ns - kDay_ns, true)).clock_is_set) << "the network knows better";
  EXPECT_TRUE(next(clockAt(kToday_ns - kDay_ns + 1)).clock_is_set) << "from then on";
}

TEST_F(TraceNumbersTest, TimesOfTracesWhoseClockWasNotSetDoNotCount) {
  addTrace("2026-09-21T13-33-20Z", {.clock_is_set = true, .number = 1});
  addTrace("2099-01-01T00-00-00Z", {.clock_is_set = false, .number = 2});
  EXPECT_TRUE(next(clockAt(kToday_ns)).clock_is_set);
}

TEST_F(TraceNumbersTest, WhereTheCountCannotBeKeptTheTracesTellIt) {
  folder.write("trace_count.yaml", "traces: {number: 3, latest_ns: 0}");
  addTrace("a", {.number = 41});
  fs::create_directory(folder.path() / "trace_count.yaml.new");  // in the way of the temporary file
  TraceNumbers numbers(folder.path());
  EXPECT_EQ(numbers.next(clockAt(kToday_ns)).number, 42U);
  EXPECT_EQ(numbers.next(clockAt(kToday_ns)).number, 43U);
}

TEST(WallClockTest, IsSetWhereTheNetworkOrABatteryKeepsIt) {
  const WallClock kept{.realtime_ns = kToday_ns, .synchronised = false, .kept_by_battery = true};
  const WallClock synchronised{.realtime_ns = kToday_ns, .synchronised = true, .kept_by_battery = false};
  const WallClock neither{.realtime_ns = kToday_ns, .synchronised = false, .kept_by_battery = false};
  EXPECT_TRUE(kept.isSet(0) && kept.isSet(kToday_ns));
  EXPECT_FALSE(kept.isSet(kToday_ns + 1));
  EXPECT_TRUE(synchronised.isSet(kToday_ns + kDay_ns));
  EXPECT_FALSE(neither.isSet(0));
  for (const std::int64_t past_ns : {std::int64_t{0}, 1'700'000'000 * rt::kNsPerSecond}) {
    EXPECT_FALSE((WallClock{past_ns, true, true}.isSet(0))) << past_ns;
  }
}

TEST(WallClockTest, ReadsWhetherTheKernelTookTheTimeFromADevice) {
  const TemporaryFolder root;
  fs::create_directories(root.path() / "sys/class/rtc/rtc0");
  fs::create_directories(root.path() / "sys/class/rtc/rtc1");
#if !defined(__x86_64__)
  EXPECT_FALSE(WallClock::read(root.path()).kept_by_battery);
  root.write("sys/class/rtc/rtc0/hctosys", "0\n");
  EXPECT_FALSE(WallClock::read(root.path()).kept_by_battery);
#endif
  root.write("sys/class/rtc/rtc1/hctosys", "1\n");
  EXPECT_TRUE(WallClock::read(root.path()).kept_by_battery);
  EXPECT_GT(WallClock::read(root.path()).realtime_ns, kToday_ns - 365 * kDay_ns);
}

}  // namespace
}  // namespace hapticd::test

// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder/trace_session.h"

#include <gtest/gtest.h>

#include "daemon/trace/reader/trace_reader.h"
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
}  // namespace hapticd::daemon

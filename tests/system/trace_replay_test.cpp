// SPDX-License-Identifier: Apache-2.0
// A session that hapticd has logged with its depth, computed again by haptic-replay.

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <span>
#include <thread>

#include "daemon/trace/format/depth_codec.h"
#include "daemon/trace/reader/trace_reader.h"
#include "daemon/trace/writer/trace_writer.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/recordings/scratch_recording.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::contains;
using test::Daemon;
using test::DaemonHome;
using test::exitedWith;
using test::Finished;

/// A ball that comes and goes, seen with the noise of the sensor, and a hand that strokes it.
constexpr const char* kSceneYaml =
    "safety: {handle_timeout_s: 1, depth_timeout_s: 5, engage_inside: true, overrun_burst: 65}\n"
    "camera: {driver: synthetic}\n"
    "synthetic: {scene: moving_sphere, noise: sensor, motion_amplitude_m: 0.03}\n"
    "simulated_handle: {start_z_m: -0.86, travel_m: 0.1, stroke_m: 0.03}\n"
    "control: {engage_at_start: true}\n";

Finished replayed(const fs::path& trace, std::vector<std::string> more = {}) {
  more.insert(more.begin(), {"--trace", trace.string()});
  return test::runToEnd(test::hapticReplayCommand(more));
}

/// The number in front of `what` in the output.
std::uint64_t countOf(const std::string& output, const std::string& what) {
  const std::size_t end = output.find(what);
  if (end == std::string::npos) return 0;
  const std::size_t begin = output.find_last_not_of("0123456789", end - 1) + 1;
  return std::stoull("0" + output.substr(begin, end - begin));
}

constexpr std::uint64_t kContactTicks = 400;

/// Logs until so many frames of depth have been recorded and the hand has been in contact for kContactTicks,
/// with changes of parameters in between; the trace.
fs::path loggedSession(const DaemonHome& home, Daemon& daemon, std::uint64_t frames) {
  EXPECT_TRUE(daemon.answers());
  EXPECT_TRUE(daemon.reaches([](const json& status) { return status.at("mode") == "engaged"; }));
  const Finished started = home.control({"--json", "trace", "start", "--depth", "--label", "session"});
  EXPECT_EQ(started.ending, exitedWith(0)) << started.errors;
  const auto contactTicks = [](const json& status) -> std::uint64_t {
    return status.at("loop").at("counters").at("contactTicks");
  };
  const std::uint64_t felt_before = contactTicks(daemon.status());
  const auto recorded = [](std::uint64_t count) {
    return [count](const json& status) { return status.at("trace").at("depthFrames") >= count; };
  };
  EXPECT_TRUE(daemon.reaches(recorded(frames / 3)));
  EXPECT_EQ(home.control({"set", "force.stiffness_n_per_m=412.7"}).ending, exitedWith(0));
  EXPECT_TRUE(daemon.reaches(recorded(2 * frames / 3)));
  EXPECT_EQ(home.control({"disengage"}).ending, exitedWith(0));
  EXPECT_EQ(home.control({"engage", "--inside"}).ending, exitedWith(0));
  EXPECT_TRUE(daemon.reaches(recorded(frames)));
  EXPECT_TRUE(daemon.reaches(
      [&](const json& status) { return contactTicks(status) >= felt_before + kContactTicks; }));
  const Finished stopped = home.control({"--json", "trace", "stop"});
  EXPECT_EQ(stopped.ending, exitedWith(0)) << stopped.errors;
  const json reply = json::parse(stopped.output, nullptr, false);
  return home.traceFolder() / (reply.value("name", "none") + ".mcap");
}

/// Expects that all forces of the trace are computed again to the bit; returns what haptic-replay says.
std::string expectSameForces(const fs::path& trace) {
  const Finished replay = replayed(trace);
  EXPECT_EQ(replay.ending, exitedWith(0)) << replay.output << replay.errors;
  EXPECT_TRUE(contains(replay.output, "different: 0 ticks")) << replay.output;
  EXPECT_GT(countOf(replay.output, " ticks computed again"), 1000U) << replay.output;
  return replay.output;
}

/// Expects that a fixture acts in more than a hundred ticks of the trace.
trace::TraceInfo expectFixturesAct(const fs::path& trace) {
  std::uint64_t acting = 0;
  const auto info = trace::readTrace(trace, {.tick = [&acting](const rt::Tick& tick) {
                                       return acting += tick.fixtures_in_contact != 0, true;
                                     }});
  EXPECT_TRUE(info) << info.error().text();
  EXPECT_GT(acting, 100U);
  return info.value_or(trace::TraceInfo{});
}

struct Setting {
  const char* name;
  std::vector<std::string> set;
};

class TraceReplay : public testing::TestWithParam<Setting> {};

TEST_P(TraceReplay, ReproducesEveryForceToTheBit) {
  const DaemonHome home;
  Daemon daemon(home, kSceneYaml, GetParam().set);
  const fs::path trace = loggedSession(home, daemon, 75);
  const std::string said = expectSameForces(trace);
  EXPECT_TRUE(contains(said, "largest difference: 0 N of the commanded force"));
  EXPECT_GT(countOf(said, " in contact"), kContactTicks / 2) << said;
  EXPECT_GT(countOf(said, " scenes modelled"), 50U) << said;
}

INSTANTIATE_TEST_SUITE_P(Laws, TraceReplay,
                         testing::Values(Setting{"springs", {"force.law=nearest_springs"}},
                                         Setting{"proxy", {"force.law=proxy", "contact.friction=0.4"}},
                                         Setting{"surface_with_filter_and_fusion",
                                                 {"force.law=surface", "filter.temporal_frames=8",
                                                  "filter.spatial_radius_px=2", "surface.fusion_frames=8",
                                                  "safety.force_filter_hz=80"}},
                                         Setting{"automatic", {"force.law=auto"}}),
                         [](const auto& parameter) { return std::string(parameter.param.name); });

TEST(TraceReplayWithFixtures, ReproducesEveryForceToTheBit) {
  const DaemonHome home;
  const std::string fixtures =
      "fixtures:\n"
      "  - {name: floor, kind: plane, position_m: [0, 0, -0.945], normal: [0, 0, 1]}\n"
      "  - {name: lead, kind: path, points_m: [[-0.05, 0, -0.88], [0.05, 0.02, -0.88]], stiffness_n_per_m: "
      "60}\n"
      "regions:\n"
      "  - {name: soft, shape: sphere, position_m: [0, 0, -0.9], radius_m: 0.1, stiffness_n_per_m: 300}\n";
  Daemon daemon(home, kSceneYaml + fixtures, {"force.law=surface"});
  const fs::path trace = loggedSession(home, daemon, 75);
  EXPECT_GE(expectFixturesAct(trace).additions, 1U);
  expectSameForces(trace);
}

/// Feeds poses of a frame that goes up and down by 4 mm, until it is destroyed.
class PoseStream {
 public:
  explicit PoseStream(const DaemonHome& home)
      : thread_([this, &home](const std::stop_token& stop) {
          while (!stop.stop_requested()) {
            // a program for each pose: never more than the box takes
            const std::string line =
                fmt::format("0,0,{},0,0,0,1\n", -0.945 + 0.004 * std::sin(0.02 * ++count_));
            const Finished fed = home.controlWithInput(line, {"frame", "feed", "phantom"});
            EXPECT_EQ(fed.ending, exitedWith(0)) << fed.errors;
          }
        }) {}

 private:
  int count_ = 0;
  std::jthread thread_;
};

TEST(TraceReplayWithMovingFrames, ReproducesEveryForceToTheBit) {
  const DaemonHome home;
  const std::string fixtures =
      "frames: [{name: phantom, timeout_s: 5}]\n"
      "fixtures:\n"
      "  - {name: wall, kind: box, frame: phantom, position_m: [0.04, 0, 0.04], size_m: [0.05, 0.2, 0.2]}\n";
  Daemon daemon(home, kSceneYaml + fixtures, {"force.law=surface"});
  ASSERT_TRUE(daemon.answers());
  fs::path trace;
  {
    const PoseStream poses(home);
    trace = loggedSession(home, daemon, 75);
  }
  EXPECT_GT(expectFixturesAct(trace).poses, 10U);  // as many as the machine starts programs meanwhile
  expectSameForces(trace);
}

/// All that a trace holds, to be rewritten with changes.
struct Session : test::MadeUpRecords {
  trace::TraceOptions options = {};
};

Session recordsIn(const fs::path& trace) {
  Session content{test::recordsIn(trace)};
  const auto info = trace::readTrace(trace);
  EXPECT_TRUE(info) << info.error().text();
  content.options.realtime_offset_ns = info->realtime_offset_ns;
  content.options.metadata = info->metadata;
  content.options.attachments = info->attachments;
  content.options.depth = true;
  return content;
}

/// Depth comes last: a reader must not rely on the order.
void writeSession(const fs::path& trace, const Session& content) {
  const auto writer = trace::TraceWriter::create(trace, content.options);
  ASSERT_TRUE(writer) << writer.error().text();
  const auto writeAll = [&writer](const auto& several) {
    for (const auto& record : several) ASSERT_TRUE((*writer)->write(record));
  };
  writeAll(content.models);
  writeAll(content.directives);
  writeAll(content.additions);
  writeAll(content.snapshots);
  writeAll(content.ticks);
  writeAll(content.depth);
  ASSERT_TRUE((*writer)->close());
}

/// Removes frames from a trace, by their positions.
void loseFrames(Session& content, std::size_t first, std::size_t count) {
  const auto begin = content.depth.begin() + static_cast<std::ptrdiff_t>(first);
  content.depth.erase(begin, begin + static_cast<std::ptrdiff_t>(count));
}

TEST(TraceReplayOfAnotherScene, FindsTheDifference) {
  const DaemonHome home;
  Daemon daemon(home, kSceneYaml);
  Session content = recordsIn(loggedSession(home, daemon, 40));
  ASSERT_GE(content.depth.size(), 40U);
  // The hand can no longer touch anything: a wall, out of its reach.
  const std::vector<std::uint16_t> wall(test::kImagePixels, 1000);
  trace::DepthEncoder encoder;
  for (trace::DepthRecord& record : content.depth) {
    const rt::DepthFrameHeader header = record.header;
    encoder.encode(header, std::as_bytes(std::span(wall)), record);
  }
  const fs::path trace = home.path() / "wall.mcap";
  writeSession(trace, content);
  const Finished replay = replayed(trace, {"--out", home.path() / "forces.csv"});
  EXPECT_EQ(replay.ending, exitedWith(1)) << replay.output << replay.errors;
  EXPECT_GT(countOf(replay.output, " ticks\nlargest difference"), 100U) << replay.output;
  EXPECT_TRUE(fs::exists(home.path() / "forces.csv"));
}

class TraceReplayOverAGap : public testing::Test {
 protected:
  Session session(const std::vector<std::string>& set) {
    daemon_.emplace(home_, kSceneYaml, set);
    return recordsIn(loggedSession(home_, *daemon_, 60));
  }
  Finished replayOf(const Session& content, const std::vector<std::string>& more = {}) {
    const fs::path trace = home_.path() / "gap.mcap";
    writeSession(trace, content);
    return replayed(trace, more);
  }

  const DaemonHome home_;
  std::optional<Daemon> daemon_;
};

TEST_F(TraceReplayOverAGap, ComputesAllUpToItAndSaysWhatIsLeftOut) {
  Session content = session({"force.law=surface", "filter.temporal_frames=8", "surface.fusion_frames=8"});
  const std::uint64_t lost = content.depth[30].header.frame;
  const auto before = static_cast<std::uint64_t>(
      std::ranges::count_if(content.ticks, [lost](const rt::Tick& tick) { return tick.scene_frame < lost; }));
  loseFrames(content, 30, 1);
  const Finished replay = replayOf(content);
  EXPECT_EQ(replay.ending, exitedWith(0)) << replay.output << replay.errors;
  EXPECT_TRUE(contains(replay.output, "different: 0 ticks"));
  EXPECT_GT(countOf(replay.output, " ticks computed again"), 100U) << replay.output;
  EXPECT_LE(countOf(replay.output, " ticks computed again"), before)
      << "filter and fusion remember the lost frame to the end: " << replay.output;
  EXPECT_GT(countOf(replay.output, " ticks: their depth frame is not recorded"), 0U) << replay.output;
  EXPECT_GT(countOf(replay.output, " ticks: filter or fusion remember what is not recorded"), 0U)
      << replay.output;
  const std::size_t frames = replay.output.find("depth frames that are not recorded: ");
  ASSERT_NE(frames, std::string::npos) << replay.output;
  EXPECT_TRUE(contains(replay.output.substr(frames), std::to_string(lost))) << replay.output;
}

TEST_F(TraceReplayOverAGap, GoesOnFromTheNextSnapshotAfterIt) {
  Session content = session({"force.law=surface", "filter.temporal_frames=8", "surface.fusion_frames=8"});
  ASSERT_FALSE(content.snapshots.empty());
  // What follows on a gap: filter and fusion restart, and a snapshot follows, as at the beginning of a trace.
  EXPECT_TRUE(daemon_->reaches([](const json& status) { return status.at("mode") == "engaged"; }));
  const Session later = recordsIn(loggedSession(home_, *daemon_, 30));
  ASSERT_FALSE(later.snapshots.empty());
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  append(content.ticks, later.ticks);
  append(content.models, later.models);
  append(content.directives, later.directives);
  append(content.additions, later.additions);
  append(content.snapshots, later.snapshots);
  loseFrames(content, 20, 10);
  append(content.depth, later.depth);
  const fs::path forces = home_.path() / "forces.csv";
  const Finished replay = replayOf(content, {"--out", forces.string()});
  EXPECT_EQ(replay.ending, exitedWith(0)) << replay.output << replay.errors;
  EXPECT_TRUE(contains(replay.output, "different: 0 ticks"));
  EXPECT_GT(countOf(replay.output, " ticks: their depth frame is not recorded"), 0U) << replay.output;
  EXPECT_GT(countOf(replay.output, " ticks: before the first snapshot"), 0U) << replay.output;

  std::ifstream rows(forces);
  std::string row;
  std::getline(rows, row);  // the names
  std::size_t before = 0, after = 0;
  while (std::getline(rows, row)) ++(std::stoull(row) < later.ticks.front().number ? before : after);
  EXPECT_GT(before, 100U);
  EXPECT_GT(after, 100U);
}

TEST_F(TraceReplayOverAGap, LeavesOutWhatDependsOnLostModelsAndParameters) {
  Session content = session({"force.law=nearest_springs"});
  const auto middle = content.models.begin() + static_cast<std::ptrdiff_t>(content.models.size() / 2);
  const std::uint64_t model = middle->model;
  content.models.erase(middle);
  content.directives.erase(content.directives.begin() + 1);
  const Finished replay = replayOf(content);
  EXPECT_EQ(replay.ending, exitedWith(0)) << replay.output << replay.errors;
  EXPECT_TRUE(contains(replay.output, "different: 0 ticks"));
  const bool in_contact =
      std::ranges::any_of(content.ticks, [&](const rt::Tick& t) { return t.scene_model == model; });
  EXPECT_EQ(countOf(replay.output, " ticks: their scene is not in the trace") > 0, in_contact)
      << replay.output;
  EXPECT_GT(countOf(replay.output, " ticks: their parameters are not in the trace"), 0U) << replay.output;
}

TEST(TraceReplayOfOtherParameters, LeavesOutParametersThatItDoesNotHaveAndNamesThem) {
  const DaemonHome home;
  Daemon daemon(home, kSceneYaml);
  Session content = recordsIn(loggedSession(home, daemon, 40));
  for (trace::TraceAttachment& attachment : content.options.attachments) {
    if (attachment.name == "settings.yaml") attachment.data.insert(0, "removed:\n  quite: true\n");
  }
  for (trace::DirectiveRecord& directive : content.directives)
    directive.parameters.emplace_back("force.once", "7");
  const fs::path trace = home.path() / "earlier.mcap";
  writeSession(trace, content);
  const Finished replay = replayed(trace);
  EXPECT_EQ(replay.ending, exitedWith(0)) << replay.output << replay.errors;
  EXPECT_TRUE(contains(replay.output,
                       "left out parameters that this version does not have: force.once, removed.quite\n"))
      << replay.output;
  EXPECT_TRUE(contains(replay.output, "different: 0 ticks")) << replay.output;
  EXPECT_GT(countOf(replay.output, " ticks computed again"), 300U) << replay.output;
}

TEST(TraceReplayRefuses, ATraceWithoutDepthOrWithoutSnapshot) {
  const DaemonHome home;
  Daemon daemon(home, kSceneYaml, {"trace.at_start=true"});
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches([](const json& status) { return status.at("trace").at("ticks") > 100; }));
  const std::string name = daemon.status().at("trace").at("name");
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  const fs::path trace = home.traceFolder() / (name + ".mcap");
  const Finished without_depth = replayed(trace);
  EXPECT_EQ(without_depth.ending, exitedWith(66)) << without_depth.output;
  EXPECT_TRUE(contains(without_depth.errors, "trace start --depth"));
  EXPECT_EQ(replayed(home.path() / "none.mcap").ending, exitedWith(66));
}

}  // namespace
}  // namespace hapticd

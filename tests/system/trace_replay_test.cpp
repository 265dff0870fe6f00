// A session that hapticd has logged with its depth, computed again by haptic-replay.

#include <gtest/gtest.h>

#include "drivers/camera/recorded/recording_reader.h"
#include "drivers/trace/trace_reader.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/scratch_recording.h"
#include "tests/system/daemon_under_test.h"

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

/// Logs until so many frames of depth have been recorded and the hand has felt something for kContactTicks,
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

struct Setting {
  const char* name;
  std::vector<std::string> set;
};

class TraceReplay : public testing::TestWithParam<Setting> {};

TEST_P(TraceReplay, ReproducesEveryForceToTheBit) {
  const DaemonHome home;
  Daemon daemon(home, kSceneYaml, GetParam().set);
  const fs::path trace = loggedSession(home, daemon, 75);
  const Finished replay = replayed(trace);
  EXPECT_EQ(replay.ending, exitedWith(0)) << replay.output << replay.errors;
  EXPECT_TRUE(contains(replay.output, "different: 0 ticks"));
  EXPECT_TRUE(contains(replay.output, "largest difference: 0 N of the commanded force"));
  EXPECT_GT(countOf(replay.output, " ticks computed again"), 1000U) << replay.output;
  EXPECT_GT(countOf(replay.output, " in contact"), kContactTicks / 2) << replay.output;
  EXPECT_GT(countOf(replay.output, " scenes modelled"), 50U) << replay.output;
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

TEST(TraceReplayOfAnotherScene, FindsTheDifference) {
  const DaemonHome home;
  Daemon daemon(home, kSceneYaml);
  const fs::path trace = loggedSession(home, daemon, 40);
  fs::path depth = trace;
  depth.replace_extension(".depth");
  const auto recording = drivers::RecordingReader::open(depth);
  ASSERT_TRUE(recording) << recording.error().text();
  // Whatever the hand felt is not there any more: a wall, out of its reach.
  const std::string wall = test::pgmBytes(std::vector<std::uint16_t>(test::kImagePixels, 1000));
  for (const auto& frame : recording->frames()) test::writeFile(depth / frame.file, wall);
  const Finished replay = replayed(trace, {"--out", home.path() / "forces.csv"});
  EXPECT_EQ(replay.ending, exitedWith(1)) << replay.output << replay.errors;
  EXPECT_GT(countOf(replay.output, " ticks\nlargest difference"), 100U) << replay.output;
  EXPECT_TRUE(fs::exists(home.path() / "forces.csv"));
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
  EXPECT_TRUE(contains(without_depth.errors, ".depth"));
  EXPECT_EQ(replayed(home.path() / "none.mcap").ending, exitedWith(66));
}

TEST(TraceReplayRefuses, ATraceOfAnotherVersion) {
  const test::TemporaryFolder folder;
  test::ScratchRecording recording;
  test::fillRecording(recording, 2);
  recording.writeIndex();
  fs::create_directory_symlink(recording.path(), folder.path() / "older.depth");
  test::writeOlderTrace(folder.path() / "older.mcap", test::madeUpRecords(1, 20).ticks);
  const Finished older = replayed(folder.path() / "older.mcap");
  EXPECT_EQ(older.ending, exitedWith(66)) << older.output;
  EXPECT_TRUE(contains(older.errors, "another version"));
  EXPECT_TRUE(contains(older.errors, "haptic-replay of the version that wrote it"));
}

}  // namespace
}  // namespace hapticd

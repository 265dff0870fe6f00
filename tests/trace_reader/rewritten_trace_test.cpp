// SPDX-License-Identifier: Apache-2.0
// Traces that the MCAP project's own reader and writer have rewritten, filtered and merged are traces still:
// read, exported, drawn and replayed.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/trace/reader/trace_reader.h"
#include "daemon/trace/recovery/trace_recovery.h"
#include "tests/support/file_content.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::size_t kRewrittenTicksPerChunk = 40;

void rewrite(const std::string& how, const fs::path& out, const std::string& topics,
             const std::vector<fs::path>& in) {
  std::vector<std::string> command{NODE_PROGRAM, REWRITE_TRACE, how, out.string(), topics};
  for (const fs::path& file : in) command.push_back(file.string());
  const Finished finished = runToEnd(command);
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.errors;
}

/// Needs the packages of the MCAP project.
class NeedsPackages : public testing::Test {
 protected:
  void SetUp() override {
    if (fs::exists(NOT_INSTALLED)) GTEST_SKIP() << contentOf(NOT_INSTALLED);
  }
};
using RewrittenSession = NeedsPackages;
using MergedTraces = NeedsPackages;

class RewrittenTrace : public NeedsPackages {
 protected:
  RewrittenTrace() {
    writeTrace(trace_, records_, kRewrittenTicksPerChunk,
               {.realtime_offset_ns = 1'700'000'000'000'000'000,
                .metadata = {{"hapticd_version", "1.2"}},
                .attachments = {{"settings.yaml", "application/yaml", "a: 1\n"}}});
  }
  Finished hapticctl(const std::vector<std::string>& arguments) const {
    std::vector<std::string> command{HAPTICCTL_PROGRAM};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return runToEnd(command);
  }

  const TemporaryFolder folder_;
  const MadeUpRecords records_ = madeUpRecords(5, kRewrittenTicksPerChunk, 11);
  const fs::path trace_ = folder_.path() / "a.mcap", out_ = folder_.path() / "out.mcap";
};

TEST_F(RewrittenTrace, IsReadToTheLastBit) {
  for (const char* how : {"chunks", "small-chunks", "plain", "bare"}) {
    SCOPED_TRACE(how);
    ASSERT_NO_FATAL_FAILURE(rewrite(how, out_, "all", {trace_}));
    EXPECT_EQ(differenceOf(recordsIn(out_), records_), "");
    const auto recovered = trace::recoverTrace(out_, folder_.path() / "recovered.mcap");
    ASSERT_TRUE(recovered) << recovered.error().text();
    EXPECT_EQ(recovered->outcome, trace::RecoveredTrace::Outcome::intact);
    EXPECT_EQ(trace::readTrace(out_)->attachments.size(), 1U);
  }
}

TEST_F(RewrittenTrace, IsExportedAndDrawnLikeTheOriginal) {
  const std::string from_original = (folder_.path() / "a.csv").string(),
                    from_rewritten = (folder_.path() / "b.csv").string();
  ASSERT_EQ(hapticctl({"trace", "export", trace_.string(), "--out", from_original}).ending, exitedWith(0));
  for (const char* how : {"chunks", "plain"}) {
    SCOPED_TRACE(how);
    ASSERT_NO_FATAL_FAILURE(rewrite(how, out_, "all", {trace_}));
    const Finished exported =
        hapticctl({"trace", "export", out_.string(), "--out", from_rewritten, "--force"});
    ASSERT_EQ(exported.ending, exitedWith(0)) << exported.errors;
    EXPECT_EQ(contentOf(from_rewritten), contentOf(from_original));
    const Finished info = hapticctl({"--json", "trace", "info", out_.string()});
    ASSERT_EQ(info.ending, exitedWith(0)) << info.errors;
    EXPECT_EQ(Json::parse(info.output).at("ticks"), records_.ticks.size());
    const Finished drawn =
        hapticctl({"trace", "plot", out_.string(), "--out", (folder_.path() / "a.svg").string(), "--force"});
    EXPECT_EQ(drawn.ending, exitedWith(0)) << drawn.errors;
  }
}

TEST_F(RewrittenTrace, BackwardsIsRefusedWithTheToolThatSortsIt) {
  ASSERT_NO_FATAL_FAILURE(rewrite("backwards", out_, "all", {trace_}));
  const std::string csv = (folder_.path() / "a.csv").string();
  for (const Finished& refused : {hapticctl({"trace", "info", out_.string()}),
                                  hapticctl({"trace", "export", out_.string(), "--out", csv}),
                                  runToEnd(hapticReplayCommand({"--trace", out_.string()}))}) {
    EXPECT_NE(refused.ending, exitedWith(0)) << refused.output;
    EXPECT_TRUE(contains(refused.errors, "is not in the order of time")) << refused.errors;
    EXPECT_TRUE(contains(refused.errors, "mcap sort")) << refused.errors;
  }
  EXPECT_FALSE(fs::exists(csv));
}

TEST_F(RewrittenTrace, FilteredToSomeTopicsSaysWhatItLacks) {
  ASSERT_NO_FATAL_FAILURE(rewrite("chunks", out_, "/hapticd/event,/hapticd/model", {trace_}));
  EXPECT_EQ(differenceOf(recordsIn(out_), {.models = records_.models, .events = records_.events}), "");
  const std::string csv = (folder_.path() / "a.csv").string();
  const Finished events = hapticctl({"trace", "export", out_.string(), "--channel", "events", "--out", csv});
  EXPECT_EQ(events.ending, exitedWith(0)) << events.errors;
  fs::remove(csv);
  const Finished ticks = hapticctl({"trace", "export", out_.string(), "--out", csv, "--force"});
  EXPECT_EQ(ticks.ending, exitedWith(1));
  EXPECT_TRUE(contains(ticks.errors, "has no channel /hapticd/tick")) << ticks.errors;
  EXPECT_FALSE(fs::exists(csv));
  EXPECT_EQ(hapticctl({"trace", "info", out_.string()}).ending, exitedWith(0));
}

/// A ball that comes and goes, and a hand that strokes it.
constexpr const char* kBallYaml =
    "safety: {handle_timeout_s: 1, depth_timeout_s: 5, engage_inside: true, overrun_burst: 65}\n"
    "camera: {driver: synthetic}\n"
    "synthetic: {scene: moving_sphere, noise: sensor, motion_amplitude_m: 0.03}\n"
    "simulated_handle: {start_z_m: -0.86, travel_m: 0.1, stroke_m: 0.03}\n"
    "control: {engage_at_start: true}\n";

/// A finished trace of a daemon that runs.
fs::path record(const DaemonHome& home, Daemon& daemon, std::vector<std::string> options) {
  options.insert(options.begin(), {"trace", "start"});
  const Finished started = home.control(options);
  EXPECT_EQ(started.ending, exitedWith(0)) << started.errors;
  EXPECT_TRUE(daemon.reaches([](const Json& status) { return status.at("trace").at("ticks") >= 3000; }));
  const Finished stopped = home.control({"--json", "trace", "stop"});
  EXPECT_EQ(stopped.ending, exitedWith(0)) << stopped.errors;
  return home.traceFolder() / (Json::parse(stopped.output).value("name", "none") + ".mcap");
}

TEST_F(RewrittenSession, IsReplayedToTheLastBit) {
  const DaemonHome home;
  Daemon daemon(home, kBallYaml);
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches([](const Json& status) { return status.at("mode") == "engaged"; }));
  const fs::path trace = record(home, daemon, {"--depth"});
  const fs::path out = home.path() / "out.mcap";
  ASSERT_NO_FATAL_FAILURE(rewrite("chunks", out, "all", {trace}));
  const Finished replay = runToEnd(hapticReplayCommand({"--trace", out.string()}));
  EXPECT_EQ(replay.ending, exitedWith(0)) << replay.output << replay.errors;
  EXPECT_TRUE(contains(replay.output, "different: 0 ticks")) << replay.output;
}

TEST_F(MergedTraces, OfOneRunAreReadAsOne) {
  const DaemonHome home;
  Daemon daemon(home, kBallYaml);
  ASSERT_TRUE(daemon.answers());
  const fs::path first = record(home, daemon, {}), second = record(home, daemon, {});
  const fs::path out = home.path() / "merged.mcap";
  ASSERT_NO_FATAL_FAILURE(rewrite("small-chunks", out, "all", {second, first}));
  const std::vector<rt::Tick> ticks = recordsIn(out).ticks;
  EXPECT_EQ(ticks.size(), recordsIn(first).ticks.size() + recordsIn(second).ticks.size());
  EXPECT_TRUE(std::ranges::is_sorted(ticks, {}, &rt::Tick::number));
}

TEST_F(MergedTraces, OfSeveralRunsAreRefused) {
  const DaemonHome home;
  std::vector<fs::path> traces;
  for (int run = 0; run < 2; ++run) {
    Daemon daemon(home, kBallYaml);
    ASSERT_TRUE(daemon.answers());
    traces.push_back(record(home, daemon, {}));
    EXPECT_EQ(daemon.terminate(), exitedWith(0));
  }
  const fs::path out = home.path() / "merged.mcap";
  ASSERT_NO_FATAL_FAILURE(rewrite("chunks", out, "all", traces));
  const auto info = trace::readTrace(out);
  ASSERT_FALSE(info);
  EXPECT_TRUE(contains(info.error().text(), "several runs")) << info.error().text();
}

}  // namespace
}  // namespace hapticd::test

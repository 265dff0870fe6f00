// SPDX-License-Identifier: Apache-2.0
// Boxes watched by a real Prometheus, and studies and replays as jobs of a real Slurm.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/file_content.h"
#include "tests/support/unused_port.h"
#include "tests/system/support/daemon_under_test.h"
#include "tests/system/support/slurm_cluster.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

const std::string kPromtool = unpackedProgram("promtool");
const std::string kPrometheus = unpackedProgram("prometheus");

void write(const fs::path& path, const std::string& text) {
  std::ofstream(path) << text;
}

/// One box and the Prometheus that scrapes it once a second.
class PrometheusTest : public testing::Test {
 protected:
  void SetUp() override {
    if (kPrometheus.empty()) GTEST_SKIP() << "Debian's package prometheus is not unpacked";
    ASSERT_TRUE(daemon_.answers());
    write(folder_.path() / "prometheus.yml",
          fmt::format("global: {{scrape_interval: 1s, evaluation_interval: 1s}}\n"
                      "rule_files: ['{}']\n"
                      "scrape_configs:\n"
                      "  - job_name: hapticd\n"
                      "    static_configs: [{{targets: ['127.0.0.1:{}']}}]\n",
                      HAPTICD_ALERTS, metrics_port_));
  }

  /// Returns the result of a query, as promtool prints it.
  std::string query(const std::string& expression) const {
    return runToEnd(
               {kPromtool, "query", "instant", fmt::format("http://127.0.0.1:{}", web_port_), expression})
        .output;
  }

  const TemporaryFolder folder_;
  const DaemonHome home_;
  Daemon daemon_{home_};
  const int metrics_port_ = unusedPort();
  const int web_port_ = unusedPort();
};

TEST_F(PrometheusTest, ScrapesTheBoxAndAlertsWhenItsDaemonIsGone) {
  // As hapticd-metrics.socket does it: a process for each connection.
  Program server({"/usr/bin/systemd-socket-activate", "--accept", "--inetd", "--listen",
                  fmt::format("127.0.0.1:{}", metrics_port_), HAPTICCTL_PROGRAM, "--socket",
                  home_.statusSocket(), "metrics", "--http"});
  Program prometheus({kPrometheus, "--config.file=" + (folder_.path() / "prometheus.yml").string(),
                      "--storage.tsdb.path=" + (folder_.path() / "data").string(),
                      fmt::format("--web.listen-address=127.0.0.1:{}", web_port_)});
  ASSERT_TRUE(becomesTrue([&] { return query("hapticd_up == 1").find("=> 1 ") != std::string::npos; }))
      << prometheus.errors() << server.errors();
  EXPECT_NE(query("hapticd_loop_ticks_total > 0").find("job=\"hapticd\""), std::string::npos);
  EXPECT_EQ(query("ALERTS").find("alertname"), std::string::npos);

  daemon_.signal(SIGTERM);
  daemon_.wait();
  EXPECT_TRUE(becomesTrue(
      [&] { return query("ALERTS{alertname=\"HapticdDown\"}").find("pending") != std::string::npos; }));
}

TEST_F(PrometheusTest, FindsNothingToComplainAboutInTheMetrics) {
  const std::string text = home_.write("metrics", home_.control({"metrics", "--prometheus"}).output);
  const Finished checked = runToEnd({"/bin/sh", "-c", kPromtool + " check metrics < '" + text + "'"});
  EXPECT_EQ(checked.ending, exitedWith(0));
  EXPECT_EQ(checked.output + checked.errors, "");
}

TEST(PrometheusAlerts, FireForWhatTheyNameAndForNothingElse) {
  if (kPromtool.empty()) GTEST_SKIP() << "Debian's package prometheus is not unpacked";
  const TemporaryFolder folder;
  fs::copy_file(HAPTICD_ALERTS, folder.path() / "hapticd-alerts.yml");
  fs::copy_file(HAPTICD_ALERTS_TEST, folder.path() / "alerts_test.yml");
  const Finished checked = runToEnd({kPromtool, "check", "rules", HAPTICD_ALERTS});
  EXPECT_EQ(checked.ending, exitedWith(0)) << checked.output << checked.errors;
  const Finished tested =
      runToEnd({kPromtool, "test", "rules", (folder.path() / "alerts_test.yml").string()});
  EXPECT_EQ(tested.ending, exitedWith(0)) << tested.output << tested.errors;
}

// Studies and replays as array jobs of a real Slurm: joined, they are what an undivided run gives.

using nlohmann::json;

class SlurmTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string obstacle = SlurmCluster::obstacle(); !obstacle.empty()) GTEST_SKIP() << obstacle;
    cluster_ = std::make_unique<SlurmCluster>();
    ASSERT_TRUE(cluster_->isReady());
  }
  void TearDown() override {
    if (!cluster_) return;
    const std::string folder = cluster_->folder().string();
    cluster_.reset();
    EXPECT_FALSE(fs::exists(folder));
    EXPECT_EQ(processesWithInEnvironment(folder), std::vector<std::string>{});
  }

  /// tools/slurm, waiting for the result.
  Finished submitted(int parts, const fs::path& out, const std::vector<std::string>& work) const {
    std::vector<std::string> command{
        "/bin/bash",  HAPTICD_SLURM,         "--wait",
        "--parts",    std::to_string(parts), "--out",
        out.string(), "--programs",          fs::path(HAPTICBENCH_PROGRAM).parent_path().string()};
    command.insert(command.end(), work.begin(), work.end());
    return cluster_->run(command);
  }
  fs::path file(const std::string& name) const { return cluster_->folder() / name; }

  std::unique_ptr<SlurmCluster> cluster_;
};

TEST_F(SlurmTest, JoinsStudiesToTheBytesOfAnUndividedRun) {
  const std::vector<std::vector<std::string>> studies{
      {"accuracy", "--quick", "--noises", "none,harsh", "--laws", "nearest_springs,surface"},
      {"stability", "--quick", "--delays", "0,2,5", "--laws", "reference,proxy"}};
  for (const std::vector<std::string>& study : studies) {
    const std::string& name = study.front();
    std::vector<std::string> command{HAPTICBENCH_PROGRAM};
    command.insert(command.end(), study.begin(), study.end());
    command.insert(command.end(), {"--json", file(name + ".json")});
    const Finished undivided = runToEnd(command);
    ASSERT_EQ(undivided.ending, exitedWith(0)) << undivided.errors;

    const Finished joined = submitted(3, file("out " + name), study);
    ASSERT_EQ(joined.ending, exitedWith(0)) << joined.output << joined.errors;
    EXPECT_TRUE(joined.output.ends_with(undivided.output)) << joined.output;
    EXPECT_EQ(contentOf(file("out " + name) / "report.txt"), undivided.output);
    EXPECT_EQ(contentOf(file("out " + name) / "report.json"), contentOf(file(name + ".json")));
  }
}

/// Records a little of a hand that strokes a ball, with depth; the trace.
fs::path recordedTrace(const DaemonHome& home) {
  Daemon daemon(home,
                "safety: {handle_timeout_s: 1, depth_timeout_s: 5, engage_inside: true, overrun_burst: 65}\n"
                "camera: {driver: synthetic}\n"
                "synthetic: {scene: moving_sphere, noise: sensor, motion_amplitude_m: 0.03}\n"
                "simulated_handle: {start_z_m: -0.86, travel_m: 0.1, stroke_m: 0.03}\n"
                "control: {engage_at_start: true}\n");
  EXPECT_TRUE(daemon.answers());
  EXPECT_EQ(home.control({"trace", "start", "--depth"}).ending, exitedWith(0));
  EXPECT_TRUE(daemon.reaches([](const json& status) { return status.at("trace").at("depthFrames") >= 20; }));
  const Finished stopped = home.control({"--json", "trace", "stop"});
  EXPECT_EQ(stopped.ending, exitedWith(0)) << stopped.errors;
  return home.traceFolder() / (json::parse(stopped.output, nullptr, false).value("name", "none") + ".mcap");
}

TEST_F(SlurmTest, JoinsReplaysOfAFolderOfTracesToTheBytesOfAnUndividedRun) {
  const DaemonHome home;
  const fs::path trace = recordedTrace(home);
  fs::create_directories(file("traces"));
  for (const char* name : {"a.mcap", "b.mcap", "c.mcap"}) fs::copy_file(trace, file("traces") / name);
  std::ofstream(file("traces") / "broken.mcap") << "no trace";
  fs::create_directories(file("forces"));
  const Finished undivided = runToEnd({HAPTIC_REPLAY_PROGRAM, "--traces", file("traces"), "--out-folder",
                                       file("forces"), "--json", file("replay.json")});
  // one trace cannot be read
  ASSERT_EQ(undivided.ending, exitedWith(65)) << undivided.output << undivided.errors;
  EXPECT_NE(undivided.output.find("4 traces, 3 of them replayed"), std::string::npos) << undivided.output;
  EXPECT_NE(undivided.output.find("\ndifferent: 0 ticks\n"), std::string::npos) << undivided.output;

  const Finished joined = submitted(3, file("out"), {"replay", "--traces", file("traces")});
  ASSERT_EQ(joined.ending, exitedWith(65)) << joined.output << joined.errors;
  EXPECT_EQ(contentOf(file("out") / "report.txt"), undivided.output);
  EXPECT_EQ(contentOf(file("out") / "report.json"), contentOf(file("replay.json")));
  for (const char* name : {"a.csv", "b.csv", "c.csv"}) {
    EXPECT_EQ(contentOf(file("out") / "forces" / name), contentOf(file("forces") / name)) << name;
  }
}

TEST_F(SlurmTest, NamesThePartsThatFailedAndJoinsNothing) {
  const Finished failed = submitted(2, file("out"), {"accuracy", "--laws", "nothing"});
  EXPECT_EQ(failed.ending, exitedWith(1));
  EXPECT_NE(failed.errors.find("2 of 2 parts failed; see " + file("out").string() + "/part-1.log"),
            std::string::npos)
      << failed.errors;
  EXPECT_NE(failed.errors.find("--laws"), std::string::npos) << "what the part said: " << failed.errors;
  EXPECT_FALSE(fs::exists(file("out") / "report.txt"));
}

TEST(SlurmScript, RefusesWrongUsageBeforeItSubmits) {
  const std::vector<std::vector<std::string>> wrong{{},
                                                    {"pareto"},
                                                    {"--parts", "0", "accuracy"},
                                                    {"--parts", "1001", "accuracy"},
                                                    {"--parts"},
                                                    {"--quick", "accuracy"},
                                                    {"accuracy", "--part", "1/2"},
                                                    {"accuracy", "--json=x.json"}};
  for (std::vector<std::string> arguments : wrong) {
    arguments.insert(arguments.begin(), {"/bin/bash", HAPTICD_SLURM});
    const Finished refused = runToEnd(arguments);
    EXPECT_EQ(refused.ending, exitedWith(2)) << refused.errors;
    EXPECT_NE(refused.errors.find("tools/slurm --help"), std::string::npos) << refused.errors;
  }
}

}  // namespace
}  // namespace hapticd::test

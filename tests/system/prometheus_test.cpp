// SPDX-License-Identifier: Apache-2.0
// Boxes watched by a real Prometheus, and the alerts that are shipped for it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/unused_port.h"
#include "tests/system/support/daemon_under_test.h"

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

}  // namespace
}  // namespace hapticd::test

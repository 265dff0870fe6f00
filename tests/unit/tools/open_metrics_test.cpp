// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/open_metrics.h"

#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <sstream>

#include "tools/hapticctl/commands.h"

namespace hapticd::tools {
namespace {

const Json kStatus = Json::parse(R"({
  "mode": "holding", "cause": "depth_stale", "warnings": ["a", "b"], "uptimeS": 60.5,
  "version": "1.2\"3", "kernel": "6.1",
  "loop": {"rateHz": 999.5, "counters": {"ticks": 12345678901, "overruns": 2},
           "wakeupLatency": {"p50Ns": 3100, "p99Ns": 8000, "p999Ns": 12000, "maxNs": 4560000},
           "transitions": {"count": 2, "byCause": {"requested": 2}}},
  "tick": {"commandForceNInWorld": {"x": 3, "y": 0, "z": 4}, "hipMInWorld": {"x": 0.1, "y": 0, "z": null}},
  "handle": {"threadPriority": 79, "lastHop": {"p50Ns": 250000, "p99Ns": 500000, "p999Ns": 900000, "maxNs": 1000000}},
  "camera": {"state": "melting"}, "trace": {"state": "off", "freeBytes": null}})");

std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

bool has(const std::string& text, const std::string& line) {
  return ("\n" + text).find("\n" + line + "\n") != std::string::npos;
}

TEST(OpenMetrics, GivesValuesInBaseUnits) {
  const std::string text = metricsOf(kStatus);
  for (const char* line : {"hapticd_up 1", "hapticd_uptime_seconds 60.5", "hapticd_warnings 2",
                           "hapticd_handle_thread_priority 79", "hapticd_loop_ticks_total 12345678901",
                           "hapticd_loop_overruns_total 2", "hapticd_tick_force_newtons{stage=\"command\"} 5",
                           "hapticd_tick_hip_metres{axis=\"x\"} 0.1",
                           "hapticd_loop_transitions_by_cause_total{cause=\"requested\"} 2",
                           "hapticd_build_info{version=\"1.2\\\"3\",kernel=\"6.1\"} 1"}) {
    EXPECT_TRUE(has(text, line)) << line << " in\n" << text;
  }
  const std::regex median("hapticd_loop_wakeup_latency_seconds\\{quantile=\"0.5\"\\} (\\S+)\n");
  std::smatch found;
  ASSERT_TRUE(std::regex_search(text, found, median));
  EXPECT_DOUBLE_EQ(std::stod(found[1]), 3.1e-6);
  const std::regex hop("hapticd_handle_last_hop_seconds\\{quantile=\"0.99\"\\} (\\S+)\n");
  ASSERT_TRUE(std::regex_search(text, found, hop)) << text;
  EXPECT_DOUBLE_EQ(std::stod(found[1]), 5e-4);
}

TEST(OpenMetrics, ShowsStatesAsStateSetsAlsoThoseOfANewerDaemon) {
  const std::string text = metricsOf(kStatus);
  EXPECT_TRUE(has(text, "# TYPE hapticd_mode stateset"));
  EXPECT_TRUE(has(text, "hapticd_mode{hapticd_mode=\"holding\"} 1"));
  EXPECT_TRUE(has(text, "hapticd_mode{hapticd_mode=\"idle\"} 0"));
  EXPECT_TRUE(has(text, "hapticd_camera_state{hapticd_camera_state=\"melting\"} 1"));
  EXPECT_TRUE(has(text, "hapticd_camera_state{hapticd_camera_state=\"streaming\"} 0"));
}

TEST(OpenMetrics, ShowsFixturesTissueAndTheStiffnessInEffect) {
  Json status = kStatus;
  status["tick"]["stiffnessNPerM"] = 420;
  status["tick"]["stiffnessBound"] = "noise";
  status["fixtures"] = {{"count", 3},          {"enabled", 2},  {"inContact", {"keep-off", "incision"}},
                        {"distanceM", -0.005}, {"forceN", 1.5}, {"guidanceForceN", 0.5}};
  status["tissue"] = {{"count", 2}, {"feed", {{"accepted", 7}, {"limited", 5}, {"outside", 4}}}};
  const std::string text = metricsOf(status);
  for (const char* line :
       {"hapticd_fixtures 3", "hapticd_fixtures_enabled 2", "hapticd_fixtures_in_contact 2",
        "hapticd_fixture_distance_metres -0.005", "hapticd_fixture_force_newtons 1.5",
        "hapticd_guidance_force_newtons 0.5", "hapticd_tissue_regions 2",
        "hapticd_tissue_feed_accepted_samples_total 7", "hapticd_tissue_feed_limited_samples_total 5",
        "hapticd_tissue_feed_outside_samples_total 4", "hapticd_tick_stiffness_newtons_per_metre 420",
        "hapticd_stiffness_bound{hapticd_stiffness_bound=\"noise\"} 1"}) {
    EXPECT_TRUE(has(text, line)) << line << " in\n" << text;
  }
  EXPECT_EQ(metricsOf(kStatus).find("fixture"), std::string::npos);
}

TEST(OpenMetrics, ShowsWhatEachFixtureSawWithItsNameAsLabel) {
  Json status = kStatus;
  status["fixtures"]["each"] = {{{"name", "nerve"},
                                 {"stage", "soft"},
                                 {"warnings", 7},
                                 {"breaches", 3},
                                 {"breachedS", 1.5},
                                 {"deepestBreachM", 0.004}},
                                {{"name", "path"}, {"stage", nullptr}, {"warnings", 0}, {"breaches", 0}},
                                {{"name", "older"}, {"breaches", 1}}};
  const std::string text = metricsOf(status);
  for (const char* line :
       {"# TYPE hapticd_fixture_breaches counter", "hapticd_fixture_breaches_total{fixture=\"nerve\"} 3",
        "hapticd_fixture_breaches_total{fixture=\"path\"} 0",
        "hapticd_fixture_breaches_total{fixture=\"older\"} 1",
        "hapticd_fixture_warnings_total{fixture=\"nerve\"} 7",
        "# UNIT hapticd_fixture_breach_seconds seconds",
        "hapticd_fixture_breach_seconds_total{fixture=\"nerve\"} 1.5",
        "hapticd_fixture_deepest_breach_metres{fixture=\"nerve\"} 0.004",
        "# TYPE hapticd_fixture_stage stateset",
        "hapticd_fixture_stage{fixture=\"nerve\",hapticd_fixture_stage=\"soft\"} 1",
        "hapticd_fixture_stage{fixture=\"nerve\",hapticd_fixture_stage=\"breach\"} 0"}) {
    EXPECT_TRUE(has(text, line)) << line << " in\n" << text;
  }
  EXPECT_EQ(text.find("stage{fixture=\"path\""), std::string::npos) << "guidance has none";
  EXPECT_EQ(text.find("warnings_total{fixture=\"older\""), std::string::npos) << "not known";
  std::size_t heads = 0;
  for (std::size_t at = 0; (at = text.find("# TYPE hapticd_fixture_breaches ", at)) != std::string::npos;
       ++at)
    ++heads;
  EXPECT_EQ(heads, 1U) << "one family for all of them";
}

TEST(OpenMetrics, LeavesOutWhatTheDaemonDoesNotKnow) {
  const std::string text = metricsOf(kStatus);
  EXPECT_EQ(text.find("free_bytes"), std::string::npos);
  EXPECT_EQ(text.find("axis=\"z\""), std::string::npos);
  EXPECT_EQ(text.find("nan"), std::string::npos);
}

TEST(OpenMetrics, TheLabelsOfTheBuildDoNotChangeWithTheLaw) {
  Json status = kStatus;
  const auto build = [&] {
    const std::string text = metricsOf(status);
    const std::size_t begin = text.find("\nhapticd_build_info{");
    return text.substr(begin, text.find('\n', begin + 1) - begin);
  };
  const std::string before = build();
  status["law"] = {{"chosen", "proxy"}};
  EXPECT_EQ(build(), before);
  EXPECT_TRUE(has(metricsOf(status), "hapticd_force_law{hapticd_force_law=\"proxy\"} 1"));
  EXPECT_TRUE(has(metricsOf(status), "hapticd_force_law{hapticd_force_law=\"surface\"} 0"));
}

TEST(PrometheusText, HasTheSameSamplesUnderTypesThatTheFormatKnows) {
  const std::string text = metricsOf(kStatus, MetricsFormat::prometheus);
  std::vector<std::string> samples, known;
  for (const std::string& line : linesOf(text)) {
    if (!line.starts_with('#')) samples.push_back(line);
  }
  for (const std::string& line : linesOf(metricsOf(kStatus))) {
    if (!line.starts_with('#')) known.push_back(line);
  }
  EXPECT_EQ(samples, known);
  for (const char* line :
       {"# TYPE hapticd_loop_ticks_total counter", "# TYPE hapticd_mode gauge",
        "# HELP hapticd_loop_ticks_total Ticks of the force loop.", "# TYPE hapticd_build_info gauge",
        "# TYPE hapticd_loop_wakeup_latency_seconds summary"}) {
    EXPECT_TRUE(has(text, line)) << line << " in\n" << text;
  }
  for (const char* word : {"# UNIT", "# EOF", "stateset"})
    EXPECT_EQ(text.find(word), std::string::npos) << word;
}

TEST(OpenMetrics, SaysThatADaemonIsDown) {
  const std::string text = metricsOf(Json());
  EXPECT_TRUE(has(text, "hapticd_up 0"));
  EXPECT_TRUE(text.ends_with("# EOF\n"));
}

// The rules of the OpenMetrics specification that a text can break: each family once, TYPE before its
// samples, samples of no other family between them, counters with _total, units as the end of the name, "#
// EOF" last.
TEST(OpenMetrics, KeepsTheRulesOfTheStandard) {
  const std::vector<std::string> lines = linesOf(metricsOf(kStatus));
  ASSERT_EQ(lines.back(), "# EOF");
  std::set<std::string> families;
  std::string family;
  std::string type;
  const std::regex sample(
      R"re(([a-z][a-z0-9_]*)(\{[a-z_]+="([^"\\]|\\.)*"(,[a-z_]+="([^"\\]|\\.)*")*\})? \S+)re");
  for (std::size_t i = 0; i + 1 < lines.size(); ++i) {
    std::istringstream words(lines[i]);
    std::string hash, kind, name, value;
    words >> hash >> kind >> name >> value;
    if (hash == "#" && kind == "TYPE") {
      family = name;
      type = value;
      EXPECT_TRUE(families.insert(family).second) << family;
      continue;
    }
    if (hash == "#") {
      EXPECT_EQ(name, family) << lines[i];
      if (kind == "UNIT") {
        EXPECT_TRUE(family.ends_with("_" + value)) << lines[i];
      }
      continue;
    }
    std::smatch match;
    ASSERT_TRUE(std::regex_match(lines[i], match, sample)) << lines[i];
    const std::string end = type == "counter" ? "_total" : type == "info" ? "_info" : "";
    EXPECT_EQ(match[1].str(), family + end) << lines[i];
  }
}

TEST(HttpReply, GivesMetricsToGetAndTheirHeadToHead) {
  const auto metrics = [](MetricsFormat) { return std::string("# EOF\n"); };
  const std::string got = httpReply("GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n", metrics);
  EXPECT_TRUE(
      got.starts_with("HTTP/1.1 200 OK\r\nContent-Type: application/openmetrics-text; version=1.0.0"));
  EXPECT_NE(got.find("\r\nContent-Length: 6\r\n"), std::string::npos);
  EXPECT_TRUE(got.ends_with("\r\n\r\n# EOF\n"));
  const std::string head = httpReply("HEAD /metrics?x=1 HTTP/1.0\r\n\r\n", metrics);
  EXPECT_NE(head.find("\r\nContent-Length: 6\r\n"), std::string::npos);
  EXPECT_TRUE(head.ends_with("\r\n\r\n"));
}

TEST(HttpReply, GivesTheFormThatIsAccepted) {
  const auto metrics = [](MetricsFormat format) {
    return std::string(format == MetricsFormat::prometheus ? "older" : "newer");
  };
  const auto body = [&](const std::string& header) {
    const std::string got = httpReply("GET /metrics HTTP/1.1\r\n" + header + "\r\n", metrics);
    return got.substr(got.find("\r\n\r\n") + 4);
  };
  EXPECT_EQ(body(""), "newer");
  EXPECT_EQ(body("Accept: */*\r\n"), "newer");
  EXPECT_EQ(body("ACCEPT: application/openmetrics-text;version=1.0.0,text/plain;q=0.5\r\n"), "newer");
  EXPECT_EQ(body("accept: text/plain;version=0.0.4\r\nX: openmetrics\r\n"), "older");
}

TEST(HttpReply, RefusesAllElseWithoutAskingTheDaemon) {
  const auto never = [](MetricsFormat) -> std::string {
    ADD_FAILURE() << "asked";
    return "";
  };
  EXPECT_TRUE(httpReply("GET / HTTP/1.1\r\n\r\n", never).starts_with("HTTP/1.1 404 "));
  EXPECT_TRUE(httpReply("POST /metrics HTTP/1.1\r\n\r\n", never).starts_with("HTTP/1.1 405 "));
  for (const std::string bad : {"", "\r\n\r\n", "GET /metrics\r\n\r\n", "hello world\n\n",
                                "GET /metrics HTTP/1.1\r\n", "GET HTTP/1.1\r\n\r\n"}) {
    EXPECT_TRUE(httpReply(bad, never).starts_with("HTTP/1.1 400 ")) << bad;
  }
}

}  // namespace
}  // namespace hapticd::tools

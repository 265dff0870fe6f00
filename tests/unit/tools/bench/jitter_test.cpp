// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/support/program.h"
#include "tools/hapticbench/jitter.h"
#include "tools/lib/child/child_process.h"

namespace hapticd::tools {
namespace {

WakeupCounts countsOf(const std::vector<std::pair<std::int64_t, std::uint64_t>>& pairs) {
  WakeupCounts counts;
  for (const auto& [latency_us, wakeups] : pairs) counts.add(latency_us, wakeups);
  return counts;
}

TEST(WakeupCounts, RoundDownToWholeMicroseconds) {
  WakeupCounts counts;
  for (const std::int64_t latency_ns : {0, 999, 1000, 1999, 2000}) counts.addLatency(latency_ns);
  EXPECT_EQ(counts.counts(), (std::map<std::int64_t, std::uint64_t>{{0, 2}, {1, 2}, {2, 1}}));
}

TEST(WakeupCounts, TakeAnEarlyWakeUpForOneInTime) {
  WakeupCounts counts;
  counts.addLatency(-5000);
  EXPECT_EQ(counts.counts(), (std::map<std::int64_t, std::uint64_t>{{0, 1}}));
}

TEST(WakeupCounts, HaveTheQuantilesOfTheSortedLatencies) {
  std::mt19937 random(1);
  std::vector<std::int64_t> latencies_us;
  WakeupCounts counts;
  for (int i = 0; i < 1000; ++i) {
    latencies_us.push_back(std::llround(std::lognormal_distribution<double>(2, 1)(random)));
    counts.addLatency(latencies_us.back() * 1000 + 500);
  }
  std::ranges::sort(latencies_us);
  // of 1000 sorted ones the 500th, 990th, 999th and the last
  EXPECT_EQ(counts.quantile_us(0.5), latencies_us[499]);
  EXPECT_EQ(counts.quantile_us(0.99), latencies_us[989]);
  EXPECT_EQ(counts.quantile_us(0.999), latencies_us[998]);
  EXPECT_EQ(counts.quantile_us(1), latencies_us[999]);
  EXPECT_EQ(counts.max_us(), latencies_us[999]);
}

TEST(WakeupCounts, AreZeroWhileEmpty) {
  EXPECT_EQ(WakeupCounts().quantile_us(0.999), 0);
  EXPECT_EQ(WakeupCounts().max_us(), 0);
}

TEST(LatencyRatio, CountsLessThanAMicrosecondAsOne) {
  EXPECT_EQ(latencyRatio(10, 8), 1.25);
  EXPECT_EQ(latencyRatio(3, 0), 3);
  EXPECT_EQ(latencyRatio(0, 0), 1);
}

/// Returns JSON as written by cyclictest, without members that are not read.
std::string cyclictestJson(const std::string& histogram, int cycles, int max_us) {
  return R"({"file_version": 1, "num_threads": 1, "resolution_in_ns": 0, "thread": {"0": {"histogram": {)" +
         histogram + R"(}, "cycles": )" + std::to_string(cycles) + R"(, "min": 5, "max": )" +
         std::to_string(max_us) + R"(, "avg": 17.12, "cpu": 1, "node": 0}}})";
}

TEST(Cyclictest, HistogramIsReadAsItIs) {
  const auto counts = parseCyclictest("file", cyclictestJson(R"("5": 1, "6": 41, "33": 2)", 44, 33));
  ASSERT_TRUE(counts) << counts.error().text();
  EXPECT_EQ(counts->counts(), (std::map<std::int64_t, std::uint64_t>{{5, 1}, {6, 41}, {33, 2}}));
}

TEST(Cyclictest, WakeUpsBeyondTheHistogramCountAsTheLatest) {
  const auto counts = parseCyclictest("file", cyclictestJson(R"("5": 10)", 12, 150'000));
  ASSERT_TRUE(counts) << counts.error().text();
  EXPECT_EQ(counts->counts(), (std::map<std::int64_t, std::uint64_t>{{5, 10}, {150'000, 2}}));
}

TEST(Cyclictest, WhatItDidNotWriteIsRefusedWithTheFileAndTheReason) {
  const struct {
    std::string text;
    std::string reason;
  } cases[] = {{"", "not a JSON object"},
               {"[]", "not a JSON object"},
               {"{}", "exactly one \"thread\""},
               {R"({"thread": {}})", "exactly one \"thread\""},
               {R"({"thread": {"0": {}, "1": {}}})", "exactly one \"thread\""},
               {R"({"thread": {"0": 7}})", "no \"histogram\""},
               {R"({"thread": {"0": {"cycles": 1, "max": 1}}})", "no \"histogram\""},
               {R"({"thread": {"0": {"histogram": {"1": 1}}}})", "lacks \"cycles\" or \"max\""},
               {cyclictestJson(R"("-1": 1)", 1, 1), "\"-1\""},
               {cyclictestJson(R"("1x": 1)", 1, 1), "\"1x\""},
               {cyclictestJson(R"("1": -1)", 1, 1), "\"1\""},
               {cyclictestJson(R"("1": 0.5)", 1, 1), "\"1\""},
               {cyclictestJson(R"("1": 3)", 2, 1), "3 wake-ups of 2"}};
  for (const auto& [text, reason] : cases) {
    const auto counts = parseCyclictest("the file", text);
    ASSERT_FALSE(counts) << text;
    EXPECT_EQ(counts.error().where, "the file");
    EXPECT_NE(counts.error().what.find(reason), std::string::npos) << counts.error().text();
  }
}

TEST(Cyclictest, RunsWithTheSettingOfTheOtherLoop) {
  const auto command =
      cyclictestCommand({.cpu = 3, .priority = 42, .period_us = 500, .cycles = 7}, {0, 2}, "out.json");
  for (const char* option : {"--affinity=3", "--mainaffinity=0,2", "--priority=42", "--interval=500",
                             "--loops=7", "--json=out.json", "--mlockall", "--threads=1"}) {
    EXPECT_NE(std::ranges::find(command, option), command.end()) << option;
  }
}

TEST(BackgroundLoad, StaysOffTheMeasuredCpu) {
  const auto command = stressCommand({0, 2, 5}, 2);
  EXPECT_NE(std::ranges::find(command, "--taskset=0,5"), command.end());
  EXPECT_NE(std::ranges::find(command, "--cpu=2"), command.end());
}

TEST(BackgroundLoad, SharesTheOnlyCpu) {
  const auto command = stressCommand({4}, 4);
  EXPECT_NE(std::ranges::find(command, "--taskset=4"), command.end());
}

TEST(KeptToCpus, HoldsForItsLifeOnly) {
  const std::vector<int> before = usableCpus();
  {
    const KeptToCpus kept({before.front()});
    EXPECT_EQ(usableCpus(), std::vector<int>{before.front()});
  }
  EXPECT_EQ(usableCpus(), before);
}

/// p99.9 is the latency given: 10 of 1000 wake-ups.
JitterRound roundWith(std::int64_t ours_us, std::int64_t theirs_us) {
  JitterRound round;
  round.ours.wakeups = countsOf({{5, 990}, {ours_us, 10}});
  round.ours.contact_ticks = 500;
  round.ours.last_hop = countsOf({{120, 400}, {700, 2}});
  round.theirs = countsOf({{4, 990}, {theirs_us, 10}});
  return round;
}

/// Under load p99.9 is 10 by 10 and 30 by 20; together, by hand: 30 by 20.
JitterResult madeUpResult() {
  JitterResult result{.options = {}, .memory_locked = true, .idle_limited = true, .loads = {}};
  result.loads.push_back({"idle", {roundWith(10, 10), roundWith(10, 10)}});
  result.loads.push_back({"stress", {roundWith(10, 10), roundWith(30, 20)}});
  return result;
}

TEST(LoadJitter, ComparesAllRoundsTogetherAndShowsTheSpreadOfSingleOnes) {
  const JitterResult result = madeUpResult();
  EXPECT_EQ(result.loads[0].ratio(), 1);
  EXPECT_TRUE(result.loads[0].met());
  EXPECT_EQ(result.loads[1].ratio(), 1.5);
  EXPECT_FALSE(result.loads[1].met());
  EXPECT_EQ(result.loads[1].sortedRatios(), (std::vector<double>{1, 1.5}));
}

TEST(JitterReport, SaysForEachLoadWhetherTheLimitIsKept) {
  const std::string table = jitterReport(madeUpResult()).text();
  EXPECT_NE(table.find("1.00, at most 1.25 (met)"), std::string::npos) << table;
  EXPECT_NE(table.find("1.50, at most 1.25 (not met)"), std::string::npos) << table;
  EXPECT_NE(table.find("in contact 50 %"), std::string::npos) << table;
  EXPECT_NE(table.find("last hop         804  120  120    700  700"), std::string::npos) << table;
}

TEST(JitterReport, SaysWhatWasNotPermitted) {
  JitterResult result = madeUpResult();
  EXPECT_EQ(jitterReport(result).text().find("not locked"), std::string::npos);
  result.memory_locked = false;
  result.idle_limited = false;
  EXPECT_NE(jitterReport(result).text().find("not locked"), std::string::npos);
  EXPECT_NE(jitterReport(result).text().find("/dev/cpu_dma_latency"), std::string::npos);
}

TEST(JitterReport, GivesProgramsTheWholeHistograms) {
  const auto document = nlohmann::json::parse(jitterReport(madeUpResult()).json());
  const auto& load = document.at("loads").at(1);
  EXPECT_EQ(load.at("load"), "stress");
  EXPECT_EQ(load.at("ratio_p999"), 1.5);
  EXPECT_EQ(load.at("met"), false);
  EXPECT_EQ(load.at("hapticd").at("histogram_us"), (nlohmann::json{{"5", 1980}, {"10", 10}, {"30", 10}}));
  EXPECT_EQ(load.at("cyclictest").at("p999_us"), 20);
  EXPECT_EQ(load.at("last_hop").at("commands"), 804);
  EXPECT_EQ(load.at("last_hop").at("max_us"), 700);
  EXPECT_EQ(load.at("round_ratios_p999"), (nlohmann::json{1.0, 1.5}));
}

TEST(ChildProcess, ThatIsNotInstalledIsAnErrorWithItsRemedy) {
  const auto child = ChildProcess::start({"no-such-program-anywhere"}, {}, "apt install it");
  ASSERT_FALSE(child);
  EXPECT_EQ(child.error().where, "no-such-program-anywhere");
  EXPECT_EQ(child.error().remedy, "apt install it");
}

TEST(ChildProcess, ReportsHowItEnded) {
  auto child = ChildProcess::start({"sh", "-c", "exit 7"}, {}, "");
  ASSERT_TRUE(child);
  const auto ending = child->waitFor(test::maxPatience());
  ASSERT_TRUE(ending);
  EXPECT_EQ(ending->text(), "exit status 7");
  EXPECT_FALSE(ending->good());
}

TEST(ChildProcess, TakesWhatItStartedWithItWhenItGoes) {
  ASSERT_EQ(::prctl(PR_SET_CHILD_SUBREAPER, 1), 0);  // orphans come here, where they are reaped
  pid_t group = 0;
  {
    auto child = ChildProcess::start({"sh", "-c", "sleep 1000 & sleep 1000"}, {}, "");
    ASSERT_TRUE(child);
    group = child->pid();
  }
  EXPECT_TRUE(test::becomesTrue([group] {
    while (::waitpid(-group, nullptr, WNOHANG) > 0) {
    }
    return ::kill(-group, 0) != 0 && errno == ESRCH;
  }));
  ::prctl(PR_SET_CHILD_SUBREAPER, 0);
}

TEST(ChildProcess, SeesTheVariablesGivenBesideThoseOfItsParent) {
  auto child = ChildProcess::start({"sh", "-c", "test \"$HAPTICD_TEST\" = given && test -n \"$PATH\""},
                                   {.environment = {"HAPTICD_TEST=given"}}, "");
  ASSERT_TRUE(child);
  const auto ending = child->waitFor(test::maxPatience());
  ASSERT_TRUE(ending);
  EXPECT_TRUE(ending->good()) << ending->text();
}

TEST(Interrupt, RemembersASignalInsteadOfDying) {
  const Interrupt interrupt;
  EXPECT_FALSE(interrupt.requested());
  ::raise(SIGTERM);
  EXPECT_TRUE(interrupt.requested());
}

}  // namespace
}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <thread>

#include "config/parameter_table.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tools/haptic-soak/memory_trend.h"
#include "tools/haptic-soak/random_changes.h"
#include "tools/haptic-soak/soak_report.h"

namespace hapticd::tools {
namespace {

TEST(MemoryTrend, OfAStraightLineIsItsRiseAfterTheFirstFifth) {
  std::vector<MemoryPoint> points;
  for (int i = 0; i <= 100; ++i) points.push_back({i * 1.0, 5000 + 3.0 * i});
  const MemoryTrend trend = memoryTrend(points);
  EXPECT_NEAR(trend.growth_kb, 3 * 80, 1e-6);
  EXPECT_NEAR(trend.noise_kb, 0, 1e-6);
}

TEST(MemoryTrend, LeavesOutWhatTheStartTakes) {
  std::vector<MemoryPoint> points;
  for (int i = 0; i <= 100; ++i) points.push_back({i * 1.0, i < 20 ? 100.0 * i : 2000.0});
  EXPECT_NEAR(memoryTrend(points).growth_kb, 0, 1e-6);
}

TEST(MemoryTrend, OfAFlatLineWithScatterIsWithinItsNoise) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> scatter(0, 400);
  std::vector<MemoryPoint> points;
  for (int i = 0; i <= 100; ++i) points.push_back({i * 1.0, 5000 + scatter(random)});
  const MemoryTrend trend = memoryTrend(points);
  EXPECT_LT(std::abs(trend.growth_kb), trend.noise_kb);
  // about the error of least squares: two standard errors of the slope over 81 points, 2 * 400 * sqrt(12 /
  // 81)
  EXPECT_NEAR(trend.noise_kb, 308, 80);
}

TEST(MemoryTrend, TakesOneStepForNoGrowthWhereverItIs) {
  for (const int step : {25, 40, 60, 80, 99}) {
    std::vector<MemoryPoint> points;
    for (int i = 0; i <= 100; ++i) points.push_back({i * 1.0, i < step ? 5000.0 : 8000.0});
    const MemoryTrend trend = memoryTrend(points);
    EXPECT_LE(trend.growth_kb, trend.noise_kb) << "step at " << step;
  }
}

TEST(MemoryTrend, OfStepAfterStepIsTheirRise) {
  std::vector<MemoryPoint> points;
  for (int i = 0; i <= 100; ++i) points.push_back({i * 1.0, 5000.0 + 1000 * (i / 10)});
  const MemoryTrend trend = memoryTrend(points);
  EXPECT_NEAR(trend.growth_kb, 8000, 400);
  EXPECT_GT(trend.growth_kb - trend.noise_kb, 7000);
}

TEST(MemoryTrend, OfTooFewPointsIsNone) {
  const std::vector<MemoryPoint> points{{0, 1}, {1, 100}};
  EXPECT_EQ(memoryTrend(points).growth_kb, 0);
  EXPECT_EQ(memoryTrend({}).growth_kb, 0);
}

TEST(AllowedGrowth, IsAMegabyteAndOnePerTenMinutesInLongerRuns) {
  EXPECT_EQ(allowedGrowth_kb(6), 1024);
  EXPECT_EQ(allowedGrowth_kb(600), 1024);
  EXPECT_EQ(allowedGrowth_kb(3600), 6 * 1024);
}

TEST(ProcessSample, ReadsFaultsBehindANameThatHoldsAnything) {
  // pid (name) state ppid pgrp session tty tpgid flags minflt cminflt majflt ...
  EXPECT_EQ(faultsIn("42 (a) (b 9) S 1 2 3 4 5 6 700 80 9 1 2 3"), 709U);
  EXPECT_FALSE(faultsIn("42"));
  EXPECT_FALSE(faultsIn("42 (short) S 1 2"));
  EXPECT_FALSE(faultsIn(""));
}

TEST(ProcessSample, CountsDescriptorsAndThreads) {
  const auto before = sampleProcess(::getpid());
  ASSERT_TRUE(before);
  EXPECT_GT(before->resident_kb, 0U);
  const int descriptor = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  std::jthread thread([](std::stop_token stop) {
    while (!stop.stop_requested()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  const auto after = sampleProcess(::getpid());
  ::close(descriptor);
  ASSERT_TRUE(after);
  EXPECT_EQ(after->descriptors, before->descriptors + 1);
  EXPECT_EQ(after->threads, before->threads + 1);
}

TEST(ProcessSample, FindsTheForceThreadByItsName) {
  const test::TemporaryFolder proc;
  const auto task = proc.path() / "7" / "task" / "8";
  std::filesystem::create_directories(task);
  std::filesystem::create_directories(proc.path() / "7" / "fd");
  proc.write("7/status", "Name:\thapticd\nVmRSS:\t  1234 kB\nThreads:\t5\n");
  proc.write("7/task/8/comm", "hapticd-force\n");
  proc.write("7/task/8/stat", "8 (hapticd-force) S 1 2 3 4 5 6 11 0 2 1 2 3\n");
  const auto sample = sampleProcess(7, proc.path());
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->force_thread_faults, 13U);
  EXPECT_EQ(sample->resident_kb, 1234U);
  EXPECT_EQ(sample->threads, 5U);
}

TEST(ProcessSample, OfNoProcessIsNothing) {
  const test::TemporaryFolder proc;
  EXPECT_FALSE(sampleProcess(7, proc.path()));
}

config::Value valueOf(const Json& json) {
  if (json.is_boolean()) return json.get<bool>();
  if (json.is_number_integer()) return json.get<std::int64_t>();
  if (json.is_number()) return json.get<double>();
  return json.is_string() ? json.get<std::string>() : json.dump();
}

/// Whether the table takes every value of the change.
bool tableTakes(const Json& parameters) {
  return std::ranges::all_of(parameters.items(), [](const auto& item) {
    const config::Parameter* parameter = config::findParameter(item.key());
    return parameter != nullptr && !item.value().is_array() &&
           parameter->check(valueOf(item.value())).has_value();
  });
}

TEST(RandomChange, IsAllowedExactlyWhereTheParameterTableSaysSo) {
  std::mt19937_64 random(1);
  int allowed = 0;
  for (int i = 0; i < 2000; ++i) {
    const RandomChange change = randomChange(random);
    EXPECT_EQ(tableTakes(change.parameters), change.allowed) << change.parameters.dump();
    allowed += change.allowed ? 1 : 0;
  }
  EXPECT_GT(allowed, 1300);  // three of four
  EXPECT_LT(allowed, 1700);
}

TEST(RandomChange, IsTheSameFromTheSameSeed) {
  std::mt19937_64 first(7), second(7), other(8);
  bool differs = false;
  for (int i = 0; i < 100; ++i) {
    const auto change = randomChange(first).parameters;
    EXPECT_EQ(change, randomChange(second).parameters);
    differs = differs || change != randomChange(other).parameters;
  }
  EXPECT_TRUE(differs);
}

/// A run without any loss.
SoakResult cleanResult() {
  SoakResult result;
  result.status = Json::parse(R"({
    "loop": {"memoryLocked": true, "traceTicksDropped": 0, "pageFaults": 0,
             "counters": {"ticks": 600000, "overruns": 0, "skippedPeriods": 0, "outsideModelTicks": 0,
                          "notFiniteTicks": 0, "depthStaleTicks": 0, "handleStaleTicks": 0,
                          "handleInvalidTicks": 0}},
    "camera": {"frames": 18000, "damagedFrames": 0},
    "scene": {"pointsOverCapacity": 0, "skippedFrames": 0}})");
  for (int i = 0; i <= 100; ++i) result.samples.push_back({i * 6.0, 80000, 20, 5, 4000});
  result.before = result.after = {0, 80000, 12, 5, 4000};
  result.clients = {{.name = "status", .calls = 100, .first_problem = ""}};
  result.ending = ChildEnding{true, 0};
  return result;
}

std::vector<std::string> brokenIn(const SoakResult& result, const SoakLimits& limits = {}) {
  std::vector<std::string> broken;
  for (const SoakFinding& finding : findingsOf(result, limits)) {
    if (finding.broken()) broken.push_back(finding.what);
  }
  return broken;
}

TEST(SoakFindings, OfACleanRunBreakNoLimit) {
  EXPECT_TRUE(brokenIn(cleanResult()).empty());
  EXPECT_TRUE(brokenIn(cleanResult(), {.strict = true, .memory_growth_kb = {}, .memory_kb = {}}).empty());
}

TEST(SoakFindings, ShowEachLossThatMustNotBe) {
  const struct {
    std::string what;
    void (*spoil)(SoakResult&);
  } losses[] = {
      {"ticks lost between the loop and the trace",
       [](SoakResult& r) { r.status["loop"]["traceTicksDropped"] = 1; }},
      {"page faults of the force thread since its first tick",
       [](SoakResult& r) { r.status["loop"]["pageFaults"] = 1; }},
      {"points over capacity", [](SoakResult& r) { r.status["scene"]["pointsOverCapacity"] = 1; }},
      {"ticks with a force that was not finite",
       [](SoakResult& r) { r.status["loop"]["counters"]["notFiniteTicks"] = 1; }},
      {"growth of descriptors, without clients", [](SoakResult& r) { ++r.after.descriptors; }},
      {"growth of threads, without clients", [](SoakResult& r) { ++r.after.threads; }},
      {"page faults of the force thread, by the kernel",
       [](SoakResult& r) { ++r.samples.back().force_thread_faults; }},
      {"calls without an answer", [](SoakResult& r) { r.clients[0].unanswered = 1; }},
      {"forbidden values taken", [](SoakResult& r) { r.clients[0].wrongly_taken = 1; }},
      {"replug commands that failed", [](SoakResult& r) { r.failed_replugs = 1; }},
      {"bad ends after SIGTERM",
       [](SoakResult& r) {
         r.ending = ChildEnding{true, 1};
       }},
      {"bad ends after SIGTERM", [](SoakResult& r) { r.ending.reset(); }},
      {"growth of memory beyond its noise, kB",
       [](SoakResult& r) {
         for (ProcessSample& s : r.samples) s.resident_kb += static_cast<std::uint64_t>(s.time_s * 3);
       }},
  };
  for (const auto& [what, spoil] : losses) {
    SoakResult result = cleanResult();
    spoil(result);
    EXPECT_EQ(brokenIn(result), std::vector<std::string>{what});
  }
}

TEST(SoakFindings, CountLateTicksOnlyWhenStrict) {
  SoakResult result = cleanResult();
  result.status["loop"]["counters"]["overruns"] = 3;
  EXPECT_TRUE(brokenIn(result).empty());
  EXPECT_EQ(brokenIn(result, {.strict = true, .memory_growth_kb = {}, .memory_kb = {}}),
            std::vector<std::string>{"ticks that ended after the next was due"});
}

TEST(SoakFindings, CountPageFaultsOnlyWhereMemoryIsLocked) {
  SoakResult result = cleanResult();
  result.status["loop"]["pageFaults"] = 3;
  result.status["loop"]["memoryLocked"] = false;
  EXPECT_TRUE(brokenIn(result).empty());
}

TEST(SoakFindings, TakeWhatIsNotKnownForBroken) {
  SoakResult result = cleanResult();
  result.status["scene"].erase("pointsOverCapacity");
  EXPECT_EQ(brokenIn(result), std::vector<std::string>{"points over capacity"});
}

TEST(SoakFindings, KeepToTheLimitsGiven) {
  EXPECT_EQ(brokenIn(cleanResult(), {.memory_growth_kb = {}, .memory_kb = 79999}),
            std::vector<std::string>{"most memory in use, kB"});
  SoakResult result = cleanResult();
  for (ProcessSample& sample : result.samples)
    sample.resident_kb += static_cast<std::uint64_t>(sample.time_s);
  EXPECT_TRUE(brokenIn(result).empty());  // 480 kB
  EXPECT_EQ(brokenIn(result, {.memory_growth_kb = 100, .memory_kb = {}}),
            std::vector<std::string>{"growth of memory beyond its noise, kB"});
}

TEST(SoakTable, ShowsTheWholeTimeAndEveryFinding) {
  const SoakResult result = cleanResult();
  const auto findings = findingsOf(result, {});
  const std::string table = soakTable(result, findings);
  for (const char* time : {"     0.0", "    60.0", "   300.0", "   600.0"}) {
    EXPECT_NE(table.find(time), std::string::npos) << table;
  }
  for (const SoakFinding& finding : findings) EXPECT_NE(table.find(finding.what), std::string::npos);
  EXPECT_EQ(table.find("BROKEN"), std::string::npos);
}

TEST(SoakTable, MarksABrokenLimit) {
  const SoakResult result = cleanResult();
  const std::string table = soakTable(result, findingsOf(result, {.memory_growth_kb = {}, .memory_kb = 1}));
  EXPECT_NE(table.find("BROKEN"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "daemon/recorder/flight_recorder.h"
#include "daemon/trace/reader/trace_folder.h"
#include "daemon/trace/reader/trace_reader.h"
#include "daemon/trace/writer/trace_writer.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::daemon {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

rt::Tick tickAt(std::int64_t time_ns, rt::Mode mode = rt::Mode::engaged, rt::Cause cause = rt::Cause::none) {
  rt::Tick tick;
  tick.planned_ns = time_ns;
  tick.mode = mode;
  tick.cause = cause;
  return tick;
}
rt::Tick burstAt(std::int64_t time_ns) {
  return tickAt(time_ns, rt::Mode::holding, rt::Cause::overrun_burst);
}
rt::Tick faultAt(std::int64_t time_ns) {
  return tickAt(time_ns, rt::Mode::faulted, rt::Cause::force_not_finite);
}

TEST(DumpSchedule, IsDueOnceASecondAfterTheFirstTickOfAFault) {
  DumpSchedule dumps(10);
  dumps.add(tickAt(kSecond_ns));
  dumps.add(faultAt(2 * kSecond_ns));
  dumps.add(faultAt(2 * kSecond_ns + 1));
  EXPECT_FALSE(dumps.takeDue(3 * kSecond_ns - 1));
  EXPECT_EQ(dumps.takeDue(3 * kSecond_ns), trace::kFaultLabel);
  EXPECT_FALSE(dumps.takeDue(100 * kSecond_ns));
}

TEST(DumpSchedule, ABurstWaitsUntilTheFlightRecorderHoldsNothingOfTheDumpBefore) {
  DumpSchedule dumps(10);
  dumps.add(burstAt(kSecond_ns));
  EXPECT_EQ(dumps.takeDue(2 * kSecond_ns), trace::kOverrunBurstLabel);
  dumps.add(tickAt(3 * kSecond_ns));
  dumps.add(burstAt(4 * kSecond_ns));
  EXPECT_FALSE(dumps.takeDue(12 * kSecond_ns - 1));
  EXPECT_EQ(dumps.takeDue(12 * kSecond_ns), trace::kOverrunBurstLabel);
}

TEST(DumpSchedule, AFaultTakesThePlaceOfABurstThatWaits) {
  DumpSchedule dumps(10);
  dumps.add(burstAt(kSecond_ns));
  ASSERT_TRUE(dumps.takeDue(2 * kSecond_ns));
  dumps.add(tickAt(3 * kSecond_ns));
  dumps.add(burstAt(4 * kSecond_ns));
  dumps.add(faultAt(5 * kSecond_ns));
  EXPECT_EQ(dumps.takeDue(6 * kSecond_ns), trace::kFaultLabel);
  EXPECT_FALSE(dumps.takeWaiting());
}

TEST(DumpSchedule, GivesWhatWaitsAtTheEnd) {
  DumpSchedule dumps(10);
  EXPECT_FALSE(dumps.takeWaiting());
  dumps.add(burstAt(kSecond_ns));
  EXPECT_EQ(dumps.takeWaiting(), trace::kOverrunBurstLabel);
  EXPECT_FALSE(dumps.takeWaiting());
}

TEST(DumpSchedule, IsNeverDueWithoutAFlightRecorder) {
  DumpSchedule dumps(0);
  dumps.add(faultAt(kSecond_ns));
  EXPECT_FALSE(dumps.takeDue(100 * kSecond_ns));
  EXPECT_FALSE(dumps.takeWaiting());
}

}  // namespace
}  // namespace hapticd::daemon

namespace hapticd::test {
namespace {

using daemon::FlightRecorder;

rt::Tick tickAt(std::uint64_t number) {
  rt::Tick tick;
  tick.number = number;
  tick.planned_ns = static_cast<std::int64_t>(number) * 1'000'000;
  tick.scene_model = number / 33;
  tick.directive_generation = number / 1000;
  tick.fixture_generation = number / 1500;
  tick.tissue_generation = number / 3000;
  return tick;
}

/// Numbers of what a trace holds.
struct Numbers {
  std::vector<std::uint64_t> ticks;
  std::vector<std::uint64_t> models;
  std::vector<std::uint64_t> directives;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> additions;  // generations
  std::vector<std::int64_t> events_ns;
};

Numbers written(const FlightRecorder& recorder) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "dump.mcap";
  auto writer = trace::TraceWriter::create(file, {});
  EXPECT_TRUE(writer && recorder.writeTo(**writer) && (*writer)->close());
  Numbers numbers;
  trace::TraceVisitor visitor;
  visitor.tick = [&](const rt::Tick& tick) { return numbers.ticks.push_back(tick.number), true; };
  visitor.model = [&](const trace::ModelRecord& model) {
    return numbers.models.push_back(model.model), true;
  };
  visitor.directive = [&](const trace::DirectiveRecord& directive) {
    return numbers.directives.push_back(directive.generation), true;
  };
  visitor.additions = [&](const trace::AdditionsRecord& additions) {
    return numbers.additions.emplace_back(additions.fixture_generation, additions.tissue_generation), true;
  };
  visitor.event = [&](const trace::EventRecord& event) {
    return numbers.events_ns.push_back(event.time_ns), true;
  };
  const auto info = trace::readTrace(file, visitor);
  EXPECT_TRUE(info) << info.error().text();
  return numbers;
}

/// Ticks 1 to `last` with what belongs to them.
void record(FlightRecorder& recorder, std::uint64_t last) {
  for (std::uint64_t number = 1; number <= last; ++number) {
    const rt::Tick tick = tickAt(number);
    if (number % 33 == 0) recorder.add(trace::ModelRecord{.model = tick.scene_model});
    if (number % 1000 == 0 || number == 1) {
      recorder.add(trace::DirectiveRecord{.generation = tick.directive_generation});
    }
    if (number % 1500 == 0 || number == 1) {
      recorder.add(trace::AdditionsRecord{.time_ns = tick.planned_ns,
                                          .fixture_generation = tick.fixture_generation,
                                          .tissue_generation = tick.tissue_generation});
    }
    if (number % 100 == 0) recorder.add(trace::EventRecord{.time_ns = tick.planned_ns});
    recorder.add(tick);
  }
}

TEST(FlightRecorder, HoldsTheNewestTicksInTheirOrder) {
  FlightRecorder recorder(2, 1000);
  EXPECT_TRUE(recorder.empty());
  record(recorder, 10'000);
  EXPECT_DOUBLE_EQ(recorder.duration_s(), 2);
  const Numbers numbers = written(recorder);
  ASSERT_EQ(numbers.ticks.size(), 2000U);
  for (std::size_t i = 0; i < numbers.ticks.size(); ++i) ASSERT_EQ(numbers.ticks[i], 8001 + i);
}

TEST(FlightRecorder, KeepsWhatItsTicksReferTo) {
  FlightRecorder recorder(2, 1000);
  record(recorder, 10'000);
  const Numbers numbers = written(recorder);
  ASSERT_FALSE(numbers.models.empty());
  EXPECT_LE(numbers.models.front(), tickAt(8001).scene_model);
  EXPECT_LT(numbers.models.size(), 100U);
  ASSERT_FALSE(numbers.directives.empty());
  EXPECT_EQ(numbers.directives.front(), tickAt(8001).directive_generation);
  EXPECT_EQ(numbers.directives.back(), 10U);
  ASSERT_FALSE(numbers.additions.empty());
  EXPECT_EQ(numbers.additions.front(), std::pair(std::uint64_t{5}, std::uint64_t{2})) << "of tick 8001";
  EXPECT_EQ(numbers.additions.back(), std::pair(std::uint64_t{6}, std::uint64_t{3}));
  ASSERT_FALSE(numbers.events_ns.empty());
  EXPECT_LT(numbers.events_ns.size(), 30U);
}

TEST(FlightRecorder, OfAFloodOfFixtureSetsKeepsTheNewest) {
  FlightRecorder recorder(2, 1000);
  recorder.add(tickAt(1));
  constexpr std::uint64_t kMany = 100;
  for (std::uint64_t generation = 1; generation <= kMany; ++generation) {
    trace::AdditionsRecord additions;
    additions.fixture_generation = generation;
    additions.labels.bytes.assign(std::size_t{1} << 20, 'x');
    recorder.add(additions);
  }
  const Numbers numbers = written(recorder);
  EXPECT_GT(numbers.additions.size(), 20U);
  EXPECT_LT(numbers.additions.size(), 33U);
  EXPECT_EQ(numbers.additions.back().first, kMany);
}

/// A solid counts where only old records hold it, and there once.
TEST(FlightRecorder, CountsTheMemoryOfSolidsThatAreNoLongerInUse) {
  const auto solid = [](std::uint32_t layers) {
    const rt::DistanceGrid grid{.samples = {256, 256, layers}, .spacing_m = 1e-3, .scale_m = 1e-6};
    const config::Solid empty(grid, std::vector<std::int16_t>(grid.size(), 1000), {.source = "test"});
    return *config::solidFrom(empty.file(), "test");
  };
  FlightRecorder recorder(2, 1000);
  recorder.add(tickAt(1));
  const auto add = [&](std::uint64_t generation, const trace::AttachedSolids& solids) {
    recorder.add(trace::AdditionsRecord{.fixture_generation = generation, .solids = solids});
  };
  const auto large = solid(200);  // 25 MiB
  const auto small = solid(100);
  for (std::uint64_t generation = 1; generation <= 10; ++generation) add(generation, {large, small});
  EXPECT_EQ(written(recorder).additions.size(), 10U);
  add(11, {small});
  EXPECT_EQ(written(recorder).additions.size(), 11U);
  add(12, {});  // leaves 37 MiB that nothing else uses
  EXPECT_EQ(written(recorder).additions.front().first, 11U);
}

TEST(FlightRecorder, HoldsAllWhileItIsNotFull) {
  FlightRecorder recorder(2, 1000);
  record(recorder, 150);
  EXPECT_DOUBLE_EQ(recorder.duration_s(), 0.15);
  EXPECT_EQ(written(recorder).ticks.size(), 150U);
  EXPECT_EQ(written(recorder).ticks.size(), 150U) << "it stays held";
}

TEST(FlightRecorder, OfNoDurationHoldsNothing) {
  FlightRecorder recorder(0, 1000);
  record(recorder, 2000);
  EXPECT_TRUE(recorder.empty());
}

}  // namespace
}  // namespace hapticd::test

// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "daemon/recorder/flight_recorder.h"
#include "daemon/trace/reader/trace_folder.h"
#include "daemon/trace/writer/trace_writer.h"
#include "tests/support/made_up_trace.h"
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

/// What the recorder writes into a trace.
MadeUpRecords written(const FlightRecorder& recorder) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "dump.mcap";
  auto writer = trace::TraceWriter::create(file, {});
  EXPECT_TRUE(writer && recorder.writeTo(**writer) && (*writer)->close());
  return recordsIn(file);
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
  const MadeUpRecords records = written(recorder);
  ASSERT_EQ(records.ticks.size(), 2000U);
  for (std::size_t i = 0; i < records.ticks.size(); ++i) ASSERT_EQ(records.ticks[i].number, 8001 + i);
}

TEST(FlightRecorder, KeepsWhatItsTicksReferTo) {
  FlightRecorder recorder(2, 1000);
  record(recorder, 10'000);
  const MadeUpRecords records = written(recorder);
  using Generations = std::pair<std::uint64_t, std::uint64_t>;
  const auto generationsOf = [](const trace::AdditionsRecord& additions) {
    return Generations(additions.fixture_generation, additions.tissue_generation);
  };
  ASSERT_FALSE(records.models.empty());
  EXPECT_LE(records.models.front().model, tickAt(8001).scene_model);
  EXPECT_LT(records.models.size(), 100U);
  ASSERT_FALSE(records.directives.empty());
  EXPECT_EQ(records.directives.front().generation, tickAt(8001).directive_generation);
  EXPECT_EQ(records.directives.back().generation, 10U);
  ASSERT_FALSE(records.additions.empty());
  EXPECT_EQ(generationsOf(records.additions.front()), Generations(5, 2)) << "of tick 8001";
  EXPECT_EQ(generationsOf(records.additions.back()), Generations(6, 3));
  ASSERT_FALSE(records.events.empty());
  EXPECT_LT(records.events.size(), 30U);
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
  const MadeUpRecords records = written(recorder);
  EXPECT_GT(records.additions.size(), 20U);
  EXPECT_LT(records.additions.size(), 33U);
  EXPECT_EQ(records.additions.back().fixture_generation, kMany);
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
  EXPECT_EQ(written(recorder).additions.front().fixture_generation, 11U);
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

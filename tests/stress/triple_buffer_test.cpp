// SPDX-License-Identifier: Apache-2.0
#include "rt/channels/triple_buffer.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <set>

#include "tests/stress/data_race.h"
#include "tests/stress/sealed_value.h"
#include "tests/stress/triple_buffer_stress.h"
#include "tests/stress/wrong_channels.h"
#include "tests/support/rerun.h"
#include "tests/support/sanitizer.h"

namespace hapticd::test {
namespace {

constexpr std::uint64_t kWrites = kThreadSanitizer ? 200'000 : 2'000'000;
/// Rounds for the wrong variants; each round detects them with near certainty if two threads run in parallel.
constexpr int kMaxRounds = 200;
constexpr std::uint64_t kWritesPerRound = 2'000;

template <typename Value>
void expectFaultless(Pace pace, std::uint64_t writes) {
  rt::TripleBuffer<Value> buffer(Value(0));
  const TripleBufferFindings found = stressTripleBuffer(buffer, writes, pace);
  EXPECT_TRUE(found.faultless()) << found;
  EXPECT_GE(found.refreshes, 1U);
}

TEST(TripleBufferUnderTwoThreads, DeliversIntactValuesInOrderAndTheNewestInTheEnd) {
  expectFaultless<SmallValue>({}, kWrites);
}

TEST(TripleBufferUnderTwoThreads, DeliversIntactLargeValuesInOrderAndTheNewestInTheEnd) {
  expectFaultless<LargeValue>({}, kWrites / 10);
}

TEST(TripleBufferUnderTwoThreads, IsCorrectWithASlowerReader) {
  expectFaultless<SmallValue>({.reader_turns = 5'000}, kWrites);
}

TEST(TripleBufferUnderTwoThreads, IsCorrectWithASlowerWriter) {
  expectFaultless<SmallValue>({.writer_turns = 5'000}, kWrites / 10);
}

TEST(TripleBuffer, HoldsTheInitialValueUntilTheFirstIsPublished) {
  rt::TripleBuffer<SmallValue> buffer(SmallValue(42));
  EXPECT_FALSE(buffer.refresh());
  EXPECT_EQ(buffer.front().sequence(), 42U);
  buffer.write(SmallValue(43));
  EXPECT_EQ(buffer.front().sequence(), 42U) << "only refresh() may change what the reader sees";
  EXPECT_TRUE(buffer.refresh());
  EXPECT_EQ(buffer.front().sequence(), 43U);
}

TEST(TripleBuffer, DeliversTheNewestOfSeveralAndEachOnlyOnce) {
  rt::TripleBuffer<SmallValue> buffer(SmallValue(0));
  for (std::uint64_t sequence = 1; sequence <= 5; ++sequence) buffer.write(SmallValue(sequence));
  EXPECT_TRUE(buffer.refresh());
  EXPECT_EQ(buffer.front().sequence(), 5U);
  EXPECT_FALSE(buffer.refresh());
  EXPECT_EQ(buffer.front().sequence(), 5U);
}

TEST(TripleBuffer, PreparesEachOfItsThreeSlotsOnce) {
  rt::TripleBuffer<SmallValue> buffer;
  std::uint64_t prepared = 0;
  buffer.prepareSlots([&prepared](SmallValue& value) { value.seal(++prepared); });
  EXPECT_EQ(prepared, 3U);
  std::set<std::uint64_t> seen{buffer.front().sequence()};
  for (int i = 0; i < 2; ++i) {  // the two other slots are returned as prepared
    buffer.publish();
    EXPECT_TRUE(buffer.refresh());
    seen.insert(buffer.front().sequence());
  }
  EXPECT_EQ(seen, (std::set<std::uint64_t>{1, 2, 3}));
}

/// Returns true if the value held by the reader does not change while the writer continues to write.
template <typename Buffer>
bool leavesTheHeldValueAlone() {
  Buffer buffer(SmallValue(0));
  std::uint64_t sequence = 0;
  for (int round = 0; round < 10; ++round) {
    for (int i = 0; i <= round; ++i) {
      buffer.back().seal(++sequence);
      buffer.publish();
    }
    buffer.refresh();
    for (int i = 0; i < 5; ++i) {
      buffer.back().seal(1'000'000 + sequence);
      if (buffer.front().sequence() != sequence || !buffer.front().isIntact()) return false;
      buffer.publish();
    }
    buffer.refresh();
  }
  return true;
}

TEST(TripleBuffer, DoesNotChangeTheValueHeldByTheReader) {
  EXPECT_TRUE(leavesTheHeldValueAlone<rt::TripleBuffer<SmallValue>>());
}

TEST(WrongTripleBuffer, WithASlotTooFewIsCaught) {
  const auto caught = [] {
    for (int round = 0; round < kMaxRounds; ++round) {
      DoubleBuffer<LargeValue> buffer(LargeValue(0));
      if (!stressTripleBuffer(buffer, kWritesPerRound, {}).faultless()) return true;
    }
    return false;
  };
  EXPECT_FALSE(leavesTheHeldValueAlone<DoubleBuffer<SmallValue>>());
  if (!kThreadSanitizer || !rerunPart().empty()) {
    EXPECT_TRUE(caught());
  } else {
    expectDataRaceInRerun();
  }
}

template <std::memory_order publish, std::memory_order refresh>
WeakOrders weakOrders(const char* name) {
  using Buffer = WeakTripleBuffer<SmallValue, publish, refresh>;
  const auto stress = [] {
    Buffer buffer(SmallValue(0));
    stressTripleBuffer(buffer, kWrites, {});
  };
  return {name, stress, leavesTheHeldValueAlone<Buffer>};
}

class WrongTripleBufferOrders : public testing::TestWithParam<WeakOrders> {};

TEST_P(WrongTripleBufferOrders, AreReportedAsADataRace) {
  expectThatWeakOrdersAreNoticed(GetParam());
}

constexpr auto kRelaxed = std::memory_order_relaxed;
constexpr auto kAcquire = std::memory_order_acquire;
constexpr auto kRelease = std::memory_order_release;
constexpr auto kBoth = std::memory_order_acq_rel;
INSTANTIATE_TEST_SUITE_P(With, WrongTripleBufferOrders,
                         testing::Values(weakOrders<kRelaxed, kRelaxed>("AllRelaxed"),
                                         weakOrders<kAcquire, kBoth>("PublishWithoutRelease"),
                                         weakOrders<kRelease, kBoth>("PublishWithoutAcquire"),
                                         weakOrders<kBoth, kRelease>("RefreshWithoutAcquire"),
                                         weakOrders<kBoth, kAcquire>("RefreshWithoutRelease")),
                         nameOf);

}  // namespace
}  // namespace hapticd::test

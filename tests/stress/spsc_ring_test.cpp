// SPDX-License-Identifier: Apache-2.0
#include "rt/channels/spsc_ring.h"

#include <gtest/gtest.h>

#include <cstdint>

#include "tests/stress/data_race.h"
#include "tests/stress/sealed_value.h"
#include "tests/stress/spsc_ring_stress.h"
#include "tests/stress/wrong_channels.h"
#include "tests/support/rerun.h"
#include "tests/support/sanitizer.h"

namespace hapticd::test {
namespace {

constexpr std::uint64_t kItems = kThreadSanitizer ? 200'000 : 2'000'000;

template <std::size_t kCapacity>
void expectFaultless(std::uint64_t items, Pace pace) {
  rt::SpscRing<SmallValue, kCapacity> ring;
  const SpscRingFindings found = stressSpscRing<SmallValue>(ring, items, 0, pace);
  EXPECT_TRUE(found.faultless()) << found;
  EXPECT_GE(found.accepted, kCapacity);
}

TEST(SpscRingUnderTwoThreads, DeliversOrCountsEachItemInOrder) {
  expectFaultless<64>(kItems, {});
}

TEST(SpscRingUnderTwoThreads, IsCorrectWithOneSlot) {
  expectFaultless<1>(kItems, {});
}

TEST(SpscRingUnderTwoThreads, IsCorrectWithASlowerConsumer) {
  expectFaultless<8>(kItems / 2, {.reader_turns = 5'000});
}

TEST(SpscRingUnderTwoThreads, IsCorrectWithASlowerProducer) {
  expectFaultless<8>(kItems / 10, {.writer_turns = 5'000});
}

TEST(SpscRingUnderTwoThreads, DropsTheNewestWhileTheConsumerHasNotStarted) {
  constexpr std::uint64_t kCapacity = 16;
  constexpr std::uint64_t kBefore = 50;
  rt::SpscRing<SmallValue, kCapacity> ring;
  const SpscRingFindings found = stressSpscRing<SmallValue>(ring, kBefore, kBefore, {});
  EXPECT_TRUE(found.faultless()) << found;
  EXPECT_EQ(found.accepted, kCapacity);
  EXPECT_EQ(found.refused, kBefore - kCapacity);
}

/// Returns true if a ring that is repeatedly filled to any level and emptied keeps all items and their order.
template <typename Ring>
bool worksInOneThread(std::uint64_t capacity) {
  Ring ring;
  SmallValue value(0);
  std::uint64_t pushed = 0;
  std::uint64_t popped = 0;
  for (std::uint64_t round = 0; round < 1'000; ++round) {
    const std::uint64_t level = round % (capacity + 1);
    for (std::uint64_t i = 0; i < level; ++i) {
      if (!ring.push(SmallValue(++pushed))) return false;
    }
    for (std::uint64_t i = 0; i < level; ++i) {
      if (!ring.pop(value) || value.sequence() != ++popped || !value.isIntact()) return false;
    }
    if (ring.pop(value)) return false;
  }
  return ring.dropped() == 0 && popped == pushed;
}

TEST(SpscRing, KeepsTheOrderOverManyWraps) {
  EXPECT_TRUE((worksInOneThread<rt::SpscRing<SmallValue, 8>>(8)));
}

TEST(SpscRing, AcceptsItemsAgainOnceThereIsRoomAndKeepsCountingDroppedOnes) {
  rt::SpscRing<SmallValue, 2> ring;
  SmallValue value(0);
  EXPECT_TRUE(ring.push(SmallValue(1)));
  EXPECT_TRUE(ring.push(SmallValue(2)));
  EXPECT_FALSE(ring.push(SmallValue(3)));
  EXPECT_TRUE(ring.pop(value));
  EXPECT_EQ(value.sequence(), 1U);
  EXPECT_TRUE(ring.push(SmallValue(4)));
  EXPECT_FALSE(ring.push(SmallValue(5)));
  EXPECT_TRUE(ring.pop(value));
  EXPECT_EQ(value.sequence(), 2U);
  EXPECT_TRUE(ring.pop(value));
  EXPECT_EQ(value.sequence(), 4U);
  EXPECT_FALSE(ring.pop(value));
  EXPECT_EQ(ring.dropped(), 2U);
}

TEST(SpscRing, DoesNotChangeTheItemWhenEmpty) {
  rt::SpscRing<SmallValue, 4> ring;
  SmallValue value(7);
  EXPECT_FALSE(ring.pop(value));
  EXPECT_EQ(value.sequence(), 7U);
  EXPECT_TRUE(value.isIntact());
}

TEST(WrongSpscRing, ThatOverwritesWhenFullIsCaught) {
  constexpr std::uint64_t kCapacity = 16;
  const auto run = [](std::uint64_t items, std::uint64_t push_first) {
    OverwritingRing<LargeValue, kCapacity> ring;
    return stressSpscRing<LargeValue>(ring, items, push_first, {});
  };
  const SpscRingFindings before_the_consumer = run(kCapacity + 4, kCapacity + 4);
  EXPECT_EQ(before_the_consumer.lost, 4U) << before_the_consumer;
  EXPECT_EQ(before_the_consumer.out_of_order, 1U) << before_the_consumer;
  if (!kThreadSanitizer || !rerunPart().empty()) {
    const SpscRingFindings found = run(20'000, kCapacity + 4);
    EXPECT_FALSE(found.faultless()) << found;
  } else {
    expectDataRaceInRerun();
  }
}

template <std::memory_order store, std::memory_order load>
WeakOrders weakOrders(const char* name) {
  constexpr std::size_t kCapacity = 8;
  using Ring = WeakSpscRing<SmallValue, kCapacity, store, load>;
  const auto stress = [] {
    Ring ring;
    stressSpscRing<SmallValue>(ring, kItems, 0, {});
  };
  return {name, stress, [] { return worksInOneThread<Ring>(kCapacity); }};
}

class WrongSpscRingOrders : public testing::TestWithParam<WeakOrders> {};

TEST_P(WrongSpscRingOrders, AreReportedAsADataRace) {
  expectThatWeakOrdersAreNoticed(GetParam());
}

constexpr auto kRelaxed = std::memory_order_relaxed;
constexpr auto kAcquire = std::memory_order_acquire;
constexpr auto kRelease = std::memory_order_release;
INSTANTIATE_TEST_SUITE_P(With, WrongSpscRingOrders,
                         testing::Values(weakOrders<kRelaxed, kRelaxed>("AllRelaxed"),
                                         weakOrders<kRelaxed, kAcquire>("StoreWithoutRelease"),
                                         weakOrders<kRelease, kRelaxed>("LoadWithoutAcquire")),
                         nameOf);

}  // namespace
}  // namespace hapticd::test

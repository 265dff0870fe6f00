// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <ostream>
#include <vector>

#include "rt/channels/spsc_ring.h"
#include "tests/stress/two_threads.h"
#include "tests/stress/wrong_channels.h"
#include "tests/support/rerun.h"
#include "tests/support/sanitizer.h"

namespace hapticd::test {
namespace {

/// Result of transferring `items` sealed values pushed in sequence by a producer.
struct SpscRingFindings {
  std::uint64_t torn = 0;          ///< values mixed from two
  std::uint64_t out_of_order = 0;  ///< values popped twice, after a later one, or never pushed
  std::uint64_t lost = 0;          ///< accepted by push() but never popped
  std::uint64_t unasked = 0;       ///< refused by push() but popped
  std::uint64_t miscounted = 0;    ///< difference between dropped() and the refusals of push()
  std::uint64_t accepted = 0;
  std::uint64_t refused = 0;
  std::uint64_t found_empty = 0;

  bool faultless() const {
    return torn == 0 && out_of_order == 0 && lost == 0 && unasked == 0 && miscounted == 0;
  }
};
std::ostream& operator<<(std::ostream& stream, const SpscRingFindings& found) {
  return stream << found.torn << " torn, " << found.out_of_order << " out of order, " << found.lost
                << " lost, " << found.unasked << " unasked, dropped() wrong by " << found.miscounted << "; "
                << found.accepted << " accepted, " << found.refused << " refused";
}

/// `push_first`: number of items pushed before the consumer starts.
template <typename Value, typename Ring>
SpscRingFindings stressSpscRing(Ring& ring, std::uint64_t items, std::uint64_t push_first, Pace pace) {
  SpscRingFindings found;
  std::vector<char> was_accepted(items + 1);
  std::vector<char> was_popped(items + 1);
  const auto push = [&](std::uint64_t sequence) {
    was_accepted[sequence] = ring.push(Value(sequence)) ? 1 : 0;
  };
  for (std::uint64_t sequence = 1; sequence <= push_first; ++sequence) push(sequence);

  std::atomic<bool> all_pushed{false};
  const auto produce = [&] {
    for (std::uint64_t sequence = push_first + 1; sequence <= items; ++sequence) {
      push(sequence);
      turn(pace.writer_turns);
    }
    all_pushed.store(true, std::memory_order_release);
  };
  const auto consume = [&] {
    Value value(0);
    std::uint64_t last = 0;
    for (bool finishing = false; true;) {
      if (ring.pop(value)) {
        if (!value.isIntact()) ++found.torn;
        const std::uint64_t sequence = value.sequence();
        if (sequence <= last || sequence > items) ++found.out_of_order;
        if (sequence <= items) was_popped[sequence] = 1;
        last = sequence;
        turn(pace.reader_turns);
        continue;
      }
      ++found.found_empty;
      if (finishing) break;
      finishing = all_pushed.load(std::memory_order_acquire);
    }
  };
  runTogether(produce, consume);

  for (std::uint64_t sequence = 1; sequence <= items; ++sequence) {
    const bool accepted = was_accepted[sequence] != 0;
    const bool popped = was_popped[sequence] != 0;
    found.accepted += accepted ? 1 : 0;
    found.refused += accepted ? 0 : 1;
    found.lost += accepted && !popped ? 1 : 0;
    found.unasked += !accepted && popped ? 1 : 0;
  }
  found.miscounted =
      ring.dropped() > found.refused ? ring.dropped() - found.refused : found.refused - ring.dropped();
  return found;
}

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

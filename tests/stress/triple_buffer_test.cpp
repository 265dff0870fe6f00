// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <ostream>
#include <set>

#include "rt/channels/triple_buffer.h"
#include "tests/stress/two_threads.h"
#include "tests/stress/wrong_channels.h"
#include "tests/support/rerun.h"
#include "tests/support/sanitizer.h"

namespace hapticd::test {
namespace {

/// Observations of a reader while a writer published `writes` sealed values in sequence.
struct TripleBufferFindings {
  std::uint64_t torn = 0;       ///< values mixed from two writes
  std::uint64_t not_newer = 0;  ///< refreshes that returned true without a later value
  std::uint64_t changed = 0;    ///< values that changed while held by the reader
  bool newest_seen = false;     ///< the last value was seen in the end
  std::uint64_t refreshes = 0;

  bool faultless() const { return torn == 0 && not_newer == 0 && changed == 0 && newest_seen; }
};
std::ostream& operator<<(std::ostream& stream, const TripleBufferFindings& found) {
  return stream << found.torn << " torn, " << found.not_newer << " not newer, " << found.changed
                << " changed while held, newest " << (found.newest_seen ? "seen" : "missed") << ", in "
                << found.refreshes << " refreshes";
}

/// `buffer` must hold a value sealed with sequence number 0.
template <typename Buffer>
TripleBufferFindings stressTripleBuffer(Buffer& buffer, std::uint64_t writes, Pace pace) {
  TripleBufferFindings found;
  std::atomic<bool> all_written{false};
  const auto write = [&] {
    for (std::uint64_t sequence = 1; sequence <= writes; ++sequence) {
      buffer.back().seal(sequence);
      buffer.publish();
      turn(pace.writer_turns);
    }
    all_written.store(true, std::memory_order_release);
  };
  const auto read = [&] {
    std::uint64_t last = 0;
    for (bool finishing = false; true;) {
      if (buffer.refresh()) {
        ++found.refreshes;
        const std::uint64_t sequence = buffer.front().sequence();
        if (sequence <= last || sequence > writes) ++found.not_newer;
        if (!buffer.front().isIntact()) ++found.torn;
        last = sequence;
      } else if (finishing) {
        break;
      }
      turn(pace.reader_turns);
      std::atomic_signal_fence(std::memory_order_seq_cst);  // forces the value to be read again
      if (buffer.front().sequence() != last || !buffer.front().isIntact()) ++found.changed;
      finishing = all_written.load(std::memory_order_acquire);
    }
    found.newest_seen = last == writes;
  };
  runTogether(write, read);
  return found;
}

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

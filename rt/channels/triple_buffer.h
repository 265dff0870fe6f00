// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

#include "rt/base/cache_line.h"

namespace hapticd::rt {

template <typename T>
concept TriviallyCopyable = std::is_trivially_copyable_v<T>;

/// Memory orders of a TripleBuffer's exchange. Only tests use others than the default, to verify that the
/// stress test detects a wrong one.
struct TripleBufferOrders {
  static constexpr std::memory_order kPublish = std::memory_order_acq_rel;
  static constexpr std::memory_order kRefresh = std::memory_order_acq_rel;
};

/// Passes the latest value from one writer to one reader; a slow reader skips values, and without a new value
/// the last one stays valid.
/// Thread: one writer thread (back, publish), one reader thread (refresh, front), for the life of the object.
/// Progress: wait-free.  RT: safe.
template <TriviallyCopyable T, typename Orders = TripleBufferOrders>
class TripleBuffer {
 public:
  TripleBuffer() = default;
  explicit TripleBuffer(const T& initial) {
    for (Slot& slot : slots_) slot.value = initial;
  }
  TripleBuffer(const TripleBuffer&) = delete;
  TripleBuffer& operator=(const TripleBuffer&) = delete;

  /// Calls `prepare(T&)` for each of the three slots, for values that refer to memory of their own.
  /// Thread: before writer and reader start.  RT: not safe.
  template <typename Prepare>
  void prepareSlots(Prepare prepare) {
    for (Slot& slot : slots_) prepare(slot.value);
  }

  /// Returns the slot to be filled by the writer; the reader does not see it before publish(). It holds an
  /// older value.
  T& back() noexcept { return slots_[back_].value; }

  /// Makes back() the newest value. The release half pairs with the acquire half in refresh(); the acquire
  /// half takes over the slot that the reader gave up there.
  void publish() noexcept {
    back_ = middle_.exchange(static_cast<std::uint8_t>(back_ | kFresh), Orders::kPublish) & kIndex;
  }

  /// Copies `value` to back() and publishes it.
  void write(const T& value) noexcept {
    back() = value;
    publish();
  }

  /// Takes over the newest value if there has been one since the last call; returns true if so. The acquire
  /// half pairs with the release half in publish(); the release half gives up the slot read so far.
  bool refresh() noexcept {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    front_ = middle_.exchange(front_, Orders::kRefresh) & kIndex;
    return true;
  }

  /// Returns the value taken over by the last refresh(); before that, the initial value.
  const T& front() const noexcept { return slots_[front_].value; }

 private:
  static constexpr std::uint8_t kIndex = 3;
  static constexpr std::uint8_t kFresh = 4;
  static_assert(std::atomic<std::uint8_t>::is_always_lock_free);

  struct alignas(kCacheLine) Slot {
    T value{};
  };

  std::array<Slot, 3> slots_;
  alignas(kCacheLine) std::atomic<std::uint8_t> middle_{1};  // exchanged by both sides
  alignas(kCacheLine) std::uint8_t back_ = 0;                // writer only
  alignas(kCacheLine) std::uint8_t front_ = 2;               // reader only
};

}  // namespace hapticd::rt

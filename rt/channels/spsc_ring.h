// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "rt/base/cache_line.h"

namespace hapticd::rt {

/// Memory orders of an SpscRing's counters. Only tests use others than the default, to verify that the stress
/// test detects a wrong one.
struct SpscRingOrders {
  static constexpr std::memory_order kStore = std::memory_order_release;
  static constexpr std::memory_order kLoad = std::memory_order_acquire;
};

/// Passes every item from one producer to one consumer, in order; when the ring is full the newest item is
/// dropped and counted.
/// Thread: one producer thread (push), one consumer thread (pop), for the life of the object.
/// Progress: wait-free.  RT: safe.
template <typename T, std::size_t kCapacity, typename Orders = SpscRingOrders>
class SpscRing {
  static_assert(std::is_trivially_copyable_v<T>);
  static_assert(std::has_single_bit(kCapacity), "the capacity is a power of two");
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

 public:
  SpscRing() = default;
  SpscRing(const SpscRing&) = delete;
  SpscRing& operator=(const SpscRing&) = delete;

  /// Appends an item; if the ring is full, returns false and increments dropped().  Thread: producer.
  bool push(const T& item) noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_seen_ == kCapacity) {
      tail_seen_ = tail_.load(Orders::kLoad);  // pairs with the store in pop()
      if (head - tail_seen_ == kCapacity) {
        dropped_.store(dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
        return false;
      }
    }
    slots_[head & (kCapacity - 1)] = item;
    head_.store(head + 1, Orders::kStore);  // pairs with the load in pop()
    return true;
  }

  /// Removes the oldest item; returns false if the ring is empty.  Thread: consumer.
  bool pop(T& item) noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_seen_) {
      head_seen_ = head_.load(Orders::kLoad);  // pairs with the store in push()
      if (tail == head_seen_) return false;
    }
    item = slots_[tail & (kCapacity - 1)];
    tail_.store(tail + 1, Orders::kStore);  // pairs with the load in push()
    return true;
  }

  /// Returns the number of items dropped since the start.  Thread: any.
  std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  alignas(kCacheLine) std::atomic<std::uint64_t> head_{0};  // written by the producer
  std::uint64_t tail_seen_ = 0;                             // producer only
  std::atomic<std::uint64_t> dropped_{0};                   // written by the producer
  alignas(kCacheLine) std::atomic<std::uint64_t> tail_{0};  // written by the consumer
  std::uint64_t head_seen_ = 0;                             // consumer only
  alignas(kCacheLine) std::array<T, kCapacity> slots_{};
};

}  // namespace hapticd::rt

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "rt/channels/spsc_ring.h"
#include "rt/channels/triple_buffer.h"

/// Deliberately wrong channels. The stress tests must detect every one of them.
namespace hapticd::test {

/// A TripleBuffer with other memory orders than its own, which are acq_rel for both operations.
template <std::memory_order publish, std::memory_order refresh>
struct WeakTripleBufferOrders {
  static constexpr std::memory_order kPublish = publish;
  static constexpr std::memory_order kRefresh = refresh;
};
template <typename T, std::memory_order publish, std::memory_order refresh>
using WeakTripleBuffer = rt::TripleBuffer<T, WeakTripleBufferOrders<publish, refresh>>;

/// An SpscRing with other memory orders than its own, which are release and acquire.
template <std::memory_order store, std::memory_order load>
struct WeakSpscRingOrders {
  static constexpr std::memory_order kStore = store;
  static constexpr std::memory_order kLoad = load;
};
template <typename T, std::size_t kCapacity, std::memory_order store, std::memory_order load>
using WeakSpscRing = rt::SpscRing<T, kCapacity, WeakSpscRingOrders<store, load>>;

/// One slot too few: the writer's second value after a refresh goes where the reader is reading.
template <typename T>
class DoubleBuffer {
 public:
  explicit DoubleBuffer(const T& initial) { slots_.fill(initial); }
  T& back() noexcept { return slots_[(published_.load(std::memory_order_relaxed) + 1) % 2]; }
  void publish() noexcept {
    published_.store(published_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }
  bool refresh() noexcept {
    const std::uint64_t published = published_.load(std::memory_order_acquire);
    if (published == seen_) return false;
    seen_ = published;
    return true;
  }
  const T& front() const noexcept { return slots_[seen_ % 2]; }

 private:
  std::array<T, 2> slots_;
  std::atomic<std::uint64_t> published_{0};
  std::uint64_t seen_ = 0;
};

/// Never full: a producer that is ahead by more than the capacity overwrites unread items.
template <typename T, std::size_t kCapacity>
class OverwritingRing {
 public:
  bool push(const T& item) noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    slots_[head % kCapacity] = item;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }
  bool pop(T& item) noexcept {
    if (tail_ == head_.load(std::memory_order_acquire)) return false;
    item = slots_[tail_ % kCapacity];
    ++tail_;
    return true;
  }
  std::uint64_t dropped() const noexcept { return 0; }

 private:
  std::array<T, kCapacity> slots_{};
  std::atomic<std::uint64_t> head_{0};
  std::uint64_t tail_ = 0;
};

}  // namespace hapticd::test

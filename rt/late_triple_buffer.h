// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>

#include "rt/triple_buffer.h"

namespace hapticd::rt {

/// A TripleBuffer for large values that most boxes never need: its memory is allocated with the first value.
/// Thread: one writer thread (write), one reader thread (refresh, front), for the life of the object.
template <TriviallyCopyable T>
class LateTripleBuffer {
 public:
  LateTripleBuffer() = default;
  LateTripleBuffer(const LateTripleBuffer&) = delete;
  LateTripleBuffer& operator=(const LateTripleBuffer&) = delete;

  /// Makes a copy of `value` the newest value. The release here pairs with the acquire in refresh(), so that
  /// the reader finds the buffer complete.  RT: not safe (the first call allocates).
  void write(const T& value) {
    if (!memory_) memory_ = std::make_unique<TripleBuffer<T>>();
    memory_->write(value);
    buffer_.store(memory_.get(), std::memory_order_release);
  }

  /// Takes over the newest value if there has been one since the last call; returns true if so.
  /// Progress: wait-free.  RT: safe.
  bool refresh() noexcept {
    reader_ = buffer_.load(std::memory_order_acquire);
    return reader_ != nullptr && reader_->refresh();
  }

  /// Returns the value taken over by the last refresh(); null as long as none has been written.
  /// Progress: wait-free.  RT: safe.
  const T* front() const noexcept { return reader_ != nullptr ? &reader_->front() : nullptr; }

 private:
  static_assert(std::atomic<TripleBuffer<T>*>::is_always_lock_free);

  std::unique_ptr<TripleBuffer<T>> memory_;                // writer only
  std::atomic<TripleBuffer<T>*> buffer_{nullptr};          // null until the first value
  alignas(kCacheLine) TripleBuffer<T>* reader_ = nullptr;  // reader only
};

}  // namespace hapticd::rt

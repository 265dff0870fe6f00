// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "rt/base/cache_line.h"

namespace hapticd::test {

/// A value of many cache lines in which every word follows from its sequence number, so that a mix of two
/// values is detected.
template <std::size_t kBytes>
class SealedValue {
  static_assert(kBytes > 2 * rt::kCacheLine && kBytes % sizeof(std::uint64_t) == 0);

 public:
  SealedValue() = default;
  explicit SealedValue(std::uint64_t sequence) noexcept { seal(sequence); }

  void seal(std::uint64_t sequence) noexcept {
    for (std::size_t i = 0; i < words_.size(); ++i) words_[i] = wordOf(sequence, i);
  }
  std::uint64_t sequence() const noexcept { return words_[0]; }
  bool isIntact() const noexcept {
    for (std::size_t i = 1; i < words_.size(); ++i) {
      if (words_[i] != wordOf(words_[0], i)) return false;
    }
    return true;
  }

 private:
  static std::uint64_t wordOf(std::uint64_t sequence, std::size_t i) noexcept {
    return sequence ^ (i * 0x9E3779B97F4A7C15);
  }

  std::array<std::uint64_t, kBytes / sizeof(std::uint64_t)> words_{};
};

using SmallValue = SealedValue<256>;   ///< fast to copy: many exchanges per second
using LargeValue = SealedValue<4096>;  ///< slow to copy: the other side often interferes

}  // namespace hapticd::test

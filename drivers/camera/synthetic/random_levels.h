// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace hapticd::drivers {

/// A fixed bijection of 64 bits that spreads every input bit over all output bits (splitmix64's finaliser).
constexpr std::uint64_t scramble(std::uint64_t bits) noexcept {
  bits += 0x9e3779b97f4a7c15U;
  bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9U;
  bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebU;
  return bits ^ (bits >> 31);
}

/// The same for 32 bits, cheap enough for every pixel.
constexpr std::uint32_t scramble32(std::uint32_t bits) noexcept {
  bits = (bits ^ (bits >> 16)) * 0x85ebca6bU;
  bits = (bits ^ (bits >> 13)) * 0xc2b2ae35U;
  return bits ^ (bits >> 16);
}

/// Returns random bits determined by a seed, a purpose and a number.
constexpr std::uint64_t bitsFor(std::uint32_t seed, std::uint32_t purpose, std::uint64_t number) noexcept {
  return scramble(scramble((std::uint64_t{seed} << 32) | purpose) ^ number);
}

/// Odd factors, so that distinct cells and distinct levels stay distinct.
inline constexpr std::uint32_t kCellFactor = 0x9e3779b9U;
inline constexpr std::uint32_t kLevelFactor = 0x85157af5U;

/// A random value that depends on a place, such as a disparity: at each whole number it is another one, and
/// in between it passes from one to the next. Its variance is 1 everywhere if that of the values is. Thread:
/// any.  RT: safe after construction.
class RandomLevels {
 public:
  RandomLevels() {
    for (int i = 0; i < kPhases; ++i) {
      const double angle = (i + 0.5) / kPhases * std::numbers::pi / 2;
      weights_[static_cast<std::size_t>(i)] = {static_cast<float>(std::cos(angle)),
                                               static_cast<float>(std::sin(angle))};
    }
  }

  /// Returns the value of a cell at `place` >= 0. `valueOf(bits)` makes a value of random bits.
  template <typename ValueOf>
  float at(std::uint32_t cell, float place, const ValueOf& valueOf) const noexcept {
    const auto level = static_cast<std::uint32_t>(place);
    const float fraction = place - static_cast<float>(level);
    const Weights& weight = weights_[static_cast<std::size_t>(fraction * kPhases) % kPhases];
    const std::uint32_t here = cell + level * kLevelFactor;
    return weight.here * valueOf(scramble32(here)) + weight.next * valueOf(scramble32(here + kLevelFactor));
  }

 private:
  static constexpr int kPhases = 256;
  /// Cosine and sine of a phase that runs from 0 to a right angle.
  struct Weights {
    float here;
    float next;
  };
  std::array<Weights, kPhases> weights_{};
};

}  // namespace hapticd::drivers

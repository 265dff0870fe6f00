// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "drivers/camera/synthetic/random_bits.h"

namespace hapticd::drivers {

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

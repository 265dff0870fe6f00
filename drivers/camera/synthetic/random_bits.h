// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

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

}  // namespace hapticd::drivers

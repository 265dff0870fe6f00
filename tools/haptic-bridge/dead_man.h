// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace hapticd::tools {

inline constexpr std::int64_t kDeadManNs = 20'000'000;

/// The share of the commanded force that may be exerted when the newest valid command arrived `age_ns` ago:
/// all of it for 10 ms, none after 20 ms, and a falling share in between, so that the
/// force fades when a network stalls.
/// RT: safe.
constexpr double deadManShare(std::int64_t age_ns) {
  constexpr std::int64_t kFullNs = kDeadManNs / 2;
  if (age_ns <= kFullNs) return 1;
  if (age_ns >= kDeadManNs) return 0;
  return static_cast<double>(kDeadManNs - age_ns) / static_cast<double>(kDeadManNs - kFullNs);
}

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy/pop_through.h"

namespace hapticd::tools {
namespace {

constexpr double kContact_n = 0.25;
constexpr double kIdealContact_n = 0.5;

}  // namespace

PopThrough judgePush(std::span<const double> outward_n, std::span<const double> ideal_n) {
  PopThrough push;
  for (std::size_t tick = 0; tick < outward_n.size(); ++tick) {
    const double force_n = outward_n[tick];
    if (force_n > push.largest_n) {
      push.dipped = push.dipped || push.popped;
      push.popped = false;
      push.largest_n = force_n;
      push.largest_tick = tick;
      continue;
    }
    const bool gives_way = push.largest_n >= kContact_n && force_n < push.largest_n / 2;
    const bool holds_nothing = ideal_n[tick] >= kIdealContact_n && force_n <= 0;
    push.popped = push.popped || gives_way || holds_nothing;
  }
  return push;
}

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "rt/laws/contact.h"
#include "rt/laws/nearest_springs.h"

namespace hapticd::rt {

/// State that the force laws keep from tick to tick.  Thread: one.
struct LawMemory {
  /// `point_capacity`: of the scenes that forces are computed from.  RT: not safe (allocates).
  explicit LawMemory(std::size_t point_capacity) : search(point_capacity) {}

  SearchMemory search;
  ProxyMemory proxy;
};

}  // namespace hapticd::rt

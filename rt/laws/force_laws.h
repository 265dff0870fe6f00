// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "rt/base/realtime_safe.h"
#include "rt/laws/contact.h"
#include "rt/laws/force_law.h"
#include "rt/laws/nearest_springs.h"

namespace hapticd::rt {

/// State that the force laws keep from tick to tick.  Thread: one.
struct LawMemory {
  /// `point_capacity`: of the scenes that forces are computed from.  RT: not safe (allocates).
  explicit LawMemory(std::size_t point_capacity) : search(point_capacity) {}

  SearchMemory search;
  ProxyMemory proxy;
};

/// Evaluates the selected force law and holds the state that the laws carry from tick to tick.
/// Thread: one.
class ForceLaws {
 public:
  /// `point_capacity`: of the scenes that forces are computed from.  RT: not safe (allocates).
  explicit ForceLaws(std::size_t point_capacity) : memory_(point_capacity) {}

  /// Returns the force of the law selected by `input.parameters`. As long as the scene does not hold the data
  /// which that law reads, the previous law is evaluated instead; if the scene does not serve that one
  /// either, the force is zero and `outside_model` is set.
  ForceSample force(const LawInput& input) HAPTICD_RT;

  /// Returns the law that the last force came from.
  ForceLaw law() const HAPTICD_RT { return law_; }

  /// Returns the place around which the scene must be modelled for the next force: the proxy if there is one,
  /// otherwise `hip_m_in_world`.
  Vec3 focus_m_in_world(const Vec3& hip_m_in_world) const HAPTICD_RT {
    return memory_.proxy.placed ? memory_.proxy.position_m_in_world : hip_m_in_world;
  }

  /// Forgets the proxy: the next force of a constraint law begins with the proxy at the HIP.
  void release() HAPTICD_RT { memory_.proxy = {}; }

  /// All state that the next force depends on.
  struct Memory {
    ProxyMemory proxy;
    ForceLaw law{};
    SearchMemory::Guess guess;
  };
  Memory memory() const HAPTICD_RT { return {memory_.proxy, law_, memory_.search.guess()}; }
  void restore(const Memory& memory) HAPTICD_RT {
    memory_.proxy = memory.proxy;
    law_ = memory.law;
    memory_.search.setGuess(memory.guess);
  }

 private:
  LawMemory memory_;
  ForceLaw law_{};
};

}  // namespace hapticd::rt

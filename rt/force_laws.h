// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "rt/force_law.h"
#include "rt/law_memory.h"
#include "rt/realtime_safe.h"

namespace hapticd::rt {

/// The force laws and what they remember from tick to tick.
/// Thread: one.
class ForceLaws {
 public:
  /// `point_capacity`: of the scenes that forces are computed from.  RT: not safe (allocates).
  explicit ForceLaws(std::size_t point_capacity) : memory_(point_capacity) {}

  /// The force of the law that `input.parameters` names; as long as the scene does not hold what that law
  /// reads, of the law before. Zero, and outside the model, where the scene does not serve that one either.
  ForceSample force(const LawInput& input) HAPTICD_RT;

  /// Whose force the last one was.
  ForceLaw law() const HAPTICD_RT { return law_; }

  /// Around this place the next force needs the scene modelled: the proxy of a constraint law, else the HIP.
  /// `hip_m_in_world`: where there is no proxy.
  Vec3 focus_m_in_world(const Vec3& hip_m_in_world) const HAPTICD_RT {
    return memory_.proxy.placed ? memory_.proxy.position_m_in_world : hip_m_in_world;
  }

  /// Forgets the proxy: the next force of a constraint law begins with the proxy at the HIP.
  void release() HAPTICD_RT { memory_.proxy = {}; }

  /// What the next force depends on.
  struct Memory {
    ProxyMemory proxy;
    ForceLaw law = ForceLaw::nearest_springs;
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
  ForceLaw law_ = ForceLaw::nearest_springs;
};

}  // namespace hapticd::rt

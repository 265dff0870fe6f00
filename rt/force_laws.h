// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "rt/contact.h"
#include "rt/force_law.h"
#include "rt/nearest_springs.h"
#include "rt/realtime_safe.h"

namespace hapticd::rt {

/// The force laws and what they remember from tick to tick.
/// Thread: one.
class ForceLaws {
 public:
  /// `point_capacity`: of the scenes to be felt.  RT: not safe (allocates).
  explicit ForceLaws(std::size_t point_capacity) : search_(point_capacity) {}

  /// The force of the law that `input.parameters` names; as long as the scene does not hold what that law
  /// reads, of the law before. Zero, and outside the model, where the scene does not serve that one either.
  ForceSample force(const LawInput& input) HAPTICD_RT;

  /// Whose force the last one was.
  ForceLaw law() const HAPTICD_RT { return law_; }

  /// Around this place the next force needs the scene modelled: the proxy of a constraint law, else the HIP.
  /// `hip_m_in_world`: where there is no proxy.
  Vec3 focus_m_in_world(const Vec3& hip_m_in_world) const HAPTICD_RT {
    return proxy_.placed ? proxy_.position_m_in_world : hip_m_in_world;
  }

  /// Forgets the proxy: the next force of a constraint law begins with the proxy at the HIP.
  void release() HAPTICD_RT { proxy_ = {}; }

  /// What the next force depends on.
  struct Memory {
    ProxyMemory proxy;
    ForceLaw law = ForceLaw::nearest_springs;
    SearchMemory::Guess guess;
  };
  Memory memory() const HAPTICD_RT { return {proxy_, law_, search_.guess()}; }
  void restore(const Memory& memory) HAPTICD_RT {
    proxy_ = memory.proxy;
    law_ = memory.law;
    search_.setGuess(memory.guess);
  }

 private:
  SearchMemory search_;
  ProxyMemory proxy_;
  ForceLaw law_ = ForceLaw::nearest_springs;
};

}  // namespace hapticd::rt

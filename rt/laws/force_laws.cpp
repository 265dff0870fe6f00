// SPDX-License-Identifier: Apache-2.0
#include "rt/laws/force_laws.h"

#include "rt/laws/law_table.h"

namespace hapticd::rt {
namespace {

/// True if the scene holds the kind of data that the law reads.
bool serves(const Scene& scene, const ForceLawRow& law) noexcept {
  return (scene.has_points || !law.reads_points) && (scene.has_image || !law.reads_image) &&
         (scene.has_surface || !law.reads_surface);
}

ForceSample outsideModel(const LawInput& input) noexcept {
  return {.force_n_in_world = {},
          .proxy_m_in_world = input.hip_m_in_world,
          .normal_in_world = {},
          .outside_model = true};
}

}  // namespace

ForceSample ForceLaws::force(const LawInput& input) HAPTICD_RT {
  if (input.scene.frame == 0 || !isFinite(input.hip_m_in_world)) return outsideModel(input);
  if (serves(input.scene, rowOf(input.parameters.law)) && law_ != input.parameters.law) {
    law_ = input.parameters.law;
    memory_.proxy.surface = {};  // another law may have moved the proxy since
  }
  const ForceLawRow& law = rowOf(law_);
  if (!serves(input.scene, law)) return outsideModel(input);
  if (!law.has_proxy) {
    release();
    if (!input.scene.covers(input.hip_m_in_world, law.reach_m(input.parameters))) return outsideModel(input);
  }
  return law.force(input, memory_);
}

}  // namespace hapticd::rt

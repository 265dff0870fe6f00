#include "rt/force_laws.h"

namespace hapticd::rt {

ForceSample ForceLaws::force(const LawInput& input) HAPTICD_RT {
  switch (input.parameters.law) {
    case ForceLaw::nearest_springs:
      return nearestSprings(input.scene, input.hip_m_in_world, input.parameters.springs, search_);
    case ForceLaw::smooth_springs:
    case ForceLaw::proxy:
    case ForceLaw::surface:
      break;
  }
  return {};
}

}  // namespace hapticd::rt

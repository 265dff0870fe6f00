// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "rt/force_law.h"
#include "rt/vec3.h"
#include "tools/lib/truth/scene_noise.h"

namespace hapticd::tools {

/// How a hand enters or leaves a body other than through the surface that the camera sees.
enum class EntryKind : std::uint8_t {
  visible_side,  ///< through a side that faces the optical axis and is seen at a grazing angle
  hidden_side,   ///< through a side that the camera does not see
  from_behind,   ///< out of the depth behind the front, and out through the front
  into_image,    ///< behind the level of a wall, from beyond the image's border
  out_of_image,  ///< pressing on a wall, over the image's border
};
std::string_view nameOf(EntryKind kind);

struct EntryCase {
  EntryKind kind = EntryKind::hidden_side;
  double wall_m = 1;
  double below_m = 0.02;  ///< of the hand, behind the level of the front
  SceneNoise noise = SceneNoise::none;
  std::uint32_t seed = 1;
};

/// The force on a hand in or beside a body, and the true ones.
struct EntryTick {
  rt::Vec3 force_n;
  rt::ContactState state = rt::ContactState::free;
  bool inside = false;       ///< the HIP is in the solid, by more than 2 mm
  bool outside = false;      ///< the HIP is out of it, by more than 2 mm
  rt::Vec3 through_front_n;  ///< the spring to the front; what is inside may get that
  rt::Vec3 through_side_n;   ///< the spring to the side, or zero where there is none to come through
};

/// Ticks inside the body by the force that they got, and the largest forces that should not exist.
struct EntryResult {
  std::size_t inside = 0;
  std::size_t of_body = 0;        ///< ticks with the force of the body that was entered
  std::size_t none_reported = 0;  ///< with no force, and the contact state is `behind`
  std::size_t none_silent = 0;    ///< with no force, and no report of it
  std::size_t wrong = 0;          ///< with another force
  double ghost_n = 0;             ///< largest force outside
  double sideways_n = 0;          ///< largest force along the motion where there is no side to come through

  void add(const EntryResult& other);
};
EntryResult judgeEntry(const std::vector<EntryTick>& ticks);

EntryResult runEntry(const std::string& law, const EntryCase& entry);

}  // namespace hapticd::tools

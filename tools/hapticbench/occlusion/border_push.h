// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "tools/lib/truth/scene_noise.h"

namespace hapticd::tools {

/// The border of the surface that a push is next to.
enum class BorderKind : std::uint8_t {
  silhouette_hidden,   ///< a body's edge whose side the camera does not see
  silhouette_visible,  ///< a body's edge whose side it sees
  image_border,        ///< the last column that is measured
};
std::string_view nameOf(BorderKind kind);

/// A push straight in, 45 mm deep, beside a border.
struct BorderPushCase {
  BorderKind kind = BorderKind::silhouette_hidden;
  double wall_m = 1;
  double beside_m = 0.01;      ///< from the border, on the body
  double speed_m_per_s = 0.1;  ///< of the hand towards the surface, or of the surface towards the hand
  bool surface_moves = false;  ///< 60 mm, from 20 mm behind a HIP that is still
  SceneNoise noise = SceneNoise::none;
  std::uint32_t seed = 1;
};

struct BorderPushResult {
  int pushes = 0;
  int popped = 0;        ///< number of pushes that popped through below 20 N
  double least_n = 1e9;  ///< smallest pop-through force, or the largest force reached

  void add(const BorderPushResult& other);
};

BorderPushResult runBorderPush(const std::string& law, const BorderPushCase& push);

}  // namespace hapticd::tools

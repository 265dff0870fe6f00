// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "drivers/trace/foxglove/depth_points.h"
#include "rt/depth/depth_frame_header.h"
#include "rt/loop/loop_state.h"

/// The haptic scene as messages of Foxglove's schemas: what is drawn, where and how large.
/// Thread: any.  RT: not safe.
namespace hapticd::drivers::foxglove {

/// Radii of the spheres, from the parameters in force.
struct SceneRadii {
  double springs_m = 0.04;  ///< force.radius_m: the laws with springs look at points this near to the HIP
  double proxy_m = 0.008;   ///< contact.proxy_radius_m

  /// Takes over a parameter if it is one of these.
  void set(std::string_view name, double value);
  void set(std::string_view name, std::string_view value);
};

/// Length of the arrow that stands for a force.
inline constexpr double kArrow_m_per_n = 0.04;

/// Appends a SceneUpdate with the entities `hip`, `proxy`, `force` and `reach`. What does not apply or is not
/// finite is an entity without content, which removes the earlier one from the picture. `proxy`: for laws
/// with a proxy; `force`: the commanded one, from the HIP on.
void encodeScene(std::uint64_t realtime_ns, const rt::Tick& tick, const SceneRadii& radii,
                 const ModelledBall& ball, std::string& to);

/// Appends FrameTransforms from the world to the camera and on to its optical frame.
void encodeCameraTransforms(std::uint64_t realtime_ns, const rt::DepthFrameHeader& camera, std::string& to);

}  // namespace hapticd::drivers::foxglove

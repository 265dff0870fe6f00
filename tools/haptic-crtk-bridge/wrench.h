// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"

namespace hapticd::tools::crtk {

/// How an arm takes a wrench.
enum class WrenchConvention : std::uint8_t {
  body_absolute,  ///< body/servo_cf, at the tip, along the axes of the frame of measured_cp
  body,           ///< body/servo_cf, at the tip, along the axes of the tip
  base,           ///< as body_absolute, by an arm that knows no other axes and so takes no setting of them
  spatial,        ///< spatial/servo_cf, along the axes of the frame of local/measured_cp, about its origin
};

struct Wrench {
  rt::Vec3 force_n;
  rt::Vec3 torque_n_m;
};

/// The wrench by which an arm exerts a force at its tip, and no torque there. `force_n_in_frame` and
/// `T_frame_tip`: in the frame of the measurements. In the spatial convention a wrench acts at the origin of
/// the frame, where a force at the tip has a torque.
inline Wrench wrenchOf(WrenchConvention convention, const rt::Vec3& force_n_in_frame,
                       const rt::RigidPose& T_frame_tip) {
  switch (convention) {
    case WrenchConvention::body_absolute:
    case WrenchConvention::base:
      break;
    case WrenchConvention::body:
      return {rotated(inverse(T_frame_tip.orientation), force_n_in_frame), {}};
    case WrenchConvention::spatial:
      return {force_n_in_frame, cross(T_frame_tip.position_m_in_world, force_n_in_frame)};
  }
  return {force_n_in_frame, {}};
}

}  // namespace hapticd::tools::crtk

// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/base/pose_json.h"

#include <array>
#include <utility>

namespace hapticd::daemon {

OrderedJson poseJson(const rt::PoseParameters& pose) {
  const auto& [position_m, roll_rad, pitch_rad, yaw_rad] = pose;
  return {{"xM", position_m.x},  {"yM", position_m.y},    {"zM", position_m.z},
          {"rollRad", roll_rad}, {"pitchRad", pitch_rad}, {"yawRad", yaw_rad}};
}

std::optional<rt::PoseParameters> poseFrom(const Json& json) {
  rt::PoseParameters pose;
  const std::array<std::pair<const char*, double*>, 6> values{{{"xM", &pose.position_m.x},
                                                               {"yM", &pose.position_m.y},
                                                               {"zM", &pose.position_m.z},
                                                               {"rollRad", &pose.roll_rad},
                                                               {"pitchRad", &pose.pitch_rad},
                                                               {"yawRad", &pose.yaw_rad}}};
  if (!json.is_object() || json.size() != values.size()) return std::nullopt;
  for (const auto& [name, value] : values) {
    const auto found = json.find(name);
    if (found == json.end() || !found->is_number()) return std::nullopt;
    *value = found->get<double>();
  }
  return pose;
}

}  // namespace hapticd::daemon

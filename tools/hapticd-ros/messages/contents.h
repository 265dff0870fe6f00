// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "rt/base/rigid_pose.h"

/// What messages are made of, without the structures of DDS.
namespace hapticd::tools::ros {

/// A frame that does not move in another one.
struct FixedFrame {
  std::string parent;
  std::string name;
  rt::RigidPose T_parent_frame;
  friend bool operator==(const FixedFrame&, const FixedFrame&) = default;
};

/// What one part of the box has to report.
struct Diagnostic {
  enum class Level : std::uint8_t { ok, warning, error, stale };  ///< as in diagnostic_msgs
  Level level = Level::ok;
  std::string name;         ///< "hapticd: camera"
  std::string message;      ///< one line for people
  std::string hardware_id;  ///< may be empty
  std::vector<std::pair<std::string, std::string>> values;
};

}  // namespace hapticd::tools::ros

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "rt/base/rigid_pose.h"
#include "tools/lib/client/varlink_client.h"
#include "tools/lib/ros/contents.h"

namespace hapticd::tools::ros {

/// What is needed to show fixtures beside their definitions.
struct FixtureSurroundings {
  std::optional<rt::RigidPose> T_world_camera;  ///< x right, y up, looking along -z
  /// T_world_frame of the frames that move and have a pose.
  std::map<std::string, rt::RigidPose> frames;
  /// Contour lines of solids, by the SHA-256 of their file. A line is x, y and z of its first point, then of
  /// the next one, and so on; metres, in the frame of the solid.
  std::map<std::string, std::vector<std::vector<double>>> outlines;
};

/// Whether the fixture with this definition is in a frame that moves, and not in that of world or camera.
bool isInMovingFrame(const Json& definition);

/// Markers in the world frame for each entry of io.hapticd.Status.ListFixtures. Red: a forbidden region;
/// blue: one that keeps the hand inside; yellow: a region that slows; green: guidance; faint: disabled. What
/// has no shape, or whose place is not known, is a line of text: a stand-off is wherever the camera sees a
/// surface. The number of markers of a fixture and their ids depend on its definition alone.
std::vector<Marker> fixtureMarkers(const Json& fixtures, const FixtureSurroundings& surroundings);

}  // namespace hapticd::tools::ros

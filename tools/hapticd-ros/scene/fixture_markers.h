// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/trace/ros/message_set.h"
#include "rt/base/rigid_pose.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::ros {

using trace::ros::Marker;

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

/// Asks a hapticd that may come and go for its fixtures, over a connection of its own.
/// Thread: one at a time. A call may wait for hapticd for up to a second.
class FixtureWatch {
 public:
  /// interrupt: a descriptor that ends waits when it becomes readable.
  FixtureWatch(std::string socket, int interrupt) : socket_(std::move(socket)), interrupt_(interrupt) {}

  /// Asks for everything. False: hapticd does not answer, and no fixtures are known then.
  bool refresh();
  /// Asks only where the moving frames are; false likewise.
  bool refreshFrames();
  /// Whether a fixture is in a frame that moves.
  bool anyMoves() const;
  /// In the world frame.
  std::vector<Marker> markers() const { return fixtureMarkers(fixtures_, surroundings_); }

 private:
  static constexpr std::chrono::milliseconds kSilence{1000};

  ClientResult<Json> call(const std::string& method, const Json& parameters = Json::object());
  bool askForFixtures();
  bool askForCamera();
  bool askForSolids();
  bool forget();

  std::string socket_;
  int interrupt_;
  std::optional<VarlinkClient> link_;
  Json fixtures_ = Json::array();
  FixtureSurroundings surroundings_;
};

}  // namespace hapticd::tools::ros

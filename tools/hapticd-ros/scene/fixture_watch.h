// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "tools/hapticd-ros/scene/fixture_markers.h"
#include "tools/lib/client/varlink_client.h"
#include "tools/lib/ros/contents.h"

namespace hapticd::tools::ros {

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

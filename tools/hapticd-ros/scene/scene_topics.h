// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tools/hapticd-ros/dds/participant.h"
#include "tools/hapticd-ros/dds/publisher.h"
#include "tools/lib/ros/contents.h"

namespace hapticd::tools::ros {

/// The topics that show what the box sees and what people have added to it. Times are UTC in nanoseconds
/// since 1970. What is written returns false where it could not be.
/// Thread: one at a time writes; all() from any.  RT: not safe: a write takes up to Publisher::kMaxBlocking.
class SceneTopics {
 public:
  /// name_space: of the topics and frames, "hapticd" or "left/hapticd".
  static base::Result<SceneTopics> open(const Participant& participant, const std::string& name_space);

  /// All of them, valid as long as this object stays where it is.
  std::vector<const Publisher*> all() const {
    return {&points_.publisher, &image_.publisher, &camera_info_, &fixtures_};
  }

  bool wantsPoints() const { return points_.publisher.subscribers() > 0; }
  bool wantsImage() const { return image_.publisher.subscribers() > 0; }
  bool wantsCameraInfo() const { return camera_info_.subscribers() > 0; }
  bool wantsFixtures() const { return fixtures_.subscribers() > 0; }

  /// Whether the last points have arrived at all their subscribers, so that others may follow; also true, for
  /// the sake of the other subscribers, when one has not got them within a second. To be asked before each
  /// write. A message of many packets that is replaced on its way is of no use to whom it was meant for, and
  /// Fast DDS 2.9 hands such a one to its subscriber as an empty message: of topics without a key it keeps
  /// messages that are not complete among those to be taken.
  bool mayWritePoints() { return mayFollow(points_); }
  bool mayWriteImage() { return mayFollow(image_); }

  /// In the optical frame of the camera. `xyz_m`: x, y and z of each point in metres.
  bool points(std::int64_t time_ns, std::span<const float> xyz_m);
  bool image(std::int64_t time_ns, const DepthImage& image);
  bool cameraInfo(std::int64_t time_ns, const PinholeCamera& camera);
  /// In the world. They replace all that were shown before.
  bool fixtures(std::int64_t time_ns, std::span<const Marker> markers);

 private:
  SceneTopics(Publisher points, Publisher image, Publisher camera_info, Publisher fixtures,
              const std::string& name_space);

  /// A publisher of large messages.
  struct Outgoing {
    Publisher publisher;
    std::int64_t written_ns = 0;  // CLOCK_MONOTONIC, of the last one
  };
  static bool mayFollow(Outgoing& outgoing);

  Outgoing points_;
  Outgoing image_;
  Publisher camera_info_;
  Publisher fixtures_;
  std::string optical_frame_;
  std::string world_frame_;
};

}  // namespace hapticd::tools::ros

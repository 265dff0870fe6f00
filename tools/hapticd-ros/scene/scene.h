// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "config/base/descriptor.h"
#include "daemon/trace/ros/depth_view.h"
#include "tools/hapticd-ros/dds/publisher.h"
#include "tools/hapticd-ros/scene/depth_source.h"
#include "tools/hapticd-ros/scene/fixture_markers.h"
#include "tools/lib/ros/utc_clock.h"

namespace hapticd::tools::ros {

/// A cloud of 1920 x 1080 points has 24.9 MB.
inline constexpr std::uint32_t kLargestSceneMessage_bytes = 32 << 20;

struct SceneOptions {
  std::string socket;      ///< of hapticd's status
  std::string name_space;  ///< of topics and frames
  int cloud_rate_hz = 10;  ///< Scene::kSlowest_hz..kFastest_hz
};

/// Publishes what the camera of a hapticd sees, which may come and go, and the fixtures. It reads depth
/// frames only while somebody subscribes to one of their topics, and makes only what is subscribed to.
/// Thread: main makes and ends it; it works in a thread of its own, with connections of its own, so that
/// nobody waits for large messages.
class Scene {
 public:
  static constexpr int kSlowest_hz = 1;
  static constexpr int kFastest_hz = 30;

  /// Errors: those of Publications::open(), and a system without descriptors.
  static base::Result<std::unique_ptr<Scene>> open(const Participant& participant, SceneOptions options);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  /// Its topics, for their counters.
  const Publications& topics() const noexcept { return topics_; }

 private:
  Scene(Publications topics, const SceneOptions& options, base::Descriptor ending);

  void run();
  bool wantsDepth() const;
  void showDepth();
  void openDepth();
  void showFrame();
  void showFixtures();
  bool wants(Topic topic) const { return topics_.of(topic).subscribers() > 0; }
  /// Whether the last message has arrived at all its subscribers, so that others may follow; also true, for
  /// the sake of the other subscribers, when one has not got it within a second. To be asked before each
  /// write. A message of many packets that is replaced on its way is of no use to whom it was meant for, and
  /// Fast DDS 2.9 hands such a one to its subscriber as an empty message: of topics without a key it keeps
  /// messages that are not complete among those to be taken.
  bool mayFollow(Topic topic, std::int64_t& written_ns) const;
  template <typename Encode>
  void show(Topic topic, Encode encode) {
    noteWrite(topics_.publish(topic, encode));
  }
  void say(const std::string& problem);
  void noteWrite(bool is_written);
  /// Waits, or returns at once when it is to end.
  void rest() const;
  bool isEnding() const;

  Publications topics_;
  std::int64_t points_written_ns_ = 0;  // CLOCK_MONOTONIC, of the last ones
  std::int64_t image_written_ns_ = 0;
  std::string world_frame_;
  std::string optical_frame_;
  base::Descriptor ending_;  // becomes readable when the thread is to end
  std::string said_;         // the last problem
  bool write_problem_was_said_ = false;
  UtcClock utc_;

  DepthSource depth_;
  FrameChoice choice_;
  std::int64_t next_open_ns_ = 0;  // CLOCK_MONOTONIC
  rt::DepthFrameHeader header_;
  std::vector<std::byte> raw_;
  trace::ros::DepthView view_;
  std::vector<float> xyz_m_;
  trace::ros::DepthImage image_;

  FixtureWatch fixtures_;
  std::int64_t next_fixtures_ns_ = 0;  // CLOCK_MONOTONIC
  std::int64_t next_frames_ns_ = 0;
  std::optional<std::vector<Marker>> markers_;  // that were written last

  std::thread thread_;
};

}  // namespace hapticd::tools::ros

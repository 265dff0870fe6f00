// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/trace/format/trace_format.h"
#include "daemon/trace/ros/depth_view.h"
#include "daemon/trace/ros/message_set.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_frame_header.h"
#include "rt/loop/loop_state.h"

/// What viewers draw of a running box and of its traces: where, how large, and under which topics.
/// Thread: any.  RT: not safe.
namespace hapticd::trace::ros {

/// A topic and its message, "sensor_msgs/Image".
struct Channel {
  std::string_view topic;
  std::string_view message;
};
inline constexpr Channel kSceneChannel{kViewerTopics[0], "visualization_msgs/MarkerArray"};
inline constexpr Channel kTransformsChannel{kViewerTopics[1], "tf2_msgs/TFMessage"};
inline constexpr Channel kReachCloudChannel{kViewerTopics[2], "sensor_msgs/PointCloud2"};

// Names of the frames of reference (frame_id).
inline constexpr std::string_view kWorldFrame = "world";
inline constexpr std::string_view kCameraFrame = "camera";  ///< x right, y up, looking along -z
/// The same place with the axes that ROS 2 expects: x right, y down, looking along +z.
inline constexpr std::string_view kOpticalFrame = "camera_optical";

/// The camera in the world, and its optical frame in the camera's own. `prefix`: of the names, "left/" or "".
std::vector<FixedFrame> cameraFrames(const std::string& prefix, const rt::RigidPose& T_world_camera);

/// Reduces ticks to at most one per window of time: the one with the largest commanded force, of equal ones
/// the newest. So no peak of the force is missed, however short it is.
/// Thread: one.
class TickDecimator {
 public:
  explicit TickDecimator(std::int64_t window_ns) : window_ns_(window_ns) {}

  /// Adds a tick; ticks come in the order of time. Returns the tick of the window before if that has ended.
  std::optional<rt::Tick> add(const rt::Tick& tick) {
    const std::int64_t window = tick.planned_ns / window_ns_;
    std::optional<rt::Tick> ended;
    if (best_ && window != number_) ended.swap(best_);
    number_ = window;
    const double force_n = rt::norm(tick.command_force_n_in_world);
    if (!best_ || !(force_n < force_n_)) {
      best_ = tick;
      force_n_ = force_n;
    }
    return ended;
  }

 private:
  std::int64_t window_ns_;
  std::int64_t number_ = 0;
  std::optional<rt::Tick> best_;
  double force_n_ = 0;
};

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

/// The markers `hip`, `proxy`, `reach`, `force` and its number, in the world frame. What does not apply or is
/// not finite is a marker that removes the earlier one from the picture. `proxy`: for laws with a proxy;
/// `force`: the commanded one, from the HIP on.
std::vector<Marker> sceneMarkers(const rt::Tick& tick, const SceneRadii& radii, const ModelledBall& ball);

/// Appends them as a message of kSceneChannel. realtime_ns: CLOCK_REALTIME.
void encodeScene(std::uint64_t realtime_ns, const rt::Tick& tick, const SceneRadii& radii,
                 const ModelledBall& ball, std::string& to);

/// Appends the frames of a camera as a message of kTransformsChannel.
void encodeCameraTransforms(std::uint64_t realtime_ns, const rt::DepthFrameHeader& camera, std::string& to);

}  // namespace hapticd::trace::ros

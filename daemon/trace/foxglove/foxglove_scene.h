// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rt/base/vec3.h"
#include "rt/depth/depth_frame_header.h"
#include "rt/loop/loop_state.h"

/// The haptic scene as messages of Foxglove's schemas: what is drawn, where and how large.
/// Thread: any.  RT: not safe.
namespace hapticd::trace {

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

/// The ball around which the scene is modelled.
struct ModelledBall {
  rt::Vec3 centre_m_in_world;
  double radius_m = 0;  ///< 0: none, or the whole frame is modelled
};

/// Converts raw depth images to points in the camera frame (x right, y up, looking along -z), in metres:
/// x, y, z, x, y, z, ... in the order of the image. Pixels without measurement, and those beyond kFarthest_m,
/// have no point.
/// Thread: one.  RT: not safe.
class DepthPoints {
 public:
  /// Farther values are no measurements but next to the pole of a reciprocal depth law.
  static constexpr double kFarthest_m = 20;

  // `image`: the stride_bytes * height_px bytes described by a valid header. The result is valid until the
  // next call.
  /// Every `step`-th pixel of every `step`-th row; `step` > 0.
  std::span<const float> decimated(const rt::DepthFrameHeader& header, std::span<const std::byte> image,
                                   std::uint32_t step);
  /// All points inside a ball.
  std::span<const float> inBall(const rt::DepthFrameHeader& header, std::span<const std::byte> image,
                                const ModelledBall& ball);

 private:
  void updateTable(const rt::DepthFrameHeader& header);

  rt::DepthFrameHeader table_of_ = {};  ///< the header that the table was computed for
  std::vector<double> depth_m_;         ///< by raw value; 0: no point
  std::vector<float> points_;
};

}  // namespace hapticd::trace

namespace hapticd::trace::foxglove {

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

}  // namespace hapticd::trace::foxglove

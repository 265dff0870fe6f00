// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "drivers/camera/synthetic/scene_camera.h"
#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_frame.h"
#include "tools/lib/truth/any_camera.h"

/// Pieces of a surface that a camera at the origin looks at along -z (x right, y up). Each knows
/// - closest(p): its point nearest to p,
/// - depth(ray): the depth Z of its first point on the ray Z * (x, y, -1), Z > 0; infinite where it is not
/// met
///   from the front,
/// - normal(p): the unit vector out of the solid at its point p.
/// Metres, camera frame.  Thread: any.
namespace hapticd::tools {

/// A part of a plane: endless along y turned into the plane, from `first_m` to `last_m` along `across`.
struct Strip {
  rt::Vec3 origin_m;
  rt::Vec3 outward;  ///< unit normal
  rt::Vec3 across;   ///< unit vector in the plane
  double first_m;    ///< may be infinite
  double last_m;     ///< may be infinite

  rt::Vec3 closest(const rt::Vec3& p) const;
  double depth(const rt::Vec3& ray) const;
  rt::Vec3 normal(const rt::Vec3& p) const;
};

/// The part of a ball that the camera sees, or of a cylinder whose axis is parallel to y.
struct Round {
  rt::Vec3 centre_m;
  double radius_m;
  bool is_cylinder;

  rt::Vec3 closest(const rt::Vec3& p) const;
  double depth(const rt::Vec3& ray) const;
  rt::Vec3 normal(const rt::Vec3& p) const;
  /// Metres to the whole ball or cylinder, negative inside.
  double signedDistance(const rt::Vec3& p) const;

 private:
  rt::Vec3 across(const rt::Vec3& v) const;
};

/// The half of a sphere farther from the camera than its centre, seen from within.
struct Bowl {
  rt::Vec3 centre_m;
  double radius_m;

  rt::Vec3 closest(const rt::Vec3& p) const;
  double depth(const rt::Vec3& ray) const;
  rt::Vec3 normal(const rt::Vec3& p) const;
};

/// A fronto-parallel wall with a round hole.
struct HoledWall {
  rt::Vec3 centre_m;
  double radius_m;  ///< of the hole

  rt::Vec3 closest(const rt::Vec3& p) const;
  double depth(const rt::Vec3& ray) const;
  rt::Vec3 normal(const rt::Vec3& p) const;
};

using SurfacePatch = std::variant<Strip, Round, Bowl, HoledWall>;

enum class SceneKind : std::uint8_t {
  plane,         ///< turned by `tilt_rad` about x (positive: its upper part is nearer); solid behind
  sphere,        ///< a ball with nothing behind it
  bowl,          ///< a wall with a hollow half sphere
  cylinder,      ///< axis along y, nothing behind it
  convex_edge,   ///< two planes at 45 degrees to the view that meet at x = 0, their edge towards the camera
  half_plane,    ///< a solid block that ends at x = 0, nothing beside it
  inner_corner,  ///< two planes at 45 degrees to the view that meet at x = 0, their corner away from the
                 ///< camera
  thin_plate,    ///< a plate around x = 0, endless along y, and a wall behind it
  step,          ///< fronto-parallel, `step_m` farther where x > 0
};

/// Metres; the scene is at `distance_m` on the optical axis at time 0 (a bowl's bottom is) and moves towards
/// the camera as a whole.
struct TrueSceneParameters {
  SceneKind kind = SceneKind::plane;
  double distance_m = 1;
  double tilt_rad = 0;
  double radius_m = 0.05;
  double plate_width_m = 0.06;
  double plate_thickness_m = 0.01;
  double wall_behind_m = 0.15;  ///< from the plate's front to the wall
  double step_m = 0.02;
  double speed_m_per_s = 0;  ///< towards the camera
};

/// A scene whose surface is known, and its image in a camera at the world's origin that looks along -z (x
/// right, y up). Times in seconds.
/// Thread: one at a time (render uses a buffer of the object).  RT: not safe.
class TrueScene {
 public:
  /// `seed`: of the noise.
  explicit TrueScene(const TrueSceneParameters& parameters, const rt::DepthModelParameters& depth_model = {},
                     std::uint32_t seed = 1);

  const TrueSceneParameters& parameters() const noexcept { return parameters_; }
  const rt::DepthModelParameters& depthModel() const noexcept { return camera_.model(); }

  /// Metres to the solid's surface, the sides that the camera does not see included: positive in free space,
  /// negative inside.
  double signedDistance(const rt::Vec3& p_m_in_world, double t_s) const;

  /// The closest point of the surface that the camera sees: where an ideal constraint holds the proxy when
  /// the HIP was pushed to `p` from the front. Where the line of sight to `p` crosses one of several sheets
  /// (plate and wall, the two levels of a step), the closest point of that sheet.
  rt::Vec3 closestVisible(const rt::Vec3& p_m_in_world, double t_s) const;

  /// Metres from `p` to closestVisible(p), or 0 where nothing that the camera sees is in front of `p`.
  double penetration(const rt::Vec3& p_m_in_world, double t_s) const;

  /// Unit vector out of the solid at the point of the visible surface that is closest to `p`.
  rt::Vec3 normal(const rt::Vec3& p_m_in_world, double t_s) const;

  /// Where to push the HIP in, and the unit vector in which to push it.
  struct Approach {
    rt::Vec3 surface_m_in_world;
    rt::Vec3 inward_in_world;
  };
  Approach approach(double t_s) const;

  /// Depth Z in metres of the surface on the ray through the middle of pixel (column, row); 0 where the ray
  /// meets nothing. Not limited by near and far.
  double trueDepth(int column, int row, double t_s) const;

  /// Renders the scene at `t_s` as frame `frame_number` (from 1 on), which chooses the noise. Nothing is
  /// measured outside the camera's near_m..far_m.
  void render(double t_s, std::uint64_t frame_number, SceneNoise noise, rt::DepthFrame& frame);

 private:
  /// A piece of the visible surface and the sheet that it belongs to.
  struct VisiblePatch {
    SurfacePatch patch;
    int sheet;
  };
  /// The scene at one time.
  struct Surface {
    std::vector<VisiblePatch> visible;
    std::vector<SurfacePatch> hidden;
  };

  double distanceAt(double t_s) const { return parameters_.distance_m - parameters_.speed_m_per_s * t_s; }
  Surface surfaceAt(double t_s) const;
  bool isSolid(const rt::Vec3& p, double distance_m) const;
  double firstDepth(const Surface& surface, const rt::Vec3& ray) const;

  TrueSceneParameters parameters_;
  drivers::SceneCamera camera_;
  SceneSensor sensor_;
  double measured_at_s_ = -1;
};

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "rt/parameters.h"
#include "rt/vec3.h"
#include "tools/lib/truth/body_scene.h"
#include "tools/lib/truth/rigid_frame.h"
#include "tools/lib/truth/true_body.h"

namespace hapticd::tools {

inline constexpr double kStrokeSpeed_m_per_s = 0.1;
/// Bodies move for that time before ticks are judged: a law may need it to notice a motion.
inline constexpr double kSteady_s = 0.2;

/// The HIP's path along a body, metres in the bodies' frame: a straight line, or an arc where the surface
/// bends. The HIP enters from free space and then stays `depth_m` deep.
struct StrokePath {
  rt::Vec3 start_m;        ///< on the surface
  rt::Vec3 outward;        ///< unit vector out of the surface at the start
  rt::Vec3 along;          ///< unit vector of the stroke at its start, across `outward`
  double length_m = 0.16;  ///< 0: the HIP is pressed in and stays
  double depth_m = 0.008;
  double bend_radius_m = 0;  ///< of the surface along the stroke, convex; 0: straight
  rt::Vec3 entry{};          ///< unit vector opposite to the approach of the HIP; zero: `outward`

  /// The HIP after `stroked_m` of the stroke.
  rt::Vec3 hip_m(double stroked_m) const;
  /// The direction of the stroke there; zero for one of no length.
  rt::Vec3 direction(double stroked_m) const;
  /// Returns the HIP during its approach, `before_m` in front of the start of the stroke.
  rt::Vec3 approach_m(double before_m) const;
};

/// The motion of the HIP once it is in contact.
enum class HipMotion : std::uint8_t {
  strokes,  ///< along its path, which moves with the bodies
  stays,    ///< moves with the bodies until their motion is steady, then stays where it is in the world
};

/// One stroke over known bodies.
struct StrokeCase {
  std::string variant;  ///< what distinguishes it from others of the same scene
  std::vector<TrueBody> bodies;
  RigidFrame T_camera_bodies;
  BodyMotion motion{};
  StrokePath path;
  HipMotion hip = HipMotion::strokes;
  double stays_s = 0.3;  ///< how long a HIP that does not stroke is judged
  double phase_s = 0;    ///< the stroke begins that much later, so that frames come at another moment of it
  std::optional<double> ends_at_m{};  ///< where on the stroke the body or the image ends
  bool ends_unseen = false;           ///< it is the image: what is beyond nobody knows
  bool held_in_front = false;  ///< the HIP is so deep that no point of the body is the nearest: what counts
                               ///< is that the side that it came through goes on holding it
  bool curved = false;         ///< needs a quadratic where a plane does for flat faces
  double patch_side_m = 0.04;  ///< of the square that fits on the body there, at most 40 mm
  double beyond_m = 0.15;      ///< what of depth behind and in front of the scene the camera resolves
};

/// A kind of scene, as it is called on the command line.
struct StrokeScene {
  std::string name;
  bool smooth = true;  ///< no proxy has a reason to stop on it
  bool flat = false;   ///< one flat face under the whole stroke
  bool moving = false;
  double narrowest_m = std::numeric_limits<double>::infinity();  ///< width of a thin body
  double nearest_m = 0;  ///< distance below which it would leave the camera's range
};

inline const std::string& nameOf(const StrokeScene& scene) {
  return scene.name;
}

/// What the cases of a scene depend on.
struct CasePlacement {
  double distance_m = 1;      ///< of the middle of the stroke along the optical axis
  double depth_m = 0.008;     ///< of the strokes; less in bodies that are thinner
  bool dead_columns = false;  ///< the camera has no measurement in its last columns
};

/// All scenes.
const std::vector<StrokeScene>& strokeScenes();

/// The strokes of a scene, all of its variants. `random`: chooses the pixel, the turn in the image and
/// directions that do not matter, so that nothing lies on the lattice of pixels.
std::vector<StrokeCase> strokeCases(const StrokeScene& scene, const CasePlacement& placement,
                                    std::mt19937& random);

/// True where the camera sees the scene: a thin body spans at least 7.9 pixels, as a rod of 20 mm at 1.5 m
/// does, and none comes nearer than the camera can measure.
bool isSeen(const StrokeScene& scene, double distance_m);

}  // namespace hapticd::tools

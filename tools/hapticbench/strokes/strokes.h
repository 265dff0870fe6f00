// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/laws/force_law.h"
#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/engine/measures.h"
#include "tools/hapticbench/engine/report.h"
#include "tools/lib/truth/body_scene.h"
#include "tools/lib/truth/noise_floor.h"

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
  double beside_edge_m = 1;    ///< distance of the stroke from an edge of its flat face
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

  /// Pixels that a thin body spans at that distance; infinite for others.
  double spans_px(double distance_m) const;
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

/// The strokes of one of strokeScenes(). `random`: chooses the pixel, the turn in the image and
/// directions that do not matter, so that nothing lies on the lattice of pixels.
std::vector<StrokeCase> strokeCases(const StrokeScene& scene, const CasePlacement& placement,
                                    std::mt19937& random);

/// True where the camera sees the scene: a thin body spans at least 7.9 pixels, as a rod of 20 mm at 1.5 m
/// does, and none comes nearer than the camera can measure.
bool isSeen(const StrokeScene& scene, double distance_m);

/// The truth at the time of a tick. World frame, metres, newtons.
struct TrueTick {
  double t_s = 0;
  rt::Vec3 hip_m;
  rt::Vec3 along;                    ///< unit vector of the stroke; zero while the HIP is not stroking
  std::optional<Hold> hold;          ///< of the ideal constraint
  rt::Vec3 force_n;                  ///< of the spring from the HIP to the ideal proxy
  double clearance_m = 0;            ///< of a HIP in free space to the nearest body
  std::optional<double> past_end_m;  ///< how far the stroke is beyond where the body ends, negative before
  bool judged = false;               ///< the HIP is pressed in and the motion is steady
};

/// The output of a law at the same tick. World frame, metres, newtons.
struct LawTick {
  rt::Vec3 law_force_n;
  rt::Vec3 blended_force_n;  ///< what the hand gets where no limit acts
  rt::Vec3 proxy_m;
  rt::ContactState state = rt::ContactState::free;
  bool outside_model = false;
};

/// The properties of the camera that sees a case.
struct StrokeView {
  SceneNoise noise = SceneNoise::none;
  rt::DepthModelParameters camera;
  std::uint32_t seed = 1;
};

/// One stroke, and the forces of every law on it.
struct StrokeRun {
  std::vector<TrueTick> truth;
  std::vector<std::vector<LawTick>> output;  ///< by the settings in turn
  double pitch_m = 0;                        ///< of the pixels along the stroke, at its end
};

/// The stroke at 1000 ticks and 30 frames per second; all settings see the same frames.
/// `settings`: complete parameters; their limits on the force are lifted.
StrokeRun runStroke(const StrokeCase& stroke, const StrokeView& view,
                    const std::vector<rt::LiveParameters>& settings);

/// The limits that a stroke is judged by.
struct JudgeLimits {
  double lag_m = 0.005;     ///< the largest lag of the proxy: 5 mm or two pixel pitches, whichever is larger
  double end_m = 0;         ///< ticks that near to the end of the body are judged by where the contact ends
  double pitch_m = 0.0015;  ///< of the pixels along the stroke
  double clear_m = 0.002;   ///< a HIP farther than that from every body touches nothing
  bool has_proxy = true;
  bool moving = false;  ///< the true force changes with the body's motion, so that a delay shows
};

/// By how much a force comes after the true one: the shift in time that leaves the smallest error.
class DelaySearch {
 public:
  static constexpr int kEarliest_ms = -30;
  static constexpr int kLatest_ms = 80;

  /// Adds forces and true forces at successive ticks of a millisecond.
  void add(const std::vector<rt::Vec3>& force_n, const std::vector<rt::Vec3>& true_n);
  void add(const DelaySearch& other);
  /// Positive: the force comes later than the true one. Nothing if nothing was added.
  std::optional<int> delay_ms() const;

 private:
  std::array<double, kLatest_ms - kEarliest_ms + 1> squares_{};  ///< of the error, by the shift
};

/// Where contacts ended, metres beyond the end of the body: the range over several strokes.
struct EndSpread {
  int ends = 0;
  double earliest_m = 0;
  double latest_m = 0;
  double worst_pitches = 0;  ///< largest distance in pixel pitches along the stroke

  void add(double past_end_m, double pitch_m);
  void add(const EndSpread& other);
};

/// The figures of a law on strokes. Judged ticks in which the true force is not zero are "contact ticks",
/// those of a HIP that touches nothing are "free ticks".
struct StrokeFigures {
  int strokes = 0;
  int stopped = 0;  ///< the proxy fell behind by more than the limit and never came back
  int lagged = 0;   ///< it did at some tick
  long contact_ticks = 0;
  long lost_ticks = 0;        ///< truth above 0.5 N, force below 0.1 N
  long right_ticks = 0;       ///< isRightForce()
  long wrong_side_ticks = 0;  ///< force into the body, more than 0.1 N where the truth is above 0.5 N
  long free_ticks = 0;
  long ghost_ticks = 0;  ///< force above 0.1 N on a HIP that touches nothing
  long outside_model_ticks = 0;
  ForceErrors error;           ///< of the law's force
  ForceErrors blended;         ///< of the force after the blend
  Spread along_n;              ///< the error's component along the stroke
  double size_sum_n = 0;       ///< of the magnitudes of the force in contact
  double true_size_sum_n = 0;  ///< and of those of the true one
  DelaySearch delay;
  double lag_m = 0;    ///< largest
  double ghost_n = 0;  ///< largest force on a HIP that touches nothing
  EndSpread end;

  void add(const StrokeFigures& other);
  double lostPercent() const { return percentOf(lost_ticks, contact_ticks); }
  double ghostPercent() const { return percentOf(ghost_ticks, free_ticks); }
  double rightPercent() const { return percentOf(right_ticks, contact_ticks); }
  /// Mean magnitude of the force in contact over that of the true one; nothing without contact.
  std::optional<double> sizeRatio() const;
  double wrongSidePercent() const { return percentOf(wrong_side_ticks, contact_ticks); }
};

/// Judges one stroke. Both series have the same length.
StrokeFigures judgeStroke(const std::vector<TrueTick>& truth, const std::vector<LawTick>& output,
                          const JudgeLimits& limits);

/// The least error that the camera's noise allows on a stroke, RMS over it: on balls and rods that of an
/// estimate that knows all but their place and size, on flat faces that of a plane of 160 mm. Not determined
/// in creases, where the force is of several faces, and where no surface alone explains it (`held_in_front`).
FloorError strokeFloor(const StrokeCase& stroke, SceneNoise noise, double distance_m,
                       double stiffness_n_per_m);

/// Options of the study.
struct StrokesOptions {
  std::vector<std::string> laws = kProxyLawChoices;  ///< of kLawChoices
  std::vector<std::string> scenes;                   ///< empty: all
  std::vector<double> distances_m{0.6, 1, 1.5, 2, 3};
  std::vector<SceneNoise> noises{SceneNoise::none, SceneNoise::sensor, SceneNoise::harsh};
  int variants = 0;  ///< at most that many strokes over a scene; 0: all
  int seeds = 10;    ///< of the noise, each for all strokes; one where there is none
  std::uint32_t seed = 1;
};

/// The strokes of one scene at one distance with one noise and one law.
struct StrokesRow {
  std::string law;
  StrokeScene scene;
  double distance_m = 0;
  SceneNoise noise = SceneNoise::none;
  StrokeFigures figures;
  std::vector<Spread> error_of_seed_n;  ///< the error of the law's force by the noise that it saw
  double lag_limit_m = 0;
  Spread floor_n;       ///< of the error that the noise makes unavoidable; nothing where there is none
  Spread tilt_floor_n;  ///< the same of the force along the surface

  /// RMS error over the floor; nothing without noise.
  std::optional<double> errorByFloor() const;
  std::optional<double> alongByFloor() const;
  /// Standard error of the RMS error by its spread over the seeds; nothing with a single one.
  std::optional<double> standardError_n() const;
};

/// One row for each law, scene, distance and noise.
std::vector<StrokesRow> measureStrokes(const StrokesOptions& options);

/// The requirements on each law with a proxy in `rows`; those that apply to no row are left out.
std::vector<Requirement> requirementsOf(const std::vector<StrokesRow>& rows);

}  // namespace hapticd::tools

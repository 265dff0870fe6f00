// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "rt/base/vec3.h"
#include "rt/depth/depth_frame.h"
#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/engine/measures.h"
#include "tools/hapticbench/engine/report.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/true_scene.h"

namespace hapticd::tools {

/// A scene on which the laws are measured, with its name on the command line.
struct AccuracyScene {
  std::string name;
  TrueSceneParameters shape;  ///< at any distance

  /// The scene at `distance_m` as the camera sees it with that noise: for `none` a camera with raw units of
  /// about 0.1 mm around it, else a Kinect's.
  TrueScene at(double distance_m, SceneNoise noise, std::uint32_t seed) const;
};

inline const std::string& nameOf(const AccuracyScene& scene) {
  return scene.name;
}

/// Planes, bodies and edges; the first is the plane that faces the camera.
const std::vector<AccuracyScene>& accuracyScenes();

inline constexpr double kFrameRate_hz = 30;
/// Number of frames shown before the HIP moves, which the filter needs to settle.
inline constexpr int kSettlingFrames = 12;

/// The images of a scene at 30 frames per second, rendered once and shown to every law.
/// Thread: one at a time.
class FrameReel {
 public:
  /// `scene` outlives the reel.
  FrameReel(TrueScene& scene, SceneNoise noise) : scene_(scene), noise_(noise) {}

  /// Frame `index`, from 0 on; its sequence number is one more. The images repeat after a while.
  const rt::DepthFrame& frame(int index);

 private:
  TrueScene& scene_;
  SceneNoise noise_;
  std::vector<std::unique_ptr<rt::DepthFrame>> rendered_;
};

struct CourseTick {
  rt::Vec3 hip_m{};
  int frame = 0;             ///< the newest one
  double depth_m = 0;        ///< of the HIP behind the visible surface, negative in front of it
  rt::Vec3 ideal_force_n{};  ///< spring from the HIP to an ideal constraint
  bool is_sample = false;    ///< forces are compared with the ideal one: 5 to 20 mm behind the surface
};

/// The motion of the HIP and the force of an ideal constraint on it, tick by tick. It ends where the ideal
/// force along `outward` exceeds 20 N by a margin, or no longer rises (the HIP is about to leave the body on
/// its far side).
struct Course {
  std::vector<CourseTick> ticks;
  rt::Vec3 outward;
};

/// Largest penetration of the HIP, more than 20 N at 500 N/m.
inline constexpr double kDeepest_m = 0.045;

/// Pushes at 0.1 m/s from 30 mm in front of the scene's approach, each at another position within 4 mm of it.
/// `stiffness`: of the ideal constraint, N/m.
std::vector<Course> pushes(const TrueScene& scene, double stiffness_n_per_m, int count, std::uint32_t seed);

struct AccuracyOptions {
  std::vector<std::string> scenes;  ///< names of accuracyScenes(); empty: all
  std::vector<LawSetting> settings = shippedSettings();
  std::vector<double> distances_m{0.6, 1, 2};
  std::vector<SceneNoise> noises{SceneNoise::none, SceneNoise::harsh};
  int pushes = 3;          ///< per case, each at another position
  int hold_frames = 60;    ///< during which the HIP is held still; 0: no steps are measured
  std::uint32_t seed = 1;  ///< of the positions and of the noise
};

/// Limits below which a surface must not give way, N.
inline constexpr std::array<double, 3> kPopLimits_n{3, 10, 20};

/// The outcome of the pushes of a case.
struct PopThroughs {
  int pushes = 0;
  int popped = 0;
  int dipped = 0;  ///< fell as if it gave way and recovered; see PopThrough
  std::array<int, kPopLimits_n.size()> popped_under{};  ///< of kPopLimits_n
  double least_force_n = 0;                             ///< the smallest of the largest forces
  double depth_at_least_force_mm = 0;  ///< penetration at that force, negative in front of the surface

  void add(const PopThroughs& other);
};
auto fieldsOf(Is<PopThroughs> auto& pops) {
  auto& [pushes, popped, dipped, under, least_force_n, depth_mm] = pops;
  return std::tie(pushes, popped, dipped, under, least_force_n, depth_mm);
}

/// One law and setting on one scene.
struct AccuracyRow {
  std::string scene;
  double distance_m = 0;
  SceneNoise noise = SceneNoise::none;
  LawSetting setting{};

  ForceErrors error{};           ///< against an ideal constraint on the true surface, 5 to 20 mm behind it
  Spread proxy_to_surface_mm{};  ///< distance of the proxy from the true surface; laws with a proxy
  PopThroughs pops{};
  double law_step_n = 0;      ///< largest change of the law's force at a new frame, HIP held still
  double blended_step_n = 0;  ///< the same of the commanded force, in the tick of the new frame
  double slew_n_per_s = 0;    ///< largest |dF/dt| of the commanded force at any tick
  bool held = false;          ///< the three above were measured
  int outside_model = 0;      ///< ticks whose force lacked a part of the scene

  /// Adds the measurements on another scene.
  void add(const AccuracyRow& other);
};
auto fieldsOf(Is<AccuracyRow> auto& row) {
  auto& [scene, distance, noise, setting, error, proxy, pops, law_step, blended_step, slew, held, outside] =
      row;
  return std::tie(scene, distance, noise, setting, error, proxy, pops, law_step, blended_step, slew, held,
                  outside);
}

/// One scene as a camera sees it, which all laws are measured on.
struct AccuracyCase {
  AccuracyScene scene;
  double distance_m = 0;
  SceneNoise noise = SceneNoise::none;
};
std::vector<AccuracyCase> casesOf(const AccuracyOptions& options);

/// A row for each setting of the options.
std::vector<AccuracyRow> measureCase(const AccuracyCase& one, const AccuracyOptions& options);

/// The rows of all cases.
std::vector<AccuracyRow> measureAccuracy(const AccuracyOptions& options);

/// All scenes and distances of one law, setting and noise as one row each, in the order of the laws.
std::vector<AccuracyRow> summaryOf(const std::vector<AccuracyRow>& rows);

/// Checks the requirements on the laws with `rows`.
std::vector<Requirement> requirementsOf(const std::vector<AccuracyRow>& rows);

/// The rows, their summary and the requirements.
Report accuracyReport(const std::vector<AccuracyRow>& rows);

}  // namespace hapticd::tools

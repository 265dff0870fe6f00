// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "tools/hapticbench/engine/measures.h"
#include "tools/hapticbench/engine/report.h"
#include "tools/lib/truth/distance_scene.h"

namespace hapticd::tools {

/// A hand's way through a scene, in the world's frame, at constant speed.
struct SceneCase {
  std::vector<DistanceBody> bodies;
  std::vector<ImageGap> gaps{};
  std::vector<rt::Vec3> path_m;  ///< corners; the first one is free and in the camera's sight
  /// Corners between which the way is closed: from one to the next the hand comes back to where it was.
  std::vector<std::size_t> loop_corners{};
  double stays_s = 0.1;    ///< at the end of the path
  double beyond_m = 0.15;  ///< what of depth behind and in front of the scene the camera resolves
  double speed_m_per_s = 0.1;
};

/// What the cases of a scene depend on.
struct ScenePlacement {
  double distance_m = 1;      ///< of the scene's middle along the optical axis
  bool has_wall = true;       ///< behind bodies that end there is a wall
  bool dead_columns = false;  ///< the camera has no measurement in its last columns
};

/// What the requirements tell scenes by.
enum class SceneGroup : std::uint8_t { front, crease, side, free, other, random };

/// A kind of scene, as it is called on the command line.
struct GodObjectScene {
  std::string name;
  SceneGroup kind = SceneGroup::other;
  double at_m = 0;  ///< the only distance that it is for; 0: any
  std::function<std::vector<SceneCase>(const ScenePlacement&, std::mt19937&)> make;
};
inline const std::string& nameOf(const GodObjectScene& scene) {
  return scene.name;
}

/// The scenes that are chosen by name, and those that are made by chance.
const std::vector<GodObjectScene>& godObjectScenes();
const std::vector<GodObjectScene>& randomScenes();

/// The truth at a tick. World frame, metres, newtons.
struct GodObjectTick {
  double t_s = 0;
  rt::Vec3 hip_m;
  rt::Vec3 proxy_m;
  rt::Vec3 force_n;       ///< of the spring from the HIP to the god-object
  double distance_m = 0;  ///< of the HIP to the nearest surface, negative inside
  bool is_known = true;   ///< the camera sees, or may take for solid, what holds the proxy
  int loop = -1;          ///< of the closed loops of the path; -1: in none
};

/// The output of a law at the same tick. World frame, newtons.
struct GodObjectForce {
  rt::Vec3 law_n;
  rt::Vec3 blended_n;  ///< what the hand gets where no limit acts
};

/// The camera that sees a case.
struct SceneView {
  SceneNoise noise = SceneNoise::none;
  rt::DepthModelParameters camera;
  std::uint32_t seed = 1;
};

struct SceneRun {
  std::vector<GodObjectTick> truth;
  std::vector<std::vector<GodObjectForce>> output;  ///< by the settings in turn
};

/// True where a camera can know what holds the proxy of a HIP: neither of the two is farther behind what is
/// seen on its ray than bodies are taken to be thick, and the surface does not face away from the camera.
bool isKnown(const DistanceScene& scene, const rt::Vec3& hip_m, const rt::Vec3& proxy_m, double t_s);

/// The stroke at 1000 ticks and 30 frames per second; all settings see the same frames.
/// `settings`: complete parameters, one at least; their limits on the force are lifted.
SceneRun runScene(const SceneCase& scene, const SceneView& view,
                  const std::vector<rt::LiveParameters>& settings);

/// The figures of a law on strokes; only ticks that the camera can know count.
struct GodObjectFigures {
  int strokes = 0;
  long contact_ticks = 0;  ///< the true force is above 0.5 N
  long lost_ticks = 0;     ///< and that of the law below 0.1 N
  long aside_ticks = 0;    ///< and that of the law above 0.5 N, more than 30 degrees from the true one
  long unknown_ticks = 0;
  Spread error_n;    ///< of the law's force, where either is not zero
  Spread blended_n;  ///< the same after the blend
  std::vector<float> errors_n;
  double ghost_n = 0;      ///< largest force on a HIP that touches nothing
  double step_n = 0;       ///< largest change of the force in a tick beyond that of the spring alone
  double true_step_n = 0;  ///< the same of the god-object
  double loop_j = 0;       ///< most energy that a closed loop gave to the hand
  int loops = 0;

  void add(const GodObjectFigures& other);
  double lostPercent() const { return percentOf(lost_ticks, contact_ticks); }
  double asidePercent() const { return percentOf(aside_ticks, contact_ticks); }
};

/// Judges a stroke. `clear_m`: a HIP farther than that from every surface touches nothing.
GodObjectFigures judgeScene(const std::vector<GodObjectTick>& truth,
                            const std::vector<GodObjectForce>& output, double clear_m,
                            double stiffness_n_per_m);

/// How a scene is seen and placed.
struct SceneSight {
  double distance_m = 1;
  SceneNoise noise = SceneNoise::none;
  std::uint32_t seed = 1;  ///< of its place, its turn and the noise; odd: with a wall behind
};

/// The figures of all strokes over a scene, by the settings in turn.
std::vector<GodObjectFigures> measureScene(const GodObjectScene& scene, const SceneSight& sight,
                                           const std::vector<rt::LiveParameters>& settings);

}  // namespace hapticd::tools

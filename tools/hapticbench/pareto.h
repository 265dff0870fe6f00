// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "tools/hapticbench/cost.h"
#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/engine/measures.h"
#include "tools/hapticbench/engine/report.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::tools {

/// A setting at one distance from the camera.
struct LawAtDistance {
  LawSetting setting;
  double distance_m = 0;
  double error_m = 0;  ///< RMS error of the force over the stiffness
  CpuCost cost;
};

inline constexpr double kTableDistances_m[] = {0.6, 0.8, 1, 1.5, 2, 3, 3.5};
/// The distances whose costs are reported and limited.
inline constexpr double kCostDistances_m[] = {0.6, 1, 2};

/// The rows as lines of a C++ initialiser list (config/settings/measured_laws.inc), sorted, under a comment
/// that names `command`.
std::string lawsTable(std::vector<LawAtDistance> rows, const std::string& command);

/// Errors of the force against the true surface, 5 to 20 mm behind it, on a plane, a sphere and a plane
/// turned by 30 degrees together, with the harsher noise. `pushes`: per scene.
std::map<LawSetting, ForceErrors> errorsOf(const std::vector<LawSetting>& settings, double distance_m,
                                           int pushes);

struct LawsTableOptions {
  std::vector<double> distances_m{std::begin(kTableDistances_m), std::end(kTableDistances_m)};
  double seconds = 2;  ///< of motion, per distance
  int repeats = 5;
  int pushes = 3;  ///< per scene and distance
};

/// Measures shippedSettings(): errorsOf(), and times on a plane turned by 30 degrees.
std::vector<LawAtDistance> measureLaws(const LawsTableOptions& options);

/// The kind of surface that is stroked.
enum class SurfaceKind : std::uint8_t {
  flat,    ///< planes, facing the camera and turned by 30 degrees
  curved,  ///< a ball of 100 mm and a rod of 80 mm
  moving,  ///< a plane at 0.3 m/s, judged at the time of each tick
};
constexpr auto wordsOf(SurfaceKind) {
  return rt::words<SurfaceKind>("flat", "curved", "moving");
}

/// Error of a law as shipped in strokes 8 mm deep over one kind of surface.
struct DistanceError {
  std::string law;
  SceneNoise noise = SceneNoise::sensor;
  double distance_m = 0;
  SurfaceKind kind = SurfaceKind::flat;
  double rms_jnd = 0;
  double lost_percent = 0;         ///< of the contact
  std::optional<double> by_floor;  ///< RMS error over the least that the sensor's noise allows
};

struct DistanceErrorOptions {
  std::vector<std::string> laws{"nearest_springs", "smooth_springs", "proxy", "surface"};
  std::vector<double> distances_m{0.6, 1, 1.5, 2, 3};
  std::vector<SceneNoise> noises{SceneNoise::sensor, SceneNoise::harsh};
  std::vector<SurfaceKind> kinds = everyOne<SurfaceKind>();
  int variants = 2;  ///< strokes over each scene
};

/// Returns one row for each combination, in the order of laws, noises, distances and kinds.
std::vector<DistanceError> measureDistanceErrors(const DistanceErrorOptions& options);

/// Limits by the sensor's noise and pixels at a distance, for any law. Errors in just noticeable
/// differences of 4 N at 500 N/m.
struct SensorLimit {
  SceneNoise noise = SceneNoise::sensor;
  double distance_m = 0;
  double raw_unit_mm = 0;      ///< what one step of the sensor is in depth
  double narrowest_mm = 0;     ///< body that spans eight pixels
  double flat_40_mm_jnd = 0;   ///< least error on a flat patch with sides of 40 mm
  double flat_160_mm_jnd = 0;  ///< of 160 mm
  double ball_100_mm_jnd = 0;  ///< on a ball of 100 mm diameter, of which only that is known
};

/// Returns the limits, ordered by noise and then by distance.
std::vector<SensorLimit> sensorLimits(const std::vector<SceneNoise>& noises,
                                      const std::vector<double>& distances_m);

/// A law or a library: its cost and its error.
struct ParetoPoint {
  ContenderCost run;  ///< over all scenes
  CpuCost cost;
  ForceErrors error;  ///< against the true surface; the libraries compute the paper's law and have its error

  /// RMS error over the stiffness: the displacement of an ideal constraint that would cause it.
  double error_mm() const { return 1000 * error.error_n.rms() / rt::SpringParameters{}.stiffness_n_per_m; }
};

/// Median times in microseconds of a single force and of nanoflann's search for the 100 nearest points.
struct EvaluationRow {
  std::string scene;
  bool along_path = false;  ///< else each at an unrelated position
  double nanoflann_us = 0;
  double nearest_springs_us = 0;
  double surface_us = 0;
};

/// The most expensive force and frame of a law on a hard frame, microseconds.
struct HardFrameRow {
  std::string frame;
  std::string law;
  double force_max_us = 0;
  double model_max_us = 0;
};

/// shippedSettings(), and `surface` without its mean over frames.
std::vector<LawSetting> allSettings();

struct ParetoOptions {
  std::string recordings;
  std::vector<LawSetting> settings = allSettings();
  CostOptions cost;
  LawsTableOptions laws;
  DistanceErrorOptions distances;
  int evaluations = 1000;  ///< single forces, per scene and motion; 0: none
  int pushes = 3;          ///< per scene that the errors are of
  bool hard_frames = true;
};

struct ParetoResult {
  std::vector<std::string> scenes;  ///< that were timed
  std::vector<ParetoPoint> points;
  std::vector<LawAtDistance> laws;
  std::vector<DistanceError> distance_errors;
  std::vector<SensorLimit> sensor_limits;  ///< at the distances and with the noises of `distance_errors`
  std::vector<EvaluationRow> evaluations;
  std::vector<HardFrameRow> hard_frames;
};

/// Errors: a recording that cannot be read.
base::Result<ParetoResult> measurePareto(const ParetoOptions& options);

/// The requirements on the figures that `result` has.
std::vector<Requirement> requirementsOf(const ParetoResult& result);

/// All figures and requirements. `cpu`: that it ran on, -1: not pinned.
Report paretoReport(const ParetoResult& result, int cpu);

/// All tables in Markdown: the error to expect by distance, what the sensor allows, what each law costs, the
/// libraries beside the laws, and the requirements with what was measured.
std::string paretoMarkdown(const ParetoResult& result);

/// One table in Markdown: the error of the law `surface` in JND by distance and kind of surface, from the
/// smallest to the largest over the cameras.
std::string surfaceErrorMarkdown(const ParetoResult& result);

/// CPU time per second of use (x) against RMS error in JND (y), both logarithmic, every point with its name:
/// the script by which gnuplot makes an image of the kind of its ending, SVG, PNG or PDF.
std::string plotScript(const ParetoResult& result, const std::filesystem::path& image);

}  // namespace hapticd::tools

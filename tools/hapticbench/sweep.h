// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rt/base/parameters.h"
#include "rt/depth/depth_frame.h"
#include "rt/laws/law_table.h"
#include "tools/hapticbench/engine/report.h"
#include "tools/hapticbench/engine/sequences.h"
#include "tools/lib/offline/offline_box.h"
#include "tools/lib/parts/fields.h"
#include "tools/lib/truth/true_scene.h"

namespace hapticd::tools {

/// The values that the paper's authors chose from by feel, or fewer.
struct SweepGrid {
  std::vector<int> max_points{50, 100, 150, 200, 250, 300};
  std::vector<double> stiffnesses_n_per_m{300, 400, 500, 600, 700};
  std::vector<double> radii_m{0.02, 0.03, 0.04, 0.05, 0.06, 0.07};

  static SweepGrid quick() { return {{50, 100, 300}, {300, 500, 700}, {0.02, 0.04, 0.07}}; }
};

/// One law with one set of parameters. What a law does not read stays at the paper's value.
struct SweepPoint {
  std::size_t index = 0;  ///< in the whole grid
  rt::ForceLaw law{};
  rt::SpringParameters springs;

  bool usesMaxPoints() const { return rt::rowOf(law).limits_points; }
  bool usesRadius() const { return rt::rowOf(law).looks_in_radius; }
  /// The paper's law with the set that the paper chose: (500 N/m, 0.04 m, 10, 100).
  bool isPapers() const;
};

/// Every point once, in an order that depends on `grid` only: nearest_springs over all three axes,
/// smooth_springs over k_s and D_thresh (it has no N_max), proxy and surface over k_s (D_thresh has no part
/// in their force).
std::vector<SweepPoint> pointsOf(const SweepGrid& grid);

/// Properties of a law's force on surfaces that are known exactly, 1 m in front of the camera. h: distance in
/// front of the surface, metres, negative behind; forces along the outward normal unless stated otherwise.
struct Feel {
  /// -dF/dh: for constraint laws the mean from 5 to 15 mm penetration, for spring laws the mean from the
  /// onset of force to its peak.
  double rendered_stiffness_n_per_m = 0;
  /// Largest -dF/dh over 1 mm in the same range: what the stability of the loop depends on.
  double steepest_stiffness_n_per_m = 0;
  /// Largest force on a push inwards before the force is lost (turns inwards, or falls below half of what it
  /// was); kNoPopThrough_n: not lost up to there.
  double pop_through_n = 0;
  /// Where the force has fallen to half of that on a plane, sideways beyond the edge of a half-plane;
  /// negative: before it.
  double edge_m = 0;
  /// Height of the lowest ridge (20 mm wide, across the stroke) that changes the force by more than one JND;
  /// 0: none of those tried.
  double smallest_ridge_m = 0;
  /// Where h was held in the strokes over edge and ridge: 5 mm behind the surface, or midway between onset
  /// and peak.
  double stroke_h_m = 0;
  std::optional<double> median_force_us{};  ///< time for one force; nothing: not measured
};
auto fieldsOf(Is<Feel> auto& feel) {
  auto& [rendered, steepest, pop_through, edge, ridge, stroke, force_us] = feel;
  return std::tie(rendered, steepest, pop_through, edge, ridge, stroke, force_us);
}

inline constexpr double kNoPopThrough_n = 20;

/// Measures laws. Renders each scene once and keeps it.
/// Thread: one.
class FeelProbe {
 public:
  /// `ridge_step`: the factor from one ridge's height to the next, above 1.
  /// `timed`: measures the time for one force, which is another one in every run.
  explicit FeelProbe(double ridge_step = 1.15, bool timed = true);

  Feel measure(const rt::LiveParameters& parameters);

 private:
  const rt::DepthFrame& plane();
  const rt::DepthFrame& halfPlane();
  const rt::DepthFrame& ridge(double height_m);

  void push(const rt::LiveParameters& parameters, Feel& feel);
  void strokeOverEdge(const rt::LiveParameters& parameters, Feel& feel);
  void strokeOverRidges(const rt::LiveParameters& parameters, Feel& feel);
  bool isNoticeable(const rt::LiveParameters& parameters, double height_m, double stroke_h_m);
  void time(const rt::LiveParameters& parameters, Feel& feel);

  double ridge_step_;
  bool timed_;
  std::map<std::pair<SceneKind, double>, std::unique_ptr<rt::DepthFrame>> frames_;
};

/// How much the force on a still hand on a still surface changes from frame to frame.
struct ForceNoise {
  double median_n = 0;    ///< standard deviation of the force in the last 2/3 of the frames, over the sites
  double largest_n = 0;   ///< the same, largest
  std::size_t sites = 0;  ///< where the law gave a force at all
};
auto fieldsOf(Is<ForceNoise> auto& noise) {
  auto& [median, largest, sites] = noise;
  return std::tie(median, largest, sites);
}

/// A position on a surface at rest in a sequence.
struct StillSite {
  std::size_t sequence = 0;
  rt::Vec3 surface_m_in_world;
  rt::Vec3 normal_in_world;  ///< towards the camera
};

/// The positions of a sequence, the nearest to the camera first, at most `count`: all that a law reads around
/// them is measured in nearly all frames, hardly changes, is nearly flat and faces the camera within 45
/// degrees.
std::vector<StillSite> stillSites(const std::vector<BenchSequence>& sequences, std::size_t sequence,
                                  std::size_t count);

/// FNV-1a over all frames, as 16 hexadecimal digits: shows whether two sweeps used the same.
std::string digestOf(const std::vector<BenchSequence>& sequences);

/// Measures the force noise of laws at still sites.
/// Thread: one.
class NoiseProbe {
 public:
  NoiseProbe(std::vector<BenchSequence> sequences, std::size_t sites_per_sequence);

  /// `h_m`: where the HIP is held along the normal of the surface.
  ForceNoise measure(const rt::LiveParameters& parameters, double h_m) const;

  const std::vector<StillSite>& sites() const { return sites_; }
  const std::vector<BenchSequence>& sequences() const { return sequences_; }

 private:
  double deviation_n(const rt::LiveParameters& parameters, const StillSite& site, double h_m) const;

  std::vector<BenchSequence> sequences_;
  std::vector<StillSite> sites_;
};

/// All that a sweep's results depend on, besides the program and the recordings' content.
struct SweepSettings {
  bool quick = false;
  bool timed = true;           ///< the time for one force is measured
  std::string noise_source{};  ///< the recordings' names, or "synthetic"
  std::string noise_digest{};  ///< of their frames
};
SweepGrid gridOf(const SweepSettings& settings);

/// The delay of the loop whose margin is computed.
inline constexpr int kMarginDelay_ticks = 2;

struct SweepResult {
  SweepPoint point{};
  Feel feel{};
  ForceNoise noise{};
  /// Largest stable stiffness of a 45 g device in a light hand (400 N/m, 4 N s/m) at the stated delay by the
  /// eigenvalues, divided by the law's steepest stiffness; infinite where the law has none.
  double stability_margin = 0;
};
/// The point follows from the grid.
auto fieldsOf(Is<SweepResult> auto& result) {
  auto& [point, feel, noise, stability_margin] = result;
  return std::tie(feel, noise, stability_margin);
}

/// Returns the parameters of a point: the shipped settings except for the law and the springs.
rt::LiveParameters parametersOf(const SweepPoint& point);

/// A plane at 1.2 m with simulated sensor noise, for where there are no recordings.
BenchSequence syntheticSequence(std::size_t frames);

/// Measures points, each by itself: a point's result does not depend on which others are measured.
/// Thread: one.
class Sweep {
 public:
  /// `noise` outlives the sweep.
  Sweep(const SweepSettings& settings, const NoiseProbe& noise);
  SweepResult measure(const SweepPoint& point);

 private:
  const SweepSettings settings_;
  const NoiseProbe& noise_;
  FeelProbe feel_;
  double limit_n_per_m_;
};

/// The table, in the order of the laws.
Report sweepReport(const SweepSettings& settings, const std::vector<SweepResult>& results);

}  // namespace hapticd::tools

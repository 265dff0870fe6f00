// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>

#include "rt/depth_frame.h"
#include "rt/parameters.h"
#include "tools/lib/offline/offline_box.h"
#include "tools/lib/parts/is.h"
#include "tools/lib/truth/true_scene.h"

namespace hapticd::tools {

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
  /// Distance from the edge of a half-plane, sideways, at which the force has fallen to half of that on the
  /// plane.
  double edge_radius_m = 0;
  bool edge_is_outside = false;  ///< the force is half beyond the edge, not before it
  /// Height of the lowest ridge (20 mm wide, across the stroke) that changes the force by more than one JND;
  /// 0: none of those tried.
  double smallest_ridge_m = 0;
  /// Where h was held in the strokes over edge and ridge: 5 mm behind the surface, or midway between onset
  /// and peak.
  double stroke_h_m = 0;
  std::optional<double> median_force_us{};  ///< time for one force; nothing: not measured
};
auto fieldsOf(Is<Feel> auto& feel) {
  auto& [rendered, steepest, pop_through, edge, is_outside, ridge, stroke, force_us] = feel;
  return std::tie(rendered, steepest, pop_through, edge, is_outside, ridge, stroke, force_us);
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

}  // namespace hapticd::tools

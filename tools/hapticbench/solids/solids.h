// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/hapticbench/solids/bodies.h"

/// How exactly virtual fixtures of kind `solid` follow meshes that are known exactly, and what a query costs.
namespace hapticd::tools {

struct SolidOptions {
  int divisions = 96;  ///< of the bodies, see makeBody()
  int places = 100'000;
  int pushes = 10'000;
  unsigned seed = 1;
};

struct SolidCase {
  BodyKind body = BodyKind::box;
  Damage damage = Damage::none;
  double tolerance_m = 0.0005;
};

/// Errors of some forces against the exact nearest point.
struct PushErrors {
  std::size_t pushes = 0;
  double p99_percent = 0, max_percent = 0;  ///< of the depth, to which the force is proportional
  double p99_deg = 0, max_deg = 0;
};

/// What was measured of one case. Where the mesh is refused, only the first members are set.
struct SolidRow {
  SolidCase of;
  std::string refusal;
  std::size_t faces = 0;
  double fold_deg = 0;  ///< median angle between neighbouring faces: a smooth surface is off by half of it
  double make_s = 0;
  double spacing_m = 0;
  std::size_t bytes = 0;
  double max_m = 0, rms_m = 0;  ///< of the distance, at places within 5 mm of the surface
  double surface_max_m = 0;     ///< at those of them that are within one spacing
  double within_percent = 0;    ///< of the places: the error is at most the tolerance
  std::size_t wrong_signs = 0;  ///< farther from the surface than the tolerance
  double smooth_percent = 0;    ///< of the places
  double gradient_median_deg = 0, gradient_p99_deg = 0;  ///< on smooth parts
  PushErrors out, in;                                    ///< kept out of the body, and in it, on smooth parts
  PushErrors far;   ///< those of both that are three spacings from an edge
  PushErrors rest;  ///< next to edges, and where another part of the surface is nearer; both sides
};

/// Smooth parts are those where the nearest point of the surface is at least one spacing from an edge, and
/// the place at least two from a medial surface.
SolidRow measureSolid(const SolidCase& one, const SolidOptions& options);

/// The error of the spline of a sphere's distance within 5 mm of its surface, sampled exactly.
struct SpacingError {
  double spacing_m = 0;
  double max_m = 0, rms_m = 0;
};
/// `places`: random ones. `radius_m`: 0.015 of the study.
SpacingError sphereError(double spacing_m, int places, double radius_m = 0.015);

/// Times in nanoseconds, medians of rounds, of 128 samples along each axis.
struct QueryCost {
  std::string query;
  double spline_ns = 0, trilinear_ns = 0;  ///< of value and gradient, from the same memory
  double ratio() const { return trilinear_ns > 0 ? spline_ns / trilinear_ns : 0; }
};
struct SolidCost {
  std::vector<QueryCost> queries;
  double eight_ticks_ns = 0;  ///< of one region in contact, the HIP moving
};
SolidCost measureSolidCost(int rounds);

}  // namespace hapticd::tools

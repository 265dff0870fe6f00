// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "tools/lib/solids/field/triangle_tree.h"
#include "tools/lib/solids/files/mesh_repair.h"

/// How exactly virtual fixtures of kind `solid` follow meshes that are known exactly, as they are and damaged
/// as exports damage them, and what a query costs.
namespace hapticd::tools {

enum class BodyKind { box, sphere, torus, bumpy, plate };
constexpr auto wordsOf(BodyKind) {
  return rt::words<BodyKind>("box", "sphere", "torus", "bumpy", "plate");
}

/// What is wrong with a mesh.
enum class Damage {
  none,
  missing,   ///< every twentieth face, at random
  turned,    ///< every twentieth face, at random
  doubled,   ///< every face is there twice, the copy turned
  crossing,  ///< a ball crosses the surface
  hole,      ///< the faces within a radius of kHole_m
};
constexpr auto wordsOf(Damage) {
  return rt::words<Damage>("none", "missing", "turned", "doubled", "crossing", "hole");
}

inline constexpr double kHole_m = 0.0015;

using Segment = std::array<rt::Vec3, 2>;

struct Body {
  solids::TriangleMesh mesh;   ///< closed, counterclockwise seen from outside
  std::vector<Segment> edges;  ///< where its surface is not smooth
  bool is_thin = false;        ///< thinner than hands are pushed: what counts is the side that they come from
};

/// Makes a body about the origin: a box of 30 mm, a sphere of radius 15 mm, a torus of radii 15 and 6 mm, a
/// sphere with bumps whose radii of curvature go down to about 4 mm, and a plate of 30 x 30 x 1 mm.
/// `divisions`: along an edge of a box and of a plate; of the others in proportion. 8..512.
Body makeBody(BodyKind kind, int divisions);

/// A mesh with that damage, and the body that it stands for: the clean one, and for Damage::crossing the
/// union with the ball. `seed`: of what is random.
struct DamagedBody {
  solids::TriangleMesh mesh;
  Body truth;
};
DamagedBody damaged(const Body& body, Damage damage, unsigned seed);

/// A place seen from a mesh.
struct ExactPlace {
  double distance_m = 0;  ///< signed, negative inside
  rt::Vec3 foot_m;        ///< the nearest point of the mesh
  rt::Vec3 gradient;      ///< unit vector; where the place is on the mesh, zero
};

/// The surface of a closed mesh without sampling: the nearest triangle decides about the distance, the
/// winding number about the sign.  Thread: any.
class ExactSurface {
 public:
  explicit ExactSurface(const Body& body) : tree_(body.mesh), edges_(body.edges) {}

  ExactPlace at(const rt::Vec3& place_m) const;
  /// The same with the sign of a place whose side is known: `is_inside`.
  ExactPlace at(const rt::Vec3& place_m, bool is_inside) const;
  bool isNearEdge(const rt::Vec3& foot_m, double reach_m) const;
  /// True where the same part of the surface stays the nearest one for another `reach_m` away from it: the
  /// place is not next to a medial surface, where the distance has a kink.
  bool isAloneFor(const ExactPlace& place, double reach_m) const;

 private:
  solids::TriangleTree tree_;
  std::vector<Segment> edges_;
};

/// The nearest point of a triangle.
rt::Vec3 nearestOfTriangle(const std::array<rt::Vec3, 3>& corners_m, const rt::Vec3& place_m);

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

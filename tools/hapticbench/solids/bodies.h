// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "tools/lib/solids/files/mesh_repair.h"

/// Meshes of bodies, as they are and damaged as exports damage them, for `hapticbench solids`.
namespace hapticd::tools {

enum class BodyKind { box, sphere, torus, bumpy, plate };
constexpr auto wordsOf(BodyKind) {
  return rt::words<BodyKind>("box", "sphere", "torus", "bumpy", "plate");
}

constexpr std::string_view nameOf(BodyKind kind) {
  return rt::wordOf(kind);
}
inline constexpr std::array kAllBodies{BodyKind::box, BodyKind::sphere, BodyKind::torus, BodyKind::bumpy,
                                       BodyKind::plate};

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

constexpr std::string_view nameOf(Damage damage) {
  return rt::wordOf(damage);
}
inline constexpr std::array kAllDamages{Damage::none,    Damage::missing,  Damage::turned,
                                        Damage::doubled, Damage::crossing, Damage::hole};

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

}  // namespace hapticd::tools

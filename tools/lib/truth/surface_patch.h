// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <variant>

#include "rt/vec3.h"

/// Pieces of a surface that a camera at the origin looks at along -z (x right, y up). Each knows
/// - closest(p): its point nearest to p,
/// - depth(ray): the depth Z of its first point on the ray Z * (x, y, -1), Z > 0; infinite where it is not
/// met
///   from the front,
/// - normal(p): the unit vector out of the solid at its point p.
/// Metres, camera frame.  Thread: any.
namespace hapticd::tools {

/// A part of a plane: endless along y turned into the plane, from `first_m` to `last_m` along `across`.
struct Strip {
  rt::Vec3 origin_m;
  rt::Vec3 outward;  ///< unit normal
  rt::Vec3 across;   ///< unit vector in the plane
  double first_m;    ///< may be infinite
  double last_m;     ///< may be infinite

  rt::Vec3 closest(const rt::Vec3& p) const;
  double depth(const rt::Vec3& ray) const;
  rt::Vec3 normal(const rt::Vec3& p) const;
};

/// The part of a ball that the camera sees, or of a cylinder whose axis is parallel to y.
struct Round {
  rt::Vec3 centre_m;
  double radius_m;
  bool is_cylinder;

  rt::Vec3 closest(const rt::Vec3& p) const;
  double depth(const rt::Vec3& ray) const;
  rt::Vec3 normal(const rt::Vec3& p) const;
  /// Metres to the whole ball or cylinder, negative inside.
  double signedDistance(const rt::Vec3& p) const;

 private:
  rt::Vec3 across(const rt::Vec3& v) const;
};

/// The half of a sphere farther from the camera than its centre, seen from within.
struct Bowl {
  rt::Vec3 centre_m;
  double radius_m;

  rt::Vec3 closest(const rt::Vec3& p) const;
  double depth(const rt::Vec3& ray) const;
  rt::Vec3 normal(const rt::Vec3& p) const;
};

/// A fronto-parallel wall with a round hole.
struct HoledWall {
  rt::Vec3 centre_m;
  double radius_m;  ///< of the hole

  rt::Vec3 closest(const rt::Vec3& p) const;
  double depth(const rt::Vec3& ray) const;
  rt::Vec3 normal(const rt::Vec3& p) const;
};

using SurfacePatch = std::variant<Strip, Round, Bowl, HoledWall>;

}  // namespace hapticd::tools

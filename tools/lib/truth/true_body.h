// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "rt/base/vec3.h"

/// Solids whose surface is known exactly, in double precision, for scenes that rays are cast into. Metres, in
/// a frame of their own. Each knows
/// - signedDistance(p): to its surface, negative inside,
/// - rayEntry(origin, direction): the smallest s >= 0 at which origin + s * direction comes into the solid
///   from outside, infinite where it does not; the origin is outside,
/// - hold(p, before, side): where its surface holds an ideal proxy without friction that followed the HIP
///   from `before` to `p`; nothing outside. `side` is what the body remembers of the contact.
/// Thread: any.
namespace hapticd::tools {

/// Where an ideal proxy is held.
struct Hold {
  rt::Vec3 proxy_m;
  rt::Vec3 outward;  ///< unit vector out of the solid
};

/// Which part of a body's surface holds the proxy, from one position of the HIP to the next.
struct HoldingSide {
  int face = -1;  ///< of a ConvexBody; -1: the HIP was outside
};

/// The half-space of all p with dot(outward, p) <= offset_m.
struct Face {
  rt::Vec3 outward;  ///< unit vector
  double offset_m = 0;

  double above_m(const rt::Vec3& p) const noexcept { return dot(outward, p) - offset_m; }
};

/// The intersection of half-spaces: a plane with solid behind it, a block, a corner of a cube. At most 8
/// faces. The proxy stays on the face that the HIP came through until it slides over an edge of it.
struct ConvexBody {
  std::vector<Face> faces;

  double signedDistance(const rt::Vec3& p) const;
  double rayEntry(const rt::Vec3& origin, const rt::Vec3& direction) const;
  std::optional<Hold> hold(const rt::Vec3& p, const rt::Vec3& before, HoldingSide& side) const;
};

/// The outside of a convex hollow: inner edges and corners. Free is what lies above all faces; their
/// `outward` points into the hollow.
struct HollowBody {
  std::vector<Face> faces;

  double signedDistance(const rt::Vec3& p) const;
  double rayEntry(const rt::Vec3& origin, const rt::Vec3& direction) const;
  std::optional<Hold> hold(const rt::Vec3& p, const rt::Vec3& before, HoldingSide& side) const;
};

/// A rod about the x axis, with flat ends at -half_length_m and half_length_m. Contact is with its round
/// side.
struct RodBody {
  double radius_m = 0.01;
  double half_length_m = 1;

  double signedDistance(const rt::Vec3& p) const;
  double rayEntry(const rt::Vec3& origin, const rt::Vec3& direction) const;
  std::optional<Hold> hold(const rt::Vec3& p, const rt::Vec3& before, HoldingSide& side) const;
};

/// A ball around the origin.
struct BallBody {
  double radius_m = 0.05;

  double signedDistance(const rt::Vec3& p) const;
  double rayEntry(const rt::Vec3& origin, const rt::Vec3& direction) const;
  std::optional<Hold> hold(const rt::Vec3& p, const rt::Vec3& before, HoldingSide& side) const;
};

using TrueBody = std::variant<ConvexBody, HollowBody, RodBody, BallBody>;

/// The point nearest to `p` of those that lie in all half-spaces, of which there are at most 8.
rt::Vec3 closestInAll(const std::vector<Face>& faces, const rt::Vec3& p);

}  // namespace hapticd::tools

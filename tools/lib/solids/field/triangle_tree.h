// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "rt/base/vec3.h"
#include "tools/lib/solids/files/mesh_repair.h"

namespace hapticd::solids {

/// Where a triangle is nearest to a point.
struct NearestTriangle {
  std::uint32_t triangle = 0;  ///< index in the mesh
  double squared_m2 = std::numeric_limits<double>::infinity();
};

/// Where a ray meets a triangle.
struct RayHit {
  std::uint32_t triangle = 0;
  double distance_m = 0;
};

/// What questions may still cost: a step is a box or a few operations, so a triangle takes several.
struct Effort {
  std::uint64_t left = std::numeric_limits<std::uint64_t>::max();
  void take(std::uint64_t steps) { left -= std::min(left, steps); }
};

/// Triangles in a hierarchy of boxes, for three questions: which is nearest to a point, how often they wind
/// about it, and which a ray meets first.
/// Thread: any number may ask at once, unless there is an effort. RT: not safe.
class TriangleTree {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  /// A group of triangles counts as one dipole farther away than so many of its radii.
  static constexpr double kFar = 2.0;

  TriangleTree() = default;  ///< without triangles; may only be assigned to
  /// `mesh`: with at least one triangle. `effort` outlives the tree; once nothing is left of it, each
  /// question is answered at once, by anything.
  explicit TriangleTree(const TriangleMesh& mesh, Effort* effort = nullptr);

  /// The nearest triangle of those that are nearer than `bound`, which is returned if none is.
  NearestTriangle nearest(const rt::Vec3& point_m, NearestTriangle bound = {}) const;

  /// The generalised winding number: 1 inside a closed mesh whose triangles are counterclockwise seen from
  /// outside, 0 outside, and between them near a hole. Its error was below 0.07 on all meshes that were
  /// tried. `without`: a triangle that is left out, for points on it. Source: Jacobson, Kavan,
  /// Sorkine-Hornung 2013; Barill, Dickson, Schmidt, Levin, Jacobson 2018 (order 1).
  double winding(const rt::Vec3& point_m, std::uint32_t without = kNone) const;

  /// The first triangle along a ray, other than `without`. `direction`: unit vector.
  std::optional<RayHit> firstHit(const rt::Vec3& from_m, const rt::Vec3& direction,
                                 std::uint32_t without) const;

  bool isSpent() const { return effort_ != nullptr && effort_->left == 0; }

  const std::array<rt::Vec3, 3>& corners_m(std::uint32_t triangle) const {
    return corners_m_[place_[triangle]];
  }
  /// Squared distance to one triangle of the tree.
  double squaredDistance(const rt::Vec3& point_m, std::uint32_t triangle) const;

 private:
  struct Box {
    rt::Vec3 low_m, high_m;
  };
  /// Triangles begin..end in the order of the leaves. The first child follows its parent.
  struct Node {
    Box box_m;
    std::uint32_t begin = 0, end = 0;
    std::uint32_t right = 0;  ///< the second child; 0: a leaf
    bool isLeaf() const { return right == 0; }
  };
  /// What a node is from afar.
  struct Dipole {
    rt::Vec3 area_normal_m2;    ///< sum of the triangles' normals, each as long as its area
    rt::Vec3 centre_m;          ///< mean of the triangles' centroids, weighted by area
    double squared_far_m2 = 0;  ///< farther than this from the centre, it stands for them
  };

  std::uint32_t build(std::uint32_t begin, std::uint32_t end);
  Box boxOf(std::uint32_t begin, std::uint32_t end) const;
  Dipole dipoleOf(std::uint32_t begin, std::uint32_t end) const;

  static constexpr std::uint64_t kStepsOfTriangle = 4;
  void take(std::uint64_t steps) const {
    if (effort_ != nullptr) effort_->take(steps);
  }

  Effort* effort_ = nullptr;
  // apart, because a search for the nearest reads only the boxes
  std::vector<Node> nodes_;
  std::vector<Dipole> dipoles_;
  std::vector<std::array<rt::Vec3, 3>> corners_m_;  ///< in the order of the leaves
  std::vector<std::uint32_t> triangle_;             ///< index in the mesh of each of those
  std::vector<std::uint32_t> place_;                ///< the reverse
};

}  // namespace hapticd::solids

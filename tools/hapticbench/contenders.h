// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "rt/parameters.h"
#include "rt/vec3.h"

namespace hapticd::tools {

/// Other ways to compute the paper's law on the same points, in single precision, to be measured beside ours.

/// Looks at every point at every evaluation.
class BruteForce {
 public:
  explicit BruteForce(const std::vector<rt::Vec3>& points_m);
  rt::Vec3 force_n(const rt::Vec3& hip_m, const rt::SpringParameters& springs);

 private:
  std::vector<float> x_, y_, z_, distance_squared_;
  std::vector<std::size_t> near_;
};

/// nanoflann's k-d tree.
class KdTree {
 public:
  /// Points in the form that the tree reads, so that copying them is not measured as building.
  struct Cloud;
  static std::shared_ptr<const Cloud> cloudOf(const std::vector<rt::Vec3>& points_m);

  /// Builds the tree.
  explicit KdTree(std::shared_ptr<const Cloud> cloud);
  ~KdTree();
  rt::Vec3 force_n(const rt::Vec3& hip_m, const rt::SpringParameters& springs);

 private:
  struct Index;
  std::shared_ptr<const Cloud> cloud_;
  std::unique_ptr<Index> index_;
  std::vector<std::size_t> nearest_;
  std::vector<float> distance_squared_;
};

}  // namespace hapticd::tools

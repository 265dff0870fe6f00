// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "rt/base/realtime_thread.h"
#include "rt/modelling/surface/block_means.h"
#include "rt/scene/visible_surface.h"

namespace hapticd::rt {

/// Mean disparities of the blocks around the sites at which facets are requested, with a border wide enough
/// for every block of every support to be readable.
struct FacetBlocks {
  /// The widest support extends this many blocks to each side of its site.
  static constexpr int kBorder = 12;
  /// Vectors of sites may read and write this many elements beyond the end of a row.
  static constexpr int kPadding = 64;
  static constexpr std::size_t kStride = BlockLattice::kMaxColumns + 2 * kBorder + kPadding;
  /// Returns the number of elements of an array for all sites of a lattice with this many rows.
  static constexpr std::size_t sizeFor(int rows) noexcept {
    return static_cast<std::size_t>(rows + 2 * kBorder) * kStride + kPadding;
  }

  const float* disparity;  ///< [sizeFor(rows)]; negative: no measurement; the first site is at(0, 0)
  int sites_across;        ///< columns of sites
  int sites_down;          ///< rows of sites

  /// Returns the array index of a site.
  static constexpr std::size_t at(int row, int column) noexcept {
    return static_cast<std::size_t>(row + kBorder) * kStride + static_cast<std::size_t>(column + kBorder);
  }
};

/// Parameters of fitFacets().
struct FacetFit {
  float noise_raw;          ///< standard deviation of a block's mean, raw units
  float raw_per_block;      ///< change of disparity per block on a surface at 45 degrees to the view
  float largest_plane;      ///< width of the widest support of a plane, in blocks
  float largest_quadratic;  ///< width of the widest support of a quadratic, in blocks
};

/// Motion of the surface.
struct FacetMotion {
  BlockRegion region;      ///< in blocks from the first site; facets elsewhere rest
  BlockMotion per_second;  ///< Facet::per_second there, by blocks from the first site
};

/// Largest differences between adjacent facets of one surface, in raw units.
struct CellLimits {
  float max_step;  ///< more: an edge
  float max_bend;  ///< more: a crease
};

/// What belongs to the sites, in BlockLattice layout; each pointer is that of the first site.
struct FacetSites {
  Facet* facet;                 ///< to be fitted
  Cell* cell;                   ///< to be found between each site and the next ones to the right and below
  const std::uint8_t* is_full;  ///< see BlockSums; whole vectors are read
  int per_row;                  ///< distance between rows
};

/// Working memory of fitFacets(). Each array has [FacetBlocks::sizeFor(rows)] elements in FacetBlocks layout.
class FacetMemory {
 public:
  /// Allocates all arrays, for a lattice with this many rows.  RT: not safe.
  explicit FacetMemory(int rows = BlockLattice::kMaxRows);
  /// Returns the memory to the system until a fit uses it, see rt::returnPages(). RT: not safe.
  void returnUnused() noexcept { returnPages(memory_.get(), floats_ * sizeof(float)); }

  /// Planes fitted to 3 x 3 blocks.
  struct Planes {
    float *value, *slope_u, *slope_v;
    float* cost;  ///< mean square of the residuals, increased where blocks are missing; huge: no plane
  } planes;
  /// Quadratics fitted to 5 x 5 blocks that all have a measurement.
  struct Quadratics {
    float *value, *slope_u, *slope_v, *curvature_uu, *curvature_uv, *curvature_vv;
    float* curved;  ///< certainty that the surface is curved, 0 to 1; already applied to the curvatures
    float* cost;    ///< mean square of the residuals; huge: no quadratic
  } quadratics;
  /// The estimate of each site before it is averaged with its neighbours.
  struct Estimates {
    float *value, *slope_u, *slope_v, *curvature_uu, *curvature_uv, *curvature_vv;
    float *cubic_u, *cubic_v;
    float* sigma;  ///< standard deviation of the value; huge: unknown
    float* slope_sigma;
    float* curvature_sigma;
  } estimates;
  float* row_sums;
  float* mean_of_9;   ///< means over 3 x 3 blocks
  float* mean_of_25;  ///< means over 5 x 5 blocks

 private:
  static constexpr std::size_t kArrays = 26;
  std::size_t floats_;
  std::unique_ptr<float[]> memory_;
};

/// Fits a local polynomial at each site, with a support that grows as long as the surface allows.
///
/// The fit starts with a quadratic over 5 x 5 blocks. Where that does not fit, at edges and creases, it
/// starts with the plane or quadratic of a neighbour that fits and predicts the site (facet model: Haralick
/// and Watson 1981). Larger supports then predict the same place with less noise; the estimate moves there,
/// by a continuous weight, as far as both agree within their confidence (intersection of confidence
/// intervals: Goldenshluger and Nemirovski 1997). Small supports are fitted with quadratics and wide ones
/// with planes, unless the surface is found to be curved there. Blocks that do not lie on the current surface
/// are ignored. A third-order term, that of a surface of constant curvature, prevents a quadratic from
/// tilting near the limb of a sphere or rod. Finally each site takes the mean of the predictions of the
/// surrounding facets that agree with it, weighted by their certainty (as in propagation-separation: Polzehl
/// and Spokoiny 2006), so that an edge uses the face it belongs to and normals change smoothly.
///
/// A cell that is not full is mixed; others are what the steps and bends between its facets make it.
/// RT: safe after the first call.  Cost: per site at most 134 samples and 50 facets; typically 100 and 12.
void fitFacets(const FacetBlocks& blocks, const FacetFit& fit, FacetMemory& memory, const FacetMotion& motion,
               const CellLimits& limits, const FacetSites& sites) noexcept;

}  // namespace hapticd::rt

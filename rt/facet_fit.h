// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>

#include "rt/visible_surface.h"

namespace hapticd::rt {

/// Mean disparities of the blocks around the sites where facets are wanted, with a border, so that every
/// block of every support can be read.
struct FacetBlocks {
  /// The widest support reaches that many blocks to each side.
  static constexpr int kBorder = 12;
  /// Vectors of sites may read and write that many elements behind a row.
  static constexpr int kPadding = 64;
  static constexpr std::size_t kStride = BlockLattice::kColumns + 2 * kBorder + kPadding;
  static constexpr std::size_t kSize = (BlockLattice::kRows + 2 * kBorder) * kStride + kPadding;

  const float* disparity;  ///< [kSize] negative: no measurement; the first site is at(0, 0)
  int sites_across;        ///< columns of sites
  int sites_down;          ///< rows of sites

  static constexpr std::size_t at(int row, int column) noexcept {
    return static_cast<std::size_t>(row + kBorder) * kStride + static_cast<std::size_t>(column + kBorder);
  }
};

/// What may be fitted.
struct FacetFit {
  float noise_raw;  ///< standard deviation of a block's mean, raw units
  float
      raw_per_block;  ///< change of the disparity from block to block on a surface at 45 degrees to the view
  float largest_plane;      ///< widest support of a plane, blocks from side to side
  float largest_quadratic;  ///< the same of a quadratic
};

/// Working memory of fitFacets(). Each array is [FacetBlocks::kSize], in the layout of the blocks.
class FacetMemory {
 public:
  FacetMemory();

  /// Planes over 3 x 3 blocks.
  struct Planes {
    float *value, *slope_u, *slope_v;
    float* cost;  ///< mean square of the residuals, and more where few blocks were there; huge: no plane
  } planes;
  /// Quadratics over 5 x 5 blocks that all have a measurement.
  struct Quadratics {
    float *value, *slope_u, *slope_v, *bend_uu, *bend_uv, *bend_vv;
    float* curved;  ///< how sure it is that the surface is curved, 0 to 1; the bends are already less by that
    float* cost;    ///< mean square of the residuals; huge: no quadratic
  } quadratics;
  /// What each site came to by itself.
  struct Estimates {
    float *value, *slope_u, *slope_v, *bend_uu, *bend_uv, *bend_vv;
    float *cubic_u, *cubic_v;
    float* sigma;  ///< standard deviations: of the value; huge: nothing is known
    float* slope_sigma;
    float* bend_sigma;
  } estimates;
  float* row_sums;
  float* mean_of_9;   ///< means over 3 x 3 blocks
  float* mean_of_25;  ///< means over 5 x 5 blocks

 private:
  static constexpr std::size_t kArrays = 26;
  std::unique_ptr<float[]> memory_;
};

/// Local polynomials with a support that grows as long as the surface allows it, for each site.
///
/// It begins with a quadratic over 5 x 5 blocks; where that does not fit, at edges and creases, with the
/// plane or quadratic of a neighbour that fits and predicts the site (facet model: Haralick and Watson 1981).
/// Larger supports then predict the same place with less noise; the estimate moves there as far as both agree
/// within their confidence (intersection of confidence intervals: Goldenshluger and Nemirovski 1997), by a
/// weight that is continuous. On small supports quadratics are fitted and planes on wide ones, as far as
/// nothing says that the surface is curved there. Blocks that do not lie on the surface so far do not count.
/// The third order, which would tilt a quadratic beside the limb of a sphere or a rod, is that of a surface
/// of constant curvature. At last each site takes the mean of what the facets around it predict for it, if
/// they agree, weighted by how sure they are (as in propagation-separation: Polzehl and Spokoiny 2006): so an
/// edge learns from the face that it ends, and normals turn evenly.
///
/// `facets`: of the first site, in the layout of BlockLattice; per_second is left. RT: safe after the first
/// call. Cost: for each site at most 134 samples and 50 facets, of which most need 100 and 12.
void fitFacets(const FacetBlocks& blocks, const FacetFit& fit, FacetMemory& memory, Facet* facets) noexcept;

}  // namespace hapticd::rt

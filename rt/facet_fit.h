#pragma once

#include <cstddef>

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

/// Planes over 3 x 3 blocks; working memory of fitFacets(), each [FacetBlocks::kSize].
struct SmallPlanes {
  float* value;
  float* per_column;
  float* per_row;
  float* cost;  ///< mean square of the residuals, and more where few blocks were there; huge: no plane
};

/// Least squares with a support that grows as long as the surface allows it, for each site.
///
/// It begins with a plane over 3 x 3 blocks: at edges and creases that of a neighbour, if it fits better
/// (facet model: Haralick and Watson 1981). Larger supports then predict the same place with less noise; the
/// estimate moves there as far as both agree within their confidence (intersection of confidence intervals:
/// Goldenshluger and Nemirovski 1997), by a weight that is continuous. On each support a quadratic is fitted
/// beside the plane; where it says that the surface is curved it is taken, up to its widest support, else the
/// plane. Blocks that do not lie on the surface so far do not count. `facets`: of the first site, in the
/// layout of BlockLattice; per_second is left. RT: safe after the first call. Cost: at most 230 blocks for
/// each site.
void fitFacets(const FacetBlocks& blocks, const FacetFit& fit, const SmallPlanes& work,
               Facet* facets) noexcept;

}  // namespace hapticd::rt

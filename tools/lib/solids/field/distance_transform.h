// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

/// Distances on grids, x fastest.
namespace hapticd::solids {

using GridSize = std::array<int, 3>;

/// The squared distance from each sample to the nearest seed, exact; infinite if there is none. `is_seed`: 1
/// or 0. `spacing`: between samples along each axis, in any unit.
/// Source: Felzenszwalb and Huttenlocher 2012 (lower envelope of parabolas, one axis after the other).
std::vector<float> squaredDistances(std::span<const std::uint8_t> is_seed, const GridSize& size,
                                    const std::array<double, 3>& spacing);

/// The signed distance to the boundary between samples that are inside and others: negative inside. The
/// boundary lies half a spacing off the samples. Both kinds of samples occur.
std::vector<float> signedDistances(std::span<const std::uint8_t> is_inside, const GridSize& size,
                                   double spacing);

/// Smooths with a Gaussian of standard deviations `sigmas` along the axes, in spacings of the grid. Beyond
/// the edge the field is continued so that linear functions remain as they are. Does nothing along an axis of
/// 0.
void smoothGaussian(std::vector<float>& values, const GridSize& size, const std::array<double, 3>& sigmas);

}  // namespace hapticd::solids

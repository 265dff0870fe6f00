// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hapticd::rt {

/// Sums over the samples that a surface was fitted to, in a window of 3 by 3 cells.
struct FitSums {
  static constexpr int kCellsPerSide = 3;
  static constexpr int kCells = kCellsPerSide * kCellsPerSide;

  double weight = 0;                  ///< of the weights
  double square = 0;                  ///< of the weighted squares of the residuals
  double cell_residual[kCells] = {};  ///< of the weighted residuals
  double cell_weight[kCells] = {};    ///< of the weights
  double explained = 0;               ///< number of samples that belong to the surface
  double unexplained = 0;             ///< number of samples beside it, which touch it

  /// Returns the loss that robust fits minimise: squares of residuals, for each of `samples` at most that of
  /// the tolerance; per sample, in squares of the tolerance.
  double loss(double samples, double tolerance_raw) const noexcept {
    return (square / (tolerance_raw * tolerance_raw) + samples - explained) / samples;
  }
};

/// How little the residuals in a window look like those of one surface in noise.
struct Misfit {
  double of_cells = 0;  ///< sum of the squares of the cells' mean residuals, in standard deviations
  double residual = 0;  ///< RMS, in standard deviations
  double beside = 0;    ///< share of pixels that touch the surface without belonging to it

  /// `sigma_raw`: standard deviation of a sample; `per_patch`: number of samples that share one sample of the
  /// noise.
  static Misfit of(const FitSums& sums, double sigma_raw, double per_patch) noexcept;
  /// Returns 0 if the pixels are not of one surface, 1 if the residuals look like noise.
  double agreement() const noexcept;
  /// Returns a mean with `before`; `share`: of this one.
  Misfit mixedWith(const Misfit& before, double share) const noexcept;
};

/// Returns 1 below `begin`, 0 above `end`, falling smoothly in between.
double fallingStep(double x, double begin, double end) noexcept;

}  // namespace hapticd::rt

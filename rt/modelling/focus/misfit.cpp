// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/focus/misfit.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {
namespace {

/// Sum over the cells of the squares of their mean residuals, in standard deviations, that noise explains.
constexpr double kNoiseMisfit = 6;
/// RMS of the residuals, in standard deviations, that noise explains.
constexpr double kNoiseResidual = 1.2;
/// Share of pixels beside a surface that an uneven border explains.
constexpr double kBesideShare = 0.06;
/// A cell of less weight says nothing.
constexpr double kLeastWeight = 4;

}  // namespace

double fallingStep(double x, double begin, double end) noexcept {
  const double t = std::clamp((x - begin) / (end - begin), 0.0, 1.0);
  return 1 - t * t * (3 - 2 * t);
}

Misfit Misfit::of(const FitSums& sums, double sigma_raw, double per_patch) noexcept {
  double of_cells = 0;
  for (int cell = 0; cell < FitSums::kCells; ++cell) {
    const double weight = sums.cell_weight[cell];
    if (weight < kLeastWeight) continue;
    const double mean = sums.cell_residual[cell] / weight;
    of_cells += mean * mean / (sigma_raw * sigma_raw * std::min(1.0, per_patch / weight));
  }
  return {.of_cells = of_cells,
          .residual = std::sqrt(sums.square / std::max(1e-9, sums.weight)) / sigma_raw,
          .beside = sums.unexplained / std::max(1.0, sums.explained + sums.unexplained)};
}

double Misfit::agreement() const noexcept {
  return fallingStep(of_cells, kNoiseMisfit, 2 * kNoiseMisfit) *
         fallingStep(beside, kBesideShare, 2.5 * kBesideShare) *
         fallingStep(residual, kNoiseResidual, 1.25 * kNoiseResidual);
}

Misfit Misfit::mixedWith(const Misfit& before, double share) const noexcept {
  return {.of_cells = std::lerp(before.of_cells, of_cells, share),
          .residual = std::lerp(before.residual, residual, share),
          .beside = std::lerp(before.beside, beside, share)};
}

}  // namespace hapticd::rt

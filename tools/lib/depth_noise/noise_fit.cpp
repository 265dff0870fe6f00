// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/depth_noise/noise_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace hapticd::tools {
namespace {

constexpr int kTerms = 3;
constexpr double kNarrowSpan = 4.0 / 3;
constexpr double kRelativeError = 0.05;  // of a measured deviation, as its weight in the fit
constexpr double kPricePerTerm = 2;      // Akaike's criterion: a term must lower chi squared by this

using Coefficients = std::array<double, kTerms>;

double power(double depth_m, int term) {
  return term == 0 ? 1 : term == 1 ? depth_m : depth_m * depth_m;
}

/// Solves A x = b by elimination with pivoting; nothing where A is singular.
std::optional<std::vector<double>> solved(std::vector<std::vector<double>> a, std::vector<double> b) {
  const std::size_t size = b.size();
  for (std::size_t column = 0; column < size; ++column) {
    std::size_t pivot = column;
    for (std::size_t row = column; row < size; ++row) {
      if (std::abs(a[row][column]) > std::abs(a[pivot][column])) pivot = row;
    }
    if (!(std::abs(a[pivot][column]) > 1e-9)) return std::nullopt;
    std::swap(a[column], a[pivot]);
    std::swap(b[column], b[pivot]);
    for (std::size_t row = 0; row < size; ++row) {
      if (row == column) continue;
      const double factor = a[row][column] / a[column][column];
      for (std::size_t k = column; k < size; ++k) a[row][k] -= factor * a[column][k];
      b[row] -= factor * b[column];
    }
  }
  for (std::size_t row = 0; row < size; ++row) b[row] /= a[row][row];
  return b;
}

/// The coefficients of these terms with the least squared relative error; nothing if one is negative.
std::optional<Coefficients> fitOf(std::span<const NoiseAtDepth> at_depths, const std::vector<int>& terms) {
  const std::size_t size = terms.size();
  std::vector<std::vector<double>> a(size, std::vector<double>(size, 0));
  std::vector<double> b(size, 0);
  for (const NoiseAtDepth& at : at_depths) {
    for (std::size_t i = 0; i < size; ++i) {
      const double x = power(at.depth_m, terms[i]) / at.sigma_m();
      b[i] += x;
      for (std::size_t j = 0; j < size; ++j) a[i][j] += x * power(at.depth_m, terms[j]) / at.sigma_m();
    }
  }
  // scaled, because the terms differ by orders of magnitude
  std::vector<double> scale(size);
  for (std::size_t i = 0; i < size; ++i) scale[i] = std::sqrt(a[i][i]);
  for (std::size_t i = 0; i < size; ++i) {
    b[i] /= scale[i];
    for (std::size_t j = 0; j < size; ++j) a[i][j] /= scale[i] * scale[j];
  }
  const auto solution = solved(std::move(a), std::move(b));
  if (!solution) return std::nullopt;
  Coefficients coefficients{};
  for (std::size_t i = 0; i < size; ++i) {
    if ((*solution)[i] < 0) return std::nullopt;
    coefficients[static_cast<std::size_t>(terms[i])] = (*solution)[i] / scale[i];
  }
  return coefficients;
}

double chiSquared(std::span<const NoiseAtDepth> at_depths, const Coefficients& coefficients) {
  double sum = 0;
  for (const NoiseAtDepth& at : at_depths) {
    double sigma_m = 0;
    for (int term = 0; term < kTerms; ++term) {
      sigma_m += coefficients[static_cast<std::size_t>(term)] * power(at.depth_m, term);
    }
    const double error = (sigma_m / at.sigma_m() - 1) / kRelativeError;
    sum += error * error;
  }
  return sum;
}

/// The terms to try: each subset, those of the camera's principle first.
std::vector<std::vector<int>> choicesOfTerms(bool is_narrow, rt::DepthPrinciple principle) {
  const bool is_flight = principle == rt::DepthPrinciple::time_of_flight;
  if (is_narrow) return {{is_flight ? 0 : 2}};
  if (is_flight) return {{0}, {1}, {2}, {0, 1}, {0, 2}, {1, 2}, {0, 1, 2}};
  return {{2}, {1}, {0}, {0, 2}, {1, 2}, {0, 1}, {0, 1, 2}};
}

double standingShareOf(std::span<const NoiseAtDepth> at_depths) {
  double sum = 0;
  double weights = 0;
  for (const NoiseAtDepth& at : at_depths) {
    const double share = at.standing_m / at.sigma_m();
    sum += static_cast<double>(at.pixels) * share * share;
    weights += static_cast<double>(at.pixels);
  }
  return weights > 0 ? sum / weights : 0;
}

}  // namespace

double NoiseAtDepth::sigma_m() const {
  return std::hypot(changing_m, standing_m);
}

std::optional<rt::DepthNoiseParameters> fittedNoise(std::span<const NoiseAtDepth> at_depths,
                                                    rt::DepthPrinciple principle) {
  std::vector<NoiseAtDepth> measured(at_depths.begin(), at_depths.end());
  std::erase_if(measured, [](const NoiseAtDepth& at) { return !(at.sigma_m() > 0 && at.depth_m > 0); });
  if (measured.empty()) return std::nullopt;
  if (std::ranges::any_of(measured, &NoiseAtDepth::has_standing))
    std::erase_if(measured, [](const NoiseAtDepth& at) { return !at.has_standing; });
  const auto [nearest, farthest] = std::ranges::minmax(measured, {}, &NoiseAtDepth::depth_m);
  const bool is_narrow = farthest.depth_m < kNarrowSpan * nearest.depth_m;
  std::optional<Coefficients> best;
  double least = std::numeric_limits<double>::infinity();
  for (const std::vector<int>& terms : choicesOfTerms(is_narrow, principle)) {
    if (terms.size() > measured.size()) continue;
    const auto fit = fitOf(measured, terms);
    if (!fit) continue;
    const double price = chiSquared(measured, *fit) + kPricePerTerm * static_cast<double>(terms.size());
    if (price >= least) continue;
    least = price;
    best = fit;
  }
  if (!best) return std::nullopt;
  rt::DepthNoiseParameters noise{(*best)[0], (*best)[1], (*best)[2]};
  noise.standing_share = standingShareOf(measured);
  return noise;
}

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/depth_noise/depth_noise.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string_view>
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
    const double share = at.static_m / at.sigma_m();
    sum += static_cast<double>(at.pixels) * share * share;
    weights += static_cast<double>(at.pixels);
  }
  return weights > 0 ? sum / weights : 0;
}

}  // namespace

double NoiseAtDepth::sigma_m() const {
  return std::hypot(temporal_m, static_m);
}

std::optional<rt::DepthNoiseParameters> fittedNoise(std::span<const NoiseAtDepth> at_depths,
                                                    rt::DepthPrinciple principle) {
  std::vector<NoiseAtDepth> measured(at_depths.begin(), at_depths.end());
  std::erase_if(measured, [](const NoiseAtDepth& at) { return !(at.sigma_m() > 0 && at.depth_m > 0); });
  if (measured.empty()) return std::nullopt;
  if (std::ranges::any_of(measured, &NoiseAtDepth::has_static))
    std::erase_if(measured, [](const NoiseAtDepth& at) { return !at.has_static; });
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

namespace {

constexpr double kRatioOfBins = 1.1;     // far to near end of an interval of depths
constexpr std::size_t kMinPixels = 200;  // of an interval that is shown
constexpr std::size_t kMinTiles = 3;     // of an interval whose static part is shown
constexpr int kTile_px = 32;             // several correlation lengths of any camera
constexpr double kTileShare = 0.9;       // pixels of a tile that must be measured
constexpr int kRowStep = 4;              // every fourth row suffices for the correlation
constexpr double kSameSurface = 0.05;    // relative difference in depth of neighbours on one surface
constexpr double kCorrelated = 0.05;     // less than this counts as none
constexpr double kOutlier = 4;           // variances beyond this multiple are of something that moves
constexpr double kRoundingVariance =
    1.0 / 4;  // largest variance of a value between two raw steps, in steps^2

double depthOf_m(const rt::DepthModelParameters& camera, std::uint16_t raw) {
  if (raw == camera.raw_no_measurement || raw >= camera.raw_values) return 0;
  const bool is_linear = camera.law == rt::DepthLawKind::linear;
  const double z_m = is_linear ? camera.unit_m * raw : 1 / (camera.a_per_m * raw + camera.b_per_m);
  return z_m >= camera.near_m && z_m <= camera.far_m ? z_m : 0;
}

/// Depth that one raw step makes.
double step_m(const rt::DepthModelParameters& camera, double depth_m) {
  return camera.law == rt::DepthLawKind::linear ? camera.unit_m
                                                : std::abs(camera.a_per_m) * depth_m * depth_m;
}

double medianOf(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// Mean of the variances without those of pixels at edges and of what moves.
double meanAtRest(std::vector<double>& variances_m2, double step) {
  const double limit = kOutlier * (medianOf(variances_m2) + kRoundingVariance * step * step);
  double sum = 0;
  std::size_t count = 0;
  for (const double variance : variances_m2) {
    if (variance > limit) continue;
    sum += variance;
    ++count;
  }
  return sum / static_cast<double>(count);
}

}  // namespace

void DepthNoise::startAnew(const rt::DepthModelParameters& camera) {
  *this = DepthNoise();
  camera_ = camera;
  const auto pixels = static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
  pixels_.resize(pixels);
  depth_m_.resize(pixels);
  previous_m_.resize(pixels);
}

void DepthNoise::add(const rt::DepthFrame& frame) {
  if (pixels_.empty() || !(frame.camera == camera_)) startAnew(frame.camera);
  std::swap(depth_m_, previous_m_);
  const int stride = rt::strideOf(camera_.width_px);
  std::size_t pixel = 0;
  for (int row = 0; row < camera_.height_px; ++row) {
    for (int column = 0; column < camera_.width_px; ++column, ++pixel) {
      const double z_m = depthOf_m(camera_, frame.raw[row * stride + column]);
      depth_m_[pixel] = static_cast<float>(z_m);
      if (!(z_m > 0)) {
        ++holes_;
        continue;
      }
      Pixel& sums = pixels_[pixel];
      if (sums.count == 0) sums.first_m = static_cast<float>(z_m);
      const double difference_m = z_m - static_cast<double>(sums.first_m);
      ++sums.count;
      sums.sum_m += difference_m;
      sums.sum_m2 += difference_m * difference_m;
    }
    if (frames_ > 0 && row % kRowStep == 0) addDifferences(row);
  }
  ++frames_;
}

void DepthNoise::addDifferences(int row) {
  const std::size_t first = static_cast<std::size_t>(row) * static_cast<std::size_t>(camera_.width_px);
  const auto difference = [&](std::size_t at) {
    return static_cast<double>(depth_m_[at]) - static_cast<double>(previous_m_[at]);
  };
  const auto isMeasured = [&](std::size_t at) { return depth_m_[at] > 0 && previous_m_[at] > 0; };
  const auto areNear = [](double a_m, double b_m) { return std::abs(a_m - b_m) < kSameSurface * a_m; };
  for (std::size_t column = 0; column + kLags < static_cast<std::size_t>(camera_.width_px); column += 2) {
    const std::size_t here = first + column;
    const auto depth_m = static_cast<double>(depth_m_[here]);
    if (!isMeasured(here) || !areNear(depth_m, static_cast<double>(previous_m_[here]))) continue;
    for (std::size_t lag = 0; lag <= kLags; ++lag) {
      const std::size_t there = here + lag;
      if (!isMeasured(there) || !areNear(depth_m, static_cast<double>(depth_m_[there]))) continue;
      products_[lag] += difference(here) * difference(there);
      squares_[lag] += 0.5 * (difference(here) * difference(here) + difference(there) * difference(there));
    }
  }
}

double DepthNoise::mean_m(std::size_t pixel) const {
  const Pixel& sums = pixels_[pixel];
  return sums.count == 0 ? 0 : static_cast<double>(sums.first_m) + sums.sum_m / sums.count;
}

double DepthNoise::variance_m2(std::size_t pixel) const {
  const Pixel& sums = pixels_[pixel];
  return std::max(0.0, (sums.sum_m2 - sums.sum_m * sums.sum_m / sums.count) / (sums.count - 1));
}

std::vector<double> DepthNoise::meanDepth_m() const {
  std::vector<double> means(pixels_.size());
  for (std::size_t pixel = 0; pixel < means.size(); ++pixel) {
    means[pixel] = 2 * pixels_[pixel].count >= frames_ ? mean_m(pixel) : 0;
  }
  return means;
}

std::vector<DepthNoise::Tile> DepthNoise::tiles() const {
  std::vector<Tile> tiles;
  const auto width = static_cast<std::size_t>(camera_.width_px);
  for (int top = 0; top + kTile_px <= camera_.height_px; top += kTile_px) {
    for (int left = 0; left + kTile_px <= camera_.width_px; left += kTile_px) {
      PlaneResidual plane;
      double rest_m2 = 0;  // what is left of the temporal part in the mean
      for (int row = 0; row < kTile_px; ++row) {
        for (int column = 0; column < kTile_px; ++column) {
          const std::size_t pixel =
              static_cast<std::size_t>(top + row) * width + static_cast<std::size_t>(left + column);
          if (pixels_[pixel].count < kMinMeasurements) continue;
          plane.add(column - kTile_px / 2, row - kTile_px / 2, 1 / mean_m(pixel));
          rest_m2 += variance_m2(pixel) / pixels_[pixel].count;
        }
      }
      if (static_cast<double>(plane.count()) < kTileShare * kTile_px * kTile_px) continue;
      // a plane in space is a plane in 1/Z over the image
      const double depth_m = 1 / plane.mean();
      const double residual_m2 = plane.variance() * std::pow(depth_m, 4);
      tiles.push_back({depth_m, residual_m2 - rest_m2 / static_cast<double>(plane.count())});
    }
  }
  return tiles;
}

std::vector<DepthNoise::Bin> DepthNoise::bins() const {
  const auto binOf = [&](double depth_m) {
    const double ratio = std::clamp(depth_m, camera_.near_m, camera_.far_m) / camera_.near_m;
    return static_cast<std::size_t>(std::log(ratio) / std::log(kRatioOfBins));
  };
  std::vector<Bin> bins(binOf(camera_.far_m) + 1);
  for (std::size_t pixel = 0; pixel < pixels_.size(); ++pixel) {
    if (pixels_[pixel].count < kMinMeasurements || 2 * pixels_[pixel].count < frames_) continue;
    Bin& bin = bins[binOf(mean_m(pixel))];
    bin.variances_m2.push_back(variance_m2(pixel));
    bin.sum_of_depths_m += mean_m(pixel);
  }
  for (const Tile& tile : tiles()) bins[binOf(tile.depth_m)].static_m2.push_back(tile.static_m2);
  return bins;
}

DepthNoiseReport DepthNoise::report() const {
  DepthNoiseReport report;
  report.frames = frames_;
  if (frames_ == 0) return report;
  const double measurements = static_cast<double>(frames_) * static_cast<double>(pixels_.size());
  report.share_of_holes = static_cast<double>(holes_) / measurements;
  for (Bin& bin : bins()) {
    NoiseAtDepth at;
    at.pixels = bin.variances_m2.size();
    if (at.pixels < kMinPixels) continue;
    at.depth_m = bin.sum_of_depths_m / static_cast<double>(at.pixels);
    at.temporal_m = std::sqrt(meanAtRest(bin.variances_m2, step_m(camera_, at.depth_m)));
    at.has_static = bin.static_m2.size() >= kMinTiles;
    if (at.has_static) {
      at.static_m = std::sqrt(std::max(0.0, medianOf(bin.static_m2)));
    }
    report.at_depths.push_back(at);
  }
  report.correlation_px = correlation_px();
  return report;
}

double DepthNoise::correlation_px() const {
  // the integral of the correlation over both directions: the width of a box that smooths white noise
  double length_px = 1;
  for (std::size_t lag = 1; lag <= kLags && squares_[lag] > 0; ++lag) {
    const double correlation = products_[lag] / squares_[lag];
    if (correlation < kCorrelated) break;
    length_px += 2 * correlation;
  }
  return length_px;
}

namespace {

constexpr std::string_view kFarToNear = ".:-=+*#%@";

/// Mean depth of a part of the image; 0 where most of it is holes.
double meanOf(const std::vector<double>& depth_m, int width_px, int left, int right, int top, int bottom) {
  double sum_m = 0;
  int count = 0;
  for (int row = top; row < bottom; ++row) {
    for (int column = left; column < right; ++column) {
      const double z_m = depth_m[static_cast<std::size_t>(row * width_px + column)];
      sum_m += z_m;
      if (z_m > 0) ++count;
    }
  }
  return 2 * count >= (right - left) * (bottom - top) && count > 0 ? sum_m / count : 0;
}

}  // namespace

std::string depthPicture(const std::vector<double>& depth_m, int width_px, int height_px, int columns) {
  columns = std::clamp(columns, 1, width_px);
  const int lines = std::max(1, height_px * columns / (2 * width_px));
  std::vector<double> parts;
  double nearest_m = std::numeric_limits<double>::infinity();
  double farthest_m = 0;
  for (int line = 0; line < lines; ++line) {
    for (int column = 0; column < columns; ++column) {
      parts.push_back(meanOf(depth_m, width_px, column * width_px / columns,
                             (column + 1) * width_px / columns, line * height_px / lines,
                             (line + 1) * height_px / lines));
      if (parts.back() > 0) nearest_m = std::min(nearest_m, parts.back());
      farthest_m = std::max(farthest_m, parts.back());
    }
  }
  if (!(farthest_m > 0)) return "";
  const double span_m = std::max(farthest_m - nearest_m, 1e-9);
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const double nearness = (farthest_m - parts[i]) / span_m;
    const auto letter = static_cast<std::size_t>(nearness * (kFarToNear.size() - 1) + 0.5);
    text += parts[i] > 0 ? kFarToNear[std::min(letter, kFarToNear.size() - 1)] : ' ';
    if ((i + 1) % static_cast<std::size_t>(columns) == 0) text += '\n';
  }
  return text;
}

namespace {

/// Largest value that the configuration takes.
constexpr double kMaxCorrelation_px = 32;

}  // namespace

std::string textOf(const DepthNoiseReport& report, rt::DepthPrinciple principle) {
  if (report.at_depths.empty())
    return "noise        not measured: too few frames, or nothing within camera.near_m and camera.far_m\n";
  std::string text = "noise        depth_m  temporal_mm  static_mm  pixels\n";
  for (const NoiseAtDepth& at : report.at_depths) {
    text += fmt::format("             {:>7.3f}  {:>11.3f}  {:>9.3f}  {:>6}\n", at.depth_m,
                        at.temporal_m * 1e3, at.static_m * 1e3, at.pixels);
  }
  const auto fit = fittedNoise(report.at_depths, principle);
  if (!fit) return text;
  text += fmt::format("correlation  {:.1f} px\nstatic       {:.0f} % of the variance\n",
                      report.correlation_px, 100 * fit->standing_share);
  return text + fmt::format(
                    "\ncamera:\n  noise_c0_m: {:.6f}\n  noise_c1: {:.6f}\n  noise_c2_per_m: {:.6f}\n"
                    "  noise_standing_share: {:.2f}\n  noise_correlation_px: {:.1f}\n",
                    fit->c0_m, fit->c1, fit->c2_per_m, fit->standing_share,
                    std::clamp(report.correlation_px, 1.0, kMaxCorrelation_px));
}

void addTo(nlohmann::ordered_json& document, const DepthNoiseReport& report, rt::DepthPrinciple principle) {
  using Json = nlohmann::ordered_json;
  Json& depths = document["noiseAtDepths"] = Json::array();
  for (const NoiseAtDepth& at : report.at_depths) {
    depths.push_back({{"depthM", at.depth_m},
                      {"temporalM", at.temporal_m},
                      {"staticM", at.static_m},
                      {"pixels", at.pixels}});
  }
  const auto fit = fittedNoise(report.at_depths, principle);
  document["noise"] = fit ? Json{{"c0M", fit->c0_m},
                                 {"c1", fit->c1},
                                 {"c2PerM", fit->c2_per_m},
                                 {"staticShare", fit->standing_share},
                                 {"correlationPx", report.correlation_px}}
                          : Json();
}

}  // namespace hapticd::tools

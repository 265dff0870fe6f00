// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/field/spline_field.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace hapticd::solids {
namespace {

constexpr double kMostCounts = std::numeric_limits<std::int16_t>::max();
/// Finer counts than this gain nothing, because the samples are single-precision numbers.
constexpr double kLeastScale_m = 1e-7;

}  // namespace

std::shared_ptr<const config::Solid> splineOf(const SampledField& field, config::Solid::About about) {
  rt::DistanceGrid grid;
  std::ranges::transform(field.samples, grid.samples.begin(),
                         [](int samples) { return static_cast<std::uint32_t>(samples); });
  grid.spacing_m = field.spacing_m;
  grid.origin_m = field.origin_m;
  std::vector<float> spline = field.distance_m;
  rt::toSplineCoefficients(spline, grid.samples);
  const auto [least, most] = std::ranges::minmax(spline);
  grid.scale_m =
      std::max(kLeastScale_m, std::max(std::abs(double{least}), std::abs(double{most})) / kMostCounts);
  std::vector<std::int16_t> coefficients;
  coefficients.reserve(spline.size());
  for (const float coefficient : spline)
    coefficients.push_back(static_cast<std::int16_t>(std::lround(double{coefficient} / grid.scale_m)));
  return std::make_shared<const config::Solid>(grid, coefficients, std::move(about));
}

FieldValue splineReader(const SampledField& field) {
  return [solid = splineOf(field, {})](const rt::Vec3& place_m) {
    return rt::distanceAt(solid->grid(), place_m).distance_m;
  };
}

}  // namespace hapticd::solids

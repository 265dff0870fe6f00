// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/field/sampled_field.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "tools/lib/solids/files/source_file.h"

namespace hapticd::solids {
namespace {

constexpr double kMostCounts = std::numeric_limits<std::int16_t>::max();
/// Finer counts than this gain nothing, because the samples are single-precision numbers.
constexpr double kLeastScale_m = 1e-7;

constexpr double kReserve_m = 0.005, kLeastBand_m = 0.010;

/// In numbers that cannot overflow.
bool fits(const rt::Vec3& low_m, const rt::Vec3& high_m, const FieldOptions& options, double spacing_m) {
  const double band_m = bandOf(options, spacing_m);
  double product = 1;
  for (const double extent_m : {high_m.x - low_m.x, high_m.y - low_m.y, high_m.z - low_m.z}) {
    const double samples = std::ceil((extent_m + 2 * band_m) / spacing_m) + 1;
    if (!(samples <= options.limits.samples_per_axis)) return false;
    product *= samples;
  }
  return product <= static_cast<double>(options.limits.samples);
}

/// Rounds up to three digits, so that the number can be given as a tolerance.
double roundedUp(double number) {
  const double digit = std::pow(10, std::floor(std::log10(number)) - 2);
  return std::ceil(number / digit) * digit;
}

}  // namespace

double trilinearValue(const SampledField& field, const rt::Vec3& place_m) {
  const rt::Vec3 from_origin = (1 / field.spacing_m) * (place_m - field.origin_m);
  const std::array<double, 3> at{from_origin.x, from_origin.y, from_origin.z};
  std::array<int, 3> cell{};
  std::array<double, 3> share{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double inside = std::clamp(at[axis], 0.0, static_cast<double>(field.samples[axis] - 1));
    cell[axis] = std::min(static_cast<int>(inside), field.samples[axis] - 2);
    share[axis] = inside - cell[axis];
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner & 1, y = corner >> 1 & 1, z = corner >> 2 & 1;
    const double weight = (x == 1 ? share[0] : 1 - share[0]) * (y == 1 ? share[1] : 1 - share[1]) *
                          (z == 1 ? share[2] : 1 - share[2]);
    sum +=
        weight * static_cast<double>(field.distance_m[field.indexOf(cell[0] + x, cell[1] + y, cell[2] + z)]);
  }
  return sum;
}

SurfaceError surfaceError(const SampledField& field, std::span<const rt::Vec3> places_m,
                          std::span<const double> distances_m, const FieldReader& reader) {
  const FieldValue value = reader(field);
  SurfaceError error;
  double squares = 0;
  for (std::size_t i = 0; i < places_m.size(); ++i) {
    const double off_m = value(places_m[i]) - (distances_m.empty() ? 0 : distances_m[i]);
    squares += off_m * off_m;
    // written so that a value that is not a number is the largest
    if (i > 0 && std::abs(off_m) <= error.max_m) continue;
    error.max_m = std::abs(off_m);
    error.worst_m = places_m[i];
    error.worst_value_m = off_m;
  }
  error.places = places_m.size();
  error.rms_m = error.places > 0 ? std::sqrt(squares / static_cast<double>(error.places)) : 0;
  return error;
}

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

base::Result<void> checkOptions(const FieldOptions& options, const std::string& name) {
  struct Range {
    const char* what;
    double value, low, high;
  };
  for (const Range& range :
       {Range{"tolerance", options.tolerance_m, 1e-5, 1e-2}, Range{"clearance", options.clearance_m, 0, 0.1},
        Range{"tool's radius", options.tool_radius_m, 0, 0.1}})
    if (!(range.value >= range.low && range.value <= range.high))
      return refused(
          name,
          fmt::format("the {} is {} m (allowed: {}..{} m)", range.what, range.value, range.low, range.high),
          "choose another one");
  return {};
}

double bandOf(const FieldOptions& options, double spacing_m) {
  return std::max(2 * spacing_m + options.clearance_m + options.tool_radius_m + kReserve_m, kLeastBand_m);
}

SampledField gridAbout(const rt::Vec3& low_m, const rt::Vec3& high_m, double band_m, double spacing_m) {
  SampledField field;
  field.spacing_m = spacing_m;
  const std::array<double, 3> low{low_m.x, low_m.y, low_m.z}, high{high_m.x, high_m.y, high_m.z};
  std::array<double, 3> origin{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double extent_m = high[axis] - low[axis] + 2 * band_m;
    field.samples[axis] = std::max(2, static_cast<int>(std::ceil(extent_m / spacing_m)) + 1);
    origin[axis] = (low[axis] + high[axis]) / 2 - spacing_m * (field.samples[axis] - 1) / 2;
  }
  field.origin_m = {origin[0], origin[1], origin[2]};
  field.distance_m.resize(field.count());
  return field;
}

double finestSpacing(const rt::Vec3& low_m, const rt::Vec3& high_m, const FieldOptions& options) {
  double too_fine_m = 1e-6, fine_enough_m = 1;
  if (!fits(low_m, high_m, options, fine_enough_m)) return std::numeric_limits<double>::infinity();
  for (int halving = 0; halving < 60; ++halving) {
    const double middle_m = std::sqrt(too_fine_m * fine_enough_m);
    (fits(low_m, high_m, options, middle_m) ? fine_enough_m : too_fine_m) = middle_m;
  }
  return fine_enough_m;
}

base::Result<bool> SpacingSearch::take(const SurfaceError& error, const std::string& name) {
  if (error.max_m <= tolerance_m_) return true;
  const double left = finest_m_ / spacing_m_;
  if (left > 1 - 1e-9)
    return refused(
        name,
        fmt::format("the field misses the surface by {:.4f} mm at {} with the finest spacing within the "
                    "limits, {:.3f} "
                    "mm (allowed: {:.4f} mm)",
                    error.max_m * 1e3, millimetreText(error.worst_m), spacing_m_ * 1e3, tolerance_m_ * 1e3),
        fmt::format("a tolerance of {:g} mm fits; or crop the body to where the tool works",
                    roundedUp(error.max_m) * 1e3));
  // at edges the error falls with the spacing, on curved surfaces with its square
  double order = 1.5;
  if (last_spacing_m_ > 0)
    order =
        std::clamp(std::log(last_error_m_ / error.max_m) / std::log(last_spacing_m_ / spacing_m_), 1.0, 2.0);
  last_spacing_m_ = spacing_m_;
  last_error_m_ = error.max_m;
  const bool is_hopeful = error.max_m * left * left <= tolerance_m_;
  const double factor = std::clamp(std::pow(0.95 * tolerance_m_ / error.max_m, 1 / order), 0.25, 0.9);
  spacing_m_ = is_hopeful ? std::max(finest_m_, factor * spacing_m_) : finest_m_;
  return false;
}

}  // namespace hapticd::solids

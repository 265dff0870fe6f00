// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/field/field_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tools/lib/solids/files/source_file.h"

namespace hapticd::solids {
namespace {

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

// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/field/sampled_field.h"

#include <algorithm>
#include <cmath>

namespace hapticd::solids {

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

}  // namespace hapticd::solids

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "rt/base/vec3.h"

namespace hapticd::solids {

/// A signed distance on a grid whose axes are those of LPS: negative inside the body, positive outside.
struct SampledField {
  std::array<int, 3> samples{};   ///< along x, y and z; each at least 2
  double spacing_m = 0;           ///< the same along all axes
  rt::Vec3 origin_m;              ///< place of the first sample
  std::vector<float> distance_m;  ///< x fastest

  std::size_t count() const {
    return static_cast<std::size_t>(samples[0]) * static_cast<std::size_t>(samples[1]) *
           static_cast<std::size_t>(samples[2]);
  }
  std::size_t indexOf(int x, int y, int z) const {
    return static_cast<std::size_t>(x) +
           static_cast<std::size_t>(samples[0]) *
               (static_cast<std::size_t>(y) +
                static_cast<std::size_t>(samples[1]) * static_cast<std::size_t>(z));
  }
  rt::Vec3 placeOf(int x, int y, int z) const {
    return origin_m +
           spacing_m * rt::Vec3{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
  }
};

/// The distance, in metres, at a place within a grid.
using FieldValue = std::function<double(const rt::Vec3& place_m)>;
/// How a consumer reads a field, which it may prepare first; the value must not outlive the field.
using FieldReader = std::function<FieldValue(const SampledField&)>;

/// The trilinear value; of the nearest place within the grid for one outside it.
double trilinearValue(const SampledField& field, const rt::Vec3& place_m);
/// The reader whose value it is.
inline FieldValue trilinearReader(const SampledField& field) {
  return [&field](const rt::Vec3& place_m) { return trilinearValue(field, place_m); };
}

/// How far the surface of a sampled field lies from that of the body.
struct SurfaceError {
  double max_m = 0;
  double rms_m = 0;
  rt::Vec3 worst_m;          ///< where it is largest
  double worst_value_m = 0;  ///< the error there with its sign; positive: the body has shrunk
  std::size_t places = 0;    ///< where it was measured
};

/// Compares the consumer's value with the true distance at places next to the surface. `distances_m`: the
/// true ones; empty: the places lie on the surface.
SurfaceError surfaceError(const SampledField& field, std::span<const rt::Vec3> places_m,
                          std::span<const double> distances_m, const FieldReader& reader);

}  // namespace hapticd::solids

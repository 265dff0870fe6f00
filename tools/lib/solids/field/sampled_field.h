// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "config/solids/solid_file.h"
#include "rt/base/vec3.h"

/// A sampled signed distance: its values as others read them, what it is made for, and its spacing.
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

/// Returns the solid whose quadratic B-spline passes through the samples of a field, rounded to 16 bits of
/// its largest distance. `field`: at least rt::kMinGridSamples along each axis.  Thread: any.  RT: not safe.
std::shared_ptr<const config::Solid> splineOf(const SampledField& field, config::Solid::About about);

/// Reads a field as the force loop reads that solid: FieldOptions::reader.
FieldValue splineReader(const SampledField& field);

/// Bounds of a sampled field.
struct FieldLimits {
  int samples_per_axis = 512;
  std::size_t samples = std::size_t{32} << 20;  ///< 64 MiB of two bytes each
};

/// What a field is made for.
struct FieldOptions {
  double tolerance_m = 0.0005;           ///< largest error of the field at the surface; 1e-5..1e-2
  double clearance_m = 0;                ///< that the consumer adds to the body; 0..0.1
  double tool_radius_m = 0;              ///< 0..0.1
  FieldReader reader = trilinearReader;  ///< as the consumer reads it; the error is measured with it
  FieldLimits limits;
};

/// What is known about every field.
struct FieldReport {
  double band_m = 0;            ///< the grid reaches so far beyond the body on every side
  SurfaceError surface;         ///< measured; of a mesh with what reading its file changed
  double finest_spacing_m = 0;  ///< that the limits permit
  std::vector<std::string> warnings;
};

/// The body is thinner than two spacings there.
struct ThinPlace {
  double thickness_m = 0;
  rt::Vec3 place_m;
};

/// Errors: an option out of its range. `name`: of the body, for the message.
base::Result<void> checkOptions(const FieldOptions& options, const std::string& name);

/// How far beyond the body the field has to be exact.
double bandOf(const FieldOptions& options, double spacing_m);

/// A grid without values about a box, which is in its middle, and the band.
SampledField gridAbout(const rt::Vec3& low_m, const rt::Vec3& high_m, double band_m, double spacing_m);

/// The smallest spacing with which the grid about a box and its band is within the limits; infinite if none
/// below a metre is.
double finestSpacing(const rt::Vec3& low_m, const rt::Vec3& high_m, const FieldOptions& options);

/// Chooses one spacing after the other until the error is within the tolerance.
class SpacingSearch {
 public:
  SpacingSearch(double start_m, double finest_m, double tolerance_m)
      : spacing_m_(start_m), finest_m_(finest_m), tolerance_m_(tolerance_m) {}

  double spacing_m() const { return spacing_m_; }
  /// Takes the error that was measured with the spacing. Returns whether it is small enough; if not, the
  /// spacing is smaller now. Errors: it was the finest; with the tolerance that fits.
  base::Result<bool> take(const SurfaceError& error, const std::string& name);

 private:
  double spacing_m_, finest_m_, tolerance_m_;
  double last_spacing_m_ = 0, last_error_m_ = 0;
};

}  // namespace hapticd::solids

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "rt/base/vec3.h"
#include "tools/lib/solids/field/sampled_field.h"

namespace hapticd::solids {

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

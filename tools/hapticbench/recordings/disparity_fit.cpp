// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/recordings/disparity_fit.h"

#include <vector>

#include "tools/lib/truth/rigid_frame.h"

namespace hapticd::tools {

using rt::Vec3;

std::optional<RobustFit> fitDisparity(std::span<const DisparitySample> samples, double middle_column,
                                      double middle_row, double half_px) {
  constexpr std::size_t kFewest = 30;
  constexpr QuadraticFitOptions kOptions{.rounds = 6, .least_deviation = 0.02, .outlier_deviations = 4};
  if (samples.size() < kFewest) return std::nullopt;
  std::vector<QuadraticSample> scaled;
  for (const DisparitySample& sample : samples) {
    scaled.push_back(
        {(sample.column - middle_column) / half_px, (sample.row - middle_row) / half_px, sample.raw});
  }
  const auto fit = fitQuadratic(scaled, kOptions);
  if (!fit) return std::nullopt;
  return RobustFit{{middle_column, middle_row, half_px, fit->quadratic}, fit->deviation, fit->outlier_share};
}

SurfacePoint surfacePoint(const CameraDisparity& camera, const DisparityQuadratic& quadratic, double column,
                          double row) {
  constexpr double kStep_px = 0.5;
  const auto at = [&](double u, double v) { return camera.pointOf(u, v, quadratic.at(u, v)); };
  const Vec3 along_row = at(column + kStep_px, row) - at(column - kStep_px, row);
  const Vec3 along_column = at(column, row + kStep_px) - at(column, row - kStep_px);
  const Vec3 normal = cross(along_row, along_column);
  const Vec3 position = at(column, row);
  const double towards_camera = dot(normal, position) < 0 ? 1 : -1;
  return {position, (towards_camera / norm(normal)) * normal};
}

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "config/base/descriptor.h"
#include "config/solids/solid_file.h"
#include "rt/base/vec3.h"

namespace hapticd::test {

/// The file of a solid around the origin. `distance_m`: its signed distance; `half_edge_m`: the samples fill
/// a cube at least so large.
inline std::string solidBytes(const std::function<double(const rt::Vec3&)>& distance_m, double half_edge_m,
                              double spacing_m) {
  constexpr double kScale_m = 5e-6;
  const auto half = static_cast<std::uint32_t>(std::ceil(half_edge_m / spacing_m));
  const std::uint32_t edge = 2 * half + 1;
  rt::DistanceGrid grid;
  grid.samples = {edge, edge, edge};
  grid.spacing_m = spacing_m;
  grid.origin_m = -spacing_m * half * rt::Vec3{1, 1, 1};
  grid.scale_m = kScale_m;
  std::vector<float> samples;
  for (std::uint32_t z = 0; z < edge; ++z) {
    for (std::uint32_t y = 0; y < edge; ++y) {
      for (std::uint32_t x = 0; x < edge; ++x)
        samples.push_back(static_cast<float>(distance_m(grid.origin_m + spacing_m * rt::Vec3(x, y, z))));
    }
  }
  rt::toSplineCoefficients(samples, grid.samples);
  std::vector<std::int16_t> coefficients;
  for (const float sample : samples)
    coefficients.push_back(static_cast<std::int16_t>(std::lround(double{sample} / kScale_m)));
  return std::string(config::Solid(grid, coefficients, {.source = "made", .error_m = 1e-5}).file());
}

/// The file of a ball.
inline std::string ballBytes(double radius_m, double spacing_m = 0.002) {
  return solidBytes([=](const rt::Vec3& p) { return norm(p) - radius_m; }, radius_m + 4 * spacing_m,
                    spacing_m);
}

/// A memory file of these bytes; `seals`: of F_ADD_SEALS.
inline base::Descriptor memoryFile(const std::string& bytes,
                                   int seals = F_SEAL_WRITE | F_SEAL_SHRINK | F_SEAL_GROW) {
  base::Descriptor memory(::memfd_create("test", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  const bool written =
      ::write(memory.get(), bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
  if (!written || ::fcntl(memory.get(), F_ADD_SEALS, seals) != 0) memory.close();
  return memory;
}

}  // namespace hapticd::test

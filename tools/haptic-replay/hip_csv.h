// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <filesystem>
#include <string>
#include <vector>

#include "config/error.h"
#include "rt/vec3.h"

namespace hapticd::tools {

/// One row of a HIP file.
struct HipSample {
  double time_s;
  rt::Vec3 hip_m_in_world;
};

/// Reads a file with the header `t_s,x_m,y_m,z_m` and one sample per line, as PointTable does.
/// Errors: every bad line, with its number, value and allowed range.
std::expected<std::vector<HipSample>, std::vector<config::Error>> readHipCsv(
    const std::filesystem::path& file);

}  // namespace hapticd::tools

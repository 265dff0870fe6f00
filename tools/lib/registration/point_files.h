// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <filesystem>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "tools/lib/registration/rigid_fit.h"

namespace hapticd::tools {

/// A point that can be seen in the depth image and touched with the handle.
struct Landmark {
  std::string name;
  int column_px = 0;  ///< 0..639, from the left
  int row_px = 0;     ///< 0..479, from the top
};

inline constexpr const char* kPairsHeader =
    "name,camera_x_m,camera_y_m,camera_z_m,world_x_m,world_y_m,world_z_m";
inline constexpr const char* kLandmarksHeader = "name,column_px,row_px";

template <typename T>
using FileOf = std::expected<std::vector<T>, std::vector<base::Error>>;

// Both read a CSV file with the header above and one point per line, as PointTable does. Errors: every bad
// line, with its number, value and allowed range.

FileOf<PointPair> readPointPairs(const std::filesystem::path& file);
FileOf<Landmark> readLandmarks(const std::filesystem::path& file);

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <expected>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "rt/depth/depth_model.h"
#include "tools/lib/registration/rigid_fit.h"

namespace hapticd::tools {

/// Reads the lines of a CSV file of points and gathers what is wrong with them, up to as many errors as a
/// person would read. LF or CRLF; empty lines and lines that begin with '#' are passed over.
class PointTable {
 public:
  using Fields = std::vector<std::string_view>;

  /// `header`: the names of the columns. `remedy`: where the file cannot be read.
  PointTable(std::filesystem::path file, std::string_view header, std::string remedy);

  /// Calls `take` with the fields of each line below the header, all of them there.
  void readInto(const std::function<void(const Fields&)>& take);

  /// The field of a column as a number; any, after an error, if it is none in the range. `unit`: of the
  /// range.
  double number(std::size_t column, const Fields& fields, double lowest, double highest,
                std::string_view unit);
  int integer(std::size_t column, const Fields& fields, int lowest, int highest);
  /// The field as a name that no other line has.
  std::string name(std::string_view text);

  std::vector<base::Error>& errors() { return errors_; }

 private:
  template <typename T>
  T numberIn(std::size_t column, const Fields& fields, T lowest, T highest, std::string_view unit);
  void takeRow(std::string_view row, const std::function<void(const Fields&)>& take);
  void report(std::string what, std::string remedy = "");

  std::filesystem::path file_;
  std::string_view header_;
  std::string remedy_;
  std::size_t line_ = 0;
  std::vector<std::string> names_;
  std::vector<base::Error> errors_;
};

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

/// Pixels about a landmark whose depths count, in each direction: 5 by 5 of them.
inline constexpr int kLandmarkReach_px = 2;

/// Where the camera sees a landmark, metres, camera frame: along the ray of its pixel, at the median depth of
/// the pixels about it. `frame`: the camera's raw values, row by row, without padding. Errors: the pixel lies
/// outside the image, or fewer than half of these pixels have a depth.
base::Result<rt::Vec3> positionInCamera(const Landmark& landmark, std::span<const std::uint16_t> frame,
                                        const rt::DepthModelParameters& model);

}  // namespace hapticd::tools

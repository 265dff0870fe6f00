// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "rt/base/vec3.h"
#include "tools/lib/solids/files/label_formats.h"
#include "tools/lib/solids/files/source_file.h"

/// One segment of a label map, from NRRD and NIfTI-1 files.
namespace hapticd::solids {

struct LabelOptions {
  /// Name or id of a segment, or value of its voxels; empty: the only one in the file.
  std::string label;
  /// For an NRRD file that has spacings and no directions.
  std::optional<Frame> frame;
  /// Voxels outside the segment that are kept on each side, also beyond the image; 0..1000.
  int margin_voxels = 1;
  LabelLimits limits;
};

/// The voxels of a segment and of a margin about it.
struct LabelMap {
  std::array<int, 3> size{};
  std::array<rt::Vec3, 3> steps_m;   ///< from a voxel's centre to the next along each axis, LPS, metres
  rt::Vec3 origin_m;                 ///< centre of the first voxel, LPS, metres
  std::vector<std::uint8_t> inside;  ///< 1 or 0, the first axis fastest

  rt::Vec3 centreOf(double i, double j, double k) const {
    return origin_m + i * steps_m[0] + j * steps_m[1] + k * steps_m[2];
  }
};

/// What a person checks before a segment is used.
struct LabelReport {
  std::string format;
  Frame frame = Frame::lps;
  KnownFrom frame_from = KnownFrom::file;
  std::string name;        ///< of the segment; empty: the file has no names
  std::int64_t value = 0;  ///< of its voxels
  std::size_t layer = 0;
  std::size_t voxels = 0;
  std::array<double, 3> spacing_mm{};
  rt::Vec3 low_mm, high_mm;   ///< corners of the box of its voxels' centres, LPS, millimetres
  bool touches_edge = false;  ///< of the image, which then cuts the body off
  std::vector<std::string> warnings;
};

struct LabelFile {
  LabelMap map;
  LabelReport report;
};

/// Reads one segment of .nrrd, .nhdr, .seg.nrrd, .nii or .nii.gz.
/// Thread: any. RT: not safe.
/// Errors: those of the format; no such label, with those that there are; a grey image instead of labels.
base::Result<LabelFile> readLabel(const std::filesystem::path& file, const LabelOptions& options = {});

/// The same for the content of a file whose voxels are in it. `name`: of the file, for its ending and for
/// messages.
base::Result<LabelFile> labelFrom(std::string_view bytes, const std::string& name,
                                  const LabelOptions& options = {});

}  // namespace hapticd::solids

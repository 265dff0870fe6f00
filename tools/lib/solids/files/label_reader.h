// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "rt/base/vec3.h"
#include "tools/lib/solids/files/source_file.h"

/// One segment of a label map, from NRRD and NIfTI-1 files.
namespace hapticd::solids {

/// Bounds of a label map. The defaults hold a CT of 512 x 512 x 1000 voxels of two bytes.
struct LabelLimits {
  std::size_t file_bytes = std::size_t{1} << 30;
  std::size_t voxel_bytes = std::size_t{1} << 30;  ///< of all layers, without compression
  std::int64_t voxels_per_axis = 4096;
};

// The formats, one source file each. `name`: of the file, for messages.
// Errors of all: what is damaged or truncated, with its line or byte; what is not supported; no orientation;
// more than the limits.

enum class VoxelType { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };
std::size_t bytesOf(VoxelType type);

/// A segment as 3D Slicer describes it.
struct Segment {
  std::string id, name;
  std::int64_t value = 0;  ///< of its voxels, within its layer
  std::size_t layer = 0;
};

/// What a label map contains, in LPS and millimetres.
struct FileLabels {
  std::string format;  ///< "NRRD"
  Frame frame = Frame::lps;
  KnownFrom frame_from = KnownFrom::file;
  std::array<std::int64_t, 3> sizes{};  ///< each 1..voxels_per_axis
  std::array<rt::Vec3, 3> steps_mm;     ///< from a voxel to the next along each axis; may be left-handed
  rt::Vec3 origin_mm;                   ///< centre of the first voxel
  std::size_t layers = 1;               ///< the fastest axis
  VoxelType type = VoxelType::uint8;
  std::endian order = std::endian::native;
  // The voxels are not read with the header, because a small file may hold very many.
  std::string_view attached;      ///< what holds them, in the content of the file
  std::string detached;           ///< the same of another file; empty: there is none
  bool is_gzip = false;           ///< what holds them is compressed
  std::uint64_t first_byte = 0;   ///< of the voxels, when decompressed
  std::vector<Segment> segments;  ///< empty: the file does not describe them
  std::vector<std::string> warnings;

  std::int64_t voxels() const { return sizes[0] * sizes[1] * sizes[2]; }
  std::string_view held() const { return detached.empty() ? attached : std::string_view(detached); }
};

/// Returns the content of a file that a header names, relative to the folder of the header.
using DetachedFile = std::function<base::Result<std::string>(const std::string& relative)>;

/// Reads a header, and where the voxels are; `bytes` must outlive the result.
/// `frame`: for a file with spacings and without directions, whose axes are then those of the frame.
base::Result<FileLabels> readNrrd(std::string_view bytes, const std::string& name, std::optional<Frame> frame,
                                  const LabelLimits& limits, const DetachedFile& detached);

/// The same. `is_compressed`: the whole file is a gzip stream.
base::Result<FileLabels> readNifti(std::string_view bytes, const std::string& name, bool is_compressed,
                                   const LabelLimits& limits);

/// Checks sizes and orientation against the limits, and returns the bytes that the voxels take.
base::Result<std::uint64_t> checkedBytes(const FileLabels& labels, const std::string& name,
                                         const LabelLimits& limits);

// What a reader of any of them gets.

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

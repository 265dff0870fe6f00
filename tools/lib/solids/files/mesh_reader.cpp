// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/files/mesh_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "config/base/value_text.h"

namespace hapticd::solids {
namespace {

constexpr double kSmallest_mm = 5, kLargest_mm = 3000;

base::Result<FileMesh> readFormat(std::string_view bytes, const std::string& name, const MeshLimits& limits) {
  const std::string ending = lowerCase(std::filesystem::path(name).extension().string());
  if (bytes.size() > limits.bytes)
    return refused(name, fmt::format("{} bytes (allowed: at most {})", bytes.size(), limits.bytes),
                   "simplify the mesh before it is exported");
  if (ending == ".stl") return readStl(bytes, name, limits);
  if (ending == ".obj") return readObj(bytes, name, limits);
  if (ending == ".ply") return readPly(bytes, name, limits);
  return refused(
      name,
      fmt::format("the ending {} is not that of a mesh (allowed: .stl, .obj, .ply)", base::inQuotes(ending)),
      "export the mesh as STL; the Save dialog of 3D Slicer offers it beside .vtk");
}

base::Result<void> setFrame(const FileMesh& file, const std::string& name, const MeshOptions& options,
                            MeshReport& report) {
  const std::optional<Frame> stated = frameOf(file.space);
  if (!file.space.empty() && !stated && !options.frame)
    return refused(name, fmt::format("the frame is SPACE={} (allowed: LPS, RAS)", file.space),
                   "export the mesh in LPS, or state the frame");
  if (stated) {
    report.frame = *stated;
    report.frame_from = KnownFrom::file;
    if (options.frame && *options.frame != *stated)
      report.warnings.push_back(ignoredFrame(*stated, *options.frame));
  } else if (options.frame) {
    report.frame = *options.frame;
    report.frame_from = KnownFrom::option;
  } else {
    report.warnings.emplace_back(
        "the file does not state its frame: LPS is assumed; compare the box with the image");
  }
  return {};
}

base::Result<void> setUnit(const Bounds& box, const std::string& name, const MeshOptions& options,
                           MeshReport& report) {
  const double diagonal = box.diagonal_m();  // still in the unit of the file
  if (options.unit) {
    report.unit = *options.unit;
    report.unit_from = KnownFrom::option;
    return {};
  }
  if (diagonal >= kSmallest_mm && diagonal <= kLargest_mm) return {};
  const bool may_be_metres =
      diagonal >= kSmallest_mm * kMetresPerMillimetre && diagonal <= kLargest_mm * kMetresPerMillimetre;
  return refused(
      name,
      fmt::format("the diagonal of the box is {:.6g} (allowed: {}..{}, which are millimetres){}", diagonal,
                  kSmallest_mm, kLargest_mm, may_be_metres ? "; it may be in metres" : ""),
      "state the unit: mm or m");
}

}  // namespace

std::string_view textOf(Unit unit) {
  return unit == Unit::metre ? "m" : "mm";
}

base::Result<MeshFile> meshFrom(std::string_view bytes, const std::string& name, const MeshOptions& options) {
  auto file = readFormat(bytes, name, options.limits);
  if (!file) return std::unexpected(file.error());
  if (file->triangles.empty())
    return refused(name, "contains no face", "export the surface, not only its points");
  MeshFile result;
  result.report.format = file->format;
  result.report.warnings = std::move(file->warnings);
  if (auto done = setFrame(*file, name, options, result.report); !done) return std::unexpected(done.error());
  result.mesh = {std::move(file->points), std::move(file->triangles), file->bend};
  result.report.topology = repair(result.mesh);
  if (result.mesh.triangles.empty())
    return refused(name, "every face is flat: two of its corners are the same point",
                   "export the mesh again");
  if (auto done = setUnit(boundsOf(result.mesh.points_m), name, options, result.report); !done)
    return std::unexpected(done.error());
  const double scale = result.report.unit == Unit::metre ? 1 : kMetresPerMillimetre;
  for (rt::Vec3& point : result.mesh.points_m) point = scale * inLps(point, result.report.frame);
  result.mesh.error_m *= scale;
  const Bounds box = boundsOf(result.mesh.points_m);
  constexpr double kFarthest_m = 100;  // of a scanner's origin; more is another unit
  for (const double number :
       {box.low_m.x, box.low_m.y, box.low_m.z, box.high_m.x, box.high_m.y, box.high_m.z})
    if (!(std::abs(number) <= kFarthest_m))
      return refused(name, fmt::format("a coordinate is {:.6g} m (allowed: -100..100 m)", number),
                     "check the unit");
  result.report.low_mm = (1 / kMetresPerMillimetre) * box.low_m;
  result.report.high_mm = (1 / kMetresPerMillimetre) * box.high_m;
  return result;
}

base::Result<MeshFile> readMesh(const std::filesystem::path& file, const MeshOptions& options) {
  auto bytes = contentOf(file, options.limits.bytes);
  if (!bytes) return std::unexpected(bytes.error());
  return meshFrom(*bytes, file.string(), options);
}

}  // namespace hapticd::solids

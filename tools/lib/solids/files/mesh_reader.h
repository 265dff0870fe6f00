// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "tools/lib/solids/files/mesh_formats.h"
#include "tools/lib/solids/files/mesh_repair.h"
#include "tools/lib/solids/files/source_file.h"

/// Meshes from STL, OBJ and PLY files, as 3D Slicer and others export them.
namespace hapticd::solids {

enum class Unit { millimetre, metre };
std::string_view textOf(Unit unit);  ///< "mm", "m"

struct MeshOptions {
  std::optional<Frame> frame;  ///< for files that do not state theirs
  std::optional<Unit> unit;    ///< none of the formats states it
  MeshLimits limits;
};

/// What a person checks before a mesh is used.
struct MeshReport {
  std::string format;
  Frame frame = Frame::lps;
  KnownFrom frame_from = KnownFrom::assumed;
  Unit unit = Unit::millimetre;
  KnownFrom unit_from = KnownFrom::assumed;  ///< assumed: from the size of the box
  rt::Vec3 low_mm, high_mm;                  ///< corners of the box, LPS, millimetres
  Topology topology;
  std::vector<std::string> warnings;
};

struct MeshFile {
  TriangleMesh mesh;
  MeshReport report;
};

/// Reads a mesh file, whose format is that of its ending (.stl, .obj, .ply), converts it to LPS and metres,
/// and repairs it. The frame is that of the note SPACE= in the file, otherwise that of the options, otherwise
/// LPS with a warning. The unit is that of the options; otherwise millimetres if the diagonal of the box is
/// 5..3000 in the unit of the file.
/// Thread: any. RT: not safe.
/// Errors: unreadable, damaged, beyond the limits, an unknown frame or unit, no face.
base::Result<MeshFile> readMesh(const std::filesystem::path& file, const MeshOptions& options = {});

/// The same for the content of a file. `name`: of the file, for its ending and for messages.
base::Result<MeshFile> meshFrom(std::string_view bytes, const std::string& name,
                                const MeshOptions& options = {});

}  // namespace hapticd::solids

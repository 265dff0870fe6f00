// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "rt/base/vec3.h"

/// The formats of mesh files, one source file each. Nothing is converted here: numbers keep the unit and the
/// frame of the file. `name`: of the file, for messages.
/// Errors of all: what is damaged, with its line or byte; what is not supported; more than the limits.
namespace hapticd::solids {

/// Indices of three points, in the order in which the outside sees them counterclockwise.
using Triangle = std::array<std::uint32_t, 3>;

/// Bounds of a mesh file. The defaults are about ten times what a segmentation of a CT exports.
struct MeshLimits {
  std::size_t bytes = std::size_t{1} << 29;
  std::size_t triangles = 4'000'000;
  std::size_t points = 12'000'000;
};

/// What a mesh file contains.
struct FileMesh {
  std::string format;               ///< "binary STL"
  std::vector<rt::Vec3> points;     ///< finite
  std::vector<Triangle> triangles;  ///< each index is one of `points`
  std::string space;                ///< what follows "SPACE=" in a header or comment; empty: no such note
  std::vector<std::string> warnings;
};

base::Result<FileMesh> readStl(std::string_view bytes, const std::string& name, const MeshLimits& limits);
base::Result<FileMesh> readObj(std::string_view bytes, const std::string& name, const MeshLimits& limits);
base::Result<FileMesh> readPly(std::string_view bytes, const std::string& name, const MeshLimits& limits);

/// Returns the word behind "SPACE=" in a comment or header, and an empty one if there is none.
std::string spaceNote(std::string_view text);

/// Appends the triangles of a polygon, a fan about its first corner.
/// Errors, as a text: fewer than three corners, a corner that is not one of `points`, too many triangles.
std::string addPolygon(FileMesh& mesh, const std::vector<std::uint64_t>& corners, std::uint64_t points,
                       const MeshLimits& limits);

}  // namespace hapticd::solids

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
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
  /// No place of a face with more than three corners is farther from the triangles that it became, whichever
  /// way it bends between its corners.
  double bend = 0;
  std::string space;  ///< what follows "SPACE=" in a header or comment; empty: no such note
  std::vector<std::string> warnings;
};

base::Result<FileMesh> readStl(std::string_view bytes, const std::string& name, const MeshLimits& limits);
base::Result<FileMesh> readObj(std::string_view bytes, const std::string& name, const MeshLimits& limits);
base::Result<FileMesh> readPly(std::string_view bytes, const std::string& name, const MeshLimits& limits);

/// Takes over the word behind "SPACE=" in a comment or header, if there is one.
/// Errors, as a text: the file stated another one above.
std::string takeSpaceNote(FileMesh& mesh, std::string_view text);

/// Appends the faces of a file, whose points are there, as triangles. A face that is not convex is one too:
/// ears are cut off until three corners are left. Thread: one. RT: not safe.
class Polygons {
 public:
  Polygons(FileMesh& mesh, const MeshLimits& limits, std::size_t file_bytes);
  /// Errors, as a text: fewer than three corners, a corner that is not one of the points, too many triangles,
  /// an outline that crosses itself, one so intricate that it would take more than mostSteps() of the file.
  std::string add(std::span<const std::uint64_t> corners);

 private:
  struct Corner;
  static constexpr int kMostLenient = 2;
  std::string cutEars(std::vector<Corner>& outline);
  bool isEar(const std::vector<Corner>& outline, std::uint32_t at, int lenience) const;

  FileMesh& mesh_;
  const MeshLimits& limits_;
  std::uint64_t steps_left_;
  double flat_ = 0;                    ///< twice the area of a triangle that is none, of the face in hand
  std::vector<std::uint32_t> hollow_;  ///< its corners where the inside has 180 degrees or more
};

}  // namespace hapticd::solids

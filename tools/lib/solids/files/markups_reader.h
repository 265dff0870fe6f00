// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "rt/base/vec3.h"

/// Points, curves, planes and boxes that were placed in 3D Slicer, from .mrk.json and .fcsv files. All in
/// LPS, metres. Positions are those of the markup itself: a transform above it in the scene that was not
/// hardened is not part of the file.
namespace hapticd::solids {

enum class MarkupKind { fiducial, line, angle, curve, closed_curve, plane, roi };
std::string_view textOf(MarkupKind kind);  ///< as in the files: "Fiducial", "ClosedCurve"

struct MarkupPoint {
  std::string label;  ///< never empty: a point without one is named by its place, "point 3"
  rt::Vec3 position_m;
};

/// A box.
struct MarkupBox {
  rt::Vec3 centre_m;
  std::array<rt::Vec3, 3> axes;  ///< unit vectors, right-handed
  rt::Vec3 size_m;               ///< full lengths of the edges along the axes; each > 0
};

struct MarkupPlane {
  rt::Vec3 position_m;
  rt::Vec3 normal;  ///< unit vector
};

struct Markup {
  MarkupKind kind = MarkupKind::fiducial;
  std::string name;                   ///< may be empty
  std::vector<MarkupPoint> points;    ///< those that are placed; for a curve in the order along it
  std::vector<std::string> unplaced;  ///< labels of the others, which `warnings` name
  std::optional<MarkupBox> box;       ///< of kind roi
  std::optional<MarkupPlane> plane;   ///< of kind plane
};

struct MarkupFile {
  std::vector<Markup> markups;
  std::vector<std::string> warnings;
};

/// Reads a file by its ending: .json or .fcsv.
/// Thread: any. RT: not safe.
/// Errors: unreadable, longer than 16 MiB, damaged, nested deeply, an unknown kind, frame or unit, a number
/// out of range.
base::Result<MarkupFile> readMarkups(const std::filesystem::path& file);

/// The same for the content of a file. `name`: of the file, for its ending and for messages.
base::Result<MarkupFile> markupsFrom(std::string_view bytes, const std::string& name);

}  // namespace hapticd::solids

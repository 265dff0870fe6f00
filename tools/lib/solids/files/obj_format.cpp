// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "config/base/value_text.h"
#include "tools/lib/solids/files/mesh_formats.h"
#include "tools/lib/solids/files/source_file.h"

namespace hapticd::solids {
namespace {

/// Faces may name points that follow further down; that is checked at the end.
struct Face {
  std::size_t line;
  std::size_t first;  ///< among the corners of all faces
  std::size_t count;
};

class ObjFile {
 public:
  ObjFile(std::string_view text, const std::string& name, const MeshLimits& limits)
      : lines_(text), bytes_(text.size()), name_(name), limits_(limits) {
    if (!text.empty() && !text.ends_with('\n') && !text.ends_with('\r'))
      mesh_.warnings.emplace_back("the last line has no end: the file may be truncated");
  }

  base::Result<FileMesh> read() {
    mesh_.format = "OBJ";
    while (const auto line = wholeLine()) {
      if (auto done = take(*line); !done) return std::unexpected(done.error());
    }
    Polygons polygons(mesh_, limits_, bytes_);
    for (const Face& face : faces_) {
      const std::string problem = polygons.add(std::span(corners_).subspan(face.first, face.count));
      if (!problem.empty()) return fault(face.line, problem, "export the mesh again");
    }
    return std::move(mesh_);
  }

 private:
  std::unexpected<base::Error> fault(std::size_t line, std::string what, std::string remedy) const {
    return refused(fmt::format("{}:{}", name_, line), std::move(what), std::move(remedy));
  }

  /// A line, joined with those that a backslash at its end continues it with.
  std::optional<std::string> wholeLine() {
    auto line = lines_.nextLine();
    if (!line) return std::nullopt;
    number_ = lines_.line();
    std::string whole(*line);
    while (whole.ends_with('\\')) {
      whole.back() = ' ';
      line = lines_.nextLine();
      if (!line) break;
      whole += *line;
    }
    return whole;
  }

  base::Result<void> take(std::string_view line) {
    const std::size_t comment = line.find('#');
    if (comment != std::string_view::npos) {
      const std::string problem = takeSpaceNote(mesh_, line.substr(comment));
      if (!problem.empty()) return fault(number_, problem, "export all bodies in the same frame");
      line = line.substr(0, comment);
    }
    const std::string_view keyword = takeWord(line);
    if (keyword == "v") return takePoint(line);
    if (keyword == "f") return takeFace(line);
    // normals, textures, groups and materials do not matter here, but what is no keyword may have been a
    // point
    const bool is_keyword = keyword.empty() || (lowerCase(keyword)[0] >= 'a' && lowerCase(keyword)[0] <= 'z');
    if (!is_keyword || keyword == "surf")
      return fault(number_,
                   is_keyword ? "a surface that is not made of faces"
                              : fmt::format("{} is not a word of an OBJ file", base::inQuotes(keyword)),
                   "export the mesh as polygons");
    return {};
  }

  base::Result<void> takePoint(std::string_view line) {
    if (mesh_.points.size() >= limits_.points)
      return fault(number_, fmt::format("more than {} points", limits_.points), "simplify the mesh");
    std::array<double, 3> numbers{};
    for (double& number : numbers) {
      const std::string_view word = takeWord(line);
      const auto read = coordinateFrom(word);
      if (!read)
        return fault(number_,
                     fmt::format("a coordinate is {} (allowed: a number in -1e9..1e9)", base::inQuotes(word)),
                     "export the mesh again");
      number = *read;
    }
    mesh_.points.push_back({numbers[0], numbers[1], numbers[2]});  // a weight or a colour may follow
    return {};
  }

  base::Result<void> takeFace(std::string_view line) {
    if (faces_.size() >= limits_.triangles)
      return fault(number_, fmt::format("more than {} faces", limits_.triangles), "simplify the mesh");
    Face face{number_, corners_.size(), 0};
    for (std::string_view word = takeWord(line); !word.empty(); word = takeWord(line), ++face.count) {
      const std::string_view digits = word.substr(0, word.find('/'));
      const auto index = base::numberFrom<std::int64_t>(digits);
      const auto points = static_cast<std::int64_t>(mesh_.points.size());
      // negative numbers count back from the last point above
      if (!index || *index == 0 || *index < -points)
        return fault(number_,
                     fmt::format("a face names point {} (allowed: 1.. from the first, -1..-{} from the last)",
                                 base::inQuotes(digits), points),
                     "export the mesh again");
      corners_.push_back(static_cast<std::uint64_t>(*index > 0 ? *index - 1 : points + *index));
    }
    if (face.count < 3)
      return fault(number_, fmt::format("a face has {} corners (allowed: at least 3)", face.count),
                   "export the mesh again");
    faces_.push_back(face);
    return {};
  }

  TextCursor lines_;
  std::size_t bytes_;
  const std::string& name_;
  const MeshLimits& limits_;
  FileMesh mesh_;
  std::size_t number_ = 0;
  std::vector<Face> faces_;
  std::vector<std::uint64_t> corners_;
};

}  // namespace

base::Result<FileMesh> readObj(std::string_view bytes, const std::string& name, const MeshLimits& limits) {
  if (bytes.find('\0') != std::string_view::npos)
    return refused(name, "a NUL byte in a text file", "check that the file is an OBJ file");
  return ObjFile(bytes, name, limits).read();
}

}  // namespace hapticd::solids

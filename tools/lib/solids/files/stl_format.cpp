// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "config/base/value_text.h"
#include "tools/lib/solids/files/mesh_formats.h"
#include "tools/lib/solids/files/source_file.h"

namespace hapticd::solids {
namespace {

constexpr std::uint64_t kHeaderBytes = 80, kHeadBytes = 84, kFacetBytes = 50;
constexpr const char* kWriteAgain = "write the file again";

/// A text has no NUL and no bytes above 127 in it.
bool hasBytesOfNoText(std::string_view bytes) {
  return std::ranges::any_of(bytes,
                             [](char byte) { return byte == 0 || static_cast<signed char>(byte) < 0; });
}

std::string tooMany(std::uint64_t triangles, const MeshLimits& limits) {
  return fmt::format("{} triangles (allowed: at most {})", triangles, limits.triangles);
}

base::Result<FileMesh> readBinary(std::string_view bytes, std::uint64_t facets, const std::string& name,
                                  const MeshLimits& limits) {
  if (facets > limits.triangles)
    return refused(name, tooMany(facets, limits), "simplify the mesh before it is exported");
  FileMesh mesh{"binary STL", {}, {}, spaceNote(bytes.substr(0, kHeaderBytes)), {}};
  const std::uint64_t extra = bytes.size() - (kHeadBytes + kFacetBytes * facets);
  if (extra > 0)
    mesh.warnings.push_back(
        fmt::format("{} bytes behind the last of {} triangles are ignored", extra, facets));
  mesh.points.reserve(3 * facets);
  mesh.triangles.reserve(facets);
  for (std::uint64_t facet = 0; facet < facets; ++facet) {
    // the normal (12 bytes) follows from the corners; the last two bytes are a colour or garbage
    const std::uint64_t at = kHeadBytes + kFacetBytes * facet + 12;
    std::array<double, 9> numbers{};
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      numbers[i] = static_cast<double>(numberAt<float>(bytes.data() + at + 4 * i, std::endian::little));
      if (!(std::abs(numbers[i]) <= kMaxCoordinate))
        return refused(
            fmt::format("{}: byte {}", name, at + 4 * i),
            fmt::format("a coordinate of triangle {} is {} (allowed: -1e9..1e9)", facet + 1, numbers[i]),
            kWriteAgain);
    }
    const auto first = static_cast<std::uint32_t>(mesh.points.size());
    for (std::size_t corner = 0; corner < 3; ++corner)
      mesh.points.push_back({numbers[3 * corner], numbers[3 * corner + 1], numbers[3 * corner + 2]});
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

/// Reads the words of a text; several solids become one mesh.
class AsciiStl {
 public:
  AsciiStl(std::string_view text, const std::string& name, const MeshLimits& limits)
      : words_(text), name_(name), limits_(limits) {}

  base::Result<FileMesh> read() {
    mesh_.format = "ASCII STL";
    while (const auto word = words_.nextWord()) {
      if (auto done = take(lowerCase(*word)); !done) return std::unexpected(done.error());
    }
    if (in_facet_) return fault("ends within a facet", "the file is truncated: write it again");
    if (in_solid_) mesh_.warnings.emplace_back("the file ends without 'endsolid': it may be truncated");
    return std::move(mesh_);
  }

 private:
  std::unexpected<base::Error> fault(std::string what, std::string remedy) const {
    return refused(fmt::format("{}:{}", name_, words_.line()), std::move(what), std::move(remedy));
  }

  base::Result<void> take(const std::string& word) {
    if (word == "solid") return takeSolid();
    if (word == "endsolid") {
      if (in_facet_) return fault("'endsolid' within a facet", kWriteAgain);
      in_solid_ = false;
      words_.restOfLine();
    } else if (word == "facet") {
      if (in_facet_) return fault("a facet begins within a facet", kWriteAgain);
      in_facet_ = true;
      corners_ = 0;
    } else if (word == "normal") {
      for (int i = 0; i < 3; ++i) words_.nextWord();  // follows from the corners
    } else if (word == "vertex") {
      return takeVertex();
    } else if (word == "endfacet") {
      return endFacet();
    } else if (word != "outer" && word != "loop" && word != "endloop") {
      return fault(fmt::format("{} is not a word of an STL file", base::inQuotes(word)),
                   "check that the file is an STL file");
    }
    return {};
  }

  base::Result<void> takeSolid() {
    if (in_facet_) return fault("a solid begins within a facet", kWriteAgain);
    in_solid_ = true;
    const std::string space = spaceNote(words_.restOfLine());
    if (!space.empty() && !mesh_.space.empty() && space != mesh_.space)
      return fault(fmt::format("SPACE={} in a file that has SPACE={} above", space, mesh_.space),
                   "export all solids in the same frame");
    if (!space.empty()) mesh_.space = space;
    return {};
  }

  base::Result<void> takeVertex() {
    if (!in_facet_) return fault("a vertex outside a facet", kWriteAgain);
    if (++corners_ > 3) return fault("a facet has more than 3 vertices", "triangulate the mesh");
    std::array<double, 3> numbers{};
    for (double& number : numbers) {
      const auto word = words_.nextWord();
      const auto read = coordinateFrom(word.value_or(""));
      if (!read)
        return fault(fmt::format("a coordinate is {} (allowed: a number in -1e9..1e9)",
                                 base::inQuotes(word.value_or(""))),
                     kWriteAgain);
      number = *read;
    }
    mesh_.points.push_back({numbers[0], numbers[1], numbers[2]});
    return {};
  }

  base::Result<void> endFacet() {
    if (!in_facet_ || corners_ != 3)
      return fault(fmt::format("a facet ends with {} vertices (allowed: 3)", in_facet_ ? corners_ : 0),
                   kWriteAgain);
    in_facet_ = false;
    if (mesh_.triangles.size() >= limits_.triangles)
      return fault(fmt::format("more than {} triangles", limits_.triangles),
                   "simplify the mesh before it is exported");
    const auto end = static_cast<std::uint32_t>(mesh_.points.size());
    mesh_.triangles.push_back({end - 3, end - 2, end - 1});
    return {};
  }

  TextCursor words_;
  const std::string& name_;
  const MeshLimits& limits_;
  FileMesh mesh_;
  bool in_solid_ = false, in_facet_ = false;
  int corners_ = 0;
};

}  // namespace

std::string spaceNote(std::string_view text) {
  constexpr std::string_view kKey = "SPACE=";
  const std::size_t at = text.find(kKey);
  if (at == std::string_view::npos) return {};
  const std::string_view value = text.substr(at + kKey.size());
  const auto is_part = [](char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '-'; };
  return std::string(value.begin(), std::ranges::find_if_not(value, is_part));
}

std::string addPolygon(FileMesh& mesh, const std::vector<std::uint64_t>& corners, std::uint64_t points,
                       const MeshLimits& limits) {
  if (corners.size() < 3) return fmt::format("a face has {} corners (allowed: at least 3)", corners.size());
  for (const std::uint64_t corner : corners)
    if (corner >= points)
      return fmt::format("a face names point {} of {}, counted from 1", corner + 1, points);
  if (mesh.triangles.size() + corners.size() - 2 > limits.triangles)
    return fmt::format("more than {} triangles", limits.triangles);
  for (std::size_t i = 2; i < corners.size(); ++i)
    mesh.triangles.push_back({static_cast<std::uint32_t>(corners[0]),
                              static_cast<std::uint32_t>(corners[i - 1]),
                              static_cast<std::uint32_t>(corners[i])});
  return {};
}

base::Result<FileMesh> readStl(std::string_view bytes, const std::string& name, const MeshLimits& limits) {
  // Many programs begin binary files with "solid" too, so the size decides.
  const bool has_bytes_of_no_text = hasBytesOfNoText(bytes);
  if (bytes.size() >= kHeadBytes) {
    const std::uint64_t facets = numberAt<std::uint32_t>(bytes.data() + kHeaderBytes, std::endian::little);
    const std::uint64_t expected = kHeadBytes + kFacetBytes * facets;
    if (bytes.size() == expected || (bytes.size() > expected && has_bytes_of_no_text))
      return readBinary(bytes, facets, name, limits);
    if (has_bytes_of_no_text)
      return refused(fmt::format("{}: byte {}", name, kHeaderBytes),
                     fmt::format("the header announces {} triangles, which take {} bytes; the file has {}",
                                 facets, expected, bytes.size()),
                     "the file is truncated or not STL: write it again");
  }
  if (has_bytes_of_no_text || bytes.empty())
    return refused(name,
                   fmt::format("{} bytes are too few for a binary STL file (at least 84)", bytes.size()),
                   "the file is truncated or not STL: write it again");
  return AsciiStl(bytes, name, limits).read();
}

}  // namespace hapticd::solids

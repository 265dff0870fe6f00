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
constexpr const char* kOneFrame = "export all bodies in the same frame";

std::string tooMany(std::uint64_t triangles, const MeshLimits& limits) {
  return fmt::format("{} triangles (allowed: at most {})", triangles, limits.triangles);
}

/// Bodies one behind the other, as programs append them.
class BinaryStl {
 public:
  BinaryStl(std::string_view bytes, const std::string& name, const MeshLimits& limits)
      : bytes_(bytes), name_(name), limits_(limits) {}

  base::Result<FileMesh> read() {
    mesh_.format = "binary STL";
    do {
      if (auto done = takeBody(); !done) return std::unexpected(done.error());
    } while (bytes_.size() - at_ >= kFacetBytes &&
             bytes_.find_first_not_of('\0', at_) != std::string_view::npos);
    if (at_ < bytes_.size())
      mesh_.warnings.push_back(fmt::format("{} bytes behind the last of {} triangles are ignored",
                                           bytes_.size() - at_, mesh_.triangles.size()));
    return std::move(mesh_);
  }

 private:
  base::Result<void> takeBody() {
    const std::string_view body = bytes_.substr(at_), header = body.substr(0, kHeaderBytes);
    const std::uint64_t facets =
        body.size() < kHeadBytes ? 0
                                 : numberAt<std::uint32_t>(body.data() + kHeaderBytes, std::endian::little);
    const std::uint64_t expected = kHeadBytes + kFacetBytes * facets;
    // what follows a body is another one only if its header is a text
    const bool is_header = at_ == 0 || std::ranges::none_of(header, [](char c) { return c < 0; });
    if (facets == 0 || expected > body.size() || !is_header)
      return refused(
          fmt::format("{}: byte {}", name_, at_ + kHeaderBytes),
          at_ == 0 ? fmt::format("the header announces {} triangles, which take {} bytes; the file has {}",
                                 facets, expected, body.size())
                   : fmt::format("{} bytes follow the {} triangles that the header announces, and are no "
                                 "further body",
                                 body.size(), mesh_.triangles.size()),
          "the file is damaged or not STL: write it again");
    if (mesh_.triangles.size() + facets > limits_.triangles)
      return refused(name_, tooMany(mesh_.triangles.size() + facets, limits_),
                     "simplify the mesh before it is exported");
    if (const std::string problem = takeSpaceNote(mesh_, header); !problem.empty())
      return refused(fmt::format("{}: byte {}", name_, at_), problem, kOneFrame);
    for (std::uint64_t facet = 0; facet < facets; ++facet) {
      // the normal (12 bytes) follows from the corners; the last two bytes are a colour or garbage
      const std::uint64_t at = at_ + kHeadBytes + kFacetBytes * facet + 12;
      std::array<double, 9> numbers{};
      for (std::size_t i = 0; i < numbers.size(); ++i) {
        numbers[i] = static_cast<double>(numberAt<float>(bytes_.data() + at + 4 * i, std::endian::little));
        if (!(std::abs(numbers[i]) <= kMaxCoordinate))
          return refused(
              fmt::format("{}: byte {}", name_, at + 4 * i),
              fmt::format("a coordinate of triangle {} is {} (allowed: -1e9..1e9)", facet + 1, numbers[i]),
              kWriteAgain);
      }
      const auto first = static_cast<std::uint32_t>(mesh_.points.size());
      for (std::size_t corner = 0; corner < 3; ++corner)
        mesh_.points.push_back({numbers[3 * corner], numbers[3 * corner + 1], numbers[3 * corner + 2]});
      mesh_.triangles.push_back({first, first + 1, first + 2});
    }
    at_ += expected;
    return {};
  }

  std::string_view bytes_;
  const std::string& name_;
  const MeshLimits& limits_;
  std::size_t at_ = 0;
  FileMesh mesh_;
};

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
    const std::string problem = takeSpaceNote(mesh_, words_.restOfLine());
    if (!problem.empty()) return fault(problem, kOneFrame);
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

base::Result<FileMesh> readStl(std::string_view bytes, const std::string& name, const MeshLimits& limits) {
  // Many programs begin binary files with "solid" too, and names in texts are in any encoding: a text is what
  // has neither the size of a binary file nor a NUL.
  const bool has_count = bytes.size() >= kHeadBytes;
  const std::uint64_t facets =
      has_count ? numberAt<std::uint32_t>(bytes.data() + kHeaderBytes, std::endian::little) : 0;
  const bool has_size = has_count && bytes.size() == kHeadBytes + kFacetBytes * facets;
  if (has_size || bytes.find('\0') != std::string_view::npos) return BinaryStl(bytes, name, limits).read();
  return AsciiStl(bytes, name, limits).read();
}

}  // namespace hapticd::solids

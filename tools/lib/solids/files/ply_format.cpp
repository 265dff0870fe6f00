// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "config/base/value_text.h"
#include "tools/lib/solids/files/mesh_formats.h"
#include "tools/lib/solids/files/source_file.h"

namespace hapticd::solids {
namespace {

enum class Encoding { ascii, little, big };

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct ScalarName {
  std::string_view name;
  Scalar scalar;
  std::uint64_t bytes;
};
constexpr ScalarName kScalars[] = {
    {"char", Scalar::int8, 1},      {"int8", Scalar::int8, 1},       {"uchar", Scalar::uint8, 1},
    {"uint8", Scalar::uint8, 1},    {"short", Scalar::int16, 2},     {"int16", Scalar::int16, 2},
    {"ushort", Scalar::uint16, 2},  {"uint16", Scalar::uint16, 2},   {"int", Scalar::int32, 4},
    {"int32", Scalar::int32, 4},    {"uint", Scalar::uint32, 4},     {"uint32", Scalar::uint32, 4},
    {"float", Scalar::float32, 4},  {"float32", Scalar::float32, 4}, {"double", Scalar::float64, 8},
    {"float64", Scalar::float64, 8}};

const ScalarName* scalarOf(std::string_view name) {
  const auto* found = std::ranges::find(kScalars, name, &ScalarName::name);
  return found == std::end(kScalars) ? nullptr : found;
}

std::uint64_t bytesOf(Scalar scalar) {
  return std::ranges::find(kScalars, scalar, &ScalarName::scalar)->bytes;
}

struct Property {
  std::string name;
  Scalar type{};
  std::optional<Scalar> count_type;  ///< of a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  /// Bytes that each of them takes at least, also as words with a blank between.
  std::uint64_t leastBytes(Encoding encoding) const {
    std::uint64_t sum = 0;
    for (const Property& property : properties)
      sum += encoding == Encoding::ascii ? 1 : bytesOf(property.count_type.value_or(property.type));
    return sum;
  }
};

double numberOf(Scalar scalar, const char* bytes, std::endian order) {
  switch (scalar) {
    case Scalar::int8:
      return numberAt<std::int8_t>(bytes, order);
    case Scalar::uint8:
      return numberAt<std::uint8_t>(bytes, order);
    case Scalar::int16:
      return numberAt<std::int16_t>(bytes, order);
    case Scalar::uint16:
      return numberAt<std::uint16_t>(bytes, order);
    case Scalar::int32:
      return numberAt<std::int32_t>(bytes, order);
    case Scalar::uint32:
      return numberAt<std::uint32_t>(bytes, order);
    case Scalar::float32:
      return static_cast<double>(numberAt<float>(bytes, order));
    case Scalar::float64:
      break;
  }
  return numberAt<double>(bytes, order);
}

class PlyFile {
 public:
  PlyFile(std::string_view bytes, const std::string& name, const MeshLimits& limits)
      : bytes_(bytes), text_(bytes), name_(name), limits_(limits), polygons_(mesh_, limits, bytes.size()) {}

  base::Result<FileMesh> read() {
    if (auto done = readHeader(); !done) return std::unexpected(done.error());
    if (auto done = checkElements(); !done) return std::unexpected(done.error());
    at_ = text_.at();
    for (const Element& element : elements_) {
      if (auto done = readElement(element); !done) return std::unexpected(done.error());
    }
    return std::move(mesh_);
  }

 private:
  std::unexpected<base::Error> faultInHeader(std::string what, std::string remedy) const {
    return refused(fmt::format("{}:{}", name_, text_.line()), std::move(what), std::move(remedy));
  }

  std::unexpected<base::Error> fault(std::string what, std::string remedy) const {
    if (encoding_ == Encoding::ascii) return faultInHeader(std::move(what), std::move(remedy));
    return refused(fmt::format("{}: byte {}", name_, at_), std::move(what), std::move(remedy));
  }

  base::Result<void> readHeader() {
    if (text_.nextLine() != "ply")
      return faultInHeader("does not begin with a line 'ply'", "check that the file is a PLY file");
    bool has_format = false;
    while (const auto line = text_.nextLine()) {
      std::string_view rest = *line;
      const std::string_view keyword = takeWord(rest);
      base::Result<void> done;
      if (keyword == "end_header") {
        if (!has_format) return faultInHeader("the header has no 'format'", "write the file again");
        return {};
      }
      if (keyword == "format") {
        done = takeFormat(rest);
        has_format = true;
      } else if (keyword == "comment") {
        const std::string problem = takeSpaceNote(mesh_, rest);
        if (!problem.empty()) done = faultInHeader(problem, "export all bodies in the same frame");
      } else if (keyword == "element") {
        done = takeElementLine(rest);
      } else if (keyword == "property") {
        done = takeProperty(rest);
      } else if (keyword != "obj_info" && !keyword.empty()) {
        if (mesh_.warnings.empty())  // one for all of them
          mesh_.warnings.push_back(fmt::format("{} in the header is not a word of PLY: the line is ignored",
                                               base::inQuotes(keyword)));
      }
      if (!done) return done;
    }
    return faultInHeader("the header has no 'end_header'", "the file is truncated: write it again");
  }

  base::Result<void> takeFormat(std::string_view rest) {
    const std::string_view word = takeWord(rest);
    if (word == "ascii") {
      encoding_ = Encoding::ascii;
      mesh_.format = "ASCII PLY";
    } else if (word == "binary_little_endian" || word == "binary_big_endian") {
      encoding_ = word == "binary_big_endian" ? Encoding::big : Encoding::little;
      mesh_.format = "binary PLY";
    } else {
      return faultInHeader(
          fmt::format("the format is {} (allowed: ascii, binary_little_endian, binary_big_endian)",
                      base::inQuotes(word)),
          "write the file in one of these");
    }
    return {};
  }

  base::Result<void> takeElementLine(std::string_view rest) {
    constexpr std::size_t kMaxElements = 64;
    Element element;
    element.name = takeWord(rest);
    const std::string_view count = takeWord(rest);
    const auto number = base::numberFrom<std::uint64_t>(count);
    if (!number || elements_.size() >= kMaxElements ||
        std::ranges::find(elements_, element.name, &Element::name) != elements_.end())
      return faultInHeader(
          fmt::format("{} elements {} (allowed: a whole number, of at most {} kinds, each once)",
                      base::inQuotes(count), base::inQuotes(element.name), kMaxElements),
          "write the file again");
    element.count = *number;
    elements_.push_back(std::move(element));
    return {};
  }

  base::Result<void> takeProperty(std::string_view rest) {
    constexpr std::size_t kMaxProperties = 256;
    if (elements_.empty())
      return faultInHeader("a property before the first element", "write the file again");
    Property property;
    std::string_view type = takeWord(rest);
    if (type == "list") {
      const std::string_view count_type = takeWord(rest);
      const ScalarName* scalar = scalarOf(count_type);
      if (scalar == nullptr || scalar->scalar == Scalar::float32 || scalar->scalar == Scalar::float64)
        return faultInHeader(
            fmt::format("a list is counted in {} (allowed: char to uint)", base::inQuotes(count_type)),
            "write the file again");
      property.count_type = scalar->scalar;
      type = takeWord(rest);
    }
    const ScalarName* scalar = scalarOf(type);
    if (scalar == nullptr || elements_.back().properties.size() >= kMaxProperties)
      return faultInHeader(fmt::format("a property of type {} (allowed: char to double, at most {} of them)",
                                       base::inQuotes(type), kMaxProperties),
                           "write the file again");
    property.type = scalar->scalar;
    property.name = takeWord(rest);
    elements_.back().properties.push_back(std::move(property));
    return {};
  }

  /// Before anything is allocated: whether the file can hold what its header announces.
  base::Result<void> checkElements() const {
    for (const Element& element : elements_) {
      const std::uint64_t left = bytes_.size() - text_.at();
      const std::uint64_t each = element.leastBytes(encoding_);
      // so many elements without properties would only take time
      const std::uint64_t most = each == 0 ? 0 : left / each + 1;
      if (element.count > most)
        return faultInHeader(fmt::format("the header announces {} of {}, and {} bytes follow it",
                                         element.count, base::inQuotes(element.name), left),
                             "the file is truncated: write it again");
      if (element.name == "vertex" && element.count > limits_.points)
        return faultInHeader(fmt::format("{} points (allowed: at most {})", element.count, limits_.points),
                             "simplify the mesh");
      if (element.name == "face" && element.count > limits_.triangles)
        return faultInHeader(fmt::format("{} faces (allowed: at most {})", element.count, limits_.triangles),
                             "simplify the mesh");
      if (element.name == "tristrips" && element.count > 0)
        return faultInHeader("triangle strips are not supported", "write the mesh with faces");
    }
    if (std::ranges::find(elements_, "vertex", &Element::name) == elements_.end())
      return faultInHeader("the header has no element 'vertex'", "write the file again");
    return {};
  }

  std::optional<double> nextNumber(Scalar type) {
    if (encoding_ == Encoding::ascii) {
      const auto word = text_.nextWord();
      return word ? base::numberFrom<double>(*word) : std::nullopt;
    }
    const std::uint64_t size = bytesOf(type);
    if (bytes_.size() - at_ < size) return std::nullopt;
    const double number = numberOf(type, bytes_.data() + at_,
                                   encoding_ == Encoding::big ? std::endian::big : std::endian::little);
    at_ += size;
    return number;
  }

  base::Result<void> readElement(const Element& element) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    const auto place = [&](std::string_view name) {
      const auto found = std::ranges::find(element.properties, name, &Property::name);
      return static_cast<std::size_t>(found - element.properties.begin());
    };
    const std::array<std::size_t, 3> axes{place("x"), place("y"), place("z")};
    const std::size_t end = element.properties.size();
    const std::size_t list = std::min(place("vertex_indices"), place("vertex_index"));
    if (is_vertex && std::ranges::any_of(axes, [&](std::size_t axis) {
          return axis == end || element.properties[axis].count_type.has_value();
        }))
      return fault("the points have no x, y and z", "write the file again");
    if (is_face && element.count > 0 && (list == end || !element.properties[list].count_type))
      return fault("the faces have no list 'vertex_indices' or 'vertex_index'", "write the file again");
    if (is_face && element.count > 0 && mesh_.points.empty())
      return fault("the points do not stand before the faces", "write the file again");
    for (std::uint64_t i = 0; i < element.count; ++i) {
      std::array<double, 3> point{};
      for (std::size_t p = 0; p < end; ++p) {
        numbers_.clear();
        if (!readProperty(element.properties[p]))
          return fault(fmt::format("{} {} of {} is damaged or missing", element.name, i + 1, element.count),
                       "the file is truncated or damaged: write it again");
        for (std::size_t axis = 0; is_vertex && axis < 3; ++axis)
          if (axes[axis] == p) point[axis] = numbers_[0];
        if (!is_face || p != list) continue;
        const std::string problem = takeFace();
        if (!problem.empty())
          return fault(fmt::format("face {}: {}", i + 1, problem), "write the file again");
      }
      // in a text each begins a line; some programs write more numbers into it than the header says
      if (encoding_ == Encoding::ascii) text_.restOfLine();
      if (!is_vertex) continue;
      if (!std::ranges::all_of(point, [](double number) { return std::abs(number) <= kMaxCoordinate; }))
        return fault(
            fmt::format("point {} is ({}, {}, {}) (allowed: -1e9..1e9)", i + 1, point[0], point[1], point[2]),
            "write the file again");
      mesh_.points.push_back({point[0], point[1], point[2]});
    }
    return {};
  }

  /// Reads a number, or all of a list, into numbers_.
  bool readProperty(const Property& property) {
    std::uint64_t count = 1;
    if (property.count_type) {
      const auto number = nextNumber(*property.count_type);
      if (!number || !(*number >= 0 && *number <= 4e9)) return false;
      count = static_cast<std::uint64_t>(*number);
      if (count > bytes_.size()) return false;
    }
    for (std::uint64_t i = 0; i < count; ++i) {
      const auto number = nextNumber(property.type);
      if (!number) return false;
      numbers_.push_back(*number);
    }
    return true;
  }

  std::string takeFace() {
    std::vector<std::uint64_t> corners;
    corners.reserve(numbers_.size());
    const std::uint64_t points = mesh_.points.size();
    for (const double number : numbers_) {
      if (!(number >= 0 && number < static_cast<double>(points)) || number != std::floor(number))
        return fmt::format("its corner is {} (allowed: 0..{})", number, points == 0 ? 0 : points - 1);
      corners.push_back(static_cast<std::uint64_t>(number));
    }
    return polygons_.add(corners);
  }

  std::string_view bytes_;
  TextCursor text_;
  std::size_t at_ = 0;
  const std::string& name_;
  const MeshLimits& limits_;
  Encoding encoding_ = Encoding::ascii;
  std::vector<Element> elements_;
  std::vector<double> numbers_;
  FileMesh mesh_;
  Polygons polygons_;
};

}  // namespace

base::Result<FileMesh> readPly(std::string_view bytes, const std::string& name, const MeshLimits& limits) {
  return PlyFile(bytes, name, limits).read();
}

}  // namespace hapticd::solids

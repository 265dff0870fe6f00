// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

#include "config/base/value_text.h"
#include "tools/lib/solids/files/label_reader.h"

namespace hapticd::solids {
namespace {

constexpr const char* kSaveAsOne = "save the image as one file, .nrrd";
constexpr const char* kSaveAgain = "save the segmentation again as .seg.nrrd";

struct TypeName {
  std::string_view name;
  VoxelType type;
};
constexpr TypeName kTypes[] = {{"signed char", VoxelType::int8},
                               {"int8", VoxelType::int8},
                               {"int8_t", VoxelType::int8},
                               {"uchar", VoxelType::uint8},
                               {"unsigned char", VoxelType::uint8},
                               {"uint8", VoxelType::uint8},
                               {"uint8_t", VoxelType::uint8},
                               {"short", VoxelType::int16},
                               {"short int", VoxelType::int16},
                               {"signed short", VoxelType::int16},
                               {"signed short int", VoxelType::int16},
                               {"int16", VoxelType::int16},
                               {"int16_t", VoxelType::int16},
                               {"ushort", VoxelType::uint16},
                               {"unsigned short", VoxelType::uint16},
                               {"unsigned short int", VoxelType::uint16},
                               {"uint16", VoxelType::uint16},
                               {"uint16_t", VoxelType::uint16},
                               {"int", VoxelType::int32},
                               {"signed int", VoxelType::int32},
                               {"int32", VoxelType::int32},
                               {"int32_t", VoxelType::int32},
                               {"uint", VoxelType::uint32},
                               {"unsigned int", VoxelType::uint32},
                               {"uint32", VoxelType::uint32},
                               {"uint32_t", VoxelType::uint32},
                               {"longlong", VoxelType::int64},
                               {"long long", VoxelType::int64},
                               {"long long int", VoxelType::int64},
                               {"signed long long", VoxelType::int64},
                               {"signed long long int", VoxelType::int64},
                               {"int64", VoxelType::int64},
                               {"int64_t", VoxelType::int64},
                               {"ulonglong", VoxelType::uint64},
                               {"unsigned long long", VoxelType::uint64},
                               {"unsigned long long int", VoxelType::uint64},
                               {"uint64", VoxelType::uint64},
                               {"uint64_t", VoxelType::uint64},
                               {"float", VoxelType::float32},
                               {"double", VoxelType::float64}};

struct Field {
  std::string value;
  std::size_t line = 0;
};

/// Words of a field, separated by white space.
std::vector<std::string_view> wordsOf(std::string_view text) {
  std::vector<std::string_view> words;
  for (std::string_view word = takeWord(text); !word.empty(); word = takeWord(text)) words.push_back(word);
  return words;
}

/// A vector "(1,2,3)" at the begin of `text`, or "none", taken off it.
struct VectorOrNone {
  bool is_valid = false, is_none = false;
  rt::Vec3 vector;
};
VectorOrNone takeVector(std::string_view& text) {
  text = trimmed(text);
  if (text.starts_with("none")) {
    text.remove_prefix(4);
    return {true, true, {}};
  }
  const std::size_t end = text.find(')');
  if (!text.starts_with('(') || end == std::string_view::npos) return {};
  std::string_view inside = text.substr(1, end - 1);
  text.remove_prefix(end + 1);
  std::array<double, 3> numbers{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t comma = inside.find(',');
    if ((comma == std::string_view::npos) != (i == 2)) return {};
    const auto number = coordinateFrom(trimmed(inside.substr(0, comma)));
    if (!number) return {};
    numbers[i] = *number;
    inside.remove_prefix(i == 2 ? inside.size() : comma + 1);
  }
  return {true, false, {numbers[0], numbers[1], numbers[2]}};
}

class NrrdFile {
 public:
  NrrdFile(std::string_view bytes, const std::string& name, std::optional<Frame> frame,
           const LabelLimits& limits, const DetachedFile& detached)
      : bytes_(bytes), lines_(bytes), name_(name), frame_(frame), limits_(limits), detached_(detached) {}

  base::Result<FileLabels> read() {
    labels_.format = "NRRD";
    for (const auto step : {&NrrdFile::readHeader, &NrrdFile::takeShape, &NrrdFile::takeSpace,
                            &NrrdFile::takeSegments, &NrrdFile::takeVoxels}) {
      if (auto done = (this->*step)(); !done) return std::unexpected(done.error());
    }
    return std::move(labels_);
  }

 private:
  std::unexpected<base::Error> fault(std::size_t line, std::string what, std::string remedy) const {
    return refused(fmt::format("{}:{}", name_, line), std::move(what), std::move(remedy));
  }

  /// A field's value, of any of its names; empty where it is missing.
  Field field(std::string_view name, std::string_view other_name = "") const {
    auto found = fields_.find(std::string(name));
    if (found == fields_.end()) found = fields_.find(std::string(other_name));
    return found == fields_.end() ? Field{} : found->second;
  }

  base::Result<void> readHeader() {
    const std::string_view magic = lines_.nextLine().value_or("");
    if (magic.size() != 8 || !magic.starts_with("NRRD000") || magic[7] < '1' || magic[7] > '5')
      return fault(
          1, fmt::format("begins with {} (allowed: NRRD0001..NRRD0005)", base::inQuotes(magic.substr(0, 8))),
          "check that the file is an NRRD file");
    constexpr std::size_t kMaxLines = 100'000;
    while (const auto line = lines_.nextLine()) {
      if (line->empty()) return {};
      if (lines_.line() > kMaxLines) break;
      if (line->starts_with('#')) continue;
      const std::size_t colon = line->find(':');
      if (colon == std::string_view::npos)
        return fault(lines_.line(),
                     fmt::format("{} is neither 'field: value' nor 'key:=value'", base::inQuotes(*line)),
                     kSaveAgain);
      const bool is_key = line->substr(colon).starts_with(":=");
      const std::string value(trimmed(line->substr(colon + (is_key ? 2 : 1))));
      if (is_key)
        keys_[std::string(trimmed(line->substr(0, colon)))] = {value, lines_.line()};
      else
        fields_[lowerCase(trimmed(line->substr(0, colon)))] = {value, lines_.line()};
      if (lowerCase(line->substr(0, colon)) == "data file" || lowerCase(line->substr(0, colon)) == "datafile")
        if (value.starts_with("LIST")) return {};
    }
    // a header alone may end without an empty line where the voxels are in another file
    if (!field("data file", "datafile").value.empty()) return {};
    return fault(lines_.line(), "the header has no empty line at its end",
                 "the file is truncated: copy it again");
  }

  base::Result<void> takeShape() {
    const Field type = field("type");
    const std::string lower = lowerCase(type.value);
    const auto* known = std::ranges::find(kTypes, std::string_view(lower), &TypeName::name);
    if (known == std::end(kTypes))
      return fault(
          type.line,
          fmt::format("the type is {} (allowed: integers, float, double)", base::inQuotes(type.value)),
          kSaveAgain);
    labels_.type = known->type;
    const Field endian = field("endian");
    if (endian.value == "big" || endian.value == "little")
      labels_.order = endian.value == "big" ? std::endian::big : std::endian::little;
    else if (bytesOf(labels_.type) > 1)
      return fault(
          endian.line,
          fmt::format("the field 'endian' is {} (allowed: little, big)", base::inQuotes(endian.value)),
          kSaveAgain);
    const Field dimension = field("dimension"), sizes = field("sizes");
    const auto axes = base::numberFrom<int>(dimension.value);
    if (axes != 3 && axes != 4)
      return fault(dimension.line,
                   fmt::format("the dimension is {} (allowed: 3, and 4 with a list axis)",
                               base::inQuotes(dimension.value)),
                   "export a segmentation, not a sequence or a colour image");
    std::vector<std::int64_t> counts;
    for (const std::string_view word : wordsOf(sizes.value)) {
      const auto count = base::numberFrom<std::int64_t>(word);
      if (!count || *count < 1 || *count > limits_.voxels_per_axis || counts.size() >= 4)
        return fault(
            sizes.line,
            fmt::format("a size is {} (allowed: 1..{})", base::inQuotes(word), limits_.voxels_per_axis),
            "crop the image");
      counts.push_back(*count);
    }
    if (counts.size() != static_cast<std::size_t>(*axes))
      return fault(sizes.line, fmt::format("{} sizes for {} axes", counts.size(), *axes), kSaveAgain);
    has_list_ = axes == 4;
    if (has_list_) {
      labels_.layers = static_cast<std::size_t>(counts.front());
      counts.erase(counts.begin());
    }
    std::ranges::copy(counts, labels_.sizes.begin());
    return checkKinds();
  }

  base::Result<void> checkKinds() {
    const Field kinds = field("kinds");
    if (!has_list_ || kinds.value.empty()) return {};
    const std::vector<std::string_view> words = wordsOf(kinds.value);
    const std::string first = words.empty() ? "" : lowerCase(words.front());
    if (first == "list" || first == "none" || first == "???") return {};
    return fault(
        kinds.line,
        fmt::format("the first of four axes is of the kind {} (allowed: list)", base::inQuotes(first)),
        "export a segmentation, whose layers are the first axis");
  }

  base::Result<void> takeSpace() {
    const Field space = field("space"), directions = field("space directions"),
                origin = field("space origin");
    const std::string lower = lowerCase(space.value);
    if (lower == "left-posterior-superior" || lower == "lps")
      labels_.frame = Frame::lps;
    else if (lower == "right-anterior-superior" || lower == "ras")
      labels_.frame = Frame::ras;
    else if (frame_ && lower.empty()) {
      labels_.frame = *frame_;
      labels_.frame_from = KnownFrom::option;
    } else {
      return fault(
          std::max<std::size_t>(space.line, 1),
          lower.empty() ? std::string("the header has no field 'space', so its frame is unknown")
                        : fmt::format("the space is {} (allowed: left-posterior-superior, "
                                      "right-anterior-superior)",
                                      base::inQuotes(space.value)),
          lower.empty() ? "state the frame, LPS or RAS" : "save the image with 3D Slicer, which writes LPS");
    }
    if (auto done = directions.value.empty() ? takeSpacings() : takeDirections(directions); !done)
      return done;
    if (auto done = takeOrigin(origin, !directions.value.empty()); !done) return done;
    return takeUnits();
  }

  base::Result<void> takeDirections(const Field& directions) {
    std::string_view rest = directions.value;
    if (has_list_) {
      const VectorOrNone list = takeVector(rest);
      if (!list.is_valid || !list.is_none)
        return fault(directions.line, "the first of four axes has a direction (allowed: none)",
                     "export a segmentation, whose layers are the first axis");
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const VectorOrNone step = takeVector(rest);
      if (!step.is_valid || step.is_none)
        return fault(directions.line,
                     fmt::format("the direction of axis {} is not a vector of three numbers", axis + 1),
                     kSaveAgain);
      labels_.steps_mm[axis] = inLps(step.vector, labels_.frame);
    }
    if (!trimmed(rest).empty())
      return fault(directions.line,
                   fmt::format("{} behind the last direction", base::inQuotes(trimmed(rest))), kSaveAgain);
    return {};
  }

  base::Result<void> takeSpacings() {
    const Field spacings = field("spacings");
    std::vector<std::string_view> words = wordsOf(spacings.value);
    if (has_list_ && words.size() == 4) words.erase(words.begin());
    if (!frame_ || words.size() != 3)
      return fault(std::max<std::size_t>(spacings.line, 1), "the header has no field 'space directions'",
                   "save the image with 3D Slicer; or state the frame of a file that has 'spacings'");
    std::array<double, 3> numbers{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto number = coordinateFrom(words[axis]);
      if (!number)
        return fault(spacings.line,
                     fmt::format("a spacing is {} (allowed: a number)", base::inQuotes(words[axis])),
                     kSaveAgain);
      numbers[axis] = *number;
    }
    labels_.steps_mm = {inLps({numbers[0], 0, 0}, labels_.frame), inLps({0, numbers[1], 0}, labels_.frame),
                        inLps({0, 0, numbers[2]}, labels_.frame)};
    return {};
  }

  base::Result<void> takeOrigin(const Field& origin, bool is_needed) {
    std::string_view rest = origin.value;
    const VectorOrNone place = takeVector(rest);
    if (place.is_valid && !place.is_none && trimmed(rest).empty()) {
      labels_.origin_mm = inLps(place.vector, labels_.frame);
      return {};
    }
    if (origin.value.empty() && !is_needed) {
      labels_.warnings.emplace_back(
          "the header has no field 'space origin': the first voxel is placed at 0, 0, 0");
      return {};
    }
    return fault(std::max<std::size_t>(origin.line, 1),
                 fmt::format("the field 'space origin' is {} (allowed: three numbers in parentheses)",
                             base::inQuotes(origin.value)),
                 "save the image with 3D Slicer");
  }

  base::Result<void> takeUnits() {
    const Field units = field("space units");
    std::string text = units.value;
    std::ranges::replace(text, '"', ' ');
    for (const std::string_view word : wordsOf(text))
      if (word != "mm" && word != "millimeter" && word != "none")
        return fault(units.line, fmt::format("a unit is {} (allowed: mm)", base::inQuotes(word)),
                     "save the image in millimetres");
    return {};
  }

  const Field* key(const std::string& name) const {
    const auto found = keys_.find(name);
    return found == keys_.end() ? nullptr : &found->second;
  }

  base::Result<void> takeSegments() {
    for (const char* name : {"Segmentation_SourceRepresentation", "Segmentation_MasterRepresentation"}) {
      const Field* source = key(name);
      if (source != nullptr && source->value.starts_with("Fractional"))
        return fault(source->line, "the segmentation is a fractional label map (allowed: Binary labelmap)",
                     "convert it to a binary label map in 3D Slicer");
    }
    constexpr std::size_t kMaxSegments = 10'000;
    for (std::size_t number = 0; number < kMaxSegments; ++number) {
      const std::string prefix = fmt::format("Segment{}_", number);
      const Field* value = key(prefix + "LabelValue");
      const Field* id = key(prefix + "ID");
      const Field* name = key(prefix + "Name");
      const Field* layer = key(prefix + "Layer");
      if (value == nullptr && id == nullptr && name == nullptr) break;
      Segment segment;
      if (id != nullptr) segment.id = id->value;
      segment.name = name != nullptr ? name->value : segment.id;
      // before 3D Slicer 4.11 each segment was a layer of its own, of ones
      segment.value = 1;
      segment.layer = layer == nullptr && value == nullptr ? number : 0;
      if (value != nullptr) {
        const auto read = base::numberFrom<std::int64_t>(value->value);
        if (!read)
          return fault(
              value->line,
              fmt::format("a label value is {} (allowed: a whole number)", base::inQuotes(value->value)),
              kSaveAgain);
        segment.value = *read;
      }
      if (layer != nullptr)
        segment.layer = base::numberFrom<std::size_t>(layer->value).value_or(labels_.layers);
      if (segment.layer >= labels_.layers)
        return fault(layer != nullptr ? layer->line : (id != nullptr ? id : name)->line,
                     fmt::format("segment {} is in the layer {} (allowed: 0..{})", number,
                                 layer != nullptr ? base::inQuotes(layer->value) : std::to_string(number),
                                 labels_.layers - 1),
                     kSaveAgain);
      labels_.segments.push_back(std::move(segment));
    }
    return {};
  }

  base::Result<void> takeVoxels() {
    const auto needed = checkedBytes(labels_, name_, limits_);
    if (!needed) return std::unexpected(needed.error());
    const Field file = field("data file", "datafile");
    if (!file.value.empty()) {
      const std::filesystem::path path(file.value);
      const bool leaves = path.is_absolute() || std::ranges::find(path, "..") != path.end();
      if (leaves || file.value.find('%') != std::string::npos || file.value.starts_with("LIST"))
        return fault(
            file.line,
            fmt::format("the data file is {} (allowed: one file in the folder of the header or below)",
                        base::inQuotes(file.value)),
            kSaveAsOne);
      if (!detached_) return fault(file.line, "the voxels are in another file", kSaveAsOne);
      auto content = detached_(file.value);
      if (!content) return std::unexpected(content.error());
      labels_.detached = std::move(*content);
    } else {
      labels_.attached = bytes_.substr(lines_.at());
    }
    return skipTo(*needed);
  }

  /// Finds the first voxel.
  base::Result<void> skipTo(std::uint64_t needed) {
    const Field encoding = field("encoding");
    const std::string lower = lowerCase(encoding.value);
    labels_.is_gzip = lower == "gzip" || lower == "gz";
    if (!labels_.is_gzip && lower != "raw")
      return fault(std::max<std::size_t>(encoding.line, 1),
                   fmt::format("the encoding is {} (allowed: raw, gzip)", base::inQuotes(encoding.value)),
                   "save the image with or without compression, but as raw or gzip");
    const Field line_skip = field("line skip", "lineskip"), byte_skip = field("byte skip", "byteskip");
    const auto lines =
        line_skip.value.empty() ? 0 : base::numberFrom<std::int64_t>(line_skip.value).value_or(-1);
    const auto skip =
        byte_skip.value.empty() ? 0 : base::numberFrom<std::int64_t>(byte_skip.value).value_or(-2);
    const std::int64_t most = static_cast<std::int64_t>(limits_.file_bytes);
    if (lines < 0 || lines > most)
      return fault(line_skip.line,
                   fmt::format("'line skip' is {} (allowed: 0..{})", base::inQuotes(line_skip.value), most),
                   kSaveAgain);
    if (skip < (labels_.is_gzip ? 0 : -1) || skip > most)
      return fault(byte_skip.line,
                   fmt::format("'byte skip' is {} (allowed: 0..{}{})", base::inQuotes(byte_skip.value), most,
                               labels_.is_gzip ? "" : ", or -1: the voxels are the last bytes"),
                   kSaveAgain);
    std::size_t begin = 0;
    const std::string_view held = labels_.held();
    for (std::int64_t line = 0; line < lines && begin < held.size(); ++line)
      begin = std::min(held.find('\n', begin), held.size() - 1) + 1;
    if (labels_.detached.empty())
      labels_.attached.remove_prefix(begin);
    else
      labels_.detached.erase(0, begin);
    const std::size_t size = labels_.held().size();
    labels_.first_byte = skip >= 0 ? static_cast<std::uint64_t>(skip) : size - std::min(size, needed);
    return {};
  }

  std::string_view bytes_;
  TextCursor lines_;
  const std::string& name_;
  std::optional<Frame> frame_;
  const LabelLimits& limits_;
  const DetachedFile& detached_;
  std::map<std::string, Field> fields_, keys_;
  bool has_list_ = false;
  FileLabels labels_;
};

}  // namespace

base::Result<FileLabels> readNrrd(std::string_view bytes, const std::string& name, std::optional<Frame> frame,
                                  const LabelLimits& limits, const DetachedFile& detached) {
  return NrrdFile(bytes, name, frame, limits, detached).read();
}

}  // namespace hapticd::solids

// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/files/label_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <type_traits>
#include <utility>

#include "config/base/value_text.h"
#include "tools/lib/solids/files/source_file.h"

namespace hapticd::solids {
namespace {

/// A label map has fewer values; an image has more.
constexpr std::size_t kMaxValues = 5000;

using Place = std::array<std::int64_t, 3>;
using Bounds3 = std::array<std::array<std::int64_t, 2>, 3>;

/// The voxels of one value in one layer, from the first to the last along each axis.
struct Choice {
  std::int64_t value = 0;
  std::size_t layer = 0;
  std::string name;
  std::size_t voxels = 0;
  Bounds3 bounds{};
};

/// Nothing if a number is not a whole one, or larger than 64 bits with a sign hold.
template <typename Number>
std::optional<std::int64_t> wholeNumber(Number number) {
  if constexpr (std::is_floating_point_v<Number>) {
    const double nearest = std::round(static_cast<double>(number));
    if (!(std::abs(static_cast<double>(number) - nearest) <= 1e-3 && std::abs(nearest) <= 1e15))
      return std::nullopt;
    return static_cast<std::int64_t>(nearest);
  } else {
    if (!std::in_range<std::int64_t>(number)) return std::nullopt;
    return static_cast<std::int64_t>(number);
  }
}

/// Calls visit(layer, place, value) for the voxels in the order of the file until it returns false. Returns
/// whether bytes follow the last one. Errors: damaged, truncated, a voxel that is not a whole number.
template <typename Number, typename Visit>
base::Result<bool> visitVoxelsOf(const FileLabels& labels, const std::string& name, Visit visit) {
  ByteStream stream(labels.held(), labels.is_gzip, name);
  std::vector<char> piece(std::size_t{1} << 16);  // of whole numbers
  std::uint64_t skip = labels.first_byte, taken = 0;
  const std::uint64_t end =
      skip + static_cast<std::uint64_t>(labels.voxels()) * labels.layers * sizeof(Number);
  Place at{};
  std::size_t layer = 0;
  while (taken < end) {
    const std::span<char> room(piece.data(),
                               std::min<std::uint64_t>(piece.size(), (skip > 0 ? skip : end) - taken));
    const auto size = stream.read(room);
    if (!size) return std::unexpected(size.error());
    taken += *size;
    if (*size < room.size())
      return refused(name, fmt::format("the voxels end at byte {} of the data, which have {}", end, taken),
                     "the file is truncated: copy or save it again");
    if (skip > 0) {
      if (taken == skip) skip = 0;
      continue;
    }
    for (const char* bytes = room.data(); bytes != room.data() + room.size(); bytes += sizeof(Number)) {
      const auto value = wholeNumber(numberAt<Number>(bytes, labels.order));
      if (!value)
        return refused(name, fmt::format("voxel ({}, {}, {}) is not a whole number", at[0], at[1], at[2]),
                       "save the labels, not the image");
      if (!visit(layer, at, *value)) return false;
      if (++layer < labels.layers) continue;
      layer = 0;
      for (std::size_t axis = 0; axis < 3 && ++at[axis] == labels.sizes[axis]; ++axis) at[axis] = 0;
    }
  }
  const auto more = stream.read(std::span(piece).first(1));  // compares the checksum if there is none
  if (!more) return std::unexpected(more.error());
  return *more > 0;
}

template <typename Visit>
base::Result<bool> visitVoxels(const FileLabels& labels, const std::string& name, Visit visit) {
  switch (labels.type) {
    case VoxelType::int8:
      return visitVoxelsOf<std::int8_t>(labels, name, visit);
    case VoxelType::uint8:
      return visitVoxelsOf<std::uint8_t>(labels, name, visit);
    case VoxelType::int16:
      return visitVoxelsOf<std::int16_t>(labels, name, visit);
    case VoxelType::uint16:
      return visitVoxelsOf<std::uint16_t>(labels, name, visit);
    case VoxelType::int32:
      return visitVoxelsOf<std::int32_t>(labels, name, visit);
    case VoxelType::uint32:
      return visitVoxelsOf<std::uint32_t>(labels, name, visit);
    case VoxelType::int64:
      return visitVoxelsOf<std::int64_t>(labels, name, visit);
    case VoxelType::uint64:
      return visitVoxelsOf<std::uint64_t>(labels, name, visit);
    case VoxelType::float32:
      return visitVoxelsOf<float>(labels, name, visit);
    case VoxelType::float64:
      break;
  }
  return visitVoxelsOf<double>(labels, name, visit);
}

/// All values of each layer.
base::Result<std::vector<Choice>> valuesOf(FileLabels& labels, const std::string& name) {
  std::map<std::pair<std::size_t, std::int64_t>, Choice> found;
  std::vector<Choice*> last(labels.layers, nullptr);
  const auto has_more =
      visitVoxels(labels, name, [&](std::size_t layer, const Place& at, std::int64_t value) {
        Choice*& choice = last[layer];
        if (choice == nullptr || choice->value != value) {
          const Choice first{value, layer, "", 0, {{{at[0], at[0]}, {at[1], at[1]}, {at[2], at[2]}}}};
          choice = &found.try_emplace({layer, value}, first).first->second;
        }
        ++choice->voxels;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          choice->bounds[axis][0] = std::min(choice->bounds[axis][0], at[axis]);
          choice->bounds[axis][1] = std::max(choice->bounds[axis][1], at[axis]);
        }
        return found.size() <= kMaxValues;
      });
  if (!has_more) return std::unexpected(has_more.error());
  if (found.size() > kMaxValues)
    return refused(
        name,
        fmt::format("more than {} different values: this looks like an image, not like labels", kMaxValues),
        "save the segmentation as .seg.nrrd");
  if (*has_more) labels.warnings.emplace_back("bytes behind the last voxel are ignored");
  std::vector<Choice> values;
  for (const auto& [key, choice] : found) values.push_back(choice);
  return values;
}

std::string listed(std::vector<std::string> names) {
  constexpr std::size_t kMaxNames = 20;
  const std::size_t left_out = names.size() > kMaxNames ? names.size() - kMaxNames : 0;
  names.resize(names.size() - left_out);
  return fmt::format("{}{}", fmt::join(names, ", "),
                     left_out > 0 ? fmt::format(" and {} more", left_out) : "");
}

class LabelChooser {
 public:
  LabelChooser(const FileLabels& labels, const std::vector<Choice>& values, const std::string& name,
               const std::string& wanted)
      : labels_(labels), values_(values), name_(name), wanted_(wanted) {}

  base::Result<Choice> choose() {
    if (!labels_.segments.empty()) {
      if (const auto segment = bySegment()) return voxelsOf(*segment);
      if (ambiguous_)
        return refused(name_,
                       fmt::format("the label {} is that of several segments", base::inQuotes(wanted_)),
                       "name one of: " + listed(namesOfSegments()));
    }
    if (labels_.voxels() == 1)
      return refused(name_, "the segmentation is empty", "segment something, and save it");
    const auto number = base::numberFrom<std::int64_t>(wanted_);
    std::vector<Choice> fitting;
    for (const Choice& choice : values_)
      if (choice.value != 0 && (wanted_.empty() || choice.value == number)) fitting.push_back(choice);
    if (fitting.size() == 1) return fitting.front();
    return refused(name_, problemWith(fitting.size()), remedy());
  }

 private:
  base::Result<Choice> voxelsOf(const Segment& segment) const {
    const auto found = std::ranges::find_if(values_, [&](const Choice& choice) {
      return choice.layer == segment.layer && choice.value == segment.value;
    });
    if (found == values_.end())
      return refused(name_, fmt::format("the segment {} is empty", base::inQuotes(segment.name)),
                     "choose another label");
    Choice choice = *found;
    choice.name = segment.name;
    return choice;
  }

  std::vector<std::string> namesOfSegments() const {
    std::vector<std::string> names;
    for (const Segment& segment : labels_.segments) names.push_back(base::inQuotes(segment.name));
    return names;
  }

  std::optional<Segment> bySegment() {
    const auto number = base::numberFrom<std::int64_t>(wanted_);
    const std::string lower = lowerCase(wanted_);
    using Test = std::function<bool(const Segment&)>;
    for (const Test& fits : {Test([&](const Segment& s) { return s.name == wanted_; }),
                             Test([&](const Segment& s) { return s.id == wanted_; }),
                             Test([&](const Segment& s) { return lowerCase(s.name) == lower; }),
                             Test([&](const Segment& s) { return number && s.value == *number; }),
                             Test([&](const Segment&) { return wanted_.empty(); })}) {
      const auto count = std::ranges::count_if(labels_.segments, fits);
      ambiguous_ = count > 1;
      if (count > 1) return std::nullopt;
      if (count == 1) return *std::ranges::find_if(labels_.segments, fits);
    }
    return std::nullopt;
  }

  std::string problemWith(std::size_t fitting) const {
    if (fitting > 1 && !wanted_.empty())
      return fmt::format("the label {} occurs in several layers", base::inQuotes(wanted_));
    if (fitting > 1) return fmt::format("contains {} labels", fitting);
    if (wanted_.empty()) return "contains no label other than 0";
    return fmt::format("contains no label {}", base::inQuotes(wanted_));
  }

  std::string remedy() const {
    std::vector<std::string> names = namesOfSegments();
    if (names.empty())
      for (const Choice& choice : values_)
        if (choice.value != 0) names.push_back(std::to_string(choice.value));
    return names.empty() ? "segment something, and save it" : "name one of: " + listed(std::move(names));
  }

  const FileLabels& labels_;
  const std::vector<Choice>& values_;
  const std::string& name_;
  const std::string& wanted_;
  bool ambiguous_ = false;
};

base::Result<LabelMap> cropped(const FileLabels& labels, const Choice& choice, int margin,
                               const std::string& name) {
  LabelMap map;
  Place first{};
  map.origin_m = labels.origin_mm;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    first[axis] = choice.bounds[axis][0] - margin;
    map.size[axis] = static_cast<int>(choice.bounds[axis][1] - first[axis] + 1 + margin);
    map.steps_m[axis] = kMetresPerMillimetre * labels.steps_mm[axis];
    map.origin_m += static_cast<double>(first[axis]) * labels.steps_mm[axis];
  }
  map.origin_m = kMetresPerMillimetre * map.origin_m;
  const auto nx = static_cast<std::size_t>(map.size[0]), ny = static_cast<std::size_t>(map.size[1]);
  map.inside.assign(nx * ny * static_cast<std::size_t>(map.size[2]), 0);
  const auto done = visitVoxels(labels, name, [&](std::size_t layer, const Place& at, std::int64_t value) {
    if (value == choice.value && layer == choice.layer)
      map.inside[static_cast<std::size_t>(at[0] - first[0]) +
                 nx * (static_cast<std::size_t>(at[1] - first[1]) +
                       ny * static_cast<std::size_t>(at[2] - first[2]))] = 1;
    return true;
  });
  if (!done) return std::unexpected(done.error());
  return map;
}

LabelReport reportOf(FileLabels& labels, const Choice& choice) {
  const Bounds3& bounds = choice.bounds;
  LabelReport report{labels.format,
                     labels.frame,
                     labels.frame_from,
                     choice.name,
                     choice.value,
                     choice.layer,
                     choice.voxels,
                     {},
                     {},
                     {},
                     false,
                     std::move(labels.warnings)};
  constexpr double kMax = std::numeric_limits<double>::max();
  report.low_mm = {kMax, kMax, kMax};
  report.high_mm = {-kMax, -kMax, -kMax};
  for (unsigned corner = 0; corner < 8; ++corner) {
    rt::Vec3 place = labels.origin_mm;
    for (std::size_t axis = 0; axis < 3; ++axis)
      place += static_cast<double>(bounds[axis][corner >> axis & 1U]) * labels.steps_mm[axis];
    report.low_mm = {std::min(report.low_mm.x, place.x), std::min(report.low_mm.y, place.y),
                     std::min(report.low_mm.z, place.z)};
    report.high_mm = {std::max(report.high_mm.x, place.x), std::max(report.high_mm.y, place.y),
                      std::max(report.high_mm.z, place.z)};
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    report.spacing_mm[axis] = norm(labels.steps_mm[axis]);
    report.touches_edge |= bounds[axis][0] == 0 || bounds[axis][1] == labels.sizes[axis] - 1;
  }
  if (report.touches_edge)
    report.warnings.emplace_back("the segment reaches the edge of the image, which cuts it off flat there");
  return report;
}

base::Result<LabelFile> labelOf(base::Result<FileLabels> labels, const std::string& name,
                                const LabelOptions& options) {
  if (!labels) return std::unexpected(labels.error());
  if (options.margin_voxels < 0 || options.margin_voxels > 1000)
    return refused(name, fmt::format("a margin of {} voxels (allowed: 0..1000)", options.margin_voxels),
                   "choose another margin");
  const auto values = valuesOf(*labels, name);
  if (!values) return std::unexpected(values.error());
  const auto choice = LabelChooser(*labels, *values, name, options.label).choose();
  if (!choice) return std::unexpected(choice.error());
  std::uint64_t voxels = 1;
  for (const auto& range : choice->bounds)
    voxels *= static_cast<std::uint64_t>(range[1] - range[0] + 1 + 2 * options.margin_voxels);
  const std::uint64_t most =
      std::min<std::uint64_t>(options.limits.voxel_bytes, mostMemory(labels->held().size()));
  if (voxels > most)
    return refused(
        name,
        fmt::format("segment and margin take {} voxels (allowed: at most {} of this file)", voxels, most),
        "crop the image, or segment with larger voxels");
  auto map = cropped(*labels, *choice, options.margin_voxels, name);
  if (!map) return std::unexpected(map.error());
  if (labels->frame_from == KnownFrom::file && options.frame && *options.frame != labels->frame)
    labels->warnings.push_back(ignoredFrame(labels->frame, *options.frame));
  return LabelFile{std::move(*map), reportOf(*labels, *choice)};
}

base::Result<FileLabels> readFormat(std::string_view bytes, const std::string& name,
                                    const LabelOptions& options, const DetachedFile& detached) {
  const std::string lower = lowerCase(name);
  if (lower.ends_with(".nrrd") || lower.ends_with(".nhdr"))
    return readNrrd(bytes, name, options.frame, options.limits, detached);
  if (lower.ends_with(".nii.gz")) return readNifti(bytes, name, true, options.limits);
  if (lower.ends_with(".nii")) return readNifti(bytes, name, bytes.starts_with("\x1f\x8b"), options.limits);
  return refused(name, "the ending is not that of a label map (allowed: .nrrd, .nhdr, .nii, .nii.gz)",
                 "save the segmentation as .seg.nrrd");
}

}  // namespace

std::size_t bytesOf(VoxelType type) {
  switch (type) {
    case VoxelType::int8:
    case VoxelType::uint8:
      return 1;
    case VoxelType::int16:
    case VoxelType::uint16:
      return 2;
    case VoxelType::int32:
    case VoxelType::uint32:
    case VoxelType::float32:
      return 4;
    case VoxelType::int64:
    case VoxelType::uint64:
    case VoxelType::float64:
      break;
  }
  return 8;
}

base::Result<std::uint64_t> checkedBytes(const FileLabels& labels, const std::string& name,
                                         const LabelLimits& limits) {
  // each factor is at most voxels_per_axis; divided instead of multiplied, so that nothing overflows
  std::uint64_t left = limits.voxel_bytes / bytesOf(labels.type);
  for (const std::uint64_t count :
       {static_cast<std::uint64_t>(labels.sizes[0]), static_cast<std::uint64_t>(labels.sizes[1]),
        static_cast<std::uint64_t>(labels.sizes[2]), std::uint64_t{labels.layers}})
    left /= count;
  if (left == 0)
    return refused(name,
                   fmt::format("{} x {} x {} voxels of {} bytes in {} layers (allowed: {} bytes)",
                               labels.sizes[0], labels.sizes[1], labels.sizes[2], bytesOf(labels.type),
                               labels.layers, limits.voxel_bytes),
                   "crop the image");
  constexpr double kMinSpacing_mm = 1e-3, kMaxSpacing_mm = 100, kFarthest_mm = 1e5;
  double volume = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double spacing_mm = norm(labels.steps_mm[axis]);
    if (!(spacing_mm >= kMinSpacing_mm && spacing_mm <= kMaxSpacing_mm))
      return refused(
          name,
          fmt::format("the spacing along axis {} is {:.6g} mm (allowed: 0.001..100)", axis + 1, spacing_mm),
          "check the unit of the image");
    volume *= spacing_mm;
  }
  const double determinant = dot(labels.steps_mm[0], cross(labels.steps_mm[1], labels.steps_mm[2]));
  if (!(std::abs(determinant) >= 0.1 * volume))
    return refused(name, "the axes of the image lie nearly in a plane", "save the image again");
  if (!(norm(labels.origin_mm) <= kFarthest_mm))
    return refused(name,
                   fmt::format("the first voxel is {:.6g} mm from the origin (allowed: at most 100000)",
                               norm(labels.origin_mm)),
                   "check the unit of the image");
  return static_cast<std::uint64_t>(labels.voxels()) * labels.layers * bytesOf(labels.type);
}

base::Result<LabelFile> labelFrom(std::string_view bytes, const std::string& name,
                                  const LabelOptions& options) {
  return labelOf(readFormat(bytes, name, options, {}), name, options);
}

base::Result<LabelFile> readLabel(const std::filesystem::path& file, const LabelOptions& options) {
  const auto bytes = contentOf(file, options.limits.file_bytes);
  if (!bytes) return std::unexpected(bytes.error());
  const DetachedFile detached = [&](const std::string& relative) -> base::Result<std::string> {
    const std::filesystem::path folder = file.parent_path(), path = folder / relative;
    std::error_code missing;  // contentOf() says what it is
    const auto real_folder = std::filesystem::weakly_canonical(folder.empty() ? "." : folder, missing),
               real_path = std::filesystem::weakly_canonical(path, missing);
    if (std::ranges::mismatch(real_folder, real_path).in1 != real_folder.end())
      return refused(path.string(), "is a link to a file outside of the folder of the header",
                     "copy the file into the folder");
    return contentOf(path, options.limits.file_bytes);
  };
  return labelOf(readFormat(*bytes, file.string(), options, detached), file.string(), options);
}

}  // namespace hapticd::solids

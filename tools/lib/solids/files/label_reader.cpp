// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/files/label_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "config/base/value_text.h"

namespace hapticd::solids {
namespace {

/// A label map has fewer values; an image has more.
constexpr std::size_t kMaxValues = 5000;

/// Value and layer of the voxels of a segment.
struct Choice {
  std::int64_t value = 0;
  std::size_t layer = 0;
  std::string name;
};

using Bounds3 = std::array<std::array<std::int64_t, 2>, 3>;

class Voxels {
 public:
  explicit Voxels(const FileLabels& labels) : labels_(labels), bytes_(bytesOf(labels.type)) {}

  /// The value of a voxel; nothing if it is not a whole number, or larger than 64 bits with a sign hold.
  std::optional<std::int64_t> at(std::int64_t voxel, std::size_t layer) const {
    const char* bytes =
        labels_.bytes.data() + (static_cast<std::size_t>(voxel) * labels_.layers + layer) * bytes_;
    switch (labels_.type) {
      case VoxelType::int8:
        return numberAt<std::int8_t>(bytes, labels_.order);
      case VoxelType::uint8:
        return numberAt<std::uint8_t>(bytes, labels_.order);
      case VoxelType::int16:
        return numberAt<std::int16_t>(bytes, labels_.order);
      case VoxelType::uint16:
        return numberAt<std::uint16_t>(bytes, labels_.order);
      case VoxelType::int32:
        return numberAt<std::int32_t>(bytes, labels_.order);
      case VoxelType::uint32:
        return numberAt<std::uint32_t>(bytes, labels_.order);
      case VoxelType::int64:
        return numberAt<std::int64_t>(bytes, labels_.order);
      case VoxelType::uint64: {
        const auto number = numberAt<std::uint64_t>(bytes, labels_.order);
        if (number > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
          return std::nullopt;
        return static_cast<std::int64_t>(number);
      }
      case VoxelType::float32:
        return wholeNumber(static_cast<double>(numberAt<float>(bytes, labels_.order)));
      case VoxelType::float64:
        break;
    }
    return wholeNumber(numberAt<double>(bytes, labels_.order));
  }

 private:
  static std::optional<std::int64_t> wholeNumber(double number) {
    const double nearest = std::round(number);
    if (!(std::abs(number - nearest) <= 1e-3 && std::abs(nearest) <= 1e15)) return std::nullopt;
    return static_cast<std::int64_t>(nearest);
  }

  const FileLabels& labels_;
  std::size_t bytes_;
};

std::string listed(std::vector<std::string> names) {
  constexpr std::size_t kMaxNames = 20;
  const std::size_t left_out = names.size() > kMaxNames ? names.size() - kMaxNames : 0;
  names.resize(names.size() - left_out);
  return fmt::format("{}{}", fmt::join(names, ", "),
                     left_out > 0 ? fmt::format(" and {} more", left_out) : "");
}

class LabelChooser {
 public:
  LabelChooser(const FileLabels& labels, const std::string& name, const std::string& wanted)
      : labels_(labels), voxels_(labels), name_(name), wanted_(wanted) {}

  base::Result<Choice> choose() {
    if (!labels_.segments.empty()) {
      if (auto segment = bySegment()) return std::move(*segment);
      if (ambiguous_)
        return refused(name_,
                       fmt::format("the label {} is that of several segments", base::inQuotes(wanted_)),
                       "name one of: " + listed(namesOfSegments()));
    }
    if (labels_.voxels() == 1)
      return refused(name_, "the segmentation is empty", "segment something, and save it");
    auto values = collectValues();
    if (!values) return std::unexpected(values.error());
    const auto number = base::numberFrom<std::int64_t>(wanted_);
    std::vector<Choice> fitting;
    for (const Choice& choice : *values)
      if (wanted_.empty() ? choice.value != 0 : number && *number != 0 && choice.value == *number)
        fitting.push_back(choice);
    if (fitting.size() == 1) return fitting.front();
    return refused(name_, problemWith(fitting.size()), remedyFor(*values));
  }

 private:
  std::vector<std::string> namesOfSegments() const {
    std::vector<std::string> names;
    for (const Segment& segment : labels_.segments) names.push_back(base::inQuotes(segment.name));
    return names;
  }

  std::optional<Choice> bySegment() {
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
      if (count == 0) continue;
      if (count > 1) return std::nullopt;
      const Segment& found = *std::ranges::find_if(labels_.segments, fits);
      return Choice{found.value, found.layer, found.name};
    }
    return std::nullopt;
  }

  base::Result<std::vector<Choice>> collectValues() const {
    std::set<std::pair<std::size_t, std::int64_t>> found;
    for (std::size_t layer = 0; layer < labels_.layers; ++layer) {
      std::int64_t last = 0;
      for (std::int64_t voxel = 0; voxel < labels_.voxels(); ++voxel) {
        const auto value = voxels_.at(voxel, layer);
        if (!value)
          return refused(name_, fmt::format("voxel {} is not a whole number", voxel),
                         "save the labels, not the image");
        if (*value == last) continue;
        last = *value;
        found.emplace(layer, last);
        if (found.size() > kMaxValues)
          return refused(
              name_,
              fmt::format("more than {} different values: this looks like an image, not like labels",
                          kMaxValues),
              "save the segmentation as .seg.nrrd");
      }
    }
    std::vector<Choice> values;
    for (const auto& [layer, value] : found)
      if (value != 0) values.push_back({value, layer, ""});
    return values;
  }

  std::string problemWith(std::size_t fitting) const {
    if (fitting > 1 && !wanted_.empty())
      return fmt::format("the label {} occurs in several layers", base::inQuotes(wanted_));
    if (fitting > 1) return fmt::format("contains {} labels", fitting);
    if (wanted_.empty()) return "contains no label other than 0";
    return fmt::format("contains no label {}", base::inQuotes(wanted_));
  }

  std::string remedyFor(const std::vector<Choice>& values) const {
    std::vector<std::string> names = namesOfSegments();
    if (names.empty())
      for (const Choice& choice : values) names.push_back(std::to_string(choice.value));
    return names.empty() ? "segment something, and save it" : "name one of: " + listed(std::move(names));
  }

  const FileLabels& labels_;
  Voxels voxels_;
  const std::string& name_;
  const std::string& wanted_;
  bool ambiguous_ = false;
};

/// The voxels of the segment, from the first to the last along each axis; nothing: there is none.
base::Result<std::optional<Bounds3>> extentOf(const FileLabels& labels, const Choice& choice,
                                              const std::string& name, std::size_t& count) {
  const Voxels voxels(labels);
  constexpr auto kMax = std::numeric_limits<std::int64_t>::max();
  Bounds3 bounds{{{kMax, -1}, {kMax, -1}, {kMax, -1}}};
  std::int64_t voxel = 0;
  std::array<std::int64_t, 3> at{};
  for (at[2] = 0; at[2] < labels.sizes[2]; ++at[2])
    for (at[1] = 0; at[1] < labels.sizes[1]; ++at[1])
      for (at[0] = 0; at[0] < labels.sizes[0]; ++at[0], ++voxel) {
        const auto value = voxels.at(voxel, choice.layer);
        if (!value)
          return refused(name, fmt::format("voxel ({}, {}, {}) is not a whole number", at[0], at[1], at[2]),
                         "save the labels, not the image");
        if (*value != choice.value) continue;
        ++count;
        for (std::size_t axis = 0; axis < 3; ++axis)
          bounds[axis] = {std::min(bounds[axis][0], at[axis]), std::max(bounds[axis][1], at[axis])};
      }
  if (count == 0) return std::nullopt;
  return bounds;
}

LabelMap cropped(const FileLabels& labels, const Choice& choice, const Bounds3& bounds, int margin) {
  const Voxels voxels(labels);
  LabelMap map;
  std::array<std::int64_t, 3> first{};
  map.origin_m = labels.origin_mm;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    first[axis] = bounds[axis][0] - margin;
    map.size[axis] = static_cast<int>(bounds[axis][1] - bounds[axis][0] + 1 + 2 * margin);
    map.steps_m[axis] = kMetresPerMillimetre * labels.steps_mm[axis];
    map.origin_m += static_cast<double>(first[axis]) * labels.steps_mm[axis];
  }
  map.origin_m = kMetresPerMillimetre * map.origin_m;
  const auto nx = static_cast<std::size_t>(map.size[0]), ny = static_cast<std::size_t>(map.size[1]);
  map.inside.assign(nx * ny * static_cast<std::size_t>(map.size[2]), 0);
  for (std::int64_t z = bounds[2][0]; z <= bounds[2][1]; ++z)
    for (std::int64_t y = bounds[1][0]; y <= bounds[1][1]; ++y)
      for (std::int64_t x = bounds[0][0]; x <= bounds[0][1]; ++x) {
        const auto to =
            static_cast<std::size_t>(x - first[0]) +
            nx * (static_cast<std::size_t>(y - first[1]) + ny * static_cast<std::size_t>(z - first[2]));
        const std::int64_t from = x + labels.sizes[0] * (y + labels.sizes[1] * z);
        map.inside[to] = voxels.at(from, choice.layer) == choice.value ? 1 : 0;
      }
  return map;
}

LabelReport reportOf(FileLabels& labels, const Choice& choice, const Bounds3& bounds, std::size_t count) {
  LabelReport report{labels.format,
                     labels.frame,
                     labels.frame_from,
                     choice.name,
                     choice.value,
                     choice.layer,
                     count,
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
  const auto choice = LabelChooser(*labels, name, options.label).choose();
  if (!choice) return std::unexpected(choice.error());
  std::size_t count = 0;
  const auto extent = extentOf(*labels, *choice, name, count);
  if (!extent) return std::unexpected(extent.error());
  const std::string label = choice->name.empty() ? std::to_string(choice->value) : choice->name;
  if (!*extent)
    return refused(name, fmt::format("the segment {} is empty", base::inQuotes(label)),
                   "choose another label");
  std::uint64_t voxels = 1;
  for (const auto& range : **extent)
    voxels *= static_cast<std::uint64_t>(range[1] - range[0] + 1 + 2 * options.margin_voxels);
  if (voxels > options.limits.voxel_bytes)
    return refused(name,
                   fmt::format("segment and margin take {} voxels (allowed: at most {})", voxels,
                               options.limits.voxel_bytes),
                   "choose a smaller margin");
  LabelMap map = cropped(*labels, *choice, **extent, options.margin_voxels);
  return LabelFile{std::move(map), reportOf(*labels, *choice, **extent, count)};
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
  const DetachedFile detached = [&](const std::string& relative) {
    return contentOf(file.parent_path() / relative, options.limits.file_bytes);
  };
  return labelOf(readFormat(*bytes, file.string(), options, detached), file.string(), options);
}

}  // namespace hapticd::solids

// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/lib/solids/files/label_reader.h"
#include "tools/lib/solids/files/source_file.h"

namespace hapticd::solids {
namespace {

constexpr std::size_t kHeaderBytes = 348;
constexpr const char* kConvert = "load the image in 3D Slicer and save it as .nrrd";

struct TypeCode {
  int code;
  VoxelType type;
};
constexpr TypeCode kTypes[] = {{2, VoxelType::uint8},    {4, VoxelType::int16},    {8, VoxelType::int32},
                               {16, VoxelType::float32}, {64, VoxelType::float64}, {256, VoxelType::int8},
                               {512, VoxelType::uint16}, {768, VoxelType::uint32}, {1024, VoxelType::int64},
                               {1280, VoxelType::uint64}};

/// An orientation in the axes of the format, RAS, and in the unit of the file.
struct Orientation {
  std::array<rt::Vec3, 3> steps;
  rt::Vec3 origin;
};

/// Offsets and names are those of nifti1.h.
class NiftiHeader {
 public:
  NiftiHeader(std::string_view bytes, std::endian order) : bytes_(bytes), order_(order) {}

  int int16At(std::size_t at) const { return numberAt<std::int16_t>(bytes_.data() + at, order_); }
  double floatAt(std::size_t at) const {
    return static_cast<double>(numberAt<float>(bytes_.data() + at, order_));
  }
  int byteAt(std::size_t at) const { return static_cast<unsigned char>(bytes_[at]); }
  double pixdim(std::size_t i) const { return floatAt(76 + 4 * i); }

  bool hasNegativeSpacing() const { return pixdim(1) < 0 || pixdim(2) < 0 || pixdim(3) < 0; }
  /// Of the quaternion without its first component, which makes it a unit quaternion.
  double squaredLength() const {
    return std::pow(floatAt(256), 2) + std::pow(floatAt(260), 2) + std::pow(floatAt(264), 2);
  }

  bool hasQform() const { return int16At(252) > 0; }
  bool hasSform() const { return int16At(254) > 0; }

  Orientation qform() const {
    const double b = floatAt(256), c = floatAt(260), d = floatAt(264);
    const double a = std::sqrt(std::max(0.0, 1 - squaredLength()));
    // a spacing has no sign; that of the third axis is qfac's, of which 0 counts as 1
    const double last = std::copysign(pixdim(3), pixdim(0) < 0 ? -1 : 1);
    return {{std::abs(pixdim(1)) *
                 rt::Vec3{a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)},
             std::abs(pixdim(2)) *
                 rt::Vec3{2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)},
             last * rt::Vec3{2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c}},
            {floatAt(268), floatAt(272), floatAt(276)}};
  }

  Orientation sform() const {
    const auto column = [&](std::size_t i) {
      return rt::Vec3{floatAt(280 + 4 * i), floatAt(296 + 4 * i), floatAt(312 + 4 * i)};
    };
    return {{column(0), column(1), column(2)}, column(3)};
  }

 private:
  std::string_view bytes_;
  std::endian order_;
};

class NiftiFile {
 public:
  NiftiFile(const std::string& name, const LabelLimits& limits) : name_(name), limits_(limits) {}

  base::Result<FileLabels> read(std::string_view bytes, bool is_compressed) {
    std::array<char, kHeaderBytes> head{};
    const auto size = ByteStream(bytes, is_compressed, name_).read(head);
    if (!size) return std::unexpected(size.error());
    labels_.attached = bytes;
    labels_.is_gzip = is_compressed;
    if (auto done = takeHeader({head.data(), *size}); !done) return std::unexpected(done.error());
    if (const auto needed = checkedBytes(labels_, name_, limits_); !needed)
      return std::unexpected(needed.error());
    return std::move(labels_);
  }

 private:
  std::unexpected<base::Error> fault(std::size_t byte, std::string what, std::string remedy) const {
    return refused(fmt::format("{}: byte {}", name_, byte), std::move(what), std::move(remedy));
  }

  base::Result<void> takeHeader(std::string_view bytes) {
    if (bytes.size() < kHeaderBytes)
      return refused(name_,
                     fmt::format("{} bytes are too few for a NIfTI header ({})", bytes.size(), kHeaderBytes),
                     "the file is truncated: copy or save it again");
    const bool is_little = numberAt<std::int32_t>(bytes.data(), std::endian::little) == 348;
    const bool is_big = numberAt<std::int32_t>(bytes.data(), std::endian::big) == 348;
    if (!is_little && !is_big)
      return fault(0, "the header does not begin with 348, its size: not a NIfTI-1 file", kConvert);
    const std::string_view magic = bytes.substr(344, 3);
    if (magic != "n+1")
      return fault(344,
                   magic == "ni1" ? "the voxels are in another file (.img)"
                                  : "the magic is not 'n+1': not a NIfTI-1 file",
                   kConvert);
    labels_.format = "NIfTI-1";
    labels_.frame = Frame::ras;
    labels_.order = is_big ? std::endian::big : std::endian::little;
    const NiftiHeader header(bytes, labels_.order);
    if (auto done = takeShape(header); !done) return done;
    if (auto done = takeOrientation(header); !done) return done;
    const double first_byte = header.floatAt(108);
    if (!(first_byte >= 348 && first_byte <= static_cast<double>(limits_.file_bytes)) ||
        first_byte != std::floor(first_byte))
      return fault(
          108, fmt::format("the voxels begin at byte {} (allowed: 352..{})", first_byte, limits_.file_bytes),
          kConvert);
    labels_.first_byte = static_cast<std::uint64_t>(first_byte);
    return {};
  }

  base::Result<void> takeShape(const NiftiHeader& header) {
    const int axes = header.int16At(40);
    if (axes < 3 || axes > 7) return fault(40, fmt::format("{} axes (allowed: 3)", axes), kConvert);
    for (std::size_t axis = 0; axis < static_cast<std::size_t>(axes); ++axis) {
      const int size = header.int16At(42 + 2 * axis);
      const std::int64_t most = axis < 3 ? limits_.voxels_per_axis : 1;
      if (size < 1 || size > most)
        return fault(42 + 2 * axis,
                     fmt::format("the size of axis {} is {} (allowed: 1..{})", axis + 1, size, most),
                     axis < 3 ? "crop the image" : "save one image of the sequence");
      if (axis < 3) labels_.sizes[axis] = size;
    }
    const int code = header.int16At(70);
    const auto* known = std::ranges::find(kTypes, code, &TypeCode::code);
    if (known == std::end(kTypes))
      return fault(70, fmt::format("the type of the voxels is {} (allowed: integers, float, double)", code),
                   kConvert);
    labels_.type = known->type;
    const double slope = header.floatAt(112), intercept = header.floatAt(116);
    // programs that do not scale write 0 or what is not a number
    const bool is_plain =
        (slope == 0 || slope == 1 || std::isnan(slope)) && (intercept == 0 || std::isnan(intercept));
    if (!is_plain)
      return fault(112,
                   fmt::format("the voxels are scaled by {} and shifted by {} (allowed: 0 or 1, and 0)",
                               slope, intercept),
                   "save the labels themselves");
    return {};
  }

  base::Result<void> takeOrientation(const NiftiHeader& header) {
    if (!header.hasQform() && !header.hasSform())
      return fault(252, "qform_code and sform_code are 0: where the image lies is unknown",
                   "load the image in 3D Slicer, check where it lies, and save it as .nrrd");
    const double scale = millimetresPerUnit(header);
    if (scale == 0) return fault(123, "the unit of length is unknown (allowed: m, mm, um)", kConvert);
    constexpr double kRounding = 1e-5;
    if (!header.hasSform()) {
      if (!(header.squaredLength() <= 1 + kRounding))
        return fault(
            256,
            fmt::format("the quaternion of qform has a squared length of {:.6g} (allowed: at most 1)",
                        header.squaredLength()),
            kConvert);
      if (header.hasNegativeSpacing())
        labels_.warnings.emplace_back(
            "a spacing (pixdim) is negative, which has no meaning: its sign is ignored; compare the box with "
            "the "
            "image");
    }
    const Orientation found = header.hasSform() ? header.sform() : header.qform();
    for (std::size_t axis = 0; axis < 3; ++axis)
      labels_.steps_mm[axis] = scale * inLps(found.steps[axis], Frame::ras);
    labels_.origin_mm = scale * inLps(found.origin, Frame::ras);
    if (header.hasQform() && header.hasSform()) compare(found, header.qform());
    return {};
  }

  double millimetresPerUnit(const NiftiHeader& header) {
    switch (header.byteAt(123) & 7) {
      case 0:
        labels_.warnings.emplace_back("the file does not state its unit of length: millimetres are assumed");
        return 1;
      case 1:
        return 1e3;
      case 2:
        return 1;
      case 3:
        return 1e-3;
      default:
        return 0;
    }
  }

  /// Both orientations should place all corners of the image alike.
  void compare(const Orientation& sform, const Orientation& qform) {
    double farthest = 0;
    for (unsigned corner = 0; corner < 8; ++corner) {
      rt::Vec3 difference = sform.origin - qform.origin;
      for (std::size_t axis = 0; axis < 3; ++axis)
        if ((corner >> axis & 1U) != 0)
          difference +=
              static_cast<double>(labels_.sizes[axis] - 1) * (sform.steps[axis] - qform.steps[axis]);
      farthest = std::max(farthest, norm(difference));
    }
    const double voxel = std::min({norm(sform.steps[0]), norm(sform.steps[1]), norm(sform.steps[2])});
    if (!(farthest <= 0.1 * voxel))
      labels_.warnings.push_back(
          fmt::format("sform and qform place the image differently, by up to {:.3g} voxels; sform is used",
                      farthest / voxel));
  }

  const std::string& name_;
  const LabelLimits& limits_;
  FileLabels labels_;
};

}  // namespace

base::Result<FileLabels> readNifti(std::string_view bytes, const std::string& name, bool is_compressed,
                                   const LabelLimits& limits) {
  return NiftiFile(name, limits).read(bytes, is_compressed);
}

}  // namespace hapticd::solids

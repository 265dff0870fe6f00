// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/tools/solids/random_files.h"
#include "tools/lib/solids/files/label_reader.h"

// Label maps as many programs write them, at random. The oracle is where each voxel of the segment was put.
namespace hapticd::solids {
namespace {

using rt::Vec3;
using test::Dice;

/// Layers of voxels, the layer fastest, then x, and where they are in LPS and millimetres.
struct Image {
  std::array<int, 3> size{};
  int layers = 1;
  std::vector<int> values;
  std::array<Vec3, 3> steps;
  Vec3 origin;
  int layer = 0, value = 0;  ///< of the segment that is read

  std::vector<Vec3> places() const {
    std::vector<Vec3> places;
    std::size_t at = 0;
    for (int z = 0; z < size[2]; ++z)
      for (int y = 0; y < size[1]; ++y)
        for (int x = 0; x < size[0]; ++x)
          for (int l = 0; l < layers; ++l)
            if (values[at++] == value && l == layer)
              places.push_back(1e-3 * (origin + x * steps[0] + y * steps[1] + z * steps[2]));
    return places;
  }
  template <typename Number>
  std::string bytes(std::endian order) const {
    std::string result;
    for (const int number : values) result += test::bytesOf(static_cast<Number>(number), order);
    return result;
  }
};

Image randomImage(Dice& dice, int layers, int highest) {
  Image image;
  for (int& size : image.size) size = dice.whole(2, 9);
  image.layers = layers;
  const int count = layers * image.size[0] * image.size[1] * image.size[2];
  for (int i = 0; i < count; ++i) image.values.push_back(dice.isTrue(0.3) ? dice.whole(1, highest) : 0);
  image.layer = dice.whole(0, layers - 1);
  image.value = dice.whole(1, highest);
  image.values[static_cast<std::size_t>(image.layer)] = image.value;
  image.steps = dice.rotation();
  for (Vec3& step : image.steps)
    step = dice.pick({"+", "-"}) == "+" ? dice.among(0.3, 5) * step : -dice.among(0.3, 5) * step;
  image.origin = {dice.among(-300, 300), dice.among(-300, 300), dice.among(-300, 300)};
  return image;
}

struct Type {
  std::string nrrd;
  std::int16_t nifti;
  std::string (*bytes)(const Image&, std::endian);
};
const std::vector<Type>& types() {
  static const std::vector<Type> all{
      {"uchar", 2, [](const Image& image, std::endian order) { return image.bytes<std::uint8_t>(order); }},
      {"signed char", 256,
       [](const Image& image, std::endian order) { return image.bytes<std::int8_t>(order); }},
      {"short", 4, [](const Image& image, std::endian order) { return image.bytes<std::int16_t>(order); }},
      {"uint16", 512,
       [](const Image& image, std::endian order) { return image.bytes<std::uint16_t>(order); }},
      {"int", 8, [](const Image& image, std::endian order) { return image.bytes<std::int32_t>(order); }},
      {"unsigned int", 768,
       [](const Image& image, std::endian order) { return image.bytes<std::uint32_t>(order); }},
      {"long long int", 1024,
       [](const Image& image, std::endian order) { return image.bytes<std::int64_t>(order); }},
      {"uint64_t", 1280,
       [](const Image& image, std::endian order) { return image.bytes<std::uint64_t>(order); }},
      {"float", 16, [](const Image& image, std::endian order) { return image.bytes<float>(order); }},
      {"double", 64, [](const Image& image, std::endian order) { return image.bytes<double>(order); }}};
  return all;
}
const Type& anyType(Dice& dice) {
  return types()[static_cast<std::size_t>(dice.whole(0, static_cast<int>(types().size()) - 1))];
}

/// One gzip stream, or several members.
std::string packed(const std::string& bytes, Dice& dice) {
  const std::size_t half = dice.isTrue(0.5) ? 0 : bytes.size() / 2;
  return (half > 0 ? test::gzipped(bytes.substr(0, half)) : "") + test::gzipped(bytes.substr(half)) +
         dice.pick({"", std::string(7, '\0')});
}

struct Written {
  std::string bytes, label;
  std::vector<Vec3> places;
};

/// With names of segments: as 3D Slicer writes them, or as its versions before 4.11 did.
Written nrrdOf(Dice& dice) {
  const bool has_names = dice.isTrue(0.5), is_old = has_names && dice.isTrue(0.5);
  const int layers = has_names ? dice.whole(1, 3) : 1;
  const Image image = randomImage(dice, layers, is_old ? 1 : 4);
  const Type& type = anyType(dice);
  const std::endian order = dice.isTrue(0.5) ? std::endian::little : std::endian::big;
  const bool is_ras = dice.isTrue(0.3), is_list = layers > 1 || dice.isTrue(0.2),
             is_packed = dice.isTrue(0.5);
  const auto vector = [&](const Vec3& v) {
    const Vec3 in_file = inLps(v, is_ras ? Frame::ras : Frame::lps);
    return fmt::format("({:.17g},{:.17g},{:.17g})", in_file.x, in_file.y, in_file.z);
  };
  const std::string list = is_list ? "none " : "";
  const std::string skipped = dice.pick({"", "", "abc"});
  std::vector<std::string> lines{"type: " + type.nrrd,
                                 fmt::format("dimension: {}", is_list ? 4 : 3),
                                 fmt::format("sizes: {}{} {} {}", is_list ? fmt::format("{} ", layers) : "",
                                             image.size[0], image.size[1], image.size[2]),
                                 "space: " + (is_ras ? dice.pick({"RAS", "right-anterior-superior"})
                                                     : dice.pick({"LPS", "left-posterior-superior"})),
                                 "space directions: " + list + vector(image.steps[0]) + " " +
                                     vector(image.steps[1]) + " " + vector(image.steps[2]),
                                 "space origin: " + vector(image.origin),
                                 std::string("endian: ") + (order == std::endian::big ? "big" : "little"),
                                 std::string("encoding: ") + (is_packed ? dice.pick({"gzip", "gz"}) : "raw")};
  if (is_list) lines.push_back("kinds: list domain domain domain");
  if (!skipped.empty()) lines.push_back("byte skip: 3");
  if (dice.isTrue(0.3)) lines.push_back("# a comment: of somebody");
  std::string label = std::to_string(image.value);
  for (int segment = 0; has_names && segment < (is_old ? layers : 2 * layers); ++segment) {
    const int layer = is_old ? segment : segment / 2;
    // the one that is read is the second of its layer
    const int value = is_old ? 1 : segment % 2 == 1 && layer == image.layer ? image.value : 99;
    lines.push_back(fmt::format("Segment{}_ID:=Segment_{}", segment, segment + 1));
    lines.push_back(fmt::format("Segment{}_Name:=part {}", segment, segment));
    if (!is_old) lines.push_back(fmt::format("Segment{}_LabelValue:={}", segment, value));
    if (!is_old) lines.push_back(fmt::format("Segment{}_Layer:={}", segment, layer));
    if (layer == image.layer && value == image.value) label = fmt::format("part {}", segment);
  }
  const std::string raw = skipped + type.bytes(image, order);
  const std::string head = test::withLineEnds(test::nrrdHeader(lines), dice.pick({"\n", "\r\n"}));
  return {head + (is_packed ? packed(raw, dice) : raw), label, image.places()};
}

Written niftiOf(Dice& dice) {
  Image image = randomImage(dice, 1, 4);
  const Type& type = anyType(dice);
  const std::endian order = dice.isTrue(0.5) ? std::endian::little : std::endian::big;
  test::MadeUpNifti file;
  file.datatype = type.nifti;
  for (std::size_t axis = 0; axis < 3; ++axis)
    file.dim[axis + 1] = static_cast<std::int16_t>(image.size[axis]);
  file.scl_slope = std::array{0.F, 1.F, std::nanf("")}[static_cast<std::size_t>(dice.whole(0, 2))];
  file.scl_inter = dice.isTrue(0.5) ? 0 : std::nanf("");
  file.vox_offset = dice.isTrue(0.5) ? 352 : 368;
  const Vec3 origin = inLps(image.origin, Frame::ras);
  const std::array<float, 3> place{static_cast<float>(origin.x), static_cast<float>(origin.y),
                                   static_cast<float>(origin.z)};
  if (dice.isTrue(0.5)) {
    file.qform_code = 1;
    auto q = dice.quaternion();
    // the header leaves the real part out, which the floats of the others do not tell where it is about 0
    while (q[0] < 0.1) q = dice.quaternion();
    const auto axes = Dice::axesOf(q);
    file.pixdim[0] = dice.pick({"1", "-1", "0"}) == "-1" ? -1.F : 1.F;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      file.quatern[axis] = static_cast<float>(q[axis + 1]);
      const double spacing = norm(image.steps[axis]);
      // a sign that means nothing
      file.pixdim[axis + 1] = static_cast<float>(dice.isTrue(0.1) ? -spacing : spacing);
      const double sign = axis == 2 && file.pixdim[0] < 0 ? -1 : 1;
      image.steps[axis] = inLps(sign * spacing * axes[axis], Frame::ras);
    }
    file.qoffset = place;
  } else {
    file.sform_code = 2;
    file.quatern = {2, 2, 2};  // unused
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Vec3 step = inLps(image.steps[axis], Frame::ras);
      file.srow[axis] = static_cast<float>(step.x);
      file.srow[4 + axis] = static_cast<float>(step.y);
      file.srow[8 + axis] = static_cast<float>(step.z);
    }
    for (std::size_t row = 0; row < 3; ++row) file.srow[4 * row + 3] = place[row];
  }
  file.voxels = std::string(static_cast<std::size_t>(file.vox_offset) - 352, 'x') + type.bytes(image, order);
  const std::string bytes = file.file(order);
  return {dice.isTrue(0.5) ? packed(bytes, dice) : bytes, std::to_string(image.value), image.places()};
}

TEST(RandomLabelMaps, HaveEachVoxelWhereItWasPut) {
  for (const auto& [name, write] : {std::pair{"a.nrrd", &nrrdOf}, std::pair{"a.nii", &niftiOf}})
    for (int trial = 0; trial < test::randomFiles(); ++trial) {
      Dice dice(static_cast<unsigned>(trial));
      const Written written = write(dice);
      LabelOptions options;
      options.label = written.label;
      const auto file = labelFrom(written.bytes, name, options);
      ASSERT_TRUE(file) << name << " " << trial << ": " << file.error().text() << "\n"
                        << written.bytes.substr(0, 1000);
      const LabelMap& map = file->map;
      std::size_t at = 0, found = 0;
      double farthest_m = 0;
      for (int z = 0; z < map.size[2]; ++z)
        for (int y = 0; y < map.size[1]; ++y)
          for (int x = 0; x < map.size[0]; ++x) {
            if (map.inside[at++] == 0) continue;
            ASSERT_LT(found, written.places.size()) << name << " " << trial;
            farthest_m = std::max(farthest_m, norm(map.centreOf(x, y, z) - written.places[found++]));
          }
      EXPECT_EQ(found, written.places.size()) << name << " " << trial;
      // floats of the header: of 300 mm, of nine steps of 5 mm, and of the quaternion
      EXPECT_LT(farthest_m, 1e-6) << name << " " << trial;
    }
}

}  // namespace
}  // namespace hapticd::solids

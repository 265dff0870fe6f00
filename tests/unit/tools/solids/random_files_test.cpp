// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/tools/solids/made_up_solids.h"
#include "tools/lib/solids/files/label_reader.h"
#include "tools/lib/solids/files/mesh_reader.h"

namespace hapticd::solids {
namespace {

using rt::Vec3;
using test::Dice;
using test::withLineEnds;

// Mesh files as many programs write them, at random. The oracle is what was written: area and volume of a
// prism with a hollow outline, by formulas that know nothing of triangles, and its box.

/// A prism with faces of any number of corners, in LPS and millimetres.
struct Prism {
  std::vector<Vec3> points;
  std::vector<std::vector<std::uint32_t>> faces;
  double area = 0, volume = 0;
};

struct Flat {
  double x, y;
};

/// An outline all of which the origin sees, or a comb with deep gaps.
std::vector<Flat> randomOutline(Dice& dice, bool about_origin) {
  std::vector<Flat> outline;
  if (about_origin) {
    const int corners = dice.whole(4, 14);
    for (int i = 0; i < corners; ++i) {
      const double angle = 2 * std::numbers::pi * (i + dice.among(0, 0.8)) / corners, r = dice.among(4, 30);
      outline.push_back({r * std::cos(angle), r * std::sin(angle)});
    }
    return outline;
  }
  const int teeth = dice.whole(2, 6);
  outline = {{0, 0}, {10.0 * teeth, 0}};
  for (int tooth = teeth - 1; tooth >= 0; --tooth) {
    const double top = dice.among(8, 30), low = dice.among(2, 7), left = 10.0 * tooth,
                 width = dice.among(2, 8);
    outline.push_back({left + 10, top});
    outline.push_back({left + 10 - width, top + dice.among(-1, 1)});
    if (tooth > 0) outline.push_back({left + 10 - width, low});
    if (tooth > 0) outline.push_back({left, low});
  }
  return outline;
}

Prism randomPrism(Dice& dice, bool only_triangles) {
  Prism prism;
  std::vector<Flat> outline = randomOutline(dice, only_triangles || dice.isTrue(0.5));
  if (dice.isTrue(0.3)) {  // corners in the middle of edges
    std::vector<Flat> more;
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Flat &a = outline[i], &b = outline[(i + 1) % outline.size()];
      more.push_back(a);
      more.push_back({0.75 * a.x + 0.25 * b.x, 0.75 * a.y + 0.25 * b.y});
    }
    outline = std::move(more);
  }
  const auto count = static_cast<std::uint32_t>(outline.size());
  const double height = dice.among(5, 40);
  double twice_area = 0, length = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Flat &a = outline[i], &b = outline[(i + 1) % count];
    twice_area += a.x * b.y - b.x * a.y;
    length += std::hypot(b.x - a.x, b.y - a.y);
  }
  prism.area = twice_area + length * height;
  prism.volume = twice_area / 2 * height;
  for (const double z : {0.0, height})
    for (const Flat& p : outline) prism.points.push_back({p.x, p.y, z});
  std::vector<std::uint32_t> low, high;
  const auto first = static_cast<std::uint32_t>(dice.whole(0, static_cast<int>(count) - 1));
  for (std::uint32_t i = 0; i < count; ++i) {
    high.push_back(count + (first + i) % count);
    low.push_back((first + count - i) % count);
    const std::uint32_t next = (i + 1) % count;
    if (only_triangles)
      prism.faces.insert(prism.faces.end(), {{i, next, count + next},
                                             {i, count + next, count + i},
                                             {next, i, 2 * count},
                                             {count + i, count + next, 2 * count + 1}});
    else
      prism.faces.push_back({i, next, count + next, count + i});
  }
  if (only_triangles)
    prism.points.insert(prism.points.end(), {{0, 0, 0}, {0, 0, height}});
  else
    prism.faces.insert(prism.faces.end(), {low, high});
  const auto axes = dice.rotation();
  const Vec3 offset{dice.among(-300, 300), dice.among(-300, 300), dice.among(-300, 300)};
  for (Vec3& p : prism.points) p = offset + p.x * axes[0] + p.y * axes[1] + p.z * axes[2];
  return prism;
}

/// How the file states its frame, and the points in it.
struct Framed {
  std::string note;
  std::vector<Vec3> points;
};
Framed framed(const Prism& prism, Dice& dice) {
  Framed result{dice.pick({"SPACE=LPS", "SPACE=RAS", "3D Slicer output. SPACE=LPS", ""}), prism.points};
  if (result.note == "SPACE=RAS")
    for (Vec3& p : result.points) p = inLps(p, Frame::ras);
  return result;
}

std::string objOf(const Prism& prism, Dice& dice) {
  const Framed file = framed(prism, dice);
  const bool counts_back = dice.isTrue(0.3), continues = dice.isTrue(0.3);
  const int stray = dice.isTrue(0.3) ? dice.whole(1, 3) : 0;
  const std::string behind = dice.pick({"", "/1", "//1", "/1/1"}),
                    more = dice.pick({"", " 1.0", " 0.5 0.5 0.5"});
  std::string text = file.note.empty() ? "" : "# " + file.note + "\n";
  text += dice.pick({"", "o K\xc3\xb6rper\n", "g a b\nusemtl x\n", "mtllib a.mtl\ns off\n"});
  for (int i = 0; i < stray; ++i) text += fmt::format("v {} 0 0\n", std::pow(10, dice.whole(1, 8)));
  for (const Vec3& p : file.points) text += fmt::format("v {:.9g} {:.9g} {:.9g}{}\n", p.x, p.y, p.z, more);
  if (behind.find('1') != std::string::npos) text += "vt 0 0\nvn 0 0 1\n";
  for (const auto& face : prism.faces) {
    text += "f";
    for (std::size_t i = 0; i < face.size(); ++i) {
      if (continues && i == 2) text += " \\\n";
      const auto index = static_cast<std::int64_t>(face[i]);
      text += fmt::format(
          " {}{}", counts_back ? index - static_cast<std::int64_t>(file.points.size()) : index + 1 + stray,
          behind);
    }
    text += "\n";
  }
  return dice.asText(std::move(text));
}

std::string stlText(const Prism& prism, Dice& dice) {
  const Framed file = framed(prism, dice);
  std::string text = "solid " + dice.pick({"", "Schädel ", "f\xe9mur "}) + file.note + "\n";
  const std::size_t split = dice.isTrue(0.3) ? prism.faces.size() / 2 : 0;
  for (std::size_t i = 0; i < prism.faces.size(); ++i) {
    if (split > 0 && i == split) text += "endsolid\nsolid two\n";
    text += "  facet normal 0 0 0\n    outer loop\n";
    for (const std::uint32_t corner : prism.faces[i]) {
      const Vec3& p = file.points[corner];
      text += fmt::format("      vertex {:.9e} {:.9e} {:.9e}\n", p.x, p.y, p.z);
    }
    text += "    endloop\n  endfacet\n";
  }
  return dice.asText(text + "endsolid\n");
}

std::string stlBinary(const Prism& prism, Dice& dice) {
  const Framed file = framed(prism, dice);
  std::string bytes;
  const std::size_t split = dice.isTrue(0.3) ? prism.faces.size() / 2 : 0;
  const auto body = [&](std::size_t begin, std::size_t end) {
    std::string header = dice.pick({"", "solid ", "COLOR=\x7f\x7f\x7f\x7f "}) + file.note;
    header.resize(80, dice.isTrue(0.5) ? ' ' : '\0');
    bytes += header + test::bytesOf(static_cast<std::uint32_t>(end - begin));
    for (std::size_t i = begin; i < end; ++i) {
      bytes += std::string(12, '\0');
      for (const std::uint32_t corner : prism.faces[i])
        for (const double number : {file.points[corner].x, file.points[corner].y, file.points[corner].z})
          bytes += test::bytesOf(static_cast<float>(number));
      bytes += test::bytesOf(static_cast<std::uint16_t>(dice.whole(0, 65535)));
    }
  };
  body(0, split > 0 ? split : prism.faces.size());
  if (split > 0) body(split, prism.faces.size());
  return bytes + dice.pick({"", "", std::string(100, '\0'), "tail"});
}

std::string plyOf(const Prism& prism, Dice& dice) {
  const Framed file = framed(prism, dice);
  const std::string format = dice.pick({"ascii", "binary_little_endian", "binary_big_endian"});
  const bool is_text = format == "ascii", has_quality = dice.isTrue(0.3), is_double = dice.isTrue(0.5);
  const std::endian order = format == "binary_big_endian" ? std::endian::big : std::endian::little;
  std::string head = "ply\nformat " + format + " 1.0\n";
  if (!file.note.empty()) head += "comment " + file.note + "\n";
  head += dice.pick({"", "obj_info made by hand\n", "VCGLIB generated\n"});
  head +=
      fmt::format("element vertex {}\n{}", file.points.size(), has_quality ? "property uchar quality\n" : "");
  for (const char axis : {'x', 'y', 'z'})
    head += fmt::format("property {} {}\n", is_double ? "double" : "float32", axis);
  head += fmt::format("element face {}\nproperty list {} {} {}\nend_header\n", prism.faces.size(), "uint8",
                      dice.isTrue(0.5) ? "int" : "uint", dice.pick({"vertex_indices", "vertex_index"}));
  const std::string end = dice.lineEnd();
  std::string body;
  const auto put = [&](auto number) { body += test::bytesOf(number, order); };
  const bool has_more = dice.isTrue(0.3), in_two_lines = !has_more && dice.isTrue(0.3);
  for (const Vec3& p : file.points) {
    if (is_text) {
      body += fmt::format("{}{:.9g} {:.9g}{}{:.9g}{}\n", has_quality ? "7 " : "", p.x, p.y,
                          in_two_lines ? "\n" : " ", p.z, has_more ? " 0.5 255" : "");
      continue;
    }
    if (has_quality) put(std::uint8_t{7});
    for (const double number : {p.x, p.y, p.z}) is_double ? put(number) : put(static_cast<float>(number));
  }
  for (const auto& face : prism.faces) {
    if (is_text) body += std::to_string(face.size());
    if (!is_text) put(static_cast<std::uint8_t>(face.size()));
    for (const std::uint32_t corner : face) is_text ? void(body += fmt::format(" {}", corner)) : put(corner);
    if (is_text) body += has_more ? " 6 0 0 1 0 1 1\n" : "\n";
  }
  return withLineEnds(head, end) + (is_text ? withLineEnds(body, end) : body);
}

TEST(RandomMeshes, HaveTheAreaTheVolumeAndTheBoxThatWereWritten) {
  struct Format {
    std::string name;
    bool only_triangles;
    std::string (*write)(const Prism&, Dice&);
  };
  const std::vector<Format> formats{{"a.obj", false, objOf},
                                    {"a.ply", false, plyOf},
                                    {"text.stl", true, stlText},
                                    {"binary.stl", true, stlBinary}};
  for (const Format& format : formats)
    for (int trial = 0; trial < test::randomFiles(); ++trial) {
      Dice dice(static_cast<unsigned>(trial));
      const Prism prism = randomPrism(dice, format.only_triangles);
      const std::string bytes = format.write(prism, dice);
      const auto file = meshFrom(bytes, format.name);
      ASSERT_TRUE(file) << trial << ": " << file.error().text() << "\n" << bytes.substr(0, 3000);
      double area = 0, volume = 0;
      for (const Triangle& t : file->mesh.triangles) {
        const Vec3 a = file->mesh.points_m[t[0]], b = file->mesh.points_m[t[1]],
                   c = file->mesh.points_m[t[2]];
        area += 0.5e6 * norm(cross(b - a, c - a));
        volume += 1e9 / 6 * dot(a - file->mesh.points_m[0], cross(b - a, c - a));
      }
      const Bounds box = boundsOf(prism.points);
      // a float of 300 mm is off by 1.5e-5 mm: along all edges, at most as long as the area is large
      const double size = box.diagonal_m();
      EXPECT_NEAR(area, prism.area, 1e-4 * size * 40) << format.name << " " << trial;
      EXPECT_NEAR(volume, prism.volume, 1e-4 * prism.area) << format.name << " " << trial;
      EXPECT_LT(norm(file->report.low_mm - box.low_m) + norm(file->report.high_mm - box.high_m), 1e-4)
          << format.name << " " << trial;
      EXPECT_EQ(file->report.topology.boundary_edges, 0U) << format.name << " " << trial;
      EXPECT_LT(file->mesh.error_m, 1e-6) << format.name << " " << trial;
    }
}

// Label maps as many programs write them, at random. The oracle is where each voxel of the segment was put.

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
  std::string (Image::*bytes)(std::endian) const;
};
const std::vector<Type> kTypes{{"uchar", 2, &Image::bytes<std::uint8_t>},
                               {"signed char", 256, &Image::bytes<std::int8_t>},
                               {"short", 4, &Image::bytes<std::int16_t>},
                               {"uint16", 512, &Image::bytes<std::uint16_t>},
                               {"int", 8, &Image::bytes<std::int32_t>},
                               {"unsigned int", 768, &Image::bytes<std::uint32_t>},
                               {"long long int", 1024, &Image::bytes<std::int64_t>},
                               {"uint64_t", 1280, &Image::bytes<std::uint64_t>},
                               {"float", 16, &Image::bytes<float>},
                               {"double", 64, &Image::bytes<double>}};
const Type& anyType(Dice& dice) {
  return kTypes[static_cast<std::size_t>(dice.whole(0, static_cast<int>(kTypes.size()) - 1))];
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
  const std::string raw = skipped + (image.*type.bytes)(order);
  const std::string head = withLineEnds(test::nrrdHeader(lines), dice.pick({"\n", "\r\n"}));
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
  file.voxels =
      std::string(static_cast<std::size_t>(file.vox_offset) - 352, 'x') + (image.*type.bytes)(order);
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

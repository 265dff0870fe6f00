// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/tools/solids/made_up_solids.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace hapticd::test {
namespace {

using rt::Vec3;
using solids::TriangleMesh;

/// A surface of revolution about z from its lowest to its highest point, which are on the axis.
TriangleMesh revolved(const Vec3& centre, const std::vector<std::array<double, 2>>& profile, int meridians) {
  TriangleMesh mesh;
  const auto rings = static_cast<std::uint32_t>(profile.size() - 2),
             count = static_cast<std::uint32_t>(meridians);
  mesh.points_m.push_back(centre + Vec3{0, 0, profile.front()[1]});
  for (std::uint32_t ring = 0; ring < rings; ++ring)
    for (std::uint32_t m = 0; m < count; ++m) {
      const double angle = 2 * std::numbers::pi * m / count;
      const auto [radius, z] = profile[ring + 1];
      mesh.points_m.push_back(centre + Vec3{radius * std::cos(angle), radius * std::sin(angle), z});
    }
  mesh.points_m.push_back(centre + Vec3{0, 0, profile.back()[1]});
  const auto last = static_cast<std::uint32_t>(mesh.points_m.size() - 1);
  const auto at = [&](std::uint32_t ring, std::uint32_t m) { return 1 + ring * count + m % count; };
  for (std::uint32_t m = 0; m < count; ++m) {
    mesh.triangles.push_back({0, at(0, m + 1), at(0, m)});
    for (std::uint32_t ring = 0; ring + 1 < rings; ++ring) {
      mesh.triangles.push_back({at(ring, m), at(ring, m + 1), at(ring + 1, m + 1)});
      mesh.triangles.push_back({at(ring, m), at(ring + 1, m + 1), at(ring + 1, m)});
    }
    mesh.triangles.push_back({last, at(rings - 1, m), at(rings - 1, m + 1)});
  }
  return mesh;
}

std::string text(double number) {
  return fmt::format("{:.9g}", number);
}

constexpr double kMillimetres = 1e3;

}  // namespace

MadeUpBody boxBody(const Vec3& centre, const Vec3& size) {
  MadeUpBody body;
  const Vec3 half = 0.5 * size;
  for (unsigned corner = 0; corner < 8; ++corner)
    body.mesh.points_m.push_back(centre + Vec3{(corner & 1U) != 0 ? half.x : -half.x,
                                               (corner & 2U) != 0 ? half.y : -half.y,
                                               (corner & 4U) != 0 ? half.z : -half.z});
  body.mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                         {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  body.distance_m = [centre, half](const Vec3& p) {
    const Vec3 q{std::abs(p.x - centre.x) - half.x, std::abs(p.y - centre.y) - half.y,
                 std::abs(p.z - centre.z) - half.z};
    const Vec3 out{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
    return norm(out) + std::min(0.0, std::max({q.x, q.y, q.z}));
  };
  return body;
}

MadeUpBody capsuleBody(const Vec3& centre, double half_length, double radius, int parallels) {
  std::vector<std::array<double, 2>> profile;
  for (int i = 0; i <= parallels; ++i) {
    const double latitude = std::numbers::pi * (static_cast<double>(i) / parallels - 0.5);
    const double shift = latitude < 0 ? -half_length : half_length;
    const bool is_pole = i == 0 || i == parallels, is_equator = 2 * i == parallels;
    // the cylinder in rings, so that its faces are not long
    for (int ring = 0; is_equator && half_length > 0 && ring < parallels; ++ring)
      profile.push_back({radius, half_length * (2.0 * ring / parallels - 1)});
    profile.push_back({is_pole ? 0 : radius * std::cos(latitude),
                       radius * std::sin(latitude) + (is_equator ? half_length : shift)});
  }
  MadeUpBody body;
  body.mesh = revolved(centre, profile, 2 * parallels);
  // half the angle between neighbours, on both axes of a quadrilateral
  body.sagitta_m = 2 * radius * (1 - std::cos(std::numbers::pi / (2 * parallels)));
  body.distance_m = [=](const Vec3& p) {
    const Vec3 q = p - centre;
    return norm(q - Vec3{0, 0, std::clamp(q.z, -half_length, half_length)}) - radius;
  };
  return body;
}

MadeUpBody sphereBody(const Vec3& centre, double radius, int parallels) {
  return capsuleBody(centre, 0, radius, parallels);
}

MadeUpBody torusBody(const Vec3& centre, double radius, double tube, int sections) {
  MadeUpBody body;
  const auto n = static_cast<std::uint32_t>(2 * sections), m = static_cast<std::uint32_t>(sections);
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t j = 0; j < m; ++j) {
      const double u = 2 * std::numbers::pi * i / n, v = 2 * std::numbers::pi * j / m;
      const double r = radius + tube * std::cos(v);
      body.mesh.points_m.push_back(centre + Vec3{r * std::cos(u), r * std::sin(u), tube * std::sin(v)});
    }
  const auto at = [=](std::uint32_t i, std::uint32_t j) { return i % n * m + j % m; };
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t j = 0; j < m; ++j) {
      body.mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      body.mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  body.sagitta_m =
      tube * (1 - std::cos(std::numbers::pi / m)) + (radius + tube) * (1 - std::cos(std::numbers::pi / n));
  body.distance_m = [=](const Vec3& p) {
    const Vec3 q = p - centre;
    return std::hypot(std::hypot(q.x, q.y) - radius, q.z) - tube;
  };
  return body;
}

MadeUpBody unionOf(const MadeUpBody& a, const MadeUpBody& b) {
  MadeUpBody body = a;
  const auto shift = static_cast<std::uint32_t>(a.mesh.points_m.size());
  body.mesh.points_m.insert(body.mesh.points_m.end(), b.mesh.points_m.begin(), b.mesh.points_m.end());
  for (const solids::Triangle& t : b.mesh.triangles)
    body.mesh.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  body.sagitta_m = std::max(a.sagitta_m, b.sagitta_m);
  body.distance_m = [a = a.distance_m, b = b.distance_m](const Vec3& p) { return std::min(a(p), b(p)); };
  return body;
}

MadeUpBody turned(const MadeUpBody& original) {
  MadeUpBody body = original;
  for (Vec3& p : body.mesh.points_m) p = {p.z, p.x, p.y};
  body.distance_m = [distance = original.distance_m](const Vec3& p) { return distance({p.y, p.z, p.x}); };
  return body;
}

solids::LabelMap labelsOf(const Distance& distance, const std::array<int, 3>& size,
                          const std::array<Vec3, 3>& steps, const Vec3& origin) {
  solids::LabelMap map{size, steps, origin, {}};
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) map.inside.push_back(distance(map.centreOf(i, j, k)) < 0 ? 1 : 0);
  return map;
}

std::string binaryStl(const TriangleMesh& mesh, std::string header) {
  header.resize(80, '\0');
  std::string file = header + bytesOf(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const solids::Triangle& t : mesh.triangles) {
    file += std::string(12, '\0');  // a normal of zeros, as some programs write
    for (const std::uint32_t corner : t) {
      const Vec3 p = kMillimetres * mesh.points_m[corner];
      for (const double number : {p.x, p.y, p.z}) file += bytesOf(static_cast<float>(number));
    }
    file += "\xff\x80";  // an attribute that is no length
  }
  return file;
}

std::string asciiStl(const TriangleMesh& mesh, const std::string& title) {
  std::string file = "solid " + title + "\n";
  for (const solids::Triangle& t : mesh.triangles) {
    file += "  facet normal 0 0 0\n    outer loop\n";
    for (const std::uint32_t corner : t) {
      const Vec3 p = kMillimetres * mesh.points_m[corner];
      file += "      vertex " + text(p.x) + " " + text(p.y) + " " + text(p.z) + "\n";
    }
    file += "    endloop\n  endfacet\n";
  }
  return file + "endsolid " + title + "\n";
}

std::string objFile(const TriangleMesh& mesh, const std::string& comment) {
  std::string file = comment.empty() ? "" : "# " + comment + "\n";
  for (const Vec3& point : mesh.points_m) {
    const Vec3 p = kMillimetres * point;
    file += "v " + text(p.x) + " " + text(p.y) + " " + text(p.z) + "\n";
  }
  for (const solids::Triangle& t : mesh.triangles)
    file += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return file;
}

std::string plyFile(const TriangleMesh& mesh, const std::string& format, const std::string& line_end) {
  std::string file;
  // an unknown property of each kind, and an unknown element, have to be skipped
  for (const std::string& line :
       {std::string("ply"), "format " + format + " 1.0", std::string("comment SPACE=LPS"),
        fmt::format("element vertex {}", mesh.points_m.size()), std::string("property float x"),
        std::string("property uchar red"), std::string("property float y"), std::string("property double z"),
        std::string("element note 2"), std::string("property list uchar short words"),
        fmt::format("element face {}", mesh.triangles.size()),
        std::string("property list uchar int vertex_indices"), std::string("property ushort group"),
        std::string("end_header")})
    file += line + line_end;
  const bool is_ascii = format == "ascii";
  const std::endian order = format == "binary_big_endian" ? std::endian::big : std::endian::little;
  const auto add = [&]<typename Number>(Number number) {
    if (!is_ascii)
      file += bytesOf(number, order);
    else if constexpr (sizeof(Number) == 1)
      file += std::to_string(static_cast<int>(number)) + " ";
    else
      file += fmt::format("{:.9g} ", static_cast<double>(number));
  };
  const auto endLine = [&] {
    if (is_ascii) file += line_end;
  };
  for (const Vec3& point : mesh.points_m) {
    const Vec3 p = kMillimetres * point;
    add(static_cast<float>(p.x));
    add(static_cast<unsigned char>(200));
    add(static_cast<float>(p.y));
    add(p.z);
    endLine();
  }
  for (int i = 0; i < 2; ++i) {
    add(static_cast<unsigned char>(i));
    for (int k = 0; k < i; ++k) add(static_cast<std::int16_t>(-7));
    endLine();
  }
  for (const solids::Triangle& t : mesh.triangles) {
    add(static_cast<unsigned char>(3));
    for (const std::uint32_t corner : t) add(static_cast<std::int32_t>(corner));
    add(static_cast<std::uint16_t>(9));
    endLine();
  }
  return file;
}

std::string gzipped(const std::string& bytes) {
  z_stream stream{};
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::runtime_error("zlib");
  std::string out(deflateBound(&stream, bytes.size()) + 64, '\0');
  std::string in = bytes;
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const int status = deflate(&stream, Z_FINISH);
  out.resize(out.size() - stream.avail_out);
  deflateEnd(&stream);
  if (status != Z_STREAM_END) throw std::runtime_error("zlib");
  return out;
}

std::string nrrdHeader(const std::vector<std::string>& lines) {
  std::string header = "NRRD0004\n";
  for (const std::string& line : lines) header += line + "\n";
  return header + "\n";
}

std::string MadeUpNifti::file(std::endian order) const {
  std::string bytes(352, '\0');
  const auto put = [&](std::size_t at, auto number) {
    bytes.replace(at, sizeof(number), bytesOf(number, order));
  };
  put(0, std::int32_t{348});
  for (std::size_t i = 0; i < 8; ++i) put(40 + 2 * i, dim[i]);
  put(70, datatype);
  for (std::size_t i = 0; i < 8; ++i) put(76 + 4 * i, pixdim[i]);
  put(108, vox_offset);
  put(112, scl_slope);
  put(116, scl_inter);
  bytes[123] = xyzt_units;
  put(252, qform_code);
  put(254, sform_code);
  for (std::size_t i = 0; i < 3; ++i) put(256 + 4 * i, quatern[i]);
  for (std::size_t i = 0; i < 3; ++i) put(268 + 4 * i, qoffset[i]);
  for (std::size_t i = 0; i < 12; ++i) put(280 + 4 * i, srow[i]);
  bytes.replace(344, 4, magic);
  return bytes + voxels;
}

}  // namespace hapticd::test

// SPDX-License-Identifier: Apache-2.0
// Mesh files: the first byte chooses the format, the rest is the file. What is accepted has finite points in
// the permitted range and no index beyond them.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tests/fuzz/seeds.h"
#include "tests/unit/tools/solids/made_up_solids.h"
#include "tools/lib/solids/files/mesh_reader.h"

namespace {

using namespace hapticd;

constexpr const char* kNames[] = {"a.stl", "a.obj", "a.ply"};

}  // namespace

std::vector<std::string> seeds() {
  const solids::TriangleMesh mesh = test::boxBody({0.03, -0.05, 0.2}, {0.02, 0.03, 0.04}).mesh;
  const std::string stl(1, '\0'), obj(1, '\1'), ply(1, '\2');
  return {stl + test::binaryStl(mesh, "3D Slicer output. SPACE=LPS"),
          stl + test::binaryStl(mesh, "solid SPACE=RAS") + "\x80",
          stl + test::asciiStl(mesh, "body SPACE=LPS"),
          stl +
              "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 9,5 0 0\nvertex 0 9 "
              "0\nendloop\nendfacet\n",
          obj + test::objFile(mesh, "SPACE=LPS"),
          obj + "v 0 0 0 1\nv 9 0 0\nv 9 9 0\nv 0 9 0\nf 1/2/3 2//1 \\\n3 -1\n",
          ply + test::plyFile(mesh, "ascii"),
          ply + test::plyFile(mesh, "binary_little_endian", "\r\n"),
          ply + test::plyFile(mesh, "binary_big_endian")};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  solids::MeshOptions options;
  options.unit = solids::Unit::millimetre;
  const auto file = solids::meshFrom(bytes, kNames[data[0] % 3], options);
  if (!file) {
    require(!file.error().where.empty() && !file.error().what.empty() && !file.error().remedy.empty());
    return 0;
  }
  require(!file->mesh.triangles.empty());
  for (const rt::Vec3& point : file->mesh.points_m) require(rt::isFinite(point) && norm(point) <= 200);
  for (const solids::Triangle& triangle : file->mesh.triangles)
    for (const std::uint32_t corner : triangle) require(corner < file->mesh.points_m.size());
  return 0;
}

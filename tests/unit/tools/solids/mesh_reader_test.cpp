// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/files/mesh_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"
#include "tests/unit/tools/solids/made_up_solids.h"

// Mesh files of all variants, written here; the mesh that was written is the oracle.
namespace hapticd::solids {
namespace {

using rt::Vec3;

const Vec3 kCentre{0.03, -0.05, 0.2};
const TriangleMesh& writtenMesh() {
  static const TriangleMesh mesh = test::boxBody(kCentre, {0.02, 0.03, 0.04}).mesh;
  return mesh;
}

/// Half a unit in the last place of a float of 0.2 m in millimetres, with a margin for the conversion.
constexpr double kFloat_m = 1e-8;

void expectSameFaces(const TriangleMesh& read, const TriangleMesh& written, const std::string& what) {
  ASSERT_EQ(read.triangles.size(), written.triangles.size()) << what;
  EXPECT_EQ(read.points_m.size(), written.points_m.size()) << what;
  for (std::size_t i = 0; i < read.triangles.size(); ++i)
    for (std::size_t corner = 0; corner < 3; ++corner)
      EXPECT_LT(
          norm(read.points_m[read.triangles[i][corner]] - written.points_m[written.triangles[i][corner]]),
          kFloat_m)
          << what;
}

struct Variant {
  std::string name, bytes;
};
std::vector<Variant> variants() {
  const TriangleMesh& mesh = writtenMesh();
  return {{"binary.stl", test::binaryStl(mesh, "3D Slicer output. SPACE=LPS")},
          {"solid.stl", test::binaryStl(mesh, "solid in spite of being binary, SPACE=LPS")},
          {"ascii.stl", test::asciiStl(mesh, "body SPACE=LPS")},
          {"body.obj", test::objFile(mesh, "SPACE=LPS")},
          {"ascii.ply", test::plyFile(mesh, "ascii")},
          {"crlf.ply", test::plyFile(mesh, "ascii", "\r\n")},
          {"little.ply", test::plyFile(mesh, "binary_little_endian")},
          {"crlf_little.ply", test::plyFile(mesh, "binary_little_endian", "\r\n")},
          {"big.ply", test::plyFile(mesh, "binary_big_endian")}};
}

TEST(MeshReader, ReadsEachFormatAsItWasWritten) {
  for (const Variant& variant : variants()) {
    const auto file = meshFrom(variant.bytes, variant.name);
    ASSERT_TRUE(file) << file.error().text();
    expectSameFaces(file->mesh, writtenMesh(), variant.name);
    EXPECT_EQ(file->report.frame_from, KnownFrom::file) << variant.name;
    EXPECT_EQ(file->report.topology.boundary_edges, 0U) << variant.name;
    EXPECT_TRUE(file->report.warnings.empty()) << variant.name << ": " << file->report.warnings[0];
    EXPECT_NEAR(file->report.low_mm.x, 20, 1e-4);
    EXPECT_NEAR(file->report.high_mm.z, 220, 1e-4);
  }
}

TEST(MeshReader, TurnsRasByTheNoteOrTheOption) {
  TriangleMesh ras = writtenMesh();
  for (Vec3& p : ras.points_m) p = {-p.x, -p.y, p.z};
  MeshOptions given;
  given.frame = Frame::ras;
  const auto noted = meshFrom(test::binaryStl(ras, "SPACE=RAS"), "a.stl");
  const auto optional = meshFrom(test::binaryStl(ras), "a.stl", given);
  ASSERT_TRUE(noted && optional);
  expectSameFaces(noted->mesh, writtenMesh(), "note");
  expectSameFaces(optional->mesh, writtenMesh(), "option");
  EXPECT_EQ(optional->report.frame_from, KnownFrom::option);
  const auto contrary = meshFrom(test::asciiStl(writtenMesh(), "SPACE=LPS"), "a.stl", given);
  ASSERT_TRUE(contrary);
  expectSameFaces(contrary->mesh, writtenMesh(), "the file decides");
  EXPECT_EQ(contrary->report.warnings.size(), 1U);
}

TEST(MeshReader, WarnsWhereTheFrameIsAssumedAndRefusesAnUnknownOne) {
  const auto silent = meshFrom(test::binaryStl(writtenMesh()), "a.stl");
  ASSERT_TRUE(silent);
  EXPECT_EQ(silent->report.frame_from, KnownFrom::assumed);
  EXPECT_EQ(silent->report.warnings.size(), 1U);
  EXPECT_FALSE(meshFrom(test::binaryStl(writtenMesh(), "SPACE=scanner-xyz"), "a.stl"));
}

TEST(MeshReader, AsksForTheUnitUnlessTheSizeTellsIt) {
  const auto scaled = [](double factor) {
    TriangleMesh mesh = writtenMesh();
    for (Vec3& p : mesh.points_m) p = factor * p;
    return mesh;
  };
  MeshOptions metres;
  metres.unit = Unit::metre;
  const auto in_metres = meshFrom(test::asciiStl(scaled(1e-3)), "a.stl", metres);
  ASSERT_TRUE(in_metres) << in_metres.error().text();
  EXPECT_NEAR(in_metres->report.high_mm.x - in_metres->report.low_mm.x, 20, 1e-6);
  for (const double factor : {1e-3, 0.05, 100.0, 1e6}) {
    const auto file = meshFrom(test::asciiStl(scaled(factor)), "a.stl");
    ASSERT_FALSE(file) << factor;
    EXPECT_NE(file.error().remedy.find("unit"), std::string::npos);
  }
}

TEST(MeshReader, ReadsObjWithPolygonsRelativeIndicesAndContinuedLines) {
  const auto file = meshFrom(
      "# SPACE=LPS\nv 0 0 0 1.0\nv 10 0 0 0.5 0.5 0.5\nv 10 10 0\nv 0 10 0\nv 0 0 10\nvn 0 0 1\nvt 0 0\ng "
      "part\n"
      "f 4//1 3/1/1 \\\n 2/1 1\nf -5 -4 -1\nf 2 3 5\nf 3 4 5\nf 4 1 5\n",
      "a.obj");
  ASSERT_TRUE(file) << file.error().text();
  EXPECT_EQ(file->mesh.triangles.size(), 6U);
  EXPECT_EQ(file->report.topology.boundary_edges, 0U);
  EXPECT_EQ(file->report.topology.reversed_edges, 0U);
}

TEST(MeshReader, ReadsSeveralSolidsDecimalCommasAndAMissingEnd) {
  const TriangleMesh other = test::boxBody({0.1, 0, 0}, {0.01, 0.01, 0.01}).mesh;
  std::string two = test::asciiStl(writtenMesh()) + test::asciiStl(other);
  two.resize(two.rfind("endsolid"));
  std::ranges::replace(two, '.', ',');
  const auto file = meshFrom(two, "a.stl");
  ASSERT_TRUE(file) << file.error().text();
  EXPECT_EQ(file->mesh.triangles.size(), 24U);
  EXPECT_EQ(file->report.warnings.size(), 2U);  // the frame, and the missing end
}

TEST(MeshReader, AcceptsABinaryStlThatIsTooLong) {
  const auto file = meshFrom(test::binaryStl(writtenMesh(), "SPACE=LPS") + "\x80 trailing", "a.stl");
  ASSERT_TRUE(file) << file.error().text();
  expectSameFaces(file->mesh, writtenMesh(), "long");
  EXPECT_EQ(file->report.warnings.size(), 1U);
}

/// A part of a file either is an error that names the file, or a mesh with a warning or an open edge.
TEST(MeshReader, NoticesATruncationAtEveryByte) {
  for (const Variant& variant : variants()) {
    for (std::size_t size = 0; size < variant.bytes.size(); ++size) {
      const auto file = meshFrom(std::string_view(variant.bytes).substr(0, size), variant.name);
      if (!file) {
        EXPECT_TRUE(file.error().where.starts_with(variant.name)) << file.error().text();
        EXPECT_FALSE(file.error().what.empty() || file.error().remedy.empty()) << file.error().text();
        continue;
      }
      const bool lacks_only_an_end =
          variant.bytes.size() - size <= std::string("endsolid body SPACE=LPS\n").size();
      const bool has_all = file->mesh.triangles.size() == writtenMesh().triangles.size() && lacks_only_an_end;
      EXPECT_TRUE(!file->report.warnings.empty() || file->report.topology.boundary_edges > 0 || has_all)
          << variant.name << " " << size;
    }
  }
}

TEST(MeshReader, RefusesHostileNumbersWithoutAllocating) {
  const std::string stl_head(80, 'x');
  const std::vector<Variant> hostile{
      {"a.stl", stl_head + test::bytesOf(std::uint32_t{0xFFFFFFFF}) + std::string(50, '\x90')},
      // 84 + 50 n in 32 bits is 84 + 4
      {"a.stl", stl_head + test::bytesOf(std::uint32_t{85'899'346}) + std::string(4, '\x90')},
      {"a.ply",
       "ply\nformat ascii 1.0\nelement vertex 18446744073709551615\nproperty float x\nproperty float "
       "y\nproperty float z\nend_header\n0 0 0\n"},
      {"a.ply",
       "ply\nformat ascii 1.0\nelement note 9000000000000000000\nelement vertex 1\nproperty float "
       "x\nproperty float y\nproperty float z\nend_header\n0 0 0\n"},
      {"a.ply",
       "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty "
       "float z\nproperty list uint double w\nend_header\n" +
           std::string(12, '\0') + std::string(4, '\xff')},
      {"a.ply",
       "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
       "z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n3 0 0 4294967296\n"},
      {"a.obj", "v 0 0 0\nf 1 2 99999999999999999999\n"},
      {"a.obj", "v 0 0 0\nf 1 1 2\n"},
      {"a.obj", "v 0 0 0\nf -1 -1 -2\n"},
      {"a.obj", "v 0 0 nan\n"},
      {"a.stl", "solid\nfacet\nvertex 0 0 1e300\n"},
      {"a.stl", "solid\nfacet\nvertex 0 0 1\nvertex 0 0 2\nendfacet\n"}};
  for (const Variant& variant : hostile) {
    const auto file = meshFrom(variant.bytes, variant.name);
    ASSERT_FALSE(file) << variant.bytes;
    EXPECT_FALSE(file.error().remedy.empty());
  }
  MeshOptions few;
  few.limits.triangles = 11;
  for (const Variant& variant : variants())
    EXPECT_FALSE(meshFrom(variant.bytes, variant.name, few)) << variant.name;
}

/// What would be left out, or taken for something else, is refused, with a word of the reason.
TEST(MeshReader, RefusesWhatItWouldReadInPart) {
  const TriangleMesh& mesh = writtenMesh();
  const std::string stl = test::binaryStl(mesh, "SPACE=LPS");
  const auto counting = [&](std::uint32_t count) {
    return std::string(stl).replace(80, 4, test::bytesOf(count));
  };
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  std::string vertices;
  for (int i = 0; i < 6; ++i) vertices += "element vertex 1\n" + xyz;
  struct Case {
    std::string name, bytes, reason;
  };
  const std::vector<Case> cases{
      {"count_0.stl", counting(0), "announces 0"},
      {"count_half.stl", counting(6), "no further body"},
      {"other_frame.stl", stl + test::binaryStl(mesh, "SPACE=RAS"), "SPACE=RAS"},
      {"mark.obj", "\xef\xbb\xbf\xef\xbb\xbfv 0 0 0\nv 9 0 0\nv 0 9 0\nv 9 9 0\nf 1 2 3\n", "not a word"},
      {"surface.obj", test::objFile(mesh) + "surf 0 1 0 1 1 2 3 4\n", "not made of faces"},
      {"bow.obj", "v 0 0 0\nv 9 9 0\nv 9 0 0\nv 0 9 0\nf 1 2 3 4\n", "crosses itself"},
      {"twice_round.obj", "v 0 0 0\nv 9 0 0\nv 9 9 0\nv 0 9 0\nv 1 1 0\nv 8 1 0\nv 8 8 0\nf 1 2 3 4 5 6 7\n",
       "crosses itself"},
      {"six.ply", "ply\nformat ascii 1.0\n" + vertices + "end_header\n0 0 0\n", "each once"},
      {"order.ply",
       "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\nelement vertex 3\n" +
           xyz + "end_header\n3 0 1 2\n0 0 0\n9 0 0\n0 9 0\n",
       "before the faces"}};
  for (const Case& one : cases) {
    const auto file = meshFrom(one.bytes, one.name);
    ASSERT_FALSE(file) << one.name;
    EXPECT_NE(file.error().text().find(one.reason), std::string::npos) << file.error().text();
  }
}

TEST(MeshReader, ReadsFacesWithHoles) {
  // a square of 30 mm with one of 10 mm in it, joined by a bridge that is passed twice
  const auto file = meshFrom(
      "# SPACE=LPS\nv 0 0 0\nv 30 0 0\nv 30 30 0\nv 0 30 0\nv 10 10 0\nv 10 20 0\nv 20 20 0\nv 20 10 0\n"
      "f 1 2 3 4 1 5 6 7 8 5\n",
      "a.obj");
  ASSERT_TRUE(file) << file.error().text();
  double area_m2 = 0;
  for (const Triangle& t : file->mesh.triangles) {
    const auto& p = file->mesh.points_m;
    area_m2 += norm(cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]])) / 2;
  }
  EXPECT_NEAR(area_m2, 800e-6, 1e-12);
}

TEST(MeshReader, NamesTheFormatsForAnotherEnding) {
  const auto file = meshFrom("x", "model.vtk");
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().text().find("STL"), std::string::npos);
}

TEST(MeshReader, ReadsAFileAndNamesOneThatIsMissing) {
  const test::TemporaryFolder folder;
  const auto path = folder.write("body.STL", test::binaryStl(writtenMesh()));
  EXPECT_TRUE(readMesh(path));
  const auto missing = readMesh(folder.path() / "other.stl");
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().where.find("other.stl"), std::string::npos);
}

TEST(MeshRepair, WeldsWithinAMillionthOfTheDiagonalOnly) {
  // each corner of each triangle is a point of its own, moved a little
  std::mt19937_64 random(1);
  for (const double share : {0.0, 0.2, 30.0}) {
    const TriangleMesh& box = writtenMesh();
    const double offset_m = share * kWeldShare * boundsOf(box.points_m).diagonal_m();
    std::uniform_real_distribution<double> noise_m(-offset_m, offset_m);
    TriangleMesh soup;
    for (const Triangle& t : box.triangles) {
      const auto first = static_cast<std::uint32_t>(soup.points_m.size());
      for (const std::uint32_t corner : t)
        soup.points_m.push_back(box.points_m[corner] +
                                Vec3{noise_m(random), noise_m(random), noise_m(random)});
      soup.triangles.push_back({first, first + 1, first + 2});
    }
    const Topology topology = repair(soup);
    EXPECT_EQ(soup.points_m.size() == 8, share < 1) << share;
    if (share == 0.2) {
      EXPECT_GT(soup.error_m, 0.5 * offset_m);
    }
    EXPECT_LE(soup.error_m, share < 1 ? 2 * std::sqrt(3) * offset_m : kWeldShare * 0.1);
    EXPECT_EQ(topology.boundary_edges == 0, share < 1) << share;
  }
}

TEST(MeshRepair, RemovesDuplicatesOfEitherOrientationAndFlatFaces) {
  TriangleMesh mesh = writtenMesh();
  const std::vector<Triangle> original = mesh.triangles;
  for (const Triangle& t : original) mesh.triangles.push_back({t[1], t[2], t[0]});
  for (const Triangle& t : original) mesh.triangles.push_back({t[1], t[0], t[2]});
  mesh.triangles.push_back({0, 1, 1});
  const Topology topology = repair(mesh);
  EXPECT_EQ(topology.duplicate_faces_removed, 24U);
  EXPECT_EQ(topology.flat_faces_removed, 1U);
  expectSameFaces(mesh, writtenMesh(), "first of each");
}

TEST(MeshRepair, TellsWhereAMeshIsOpen) {
  TriangleMesh mesh = writtenMesh();
  mesh.triangles.erase(mesh.triangles.begin(),
                       mesh.triangles.begin() + 2);  // the face at low z, 20 mm x 30 mm
  mesh.triangles.pop_back();                         // half a face at high x
  const Topology topology = repair(mesh);
  // they touch in one corner and count as one opening
  EXPECT_EQ(topology.boundary_edges, 7U);
  ASSERT_EQ(topology.holes.size(), 1U);
  TriangleMesh apart = writtenMesh();
  apart.triangles.erase(apart.triangles.begin(), apart.triangles.begin() + 2);
  const Topology one = repair(apart);
  ASSERT_EQ(one.holes.size(), 1U);
  EXPECT_EQ(one.boundary_edges, 4U);
  EXPECT_NEAR(one.holes[0].extent_m, std::hypot(0.02, 0.03), 1e-9);
  EXPECT_LT(norm(one.holes[0].centre_m - (kCentre - Vec3{0, 0, 0.02})), 1e-9);
}

}  // namespace
}  // namespace hapticd::solids

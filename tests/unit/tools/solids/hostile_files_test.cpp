// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"
#include "tests/unit/tools/solids/made_up_solids.h"
#include "tools/lib/solids/files/label_reader.h"
#include "tools/lib/solids/files/mesh_reader.h"

// Files that nobody exports: each is refused by its name.
namespace hapticd::solids {
namespace {

namespace fs = std::filesystem;

class HostileFiles : public ::testing::Test {
 protected:
  static void expectRefused(const fs::path& file, const std::string& named) {
    const std::string ending = file.extension().string();
    const bool is_mesh = ending == ".stl" || ending == ".obj" || ending == ".ply" || ending == ".txt";
    const auto whereOf = [](const auto& read) { return read ? std::string("read") : read.error().where; };
    const std::string where = is_mesh ? whereOf(readMesh(file)) : whereOf(readLabel(file));
    EXPECT_NE(where.find(named), std::string::npos) << where;
  }

  test::TemporaryFolder folder_;
};

TEST_F(HostileFiles, AreRefusedByName) {
  const TriangleMesh box = test::boxBody({}, {0.03, 0.03, 0.03}).mesh;
  const std::string stl = test::binaryStl(box);
  std::string many = stl, not_a_number = stl;
  many.replace(80, 4, test::bytesOf(std::uint32_t{1'000'000'000}));
  not_a_number.replace(96, 4, test::bytesOf(std::numeric_limits<float>::quiet_NaN()));
  const std::string ply = test::plyFile(box, "binary_little_endian");
  std::string many_points = ply;
  many_points.replace(many_points.find("vertex 8"), 8, "vertex 1000000000");
  const std::vector<std::pair<std::string, std::string>> files{
      {"many.stl", many},
      {"nan.stl", not_a_number},
      {"short.stl", stl.substr(0, stl.size() - 30)},
      {"header.stl", stl.substr(0, 80)},
      {"many.ply", many_points},
      {"short.ply", ply.substr(0, ply.size() - 5)},
      {"nan.obj", "v nan 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n"},
      {"corner.obj", "v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 1000000000\n"},
      {"mesh.txt", stl},
      {"mesh.nrrd", stl},
      {"mesh.nii", stl},
      {"mesh.nii.gz", stl},
      {"short.nii.gz", test::gzipped(std::string(100'000, '\0')).substr(0, 40)},
      {"zeros.nii.gz", test::gzipped(std::string(std::size_t{1} << 24, '\0'))},
      {"empty.stl", ""},
      {"empty.obj", ""},
      {"empty.ply", ""},
      {"empty.nrrd", ""},
      {"empty.nii", ""},
      {"empty.nii.gz", ""}};
  for (const auto& [name, bytes] : files) expectRefused(folder_.write(name, bytes), name);
}

TEST_F(HostileFiles, ThatAreNotRegularAreNotRead) {
  for (const std::string ending : {".stl", ".obj", ".ply", ".nrrd", ".nii", ".nii.gz"}) {
    fs::create_symlink("/dev/zero", folder_.path() / ("zero" + ending));
    fs::create_directory(folder_.path() / ("folder" + ending));
    ASSERT_EQ(::mkfifo((folder_.path() / ("pipe" + ending)).c_str(), 0600), 0);
    for (const std::string name : {"zero", "folder", "pipe"})
      expectRefused(folder_.path() / (name + ending), name + ending);
  }
  fs::create_symlink("/dev/zero", folder_.path() / "zero.raw");
  expectRefused(
      folder_.write("detached.nhdr",
                    test::nrrdHeader({"type: uchar", "dimension: 3", "space: left-posterior-superior",
                                      "sizes: 9 9 9", "space directions: (1,0,0) (0,1,0) (0,0,1)",
                                      "space origin: (0,0,0)", "encoding: raw", "data file: zero.raw"})),
      "zero.raw");
}

/// A file that would fill the memory is refused by its size, before it is read.
TEST_F(HostileFiles, ThatAreHugeAreRefused) {
  for (const std::string name : {"huge.stl", "huge.obj", "huge.ply", "huge.nrrd", "huge.nii.gz"}) {
    fs::resize_file(folder_.write(name, "x"), std::uintmax_t{1} << 40);
    expectRefused(folder_.path() / name, name);
  }
}

}  // namespace
}  // namespace hapticd::solids

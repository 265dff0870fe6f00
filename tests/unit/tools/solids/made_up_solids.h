// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "rt/base/vec3.h"
#include "tools/lib/solids/files/label_reader.h"
#include "tools/lib/solids/files/mesh_repair.h"

/// Bodies whose signed distance is known in closed form, their meshes and label maps, and files of them in
/// the formats that are read.
namespace hapticd::test {

using Distance = std::function<double(const rt::Vec3&)>;  ///< metres, negative inside

/// A mesh and the true distance to the body that it approximates.
struct MadeUpBody {
  solids::TriangleMesh mesh;
  Distance distance_m;
  double sagitta_m = 0;  ///< the mesh is nowhere farther from the body
};

MadeUpBody boxBody(const rt::Vec3& centre_m, const rt::Vec3& size_m);
MadeUpBody sphereBody(const rt::Vec3& centre_m, double radius_m, int parallels = 48);
/// Along z.
MadeUpBody capsuleBody(const rt::Vec3& centre_m, double half_length_m, double radius_m, int parallels = 48);
/// About z.
MadeUpBody torusBody(const rt::Vec3& centre_m, double radius_m, double tube_m, int sections = 64);
/// Both meshes in one; the distance is that of the union outside, and has its sign inside.
MadeUpBody unionOf(const MadeUpBody& a, const MadeUpBody& b);
/// The same body turned by the rotation that carries z to x, x to y and y to z.
MadeUpBody turned(const MadeUpBody& body);

/// The voxels whose centres are inside. `steps_m`: along the axes of the map.
solids::LabelMap labelsOf(const Distance& distance_m, const std::array<int, 3>& size,
                          const std::array<rt::Vec3, 3>& steps_m, const rt::Vec3& origin_m);

/// Bytes of a number.
template <typename Number>
std::string bytesOf(Number number, std::endian order = std::endian::little) {
  std::array<char, sizeof(Number)> bytes = std::bit_cast<std::array<char, sizeof(Number)>>(number);
  if (order != std::endian::native) std::ranges::reverse(bytes);
  return {bytes.begin(), bytes.end()};
}

// Files of a mesh, in millimetres and in the frame in which the mesh is.
std::string binaryStl(const solids::TriangleMesh& mesh, std::string header = "");
std::string asciiStl(const solids::TriangleMesh& mesh, const std::string& title = "body");
std::string objFile(const solids::TriangleMesh& mesh, const std::string& comment = "");
/// `format`: ascii, binary_little_endian or binary_big_endian.
std::string plyFile(const solids::TriangleMesh& mesh, const std::string& format,
                    const std::string& line_end = "\n");

/// A gzip stream.
std::string gzipped(const std::string& bytes);

/// A header of NRRD: these lines, and the empty one.
std::string nrrdHeader(const std::vector<std::string>& lines);

/// A NIfTI-1 file with voxels of a byte.
struct MadeUpNifti {
  std::array<std::int16_t, 8> dim{3, 1, 1, 1, 1, 1, 1, 1};
  std::int16_t datatype = 2;
  std::array<float, 8> pixdim{1, 1, 1, 1, 1, 1, 1, 1};
  float vox_offset = 352, scl_slope = 0, scl_inter = 0;
  char xyzt_units = 2;
  std::int16_t qform_code = 0, sform_code = 0;
  std::array<float, 3> quatern{}, qoffset{};
  std::array<float, 12> srow{};
  std::string magic{"n+1\0", 4};
  std::string voxels;

  std::string file(std::endian order = std::endian::little) const;
};

/// Files of each format that a test makes: HAPTICD_RANDOM_FILES, or a few hundred.
inline int randomFiles() {
  const char* const number = std::getenv("HAPTICD_RANDOM_FILES");
  return number != nullptr ? std::atoi(number) : 300;
}

/// A text with other ends of lines than LF.
inline std::string withLineEnds(const std::string& text, const std::string& end) {
  std::string result;
  for (const char character : text) character == '\n' ? void(result += end) : result.push_back(character);
  return result;
}

class Dice {
 public:
  explicit Dice(unsigned seed) : random_(seed) {}

  double among(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  int whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  bool isTrue(double probability) { return among(0, 1) < probability; }
  std::string pick(const std::vector<std::string>& words) {
    return words[static_cast<std::size_t>(whole(0, static_cast<int>(words.size()) - 1))];
  }
  std::string lineEnd() { return pick({"\n", "\n", "\r\n", "\r"}); }
  /// With a byte-order mark and ends of lines as programs write them.
  std::string asText(const std::string& text) {
    return pick({"", "", "\xef\xbb\xbf"}) + withLineEnds(text, lineEnd());
  }

  /// A unit quaternion, its real part first and not negative.
  std::array<double, 4> quaternion() {
    std::normal_distribution<double> normal;
    std::array<double, 4> q{};
    for (double& part : q) part = normal(random_);
    const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3])) * (q[0] < 0 ? -1 : 1);
    for (double& part : q) part /= length;
    return q;
  }
  /// Where a rotation takes the axes: q v q*, multiplied out for a vector.
  static std::array<rt::Vec3, 3> axesOf(const std::array<double, 4>& q) {
    std::array<rt::Vec3, 3> axes{rt::Vec3{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const rt::Vec3 imaginary{q[1], q[2], q[3]};
    for (rt::Vec3& v : axes) {
      const rt::Vec3 twice = 2 * cross(imaginary, v);
      v = v + q[0] * twice + cross(imaginary, twice);
    }
    return axes;
  }
  std::array<rt::Vec3, 3> rotation() { return axesOf(quaternion()); }

 private:
  std::mt19937_64 random_;
};

}  // namespace hapticd::test

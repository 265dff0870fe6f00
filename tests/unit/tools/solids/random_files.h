// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "rt/base/vec3.h"
#include "tests/unit/tools/solids/made_up_solids.h"

/// What random files of all formats share.
namespace hapticd::test {

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

// SPDX-License-Identifier: Apache-2.0
#include "tests/support/recordings/made_up_scene.h"

#include <cmath>
#include <random>

namespace hapticd::test {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr int kFirstDeadColumn = 632;
constexpr std::uint16_t kNoMeasurement = 2047;

/// Returns the raw value without noise: the nearer of ball and wall.
double smoothRaw(int u, int v, std::uint32_t frame) {
  constexpr double kBallRadius_px = 90;
  const double wall = 860 + 0.05 * (u - kWidth / 2) + 0.03 * (v - kHeight / 2);
  const double x = (u - 280 - 10.0 * frame) / kBallRadius_px;
  const double y = (v - kHeight / 2) / kBallRadius_px;
  const double inside = 1 - x * x - y * y;
  return inside > 0 ? 720 - 40 * std::sqrt(inside) : wall;
}

std::uint16_t noisyRaw(double smooth, std::uint64_t random) {
  switch (random % 100) {
    case 0:
      return 0;  // 0.3 m, too near
    case 1:
      return 1085;  // behind the camera
    case 2:
      return 1040;  // 7.3 m, too far
    default:
      break;
  }
  if (random % 10 == 9) return kNoMeasurement;
  return static_cast<std::uint16_t>(std::lround(smooth) + static_cast<int>(random >> 32 & 3) % 3 - 1);
}

/// Returns a value in [0, 1), identical on every machine.
double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

rt::Vec3 anyDirection(std::mt19937_64& random) {
  for (;;) {
    const rt::Vec3 v{2 * uniform(random) - 1, 2 * uniform(random) - 1, 2 * uniform(random) - 1};
    const double length = norm(v);
    if (length > 0.01 && length <= 1) return {v.x / length, v.y / length, v.z / length};
  }
}

rt::Vec3 directionOf(std::size_t kind, const rt::Vec3& point, std::mt19937_64& random) {
  const double distance = norm(point);
  switch (kind) {
    case 1:
      return {point.x / distance, point.y / distance, point.z / distance};
    case 2:
      return {0, 0, 1};
    default:
      return anyDirection(random);
  }
}

}  // namespace

std::vector<std::uint16_t> wallImage(std::uint16_t raw) {
  return std::vector<std::uint16_t>(kWidth * kHeight, raw);
}

std::vector<std::uint16_t> sceneImage(std::uint32_t frame) {
  std::vector<std::uint16_t> raw;
  std::mt19937_64 random(1 + frame);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const std::uint16_t value = noisyRaw(smoothRaw(u, v, frame), random());
      raw.push_back(u < kFirstDeadColumn ? value : kNoMeasurement);
    }
  }
  return raw;
}

std::vector<rt::Vec3> positionsNear(const std::vector<rt::Vec3>& points_m, std::size_t count,
                                    std::uint64_t seed) {
  constexpr double kFarthest_m = 0.04;
  std::mt19937_64 random(seed);
  std::vector<rt::Vec3> positions_m;
  for (std::size_t i = 0; i < count; ++i) {
    rt::Vec3 position_m = points_m[random() % points_m.size()];
    const std::size_t kind = i % 4;
    const double offset = kFarthest_m * (2 * uniform(random) - 1);
    const rt::Vec3 direction = directionOf(kind, position_m, random);
    if (kind != 0) position_m += offset * direction;
    positions_m.push_back(position_m);
  }
  return positions_m;
}

}  // namespace hapticd::test

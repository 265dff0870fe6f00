// SPDX-License-Identifier: Apache-2.0
#include "tests/support/brute_force.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

namespace hapticd::test {
namespace {

constexpr std::size_t kWidth = 640;
constexpr std::size_t kHeight = 480;

/// Points whose distances differ by less are interchangeable.
constexpr double kTie_m = 1e-6;
/// Nearer points coincide with the HIP, where eq. (10) is undefined and its term is zero by definition.
constexpr double kCoincident_m = 1e-9;
/// Limit of alternatives; a scene with more is too symmetric to be compared.
constexpr std::size_t kMaxChoices = 20000;

struct Neighbour {
  double distance_m;
  Vector spring_n;  // F_k of eq. (10)
};

Neighbour neighbourOf(const Vector& point, const Vector& hip, const SpringLaw& law) {
  const double distance = distanceBetween(hip, point);
  Neighbour neighbour{distance, {}};
  if (distance < kCoincident_m) return neighbour;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    neighbour.spring_n[axis] =
        law.stiffness_n_per_m * (law.radius_m - distance) * (hip[axis] - point[axis]) / distance;
  }
  return neighbour;
}

Vector sumOf(std::span<const Neighbour> neighbours) {
  Vector sum{};
  for (const Neighbour& neighbour : neighbours) {
    for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += neighbour.spring_n[axis];
  }
  return sum;
}

Vector meanOf(const Vector& a, const Vector& b, std::size_t count) {
  const auto n = static_cast<double>(count);
  return {(a[0] + b[0]) / n, (a[1] + b[1]) / n, (a[2] + b[2]) / n};
}

/// Returns the points within D_thresh, nearest first.
std::vector<Neighbour> neighboursOf(const std::vector<Vector>& points, const Vector& hip,
                                    const SpringLaw& law) {
  std::vector<Neighbour> near;
  for (const Vector& point : points) {
    const double x = hip[0] - point[0], y = hip[1] - point[1], z = hip[2] - point[2];
    // a little more than the ball; the exact distance decides later
    if (x * x + y * y + z * z > law.radius_m * law.radius_m * 1.0001) continue;
    const Neighbour neighbour = neighbourOf(point, hip, law);
    if (neighbour.distance_m <= law.radius_m) near.push_back(neighbour);
  }
  std::ranges::stable_sort(near, {}, &Neighbour::distance_m);
  return near;
}

/// Returns the forces of all equally correct choices of `count` points where distances tie.
std::vector<Vector> forcesOfAllChoices(const std::vector<Neighbour>& near, std::size_t count) {
  const double last = near[count - 1].distance_m;
  const auto begin = std::ranges::upper_bound(near, last - kTie_m, {}, &Neighbour::distance_m);
  const auto end = std::ranges::lower_bound(near, last + kTie_m, {}, &Neighbour::distance_m);
  const auto certain = static_cast<std::size_t>(begin - near.begin());
  const Vector certain_sum = sumOf(std::span(near).first(certain));
  const std::vector<Neighbour> tied(begin, end);
  std::vector<bool> taken(tied.size(), false);
  std::fill_n(taken.begin(), count - certain, true);

  std::vector<Vector> forces;
  do {
    if (forces.size() == kMaxChoices) throw std::runtime_error("too many points are equally far");
    std::vector<Neighbour> choice;
    for (std::size_t i = 0; i < tied.size(); ++i) {
      if (taken[i]) choice.push_back(tied[i]);
    }
    forces.push_back(meanOf(certain_sum, sumOf(choice), count));
  } while (std::prev_permutation(taken.begin(), taken.end()));
  return forces;
}

}  // namespace

double distanceBetween(const Vector& a, const Vector& b) {
  const Vector v{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

std::vector<std::uint16_t> rawPixelsOf(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string header;
  std::getline(stream, header);
  std::vector<unsigned char> bytes(2 * kWidth * kHeight);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!stream) throw std::runtime_error("cannot read " + file.string());
  std::vector<std::uint16_t> raw(kWidth * kHeight);
  for (std::size_t pixel = 0; pixel < raw.size(); ++pixel) {
    raw[pixel] = static_cast<std::uint16_t>(bytes[2 * pixel] + 256 * bytes[2 * pixel + 1]);
  }
  return raw;
}

std::vector<Vector> pointsOf(std::span<const std::uint16_t> raw) {
  constexpr double fx = 594.214342, fy = 591.040537, cx = 339.307810, cy = 242.739138;
  constexpr double a = -0.003071102, b = 3.330949516;
  constexpr double near_m = 0.4, far_m = 4.0;
  std::vector<Vector> points;
  for (std::size_t v = 0; v < kHeight; ++v) {
    for (std::size_t u = 0; u < kWidth; ++u) {
      const int d = raw[v * kWidth + u];
      const double w = a * d + b;
      if (d >= 2047 || w <= 0 || 1 / w < near_m || 1 / w > far_m) continue;
      points.push_back(
          {(static_cast<double>(u) - cx) / fx / w, -(static_cast<double>(v) - cy) / fy / w, -1 / w});
    }
  }
  return points;
}

BruteForce::BruteForce(const std::vector<Vector>& points, const Vector& hip, const SpringLaw& law) {
  const std::vector<Neighbour> near = neighboursOf(points, hip, law);
  if (near.size() < law.min_points) {
    forces_.push_back({});
    return;
  }
  points_ = std::min(near.size(), law.max_points);
  forces_.push_back(meanOf(sumOf(std::span(near).first(points_)), {}, points_));
  if (near.size() == points_) return;
  const std::vector<Vector> choices = forcesOfAllChoices(near, points_);
  forces_.insert(forces_.end(), choices.begin(), choices.end());
}

double BruteForce::error_n(const Vector& force_n) const {
  double smallest = std::numeric_limits<double>::infinity();
  for (const Vector& right : forces_) smallest = std::min(smallest, distanceBetween(right, force_n));
  return smallest;
}

}  // namespace hapticd::test

// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/field/distance_transform.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace hapticd::solids {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t sizeAt(const GridSize& size, std::size_t axis) {
  return static_cast<std::size_t>(size[axis]);
}

/// Calls `work` with the samples of each line along an axis, which it may change.
template <typename Work>
void forEachLine(std::vector<float>& values, const GridSize& size, std::size_t axis, Work work) {
  const std::size_t length = sizeAt(size, axis);
  std::size_t step = 1;
  for (std::size_t before = 0; before < axis; ++before) step *= sizeAt(size, before);
  const std::size_t block = step * length;
  std::vector<double> line(length);
  for (std::size_t start = 0; start < values.size(); start += block)
    for (std::size_t offset = 0; offset < step; ++offset) {
      float* first = values.data() + start + offset;
      for (std::size_t i = 0; i < length; ++i) line[i] = static_cast<double>(first[i * step]);
      work(line);
      for (std::size_t i = 0; i < length; ++i) first[i * step] = static_cast<float>(line[i]);
    }
}

/// Replaces f(i) by the least of f(j) + (spacing (i - j))^2 over all j.
class LowerEnvelope {
 public:
  LowerEnvelope(std::size_t length, double spacing)
      : squared_spacing_(spacing * spacing), apex_(length), from_(length + 1), result_(length) {}

  void apply(std::vector<double>& line) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (line[i] == kInfinity) continue;
      double begin = -kInfinity;
      // a parabola that the new one undercuts everywhere is dropped
      while (count > 0) {
        const std::size_t last = apex_[count - 1];
        const auto a = static_cast<double>(last), b = static_cast<double>(i);
        begin = ((line[i] - line[last]) / squared_spacing_ + b * b - a * a) / (2 * (b - a));
        if (begin > from_[count - 1]) break;
        --count;
        begin = -kInfinity;
      }
      apex_[count] = i;
      from_[count] = begin;
      ++count;
    }
    if (count == 0) return;
    std::size_t at = 0;
    for (std::size_t i = 0; i < line.size(); ++i) {
      while (at + 1 < count && from_[at + 1] < static_cast<double>(i)) ++at;
      const double offset = static_cast<double>(i) - static_cast<double>(apex_[at]);
      result_[i] = line[apex_[at]] + squared_spacing_ * offset * offset;
    }
    std::ranges::copy(result_, line.begin());
  }

 private:
  double squared_spacing_;
  std::vector<std::size_t> apex_;  ///< of each parabola of the envelope
  std::vector<double> from_;       ///< where it begins to be the lowest
  std::vector<double> result_;
};

}  // namespace

std::vector<float> squaredDistances(std::span<const std::uint8_t> is_seed, const GridSize& size,
                                    const std::array<double, 3>& spacing) {
  std::vector<float> values(is_seed.size());
  std::ranges::transform(is_seed, values.begin(), [](std::uint8_t seed) {
    return seed != 0 ? 0.0F : std::numeric_limits<float>::infinity();
  });
  for (std::size_t axis = 0; axis < 3; ++axis) {
    LowerEnvelope envelope(sizeAt(size, axis), spacing[axis]);
    forEachLine(values, size, axis, [&](std::vector<double>& line) { envelope.apply(line); });
  }
  return values;
}

std::vector<float> signedDistances(std::span<const std::uint8_t> is_inside, const GridSize& size,
                                   double spacing) {
  std::vector<std::uint8_t> outside(is_inside.size());
  std::ranges::transform(is_inside, outside.begin(),
                         [](std::uint8_t inside) -> std::uint8_t { return inside == 0; });
  const std::array<double, 3> spacings{spacing, spacing, spacing};
  std::vector<float> values = squaredDistances(is_inside, size, spacings);
  const std::vector<float> to_outside = squaredDistances(outside, size, spacings);
  const auto half = static_cast<float>(spacing / 2);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = is_inside[i] != 0 ? half - std::sqrt(to_outside[i]) : std::sqrt(values[i]) - half;
  return values;
}

void smoothGaussian(std::vector<float>& values, const GridSize& size, const std::array<double, 3>& sigmas) {
  std::vector<double> weights, extended;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double sigma = sigmas[axis];
    if (!(sigma > 0)) continue;
    const auto reach = static_cast<std::size_t>(std::ceil(4 * sigma));
    weights.resize(reach + 1);
    double sum = 0;
    for (std::size_t i = 0; i <= reach; ++i) {
      weights[i] = std::exp(-0.5 * static_cast<double>(i * i) / (sigma * sigma));
      sum += (i == 0 ? 1 : 2) * weights[i];
    }
    for (double& weight : weights) weight /= sum;
    const std::size_t length = sizeAt(size, axis);
    extended.resize(length + 2 * reach);
    forEachLine(values, size, axis, [&](std::vector<double>& line) {
      const std::size_t last = length - 1;
      std::ranges::copy(line, extended.begin() + static_cast<std::ptrdiff_t>(reach));
      for (std::size_t i = 1; i <= reach; ++i) {
        extended[reach - i] = 2 * line[0] - line[std::min(i, last)];
        extended[reach + last + i] = 2 * line[last] - line[last - std::min(i, last)];
      }
      for (std::size_t i = 0; i < length; ++i) {
        double value = weights[0] * extended[reach + i];
        for (std::size_t k = 1; k <= reach; ++k)
          value += weights[k] * (extended[reach + i - k] + extended[reach + i + k]);
        line[i] = value;
      }
    });
  }
}

}  // namespace hapticd::solids

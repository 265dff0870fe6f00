// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/noise/noise_statistics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "tools/hapticbench/noise/window_residuals.h"
#include "tools/hapticbench/statistics.h"

namespace hapticd::tools {
namespace {

constexpr int kGroup = 8;  // frames of a mean
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// A sum of products and how many there are.
struct Mean {
  double sum = 0;
  double count = 0;

  void add(double value) {
    sum += value;
    count += 1;
  }
  double value() const { return count > 0 ? sum / count : kUnknown; }
};

/// The sums that the figures of one window are computed from.
struct Sums {
  Mean temporal;
  Mean first_half;
  Mean second_half;
  Mean both_halves;
  Mean groups;
  std::array<Mean, kTimeLags + 1> in_time;
  std::array<Mean, kSpaceLags + 1> in_space;
};

double meanOver(const WindowResiduals& residuals, std::size_t place, std::size_t first, std::size_t end) {
  double sum = 0;
  for (std::size_t i = first; i < end; ++i) sum += double{residuals.frames[i][place]};
  return sum / static_cast<double>(end - first);
}

void addOverTime(const NoiseSession& session, const WindowResiduals& residuals, std::size_t place,
                 Sums& sums) {
  const std::size_t frames = residuals.frames.size();
  const double mean = meanOver(residuals, place, 0, frames);
  double squares = 0;
  for (std::size_t i = 0; i < frames; ++i) {
    const double now = double{residuals.frames[i][place]};
    squares += (now - mean) * (now - mean);
    for (std::size_t j = i; j < frames; ++j) {
      const int lag = session.frames[j].period - session.frames[i].period;
      if (lag > kTimeLags) break;
      sums.in_time[static_cast<std::size_t>(lag)].add(now * double{residuals.frames[j][place]});
    }
  }
  sums.temporal.add(squares / static_cast<double>(frames - 1));
  const double first = meanOver(residuals, place, 0, frames / 2);
  const double second = meanOver(residuals, place, frames / 2, frames);
  sums.first_half.add(first * first);
  sums.second_half.add(second * second);
  sums.both_halves.add(first * second);
  for (std::size_t i = 0; i + kGroup <= frames; i += kGroup) {
    const double group = meanOver(residuals, place, i, i + kGroup);
    sums.groups.add(group * group);
  }
}

void addOverSpace(const WindowResiduals& residuals, Sums& sums) {
  const int side = residuals.side_px;
  const auto place = [side](int x, int y) { return static_cast<std::size_t>(y * side + x); };
  for (int lag = 0; lag <= kSpaceLags; ++lag) {
    Mean& mean = sums.in_space[static_cast<std::size_t>(lag)];
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x + lag < side; ++x) {
        for (const auto& [a, b] :
             {std::pair(place(x, y), place(x + lag, y)), std::pair(place(y, x), place(y, x + lag))}) {
          if (!residuals.steady[a] || !residuals.steady[b]) continue;
          for (const auto& frame : residuals.frames) mean.add(double{frame[a]} * double{frame[b]});
        }
      }
    }
  }
}

Sums sumsOf(const NoiseSession& session, const WindowResiduals& residuals) {
  Sums sums;
  for (std::size_t place = 0; place < residuals.steady.size(); ++place) {
    if (residuals.steady[place]) addOverTime(session, residuals, place, sums);
  }
  addOverSpace(residuals, sums);
  return sums;
}

/// Estimates a figure from those values that are known.
Estimate estimate(std::vector<double> values) {
  std::erase_if(values, [](double value) { return std::isnan(value); });
  if (values.empty()) return {kUnknown, kUnknown, kUnknown};
  Estimate result;
  result.value = quantile(values, 0.5);
  for (double& value : values) value -= result.value;
  constexpr double kMedianAgainstMean = 1.2533;  // sqrt(pi / 2): the median's error of a normal distribution
  result.spread = robustDeviation(values);
  result.standard_error = kMedianAgainstMean * result.spread / std::sqrt(static_cast<double>(values.size()));
  return result;
}

double deviation(const Mean& variance) {
  return std::sqrt(std::max(0.0, variance.value()));
}

double correlation(const Mean& product, const Mean& a, const Mean& b) {
  return product.value() / std::sqrt(a.value() * b.value());
}

void estimateAll(const std::vector<Sums>& windows, NoiseStatistics& statistics) {
  const auto of = [&windows](const auto& figure) {
    std::vector<double> values;
    values.reserve(windows.size());
    for (const Sums& window : windows) values.push_back(figure(window));
    return estimate(std::move(values));
  };
  statistics.temporal_raw = of([](const Sums& s) { return deviation(s.temporal); });
  statistics.static_raw = of([](const Sums& s) { return deviation(s.both_halves); });
  statistics.halves_correlation =
      of([](const Sums& s) { return correlation(s.both_halves, s.first_half, s.second_half); });
  statistics.left_after_8_raw = of([](const Sums& s) { return deviation(s.groups); });
  for (std::size_t i = 0; i <= kTimeLags; ++i)
    statistics.in_time.push_back(of([i](const Sums& s) { return s.in_time[i].value(); }));
  for (std::size_t i = 0; i <= kSpaceLags; ++i)
    statistics.in_space.push_back(of([i](const Sums& s) { return s.in_space[i].value(); }));
}

}  // namespace

NoiseStatistics measureNoise(const NoiseSession& session, int window_px) {
  NoiseStatistics statistics;
  statistics.window_px = window_px;
  std::vector<Sums> measured;
  for (const Window& window : windowsOf(window_px)) {
    const WindowResiduals residuals = residualsOf(session, window);
    statistics.with_holes += residuals.state == WindowState::with_holes;
    statistics.not_smooth += residuals.state == WindowState::not_smooth;
    statistics.moving += residuals.state == WindowState::moving;
    if (residuals.state == WindowState::good) measured.push_back(sumsOf(session, residuals));
  }
  statistics.windows = static_cast<int>(measured.size());
  estimateAll(measured, statistics);
  return statistics;
}

Estimate patternCorrelation(const NoiseSession& a, const NoiseSession& b, int window_px) {
  std::vector<double> correlations;
  for (const Window& window : windowsOf(window_px)) {
    const WindowResiduals of_a = residualsOf(a, window);
    const WindowResiduals of_b = residualsOf(b, window);
    if (of_a.state != WindowState::good || of_b.state != WindowState::good) continue;
    Mean squares_a;
    Mean squares_b;
    Mean products;
    for (std::size_t place = 0; place < of_a.steady.size(); ++place) {
      if (!of_a.steady[place] || !of_b.steady[place]) continue;
      const double in_a = meanOver(of_a, place, 0, of_a.frames.size());
      const double in_b = meanOver(of_b, place, 0, of_b.frames.size());
      squares_a.add(in_a * in_a);
      squares_b.add(in_b * in_b);
      products.add(in_a * in_b);
    }
    correlations.push_back(correlation(products, squares_a, squares_b));
  }
  return estimate(std::move(correlations));
}

}  // namespace hapticd::tools

#include "tools/hapticbench/noise/noise_statistics.h"

#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "tools/hapticbench/noise/window_residuals.h"

namespace hapticd::tools {
namespace {

constexpr int kGroup = 8;  // frames of a mean

/// A sum of products and how many there are.
struct Mean {
  double sum = 0;
  double count = 0;

  void add(double value) {
    sum += value;
    count += 1;
  }
  void add(const Mean& other, double sign) {
    sum += sign * other.sum;
    count += sign * other.count;
  }
  double value() const { return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN(); }
};

/// What the estimates of a window, or of all windows together, are made from.
struct Sums {
  Mean temporal;
  Mean first_half;
  Mean second_half;
  Mean both_halves;
  Mean groups;
  std::array<Mean, kTimeLags + 1> in_time;
  std::array<Mean, kSpaceLags + 1> in_space;

  void add(const Sums& other, double sign) {
    temporal.add(other.temporal, sign);
    first_half.add(other.first_half, sign);
    second_half.add(other.second_half, sign);
    both_halves.add(other.both_halves, sign);
    groups.add(other.groups, sign);
    for (std::size_t i = 0; i < in_time.size(); ++i) in_time[i].add(other.in_time[i], sign);
    for (std::size_t i = 0; i < in_space.size(); ++i) in_space[i].add(other.in_space[i], sign);
  }
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

/// `figure` of all windows, with its error.
template <typename Part>
Estimate estimate(const std::vector<Part>& windows, const std::function<double(const Part&)>& figure) {
  Part all;
  for (const Part& window : windows) all.add(window, 1);
  Estimate result{figure(all), std::numeric_limits<double>::quiet_NaN()};
  double squares = 0;
  for (const Part& window : windows) {
    Part without = all;
    without.add(window, -1);
    const double change = figure(without) - result.value;
    squares += change * change;
  }
  const auto count = static_cast<double>(windows.size());
  if (count > 1) result.standard_error = std::sqrt((count - 1) / count * squares);
  return result;
}

void estimateAll(const std::vector<Sums>& windows, NoiseStatistics& statistics) {
  const auto of = [&windows](const std::function<double(const Sums&)>& figure) {
    return estimate<Sums>(windows, figure);
  };
  statistics.temporal_raw = of([](const Sums& s) { return std::sqrt(s.temporal.value()); });
  statistics.standing_raw = of([](const Sums& s) { return std::sqrt(std::max(0.0, s.both_halves.value())); });
  statistics.halves_correlation = of([](const Sums& s) {
    return s.both_halves.value() / std::sqrt(s.first_half.value() * s.second_half.value());
  });
  statistics.left_after_8_raw = of([](const Sums& s) { return std::sqrt(s.groups.value()); });
  for (std::size_t i = 0; i <= kTimeLags; ++i)
    statistics.in_time.push_back(of([i](const Sums& s) { return s.in_time[i].value(); }));
  for (std::size_t i = 0; i <= kSpaceLags; ++i)
    statistics.in_space.push_back(of([i](const Sums& s) { return s.in_space[i].value(); }));
}

/// What the mean images of two sessions have in common in a window.
struct PairSums {
  Mean a;
  Mean b;
  Mean both;

  void add(const PairSums& other, double sign) {
    a.add(other.a, sign);
    b.add(other.b, sign);
    both.add(other.both, sign);
  }
};

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
  std::vector<PairSums> windows;
  for (const Window& window : windowsOf(window_px)) {
    const WindowResiduals of_a = residualsOf(a, window);
    const WindowResiduals of_b = residualsOf(b, window);
    if (of_a.state != WindowState::good || of_b.state != WindowState::good) continue;
    PairSums sums;
    for (std::size_t place = 0; place < of_a.steady.size(); ++place) {
      if (!of_a.steady[place] || !of_b.steady[place]) continue;
      const double in_a = meanOver(of_a, place, 0, of_a.frames.size());
      const double in_b = meanOver(of_b, place, 0, of_b.frames.size());
      sums.a.add(in_a * in_a);
      sums.b.add(in_b * in_b);
      sums.both.add(in_a * in_b);
    }
    windows.push_back(sums);
  }
  return estimate<PairSums>(
      windows, [](const PairSums& s) { return s.both.value() / std::sqrt(s.a.value() * s.b.value()); });
}

}  // namespace hapticd::tools

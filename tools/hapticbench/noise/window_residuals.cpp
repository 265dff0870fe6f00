// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/noise/window_residuals.h"

#include <algorithm>
#include <cmath>

#include "drivers/camera/kinect_image.h"
#include "tools/hapticbench/noise/noise_statistics.h"
#include "tools/hapticbench/quadratic_fit.h"
#include "tools/hapticbench/statistics.h"

namespace hapticd::tools {
namespace {

constexpr double kSmoothDeviation = 1.2;  // raw units; no sensor leaves as much on a smooth surface
constexpr double kSmoothOutliers = 0.02;
constexpr double kFarResidual = 6;  // raw units: a pixel that shows something else

std::size_t pixelOf(const Window& window, int x, int y) {
  return static_cast<std::size_t>(window.row + y) * drivers::kKinectWidth +
         static_cast<std::size_t>(window.column + x);
}

double placeIn(const Window& window, int pixel) {
  return (2 * pixel + 1) / double(window.side_px) - 1;
}

/// The mean over frames first..end-1 at every steady pixel.
std::vector<QuadraticSample> meanSamples(const NoiseSession& session, const Window& window,
                                         const std::vector<bool>& steady, std::size_t first,
                                         std::size_t end) {
  std::vector<QuadraticSample> samples;
  for (int y = 0; y < window.side_px; ++y) {
    for (int x = 0; x < window.side_px; ++x) {
      if (!steady[static_cast<std::size_t>(y * window.side_px + x)]) continue;
      double sum = 0;
      for (std::size_t i = first; i < end; ++i) sum += session.frames[i].raw[pixelOf(window, x, y)];
      samples.push_back({placeIn(window, x), placeIn(window, y), sum / static_cast<double>(end - first)});
    }
  }
  return samples;
}

std::vector<bool> steadyPixels(const NoiseSession& session, const Window& window) {
  std::vector<bool> steady;
  for (int y = 0; y < window.side_px; ++y) {
    for (int x = 0; x < window.side_px; ++x) {
      const std::size_t pixel = pixelOf(window, x, y);
      steady.push_back(std::ranges::all_of(session.frames, [pixel](const NoiseSession::Frame& frame) {
        return frame.raw[pixel] < drivers::kKinectNoMeasurement;
      }));
    }
  }
  return steady;
}

/// Whether the mean of the first half and that of the second half differ by a motion of the surface.
bool moves(const std::vector<QuadraticSample>& before, const std::vector<QuadraticSample>& after) {
  std::vector<double> changes(before.size());
  for (std::size_t i = 0; i < before.size(); ++i) changes[i] = after[i].value - before[i].value;
  // a body that passes through a part of the window leaves the median alone
  constexpr double kLargestDeviation = 1.5;
  return std::abs(quantile(changes, 0.5)) > kMotionRaw || rootMeanSquare(changes) > kLargestDeviation;
}

void subtract(const Quadratic& surface, const NoiseSession& session, const Window& window,
              WindowResiduals& residuals) {
  const auto pixels = static_cast<std::size_t>(window.side_px) * static_cast<std::size_t>(window.side_px);
  residuals.frames.assign(session.frames.size(), std::vector<float>(pixels));
  for (int y = 0; y < window.side_px; ++y) {
    for (int x = 0; x < window.side_px; ++x) {
      const auto place = static_cast<std::size_t>(y * window.side_px + x);
      if (!residuals.steady[place]) continue;
      const double smooth = surface.at(placeIn(window, x), placeIn(window, y));
      bool far = false;
      for (std::size_t i = 0; i < session.frames.size(); ++i) {
        const double residual = session.frames[i].raw[pixelOf(window, x, y)] - smooth;
        far = far || std::abs(residual) > kFarResidual;
        residuals.frames[i][place] = static_cast<float>(residual);
      }
      if (!far) continue;
      residuals.steady[place] = false;
      for (auto& frame : residuals.frames) frame[place] = 0;
    }
  }
}

}  // namespace

std::size_t WindowResiduals::count() const {
  return static_cast<std::size_t>(std::ranges::count(steady, true));
}

WindowResiduals residualsOf(const NoiseSession& session, const Window& window) {
  WindowResiduals residuals;
  residuals.side_px = window.side_px;
  residuals.steady = steadyPixels(session, window);
  const auto required = kSteadyShare * static_cast<double>(residuals.steady.size());
  if (static_cast<double>(residuals.count()) < required) return residuals;
  const std::size_t half = session.frames.size() / 2;
  const std::size_t all = session.frames.size();
  const auto mean = meanSamples(session, window, residuals.steady, 0, all);
  // rounding alone leaves 0.29 raw units
  const auto fit = fitQuadratic(mean, {.least_deviation = 0.05, .outlier_deviations = 5, .least_outlier = 3});
  if (moves(meanSamples(session, window, residuals.steady, 0, half),
            meanSamples(session, window, residuals.steady, half, all))) {
    residuals.state = WindowState::moving;
    return residuals;
  }
  if (!fit || fit->deviation > kSmoothDeviation || fit->outlier_share > kSmoothOutliers) {
    residuals.state = WindowState::not_smooth;
    return residuals;
  }
  subtract(fit->quadratic, session, window, residuals);
  residuals.state = WindowState::good;
  return residuals;
}

std::vector<Window> windowsOf(int side_px) {
  std::vector<Window> windows;
  for (int row = 0; row + side_px <= drivers::kKinectHeight; row += side_px) {
    for (int column = 0; column + side_px <= drivers::SensorNoise::kFirstDeadColumn; column += side_px) {
      windows.push_back({column, row, side_px});
    }
  }
  return windows;
}

}  // namespace hapticd::tools

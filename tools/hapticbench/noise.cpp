// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/noise.h"

#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "rt/base/parameters.h"
#include "tools/hapticbench/disparity.h"
#include "tools/hapticbench/engine/study.h"
#include "tools/lib/depth_noise/depth_noise.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::tools {
namespace {

constexpr std::uint32_t kTicksPerPeriod = 2002155;  // of the camera's 60 MHz counter
constexpr double kPeriod_ns = 33.369e6;

/// Periods since `earlier`; at least one.
int periodsBetween(const drivers::RecordedFrame& earlier, const drivers::RecordedFrame& later) {
  const bool counts = earlier.device_ticks != 0 && later.device_ticks != 0;
  const std::uint32_t ticks = later.device_ticks - earlier.device_ticks;  // wraps as the counter does
  const double periods = counts ? static_cast<double>(ticks) / kTicksPerPeriod
                                : static_cast<double>(later.host_ns - earlier.host_ns) / kPeriod_ns;
  constexpr double kMaxPause = 1000;  // a counter that was reset is no reason for a lag of hours
  return static_cast<int>(std::lround(std::clamp(periods, 1.0, kMaxPause)));
}

}  // namespace

base::Result<std::size_t> framesOf(const std::filesystem::path& recording, std::size_t recorded, int wanted) {
  const std::size_t frames = std::min(recorded, static_cast<std::size_t>(wanted));
  if (frames >= kMinFrames) return frames;
  return std::unexpected(
      base::Error{recording.string(),
                  fmt::format("{} depth frames are too few, at least {} are needed", frames, kMinFrames),
                  "take another recording"});
}

base::Result<NoiseSession> readSession(const std::filesystem::path& recording, int frames) {
  const auto reader = drivers::RecordingReader::open(recording);
  if (!reader) return std::unexpected(reader.error());
  const auto& recorded = reader->frames();
  const auto measured = framesOf(recording, recorded.size(), frames);
  if (!measured) return std::unexpected(measured.error());
  NoiseSession session;
  const auto image = std::make_unique<rt::DepthFrame>();
  int period = 0;
  for (std::size_t i = 0; i < *measured; ++i) {
    const auto read = reader->read(i, *image);
    if (!read) return std::unexpected(read.error());
    if (i > 0) period += periodsBetween(recorded[i - 1], recorded[i]);
    session.frames.push_back({period, {image->raw, image->raw + drivers::kKinectPixels}});
  }
  return session;
}

NoiseSession madeUpSession(const drivers::SensorNoise& noise, int frames, double shift_raw) {
  const rt::DepthModelParameters camera;
  constexpr double kDistance_m = 1.8;
  const double slope = std::tan(25 * std::numbers::pi / 180);
  std::vector<float> exact;
  exact.reserve(drivers::kKinectPixels);
  for (int row = 0; row < drivers::kKinectHeight; ++row) {
    for (int column = 0; column < drivers::kKinectWidth; ++column) {
      const double x = (column - camera.cx_px) / camera.fx_px;
      const double y = (row - camera.cy_px) / camera.fy_px;
      const double inverse_depth = (1 + slope * x + slope * y) / kDistance_m;
      exact.push_back(static_cast<float>((inverse_depth - camera.b_per_m) / camera.a_per_m + shift_raw));
    }
  }
  NoiseSession session;
  for (int i = 0; i < frames; ++i) {
    session.frames.push_back({i, std::vector<std::uint16_t>(drivers::kKinectPixels)});
    noise.applySensor(static_cast<std::uint64_t>(i) + 1, exact, session.frames.back().raw.data());
  }
  return session;
}

namespace {

/// A square of the image.
struct Window {
  int column = 0;
  int row = 0;
  int side_px = 0;
};

enum class WindowState : std::uint8_t {
  good,
  with_holes,
  not_smooth,
  moving,
};

/// A window's disparities in every frame without its smooth surface, raw units.
struct WindowResiduals {
  WindowState state = WindowState::with_holes;
  int side_px = 0;
  std::vector<bool> steady;                ///< per pixel: measured in every frame, and not at an edge
  std::vector<std::vector<float>> frames;  ///< per frame and pixel; 0 where not steady

  std::size_t count() const { return static_cast<std::size_t>(std::ranges::count(steady, true)); }
};

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
  constexpr double kMaxDeviation = 1.5;
  return std::abs(quantile(changes, 0.5)) > kMotionRaw || rootMeanSquare(changes) > kMaxDeviation;
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

/// Returns the residuals of a window; the smooth surface is fitted to the mean over the frames.
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

/// Returns all adjacent windows with that side.
std::vector<Window> windowsOf(int side_px) {
  std::vector<Window> windows;
  for (int row = 0; row + side_px <= drivers::kKinectHeight; row += side_px) {
    for (int column = 0; column + side_px <= drivers::SensorNoise::kFirstDeadColumn; column += side_px) {
      windows.push_back({column, row, side_px});
    }
  }
  return windows;
}

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

namespace {

/// Null where it is not a number.
Figure figureOf(double value) {
  return std::isnan(value) ? Figure(nullptr) : Figure(value);
}

Row estimateCells(const std::string& key, const Estimate& estimate) {
  return {{key + "/value", "", 0, figureOf(estimate.value)},
          {key + "/spread", "", 0, figureOf(estimate.spread)},
          {key + "/standard_error", "", 0, figureOf(estimate.standard_error)}};
}

Row noiseCells(const NoiseStatistics& s) {
  Row row{{"/window_px", "window px", 0, s.window_px},
          {"/windows", "measured", 0, s.windows},
          {"/with_holes", "holes", 0, s.with_holes},
          {"/not_smooth", "rough", 0, s.not_smooth},
          {"/moving", "moving", 0, s.moving}};
  const auto add = [&row](const std::string& key, const char* heading, const Estimate& estimate) {
    row = joined(std::move(row), estimateCells(key, estimate));
    row.push_back({"", heading, 3, figureOf(estimate.value)});
  };
  const auto add_list = [&row](const std::string& key, const std::vector<Estimate>& lags) {
    for (std::size_t i = 0; i < lags.size(); ++i)
      row = joined(std::move(row), estimateCells(fmt::format("{}/{}", key, i), lags[i]));
  };
  add("/temporal_raw", "temporal", s.temporal_raw);
  add("/standing_raw", "static", s.static_raw);
  add("/halves_correlation", "halves", s.halves_correlation);
  add("/left_after_8_raw", "after 8", s.left_after_8_raw);
  add_list("/in_time_raw2", s.in_time);
  add_list("/in_space_raw2", s.in_space);
  return row;
}

struct NoiseOptions {
  std::string recording;
  std::string synthetic;  ///< setting of the synthetic camera
  int frames = 60;
};

/// Of a Kinect v1 or the synthetic one, in raw units.
Report reportOf(const std::string& source, const NoiseSession& session) {
  std::vector<NoiseStatistics> statistics;
  for (const int window_px : kWindowSides_px) statistics.push_back(measureNoise(session, window_px));
  Report report;
  report.note("/source", source);
  report.note("/frames", session.frames.size());
  report.table("windows", fmt::format("noise of {}, raw units\n", source), rowsOf(statistics, noiseCells));
  return report;
}

/// Measures a recording with camera.yaml, in metres and not in raw units as a Kinect's.
int runAnyCamera(const NoiseOptions& chosen, const drivers::RecordingReader& reader,
                 const StudyCommand& command) {
  const auto frames = framesOf(chosen.recording, reader.frames().size(), chosen.frames);
  if (!frames) return fail(frames.error(), EX_NOINPUT);
  DepthNoise noise;
  const auto frame = std::make_unique<rt::DepthFrame>();
  for (std::size_t i = 0; i < *frames; ++i) {
    if (const auto read = reader.read(i, *frame); !read) return fail(read.error(), EX_NOINPUT);
    noise.add(*frame);
  }
  const rt::DepthModelParameters& camera = *reader.camera();
  const DepthNoiseReport measured = noise.report();
  Report report;
  report.say(fmt::format("{}: {} frames of {} x {} pixels, {:.1f} % holes\n", chosen.recording,
                         measured.frames, camera.width_px, camera.height_px, 100 * measured.share_of_holes));
  report.say(textOf(measured, camera.principle));
  report.note("/source", chosen.recording);
  report.note("/frames", measured.frames);
  report.note("/shareOfHoles", measured.share_of_holes);
  addTo(report.document(), measured, camera.principle);
  return command.report(report);
}

int runNoise(const NoiseOptions& chosen, const StudyCommand& command) {
  if (!chosen.synthetic.empty()) {
    const auto noise = sensorParameters(chosen.synthetic == "harsh" ? SceneNoise::harsh : SceneNoise::sensor);
    return command.report(reportOf(fmt::format("the synthetic camera, {}", chosen.synthetic),
                                   madeUpSession(drivers::SensorNoise(1, noise), chosen.frames)));
  }
  if (chosen.recording.empty()) {
    return fail({"noise", "there is nothing to measure", "name the folder of a recording, or give --made-up"},
                EX_USAGE);
  }
  constexpr drivers::DepthLimits kAllThatACameraDelivers{0.001, 100};
  const auto reader = drivers::RecordingReader::open(chosen.recording, kAllThatACameraDelivers);
  if (!reader) return fail(reader.error(), EX_NOINPUT);
  if (reader->camera()) return runAnyCamera(chosen, *reader, command);
  const auto session = readSession(chosen.recording, chosen.frames);
  return session ? command.report(reportOf(chosen.recording, *session)) : fail(session.error(), EX_NOINPUT);
}

}  // namespace

StudyCommand noiseCommand(CLI::App& app) {
  const auto chosen = std::make_shared<NoiseOptions>();
  StudyCommand command(app, "noise", "statistics of the depth noise of a scene at rest");
  CLI::Option* recording =
      command->add_option("recording", chosen->recording,
                          "folder of an unpacked recording whose camera is at rest most of the time");
  command->add_option("--made-up", chosen->synthetic, "of the synthetic camera instead: recorded or harsh")
      ->check(CLI::IsMember({"recorded", "harsh"}))
      ->excludes(recording);
  command.number("--frames", chosen->frames, kMinFrames, 600, "number of frames that are used (60)");
  command.onRun([chosen](const StudyCommand& self) { return runNoise(*chosen, self); });
  return command;
}

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/noise/noise_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "rt/parameters.h"

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
  constexpr double kLongestPause = 1000;  // a counter that was reset is no reason for a lag of hours
  return static_cast<int>(std::lround(std::clamp(periods, 1.0, kLongestPause)));
}

}  // namespace

config::Result<FrameRange> framesOf(const std::filesystem::path& recording, std::size_t recorded,
                                    const SessionPart& part) {
  const auto first = static_cast<std::size_t>(part.first);
  const std::size_t end = std::min(recorded, first + static_cast<std::size_t>(part.frames));
  if (end >= first + kFewestFrames) return FrameRange{first, end};
  return std::unexpected(
      config::Error{recording.string(),
                    fmt::format("has {} depth frames from frame {} on, at least {} are needed",
                                end > first ? end - first : 0, part.first, kFewestFrames),
                    "take another recording, or an earlier first frame"});
}

config::Result<NoiseSession> readSession(const std::filesystem::path& recording, const SessionPart& part) {
  const auto reader = drivers::RecordingReader::open(recording);
  if (!reader) return std::unexpected(reader.error());
  if (reader->camera()) {
    return std::unexpected(config::Error{recording.string(), "is not of a Kinect v1",
                                         "take a recording in libfreenect's format (with INDEX.txt)"});
  }
  const auto& recorded = reader->frames();
  const auto range = framesOf(recording, recorded.size(), part);
  if (!range) return std::unexpected(range.error());
  NoiseSession session;
  const auto image = std::make_unique<rt::DepthFrame>();
  int period = 0;
  for (std::size_t i = range->begin; i < range->end; ++i) {
    const auto read = reader->read(i, *image);
    if (!read) return std::unexpected(read.error());
    if (i > range->begin) period += periodsBetween(recorded[i - 1], recorded[i]);
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

}  // namespace hapticd::tools

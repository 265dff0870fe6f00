// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/synthetic_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "drivers/base/start_thread.h"
#include "rt/base/clock.h"

namespace hapticd::drivers {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr double kTicksPerSecond = 60e6;  // frequency of a real camera's counter

std::uint32_t ticksAt(double t_s) {
  return static_cast<std::uint32_t>(std::fmod(t_s * kTicksPerSecond, 0x1p32));
}

}  // namespace

base::Result<void> SyntheticCamera::start(FrameSink& sink) {
  if (thread_.joinable()) return std::unexpected(base::Error{"synthetic", "is already running", ""});
  if (!(frame_rate_hz_ > 0) || !std::isfinite(frame_rate_hz_)) {
    return std::unexpected(
        base::Error{"synthetic.frame_rate_hz", fmt::format("{} is not above 0", frame_rate_hz_), ""});
  }
  board_.reset("synthetic");
  stop_signal_.reset();
  auto thread = startThread("camera", [this, &sink] { film(sink); });
  if (!thread) return std::unexpected(thread.error());
  thread_ = std::move(*thread);
  return {};
}

void SyntheticCamera::stop() {
  stop_signal_.raise();
  if (thread_.joinable()) thread_.join();
}

void SyntheticCamera::film(FrameSink& sink) {
  const Clock::time_point begin = Clock::now();
  std::uint64_t period = 0;
  std::uint64_t published = 0;
  while (true) {
    const double t_s = static_cast<double>(period) / frame_rate_hz_;
    rt::DepthFrame& frame = sink.back();
    scene_.render(t_s, frame);
    if (stop_signal_.waitUntil(begin + std::chrono::duration_cast<Clock::duration>(Seconds(t_s)))) return;
    frame.sequence = ++published;
    frame.arrival_ns = rt::monotonicNow_ns();
    frame.device_ticks = ticksAt(t_s);
    sink.publish();
    board_.countFrame();
    const double elapsed_s = Seconds(Clock::now() - begin).count();
    period = std::max(period + 1, static_cast<std::uint64_t>(elapsed_s * frame_rate_hz_));
  }
}

std::unique_ptr<Camera> makeSyntheticCamera(const config::CameraSettings& settings) {
  return std::make_unique<SyntheticCamera>(settings.of<SyntheticSettings>(), settings.effectiveDepthModel());
}

}  // namespace hapticd::drivers

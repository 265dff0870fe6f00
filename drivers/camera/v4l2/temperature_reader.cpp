// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/v4l2/temperature_reader.h"

#include <chrono>
#include <utility>

#include "drivers/base/start_thread.h"
#include "drivers/camera/v4l2/camera_report.h"

namespace hapticd::drivers {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kPeriod{5};

}  // namespace

TemperatureReader::TemperatureReader(const OpenDevice& device, std::uint16_t vendor, Report report) {
  if (vendor != kRealSenseVendor) return;
  auto thread = startThread("temperature", [this, &device, vendor, report = std::move(report)] {
    do {
      report(temperatureOf(device, vendor));
    } while (!stop_signal_.waitUntil(Clock::now() + kPeriod));
  });
  if (thread) thread_ = std::move(*thread);
}

TemperatureReader::~TemperatureReader() {
  stop_signal_.raise();
  if (thread_.joinable()) thread_.join();
}

}  // namespace hapticd::drivers

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/depth_region/depth_region.h"
#include "rt/base/clock.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::ros {

/// The depth frames of a hapticd that may come and go, which it shares through memory as long as this is
/// open.
/// Thread: one at a time.
class DepthSource {
 public:
  /// interrupt: a descriptor that ends waits when it becomes readable.
  DepthSource(std::string socket, int interrupt) : socket_(std::move(socket)), interrupt_(interrupt) {}

  /// Asks hapticd to share the frames; waits for its answer for up to a second.
  /// Errors: it does not answer, or refuses.
  ClientResult<void> open();
  void close();
  bool isOpen() const noexcept { return region_.has_value(); }

  /// Waits for a frame that it has not returned true for; false: none came within `limit`. It closes itself
  /// where hapticd shares no further ones.
  bool wait(std::chrono::milliseconds limit);
  /// As DepthRegionReader::read(), of the newest frame.
  bool read(rt::DepthFrameHeader& header, std::vector<std::byte>& image) const {
    return region_ && region_->read(header, image);
  }

 private:
  static constexpr std::chrono::milliseconds kSilence{1000};

  bool isLinked();

  std::string socket_;
  int interrupt_;
  std::optional<VarlinkClient> link_;
  std::optional<drivers::DepthRegionReader> region_;
  std::uint32_t seen_ = 0;
};

/// Chooses frames of a camera, whose rate is not known and not quite even, so that their mean rate is at most
/// a given one; a camera that is no faster has all its frames chosen.
/// Thread: one.
class FrameChoice {
 public:
  /// rate_hz: > 0.
  explicit FrameChoice(int rate_hz) : period_ns_(rt::kNsPerSecond / rate_hz) {}

  /// Whether a frame that came at this time is chosen; CLOCK_MONOTONIC, ascending.
  bool takes(std::int64_t time_ns) {
    // what was saved covers a frame that comes early after one that came late
    saved_ns_ = std::min(saved_ns_ + time_ns - before_ns_, kMostSaved * period_ns_);
    before_ns_ = time_ns;
    if (saved_ns_ < period_ns_) return false;
    saved_ns_ -= period_ns_;
    return true;
  }

 private:
  static constexpr std::int64_t kMostSaved = 2;  // periods

  std::int64_t period_ns_;
  std::int64_t before_ns_ = 0;
  std::int64_t saved_ns_ = 0;
};

}  // namespace hapticd::tools::ros

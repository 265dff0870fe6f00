// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/depth_region/depth_region.h"
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

}  // namespace hapticd::tools::ros

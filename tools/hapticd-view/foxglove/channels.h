// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/trace/messages.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::view {

/// What the Foxglove protocol offers, with the schemas of traces. Thread: any.
enum class FoxgloveChannel : std::uint8_t {
  tick,
  scene,
  transforms,
  cloud,
  cloud_reach,
  depth_image,
  camera_calibration,
  events,
};
inline constexpr std::size_t kFoxgloveChannels = 8;

/// Topic and schema of a channel.
drivers::ChannelName nameOf(FoxgloveChannel channel);

/// Its id in the protocol, from 1 on.
constexpr std::uint32_t idOf(FoxgloveChannel channel) {
  return static_cast<std::uint32_t>(channel) + 1;
}
std::optional<FoxgloveChannel> foxgloveChannelOf(std::uint64_t id);

/// The message `advertise` with all of them.
Json advertisement();

}  // namespace hapticd::tools::view

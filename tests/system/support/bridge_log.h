// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "rt/base/vec3.h"

/// The log of haptic-bridge at the device's end of the connection.
namespace hapticd::test {

/// A row of its log, one per tick of the device.
struct BridgeRow {
  std::int64_t time_ns = 0;  ///< CLOCK_MONOTONIC
  std::uint64_t sequence = 0;
  std::int64_t made_ns = 0;        ///< when the newest command was made, by the daemon's clock
  std::int64_t age_ns = 0;         ///< of the newest command
  std::uint64_t force_tick = 0;    ///< of the force loop, that computed the newest command; 0: none
  std::int64_t force_tick_ns = 0;  ///< when it began, by the daemon's clock
  bool active = false;             ///< false: the driver vetoed the force, or there is no command
  rt::Vec3 commanded_n;
  rt::Vec3 exerted_n;
  rt::Vec3 position_m;
};

/// The rows that are in the log so far, none before it is begun; a test fails if the file is not such a log.
std::vector<BridgeRow> bridgeRows(const std::filesystem::path& log);

/// Addresses of the loopback network that no other test has at the moment. `host`: 1..6.
std::string ownLoopback(int host);

}  // namespace hapticd::test

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/handle/udp/conversation.h"
#include "drivers/handle/udp/packet.h"
#include "drivers/handle/udp/udp_settings.h"
#include "drivers/handle/udp/udp_socket.h"
#include "tools/lib/bridge/device.h"
#include "tools/lib/bridge/device_log.h"
#include "tools/lib/bridge/impaired_link.h"

namespace hapticd::tools {

struct BridgeOptions {
  drivers::Ipv4Endpoint peer;   ///< hapticd
  drivers::Ipv4Endpoint local;  ///< zero: any
  std::vector<std::byte> key;   ///< empty: packets are not authenticated
  std::uint8_t protocol =
      drivers::udp::kVersion;  ///< in which the first packet is sent; hapticd answers in it
  double max_force_n = 10;  ///< of a person; longer forces are shortened to it, and to what the device bears
  bool damps = true;        ///< damp contact here, if hapticd offers it and the device measures velocity
  double max_damping_n_s_per_m =
      20;  ///< largest damping that the device renders without noise; more is clamped
  Impairments impairments;
};

/// Statistics of a bridge since its start.
struct BridgeSummary {
  std::uint64_t ticks = 0;
  std::uint64_t skipped_ticks = 0;   ///< ticks that the bridge missed because it woke too late
  std::uint64_t active_ticks = 0;    ///< ticks with a force
  std::uint64_t dead_man_ticks = 0;  ///< ticks with less force than commanded, because the command was stale
  double most_force_n = 0;           ///< largest force exerted
  double energy_j = 0;               ///< given to the hand (above zero) or taken from it
  std::uint64_t dropped_rows = 0;    ///< ticks that are missing in the log, because the disk was too slow
  drivers::LinkStatus link;
  std::uint64_t log_rows_dropped = 0;  ///< because the disk of the log was too slow
  std::string last_refusal;
};

/// Connects a device to hapticd: sends what the device measures and has it exert what hapticd
/// commands, 1000 times a second, as defined in drivers/handle/udp/protocol.md. Nothing is exerted without a
/// valid command of the last 20 ms. Thread: one.
class Bridge {
 public:
  static constexpr std::int64_t kTickNs = 1'000'000;

  /// `log`: may be null. All three outlive the bridge.
  Bridge(const BridgeOptions& options, drivers::udp::UdpSocket& socket, Device& device, DeviceLog* log);
  /// Leaves the device without force.
  ~Bridge();
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  /// Runs until `ends(seconds since the start)`, and leaves the device without force.
  void run(const std::function<bool(double)>& ends);

  BridgeSummary summary() const;

 private:
  void receiveUntil(std::int64_t when_ns);
  void tick(std::int64_t now_ns);
  void receive(std::int64_t now_ns);
  void take(std::span<const std::byte> bytes, std::int64_t now_ns);
  bool damps(const DeviceReading& reading) const;
  DeviceCommand exertedAt(std::int64_t now_ns, const DeviceReading& reading);
  void sendState(const DeviceReading& reading, std::int64_t now_ns);
  void account(const DeviceReading& reading, const rt::Vec3& exerted_n, std::int64_t now_ns);

  BridgeOptions options_;
  drivers::udp::UdpSocket& socket_;
  Device& device_;
  DeviceLog* log_;
  drivers::udp::Conversation conversation_;
  ImpairedLink out_;
  ImpairedLink in_;
  std::optional<drivers::udp::CommandPacket> command_;  // the newest valid one
  std::int64_t command_ns_ = 0;                         // when it arrived
  std::int64_t ticked_ns_ = 0;
  BridgeSummary summary_;
};

/// The summary as a table for people.
std::string bridgeTable(const BridgeSummary& summary);

}  // namespace hapticd::tools

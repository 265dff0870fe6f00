// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "config/base/error.h"
#include "drivers/base/stop_signal.h"
#include "drivers/handle/udp/conversation.h"
#include "drivers/handle/udp/packet.h"
#include "drivers/handle/udp/udp_settings.h"
#include "drivers/handle/udp/udp_socket.h"
#include "rt/base/vec3.h"
#include "rt/channels/spsc_ring.h"
#include "tools/lib/bridge/device.h"

namespace hapticd::tools {

/// The impairments of a network, which apply to each direction separately.
struct Impairments {
  double delay_ms = 0;   ///< for every packet
  double loss = 0;       ///< probabilities, 0..1
  double duplicate = 0;  ///< arrives twice
  double reorder = 0;    ///< is delayed until others have overtaken it
  double corrupt = 0;    ///< one bit is wrong
  std::uint64_t seed = 1;
};

/// One direction of a network that loses, duplicates, reorders and damages packets. The same seed and the
/// same packets give the same impairments. Thread: one.
class ImpairedLink {
 public:
  using Packet = std::vector<std::byte>;

  /// `direction`: 0 or 1, so that the two directions are impaired differently.
  ImpairedLink(const Impairments& impairments, std::uint64_t direction)
      : impairments_(impairments), random_(impairments.seed * 2 + direction) {}

  void push(std::span<const std::byte> bytes, std::int64_t now_ns);
  /// The next packet that has arrived by now; nothing: there is none.
  std::optional<Packet> pop(std::int64_t now_ns);

 private:
  bool happens(double probability) {
    return probability > 0 && std::uniform_real_distribution<double>()(random_) < probability;
  }

  Impairments impairments_;
  std::mt19937_64 random_;
  std::multimap<std::int64_t, Packet>
      under_way_;  // by time of arrival; in order of sending where it is the same
};

/// One tick of the device, with the command that it received.
struct DeviceTick {
  std::int64_t time_ns = 0;            ///< CLOCK_MONOTONIC
  std::uint64_t command_sequence = 0;  ///< of the newest valid command; 0: none yet
  std::int64_t command_made_ns = 0;    ///< by the clock of its sender
  std::int64_t command_age_ns = 0;     ///< since its arrival; -1: none yet
  std::uint64_t force_tick = 0;        ///< of the force loop that computed it
  std::int64_t force_tick_ns = 0;      ///< when that tick began, by the clock of its sender
  bool active = false;                 ///< its mode
  rt::Vec3 commanded_n;
  rt::Vec3 exerted_n;
  rt::Vec3 position_m;
};

/// One CSV row per tick: t_ns, command_sequence, command_made_ns, command_age_ns, force_tick, force_tick_ns,
/// mode (zero or active), commanded force, exerted force, position. A thread of its own writes the rows, so
/// that a disk that stalls never holds up the loop that drives the device; rows for which there is no room
/// meanwhile are dropped and counted.
/// Thread: one, but for what is said below.
class DeviceLog {
 public:
  static constexpr std::size_t kWaitingRows = 16384;  ///< those of 16 s

  /// Errors: the file cannot be made, no thread can be started.
  static base::Result<std::unique_ptr<DeviceLog>> at(const std::string& path);
  /// Writes to a stream that is open already; `path` names it in errors.  Errors: no thread can be started.
  static base::Result<std::unique_ptr<DeviceLog>> into(std::FILE* stream, const std::string& path);
  ~DeviceLog();
  DeviceLog(const DeviceLog&) = delete;
  DeviceLog& operator=(const DeviceLog&) = delete;

  /// Progress: wait-free.  RT: safe.
  void add(const DeviceTick& tick) noexcept { waiting_.push(tick); }
  /// Returns the number of rows dropped since the start.  Thread: any.
  std::uint64_t dropped() const noexcept { return waiting_.dropped(); }
  /// Writes what is still waiting and closes the file; nothing may be added after it. It takes as long as the
  /// disk does.  Errors: not all could be written; then nothing of it is left.
  base::Result<void> finish();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  DeviceLog(std::FILE* file, std::string path) : path_(std::move(path)), file_(file) {}

  void writeRows();
  void writeWaiting();
  void write(const std::string& text);
  void endThread();

  std::string path_;
  rt::SpscRing<DeviceTick, kWaitingRows> waiting_;
  drivers::StopSignal ends_;
  int error_ = 0;  ///< errno of the first write that failed; 0: none has; the writing thread's until it ended
  std::unique_ptr<std::FILE, Close> file_;
  std::thread thread_;
};

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

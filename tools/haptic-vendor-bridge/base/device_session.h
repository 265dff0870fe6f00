// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <utility>

#include "drivers/base/stop_signal.h"
#include "drivers/handle/udp/peer_clock.h"
#include "rt/base/cache_line.h"
#include "rt/channels/triple_buffer.h"
#include "tools/lib/bridge/device.h"

namespace hapticd::tools {

/// What a device is, known once it is open.
struct DeviceAbout {
  std::string model;
  std::string serial;
  DeviceLimits limits;
};

/// Passes readings and commands between the bridge's loop and the thread that drives a device, so that a
/// library or service that hangs does not hold up the bridge.
/// Progress: wait-free.  RT: safe, unless said otherwise.
class DeviceExchange {
 public:
  // The bridge's loop.

  /// The newest reading, with the delay that the exchange adds in its `latency_ns`. It is a fault while the
  /// device is not open, and when the newest reading is older than kDeadManNs.
  DeviceReading newest(std::int64_t now_ns);
  void command(const DeviceCommand& command, std::int64_t now_ns);
  DeviceLimits limits() const;

  // The thread that drives the device.

  /// From now on readings count. `limits`: of this device.  Thread: also another one, before the first
  /// reading.
  void open(const DeviceLimits& limits);
  /// From now on nothing counts.  Thread: any.
  void close() { open_.store(0, std::memory_order_release); }
  void publish(const DeviceReading& reading, std::int64_t measured_ns);
  /// What the device has to exert; nothing while the bridge's loop has said nothing for kDeadManNs.
  DeviceCommand commandAt(std::int64_t now_ns);

 private:
  struct Reading {
    DeviceReading reading;
    std::int64_t measured_ns = 0;
    std::uint64_t opening = 0;
  };
  struct Command {
    DeviceCommand command;
    std::int64_t written_ns = 0;
  };

  rt::TripleBuffer<Reading> readings_;
  rt::TripleBuffer<Command> commands_;
  alignas(rt::kCacheLine) std::atomic<std::uint64_t> open_{0};  // number of this opening; 0: not open
  std::atomic<double> force_n_{0};
  std::atomic<double> torque_n_m_{0};
  std::atomic<double> gripper_force_n_{0};
  std::uint64_t openings_ = 0;
  std::atomic<std::int64_t> command_wait_ns_{0};  // of the command that the device took last
  std::int64_t taken_ns_ = 0;                     // when that command was written
  drivers::udp::DelayEstimate delay_;             // the bridge's loop
};

/// One attempt to use a device: what its driver needs from the program.
class DeviceSession {
 public:
  DeviceSession(DeviceExchange& exchange, drivers::StopSignal& stop, std::string name)
      : exchange_(exchange), stop_(stop), name_(std::move(name)) {}

  DeviceExchange& exchange() { return exchange_; }
  /// Whether the driver has to leave the device now.  Thread: any.  RT: not safe.
  bool ends() const { return stop_.raised(); }
  /// Sleeps; returns ends().
  bool pause(std::chrono::milliseconds duration) {
    return stop_.waitUntil(std::chrono::steady_clock::now() + duration);
  }
  /// Prints "name: text" to standard error, for the person at the device. Thread: the driver's.  RT: not
  /// safe.
  void say(const std::string& text);
  /// The device is ready: prints what it is, and opens the exchange.
  void opened(const DeviceAbout& about);
  /// Whether opened() was called since the last call.  Thread: the driver's.
  bool takeOpened() { return std::exchange(opened_, false); }

 private:
  DeviceExchange& exchange_;
  drivers::StopSignal& stop_;
  std::string name_;
  bool opened_ = false;
};

}  // namespace hapticd::tools

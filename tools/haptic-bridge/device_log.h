// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>

#include "config/error.h"
#include "rt/spsc_ring.h"
#include "rt/vec3.h"

namespace hapticd::tools {

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
/// mode (zero or active), commanded force, exerted force, position. A thread of its own writes them, so that
/// a disk that stalls cannot hold up the loop that commands the device. Thread: one.
class DeviceLog {
 public:
  /// Errors: the file cannot be made.
  static config::Result<std::unique_ptr<DeviceLog>> at(const std::string& path);
  DeviceLog(const DeviceLog&) = delete;
  DeviceLog& operator=(const DeviceLog&) = delete;

  /// Progress: wait-free. A row for which there is no room is dropped and counted.
  void add(const DeviceTick& tick) { ticks_.push(tick); }
  std::uint64_t dropped() const { return ticks_.dropped(); }
  /// Waits for the disk and closes the file; nothing may be added after it.  Errors: not all could be
  /// written; then nothing of it is left.
  config::Result<void> finish();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  DeviceLog(std::string path, std::FILE* file) : path_(std::move(path)), file_(file) {}

  // All of these run on the log's thread.
  void run(const std::stop_token& stop);
  void write(const DeviceTick& tick);
  void write(const std::string& text);

  static constexpr std::size_t kCapacity = 16384;  // 16 s of ticks

  std::string path_;
  int error_ = 0;  // errno of the first write that failed; 0: none has
  std::unique_ptr<std::FILE, Close> file_;
  rt::SpscRing<DeviceTick, kCapacity> ticks_;
  std::jthread thread_;  // last, so that it ends before the other members
};

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "config/base/error.h"
#include "drivers/base/stop_signal.h"
#include "rt/base/vec3.h"
#include "rt/channels/spsc_ring.h"

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

}  // namespace hapticd::tools

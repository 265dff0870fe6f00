// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "config/base/error.h"
#include "drivers/base/stop_signal.h"
#include "drivers/handle/udp/conversation.h"
#include "rt/base/cache_line.h"
#include "rt/channels/triple_buffer.h"
#include "tools/lib/bridge/device.h"

namespace hapticd::tools {

/// A call of a function of somebody else's, which may hang: as long as the object lives, another thread can
/// tell which one it is.  Thread: any.  Progress: wait-free.  RT: safe.
class OutsideCall {
 public:
  /// `name`: of the function; never freed.
  explicit OutsideCall(const char* name) noexcept;
  ~OutsideCall();
  OutsideCall(const OutsideCall&) = delete;
  OutsideCall& operator=(const OutsideCall&) = delete;

  struct Lasting {
    std::string_view name;
    std::int64_t since_ns = 0;  ///< CLOCK_MONOTONIC
  };
  /// The call that has lasted longest now, of those that have lasted for kPatienceNs.
  static std::optional<Lasting> hanging() noexcept;
  static constexpr std::int64_t kPatienceNs = 2'000'000'000;

 private:
  struct Place* place_ = nullptr;  // null: more calls at once than are watched
};

/// What became of a reading that a driver published.
enum class ReadingVerdict {
  taken_over,
  not_finite,  ///< it counts as a fault, at the last finite position
  jumped,      ///< farther than a hand moves: the encoders have slipped; it counts as a fault
};

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
  /// device is not open, and when the newest reading is older than kDeadManNs; not calibrated until one of
  /// this opening is there.
  DeviceReading newest(std::int64_t now_ns);
  /// What the device has to exert, in answer to what newest() returned last: nothing while that was a fault
  /// or not calibrated.
  void command(const DeviceCommand& command, std::int64_t now_ns);
  DeviceLimits limits() const;

  // The thread that drives the device.

  /// From now on readings count, and commands that answer them. `limits`: of this device; all zero while it
  /// is there but may exert nothing yet.  Thread: the driver's, also while another one publishes.
  void open(const DeviceLimits& limits);
  /// From now on nothing counts.  Thread: any.
  void close() { open_.store(0, std::memory_order_release); }
  /// `measured_ns`: no later than the measurement. A value of the sensor that was published before must not
  /// be published again.
  ReadingVerdict publish(const DeviceReading& reading, std::int64_t measured_ns);
  /// What the device has to exert, within its limits; nothing while the bridge's loop has said nothing for
  /// kDeadManNs, while the reading published last is a fault or not calibrated, and in answer to readings
  /// from before this opening.
  DeviceCommand commandAt(std::int64_t now_ns);

 private:
  /// A hand moves a handle at less than this; a thread that was held up between clock and measurement adds at
  /// most kJumpM.
  static constexpr double kFastestHandMPerS = 10;
  static constexpr double kJumpM = 0.05;

  ReadingVerdict judge(const DeviceReading& reading, std::int64_t measured_ns) const;

  struct Reading {
    DeviceReading reading;
    std::int64_t measured_ns = 0;
    std::uint64_t opening = 0;
  };
  struct Command {
    DeviceCommand command;
    std::int64_t written_ns = 0;
    std::uint64_t opening = 0;  // of the reading that it answers; 0: it answers none
  };

  rt::TripleBuffer<Reading> readings_;
  rt::TripleBuffer<Command> commands_;
  alignas(rt::kCacheLine) std::atomic<std::uint64_t> open_{0};  // number of this opening; 0: not open
  std::atomic<double> force_n_{0};
  std::atomic<double> torque_n_m_{0};
  std::atomic<double> gripper_force_n_{0};
  std::uint64_t openings_ = 0;
  std::atomic<std::int64_t> command_wait_ns_{0};  // of the command that the device took last
  // who publishes
  std::int64_t taken_ns_ = 0;  // when that command was written
  Reading last_sound_;
  bool sound_ = false;  // the reading published last
  // the bridge's loop
  drivers::udp::DelayEstimate delay_;
  std::uint64_t answered_ = 0;  // opening of the reading returned last, if it was sound
};

/// One attempt to use a device: what its driver needs from the program.
class DeviceSession {
 public:
  /// `name`: of the program; `on_open` gets what opened() is given.
  DeviceSession(DeviceExchange& exchange, drivers::StopSignal& stop, std::string name,
                std::function<void(const DeviceAbout&)> on_open)
      : exchange_(exchange), stop_(stop), name_(std::move(name)), on_open_(std::move(on_open)) {}

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
  bool wasOpened() const { return was_opened_; }

 private:
  DeviceExchange& exchange_;
  drivers::StopSignal& stop_;
  std::string name_;
  std::function<void(const DeviceAbout&)> on_open_;
  bool was_opened_ = false;
};

/// Something that can be wrong for long with a device: said when it begins or changes, not each time that it
/// is found. Thread: the driver's.
class Complaint {
 public:
  /// `state`: what is wrong; 0: nothing. `text`: for the person; the number of times is added to it.
  void update(DeviceSession& session, int state, const std::string& text);

 private:
  int state_ = 0;
  int times_ = 0;
};

/// Drives devices of one kind. Thread: one, but for those of a library.
class DeviceDriver {
 public:
  virtual ~DeviceDriver() = default;
  /// Opens a device, leads the person through what it needs (calibration), says that it is opened, and drives
  /// it until the session ends or the device is lost. However it returns, the device exerts nothing any more
  /// and has its brakes on. No force before the device is initialised and calibrated.
  /// A velocity of the vendor is not passed on: by how much it was filtered, and so how late it is, no vendor
  /// publishes, and damping with a late velocity is unstable (rt/safety/stiffness_limit.h).
  /// Returns why the device could not be used any longer; nothing: the session ended.
  virtual base::Result<void> drive(DeviceSession& session) = 0;
};

/// A device behind a DeviceDriver, which has a thread of its own and is opened again after a pause when it is
/// lost or not there yet. Another thread names a call of the driver (OutsideCall) that hangs.
class ThreadedDevice final : public Device {
 public:
  static constexpr std::chrono::milliseconds kRetry{1000};

  /// `name`: of the program, for messages.
  ThreadedDevice(std::unique_ptr<DeviceDriver> driver, std::string name)
      : driver_(std::move(driver)), name_(std::move(name)) {}
  /// Ends the thread, which leaves the device without force, and waits for a call that hangs.
  ~ThreadedDevice() override;

  /// Errors: no thread can be started.
  base::Result<void> start();
  DeviceReading read() override;
  void exert(const DeviceCommand& command) override;
  DeviceLimits limits() const override { return exchange_.limits(); }
  /// What was opened last.  Thread: any.
  DeviceAbout about() const;

 private:
  void run();
  void watch();

  std::unique_ptr<DeviceDriver> driver_;
  std::string name_;
  DeviceExchange exchange_;
  drivers::StopSignal stop_;
  mutable std::mutex about_mutex_;
  DeviceAbout about_;
  std::thread thread_;
  drivers::StopSignal watch_ends_;
  std::thread watch_thread_;
};

}  // namespace hapticd::tools

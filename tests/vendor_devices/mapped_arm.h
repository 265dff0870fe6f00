// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <new>
#include <stdexcept>

namespace hapticd::test {

/// What can be wrong with an emulated device; bits, set by a test at any time.
enum ArmFault : std::uint32_t {
  kArmUnplugged = 1,        ///< calls fail as those of a device whose cable was pulled
  kArmBusy = 2,             ///< another program has it open
  kArmNotCalibrated = 4,    ///< encoders are not homed, or lost it in use
  kArmWarm = 8,             ///< motors are warm
  kArmForceCut = 16,        ///< the device itself cut the force
  kArmSlow = 32,            ///< each call takes 30 ms
  kArmNotFinite = 64,       ///< positions are NaN
  kArmJump = 128,           ///< positions are 0.3 m off
  kArmRepeats = 256,        ///< calls say that there is no new measurement
  kArmSaturated = 512,      ///< calls say that motors are saturated
  kArmWrongVersion = 1024,  ///< the vendor's software is another version
  kArmNoWatchdog = 2048,    ///< the device keeps another watchdog than the one that was set
  kArmHangs = 4096,         ///< calls do not return
};

/// An emulated device as the fake library of a vendor sees it, in memory that both processes map. The device
/// lives in the test, so that it goes on when the program that drives it is killed. In the device's own axes.
struct ArmMemory {
  // set by the library
  std::array<std::atomic<double>, 3> force_n{};
  std::array<std::atomic<double>, 3> torque_n_m{};
  std::atomic<double> gripper_force_n{0};
  std::atomic<std::int64_t> force_ns{0};  ///< when a force was set last, CLOCK_MONOTONIC
  std::atomic<std::uint64_t> forces{0};   ///< how often
  std::atomic<bool> force_on{false};      ///< the amplifier
  std::atomic<bool> brakes{true};
  std::atomic<std::int64_t> watchdog_ns{0};   ///< the device drops a force that is older; 0: it keeps it
  std::atomic<bool> watchdog_latches{false};  ///< once it has run out, the amplifier stays off
  std::atomic<std::uint64_t> openings{0};
  // set by the device
  std::array<std::atomic<double>, 3> position_m{};
  std::array<std::atomic<double>, 4> orientation{};  ///< x, y, z, w
  std::atomic<double> gripper_rad{0};
  std::atomic<std::uint32_t> buttons{0};
  std::atomic<std::int64_t> measured_ns{0};
  std::atomic<std::uint64_t> watchdog_trips{0};  ///< how often it turned the amplifier off
  // set by a test
  std::atomic<std::uint32_t> faults{0};
  std::atomic<std::int64_t> extra_delay_ns{0};  ///< positions that the library gives are that old
  std::atomic<int> model{0};                    ///< as the fake library numbers them
  std::atomic<int> cut_cause{2};                ///< of kArmForceCut, as the vendor numbers them
  std::atomic<bool> docked{false};              ///< it is where its calibration begins
  // what the device exerted
  std::atomic<double> exerted_n{0};                        ///< now
  std::atomic<double> most_exerted_n{0};                   ///< so far
  std::atomic<std::int64_t> last_exerted_ns{0};            ///< when it exerted something last
  std::atomic<std::uint64_t> uncalibrated_force_steps{0};  ///< steps with a force while not calibrated
};

/// Where the fake libraries find the memory: the path is in this variable of the environment.
inline constexpr const char* kArmVariable = "HAPTICD_EMULATED_ARM";

/// Memory that two processes share by a file.  Errors: std::runtime_error, the file cannot be made or mapped.
template <typename Memory>
class MappedMemory {
 public:
  /// `make`: makes the file anew.
  MappedMemory(const std::filesystem::path& path, bool make) {
    const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC | (make ? O_CREAT | O_TRUNC : 0), 0600);
    if (file < 0) throw std::runtime_error("cannot open " + path.string());
    const bool sized = !make || ::ftruncate(file, sizeof(Memory)) == 0;
    void* at =
        sized ? ::mmap(nullptr, sizeof(Memory), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0) : MAP_FAILED;
    ::close(file);
    if (at == MAP_FAILED) throw std::runtime_error("cannot map " + path.string());
    memory_ = make ? new (at) Memory : static_cast<Memory*>(at);
  }
  ~MappedMemory() { ::munmap(memory_, sizeof(Memory)); }
  MappedMemory(const MappedMemory&) = delete;
  MappedMemory& operator=(const MappedMemory&) = delete;
  Memory& memory() const { return *memory_; }

 private:
  Memory* memory_;
};

using MappedArm = MappedMemory<ArmMemory>;

}  // namespace hapticd::test

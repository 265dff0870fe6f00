// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace hapticd::test {

/// What can be wrong with an emulated Omni and its bus; bits, set by a test at any time.
enum OmniFault : std::uint32_t {
  kOmniSilent = 1,        ///< sends no packets
  kOmniSkips = 2,         ///< every second packet is lost on its way
  kOmniForeign = 4,       ///< its packets have another header
  kOmniUnplugged = 8,     ///< is not on the bus
  kOmniNoChannels = 16,   ///< the bus has only one channel left
  kOmniDenied = 32,       ///< this user may not open the bus
  kOmniJump = 64,         ///< encoders have slipped by a radian
  kOmniCannotSend = 128,  ///< the bus takes no packets
};

/// An emulated Omni on its bus as the fake libraw1394 sees it, in memory that both processes map. The device
/// lives in the test, so that it goes on when the program that drives it is killed.
struct OmniMemory {
  // set by the library
  std::array<std::atomic<int>, 3> dac{0x7ff, 0x7ff, 0x7ff};  ///< of the newest packet
  std::atomic<unsigned int> bits{0};                         ///< of the newest packet
  std::atomic<std::int64_t> packet_ns{0};                    ///< when it came, CLOCK_MONOTONIC
  std::atomic<std::uint64_t> packets{0};                     ///< how many
  std::atomic<bool> streams{false};                          ///< register of the device
  std::atomic<int> channel_in{-1};                           ///< register of the device, on which it receives
  std::atomic<int> channel_out{-1};                          ///< register of the device, on which it sends
  std::atomic<std::uint64_t> channels_taken{0};              ///< of the bus, one bit each
  std::atomic<std::uint64_t> openings{0};                    ///< how often its streams were turned on
  std::atomic<std::uint64_t> other_writes{0};                ///< to registers of unknown meaning
  // set by the device
  std::array<std::atomic<int>, 3> encoders{};
  std::atomic<bool> docked{false};
  // set by a test
  std::atomic<std::uint32_t> faults{0};
  std::atomic<unsigned int> generation{1};  ///< of the bus
  std::atomic<std::uint32_t> serial_register{0x80000001};
  std::atomic<std::uint32_t> buttons{0};
};

/// The node of the device, which a reset of the bus changes; others are 0 to 3.
inline unsigned int omniNodeIn(unsigned int generation) {
  return 1 + generation % 3;
}

/// Where the fake library finds the memory: the path is in this variable of the environment.
inline constexpr const char* kOmniVariable = "HAPTICD_EMULATED_OMNI";

}  // namespace hapticd::test

// SPDX-License-Identifier: Apache-2.0
// The functions of libraw1394 that hapticd calls, on a bus with one emulated Omni. Cycles are those of the
// clock: a program that comes late loses packets, as on a bus. Each handle's descriptor is a timer.

#include <arpa/inet.h>
#include <libraw1394/raw1394.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <memory>
#include <utility>

#include "rt/base/clock.h"
#include "tests/vendor_devices/mapped_arm.h"
#include "tests/vendor_devices/phantom_omni/omni_memory.h"

namespace {

namespace test = hapticd::test;
using test::OmniMemory;

constexpr std::int64_t kCycle_ns = 125'000;
constexpr int kNodes = 4;
constexpr nodeid_t kLocalBus = 0xffc0;
constexpr std::size_t kReadingBytes = 0x40;
using CommandBytes = std::array<unsigned char, 16>;

enum class Context { none, receives, sends };

OmniMemory& omni() {
  static test::MappedMemory<OmniMemory> mapped(std::getenv(test::kOmniVariable), false);
  return mapped.memory();
}
bool has(std::uint32_t fault) {
  return (omni().faults & fault) != 0;
}
std::int64_t cycleNow() {
  return hapticd::rt::monotonicNow_ns() / kCycle_ns;
}
int failWith(int error) {
  errno = error;
  return -1;
}

}  // namespace

struct raw1394_handle {
  void* user = nullptr;
  bus_reset_handler_t on_reset = nullptr;
  unsigned int generation = 0;
  unsigned int reset_seen = 0;  // generation of which the handler knows
  int timer = -1;
  Context context = Context::none;
  bool runs = false;
  raw1394_iso_recv_handler_t receive = nullptr;
  raw1394_iso_xmit_handler_t fill = nullptr;
  unsigned int buffer = 0;  // packets
  int channel = -1;
  std::int64_t cycle = 0;  // done last
  std::deque<CommandBytes> queue;

  void tick(std::int64_t period_ns) const {
    const itimerspec every{{0, period_ns}, {0, period_ns}};
    ::timerfd_settime(timer, 0, &every, nullptr);
  }
};

namespace {

void fillQueue(raw1394_handle& handle) {
  while (handle.queue.size() < handle.buffer) {
    CommandBytes bytes{};
    unsigned int length = 0;
    unsigned char tag = 1;
    unsigned char sy = 1;
    handle.fill(&handle, bytes.data(), &length, &tag, &sy, -1, 0);
    if (length != bytes.size() || tag != 0 || sy != 0) std::abort();
    handle.queue.push_back(bytes);
  }
}

void deliver(const CommandBytes& bytes) {
  const auto word = [&bytes](std::size_t at) {
    return static_cast<unsigned int>(bytes[at]) | static_cast<unsigned int>(bytes[at + 1]) << 8;
  };
  for (std::size_t joint = 0; joint < 3; ++joint) omni().dac[joint] = static_cast<int>(word(2 * joint));
  omni().bits = word(6);
  omni().packet_ns = hapticd::rt::monotonicNow_ns();
  ++omni().packets;
}

int sendCycles(raw1394_handle& handle, std::int64_t cycles) {
  if (has(test::kOmniCannotSend)) return failWith(EIO);
  const bool hears = omni().streams && omni().channel_in == handle.channel && !has(test::kOmniUnplugged);
  for (std::int64_t i = 0; i < cycles && !handle.queue.empty(); ++i) {
    if (hears) deliver(handle.queue.front());
    handle.queue.pop_front();
  }
  fillQueue(handle);
  return 0;
}

std::array<unsigned char, kReadingBytes> readingAt(std::int64_t cycle) {
  std::array<unsigned char, kReadingBytes> bytes{};
  const auto write = [&bytes](std::size_t at, unsigned int word) {
    bytes[at] = static_cast<unsigned char>(word);
    bytes[at + 1] = static_cast<unsigned char>(word >> 8);
  };
  write(2, has(test::kOmniForeign) ? 0x1f : 0x1e);
  constexpr int kRadian = 2387;  // in counts
  for (std::size_t joint = 0; joint < 3; ++joint) {
    const int count = omni().encoders[joint] + (has(test::kOmniJump) ? kRadian : 0);
    write(4 + 2 * joint, static_cast<unsigned int>(count));
  }
  const unsigned int pressed = omni().buttons;
  bytes[18] = static_cast<unsigned char>(cycle);
  bytes[19] = static_cast<unsigned char>((~pressed & 3U) | (omni().docked ? 0U : 4U) | 0xa0U);
  write(20, 0x1007);
  write(32, static_cast<unsigned int>(cycle));
  write(34, static_cast<unsigned int>(cycle >> 16));
  return bytes;
}

void receiveCycles(raw1394_handle& handle, std::int64_t cycles) {
  const bool speaks = omni().streams && omni().channel_out == handle.channel &&
                      !has(test::kOmniSilent | test::kOmniUnplugged);
  if (!speaks) return;
  // what came once the buffer was full is lost
  const std::int64_t kept = std::min(cycles, std::int64_t{handle.buffer});
  for (std::int64_t cycle = handle.cycle + 1; cycle <= handle.cycle + kept; ++cycle) {
    if (has(test::kOmniSkips) && cycle % 2 == 0) continue;
    auto bytes = readingAt(cycle);
    handle.receive(&handle, bytes.data(), bytes.size(), static_cast<unsigned char>(handle.channel), 0, 0, 0,
                   0);
  }
}

/// Whether a transaction of this handle reaches the device at `node`.
bool reaches(const raw1394_handle& handle, nodeid_t node) {
  const unsigned int generation = omni().generation;
  if (handle.generation != generation) return false;
  return !has(test::kOmniUnplugged) && node == (kLocalBus | test::omniNodeIn(generation));
}

}  // namespace

extern "C" {

raw1394handle_t raw1394_new_handle() {
  if (has(test::kOmniDenied)) {
    errno = EACCES;
    return nullptr;
  }
  auto handle = std::make_unique<raw1394_handle>();
  handle->timer = ::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC);
  return handle->timer < 0 ? nullptr : handle.release();
}
void raw1394_destroy_handle(raw1394handle_t handle) {
  ::close(handle->timer);
  delete handle;
}
int raw1394_get_port_info(raw1394handle_t, raw1394_portinfo* infos, int most) {
  if (most > 0) infos[0].nodes = kNodes;
  return 1;
}
int raw1394_set_port(raw1394handle_t handle, int port) {
  if (port != 0) return failWith(EINVAL);
  handle->generation = handle->reset_seen = omni().generation;
  constexpr std::int64_t kLook_ns = 5'000'000;  // for a reset of the bus
  handle->tick(kLook_ns);
  return 0;
}
int raw1394_get_nodecount(raw1394handle_t) {
  return kNodes;
}
void raw1394_set_userdata(raw1394handle_t handle, void* user) {
  handle->user = user;
}
void* raw1394_get_userdata(raw1394handle_t handle) {
  return handle->user;
}
bus_reset_handler_t raw1394_set_bus_reset_handler(raw1394handle_t handle, bus_reset_handler_t on_reset) {
  return std::exchange(handle->on_reset, on_reset);
}
void raw1394_update_generation(raw1394handle_t handle, unsigned int generation) {
  handle->generation = generation;
}
unsigned int raw1394_get_generation(raw1394handle_t handle) {
  return handle->generation;
}
int raw1394_get_fd(raw1394handle_t handle) {
  return handle->timer;
}

int raw1394_read(raw1394handle_t handle, nodeid_t node, nodeaddr_t address, size_t length, quadlet_t* into) {
  if (!reaches(*handle, node) || length != sizeof(quadlet_t)) return failWith(EAGAIN);
  if (address == 0x1006000c) {
    *into = htonl(0x000b9900);
  } else if (address == 0x10060010) {
    *into = htonl(omni().serial_register);
  } else {
    return failWith(EINVAL);
  }
  return 0;
}
int raw1394_write(raw1394handle_t handle, nodeid_t node, nodeaddr_t address, size_t length, quadlet_t* from) {
  if (!reaches(*handle, node)) return failWith(EAGAIN);
  unsigned char byte = 0;
  std::memcpy(&byte, from, 1);
  if (length != 1) {
    ++omni().other_writes;
  } else if (address == 0x1000) {
    omni().channel_in = byte;
  } else if (address == 0x1001) {
    omni().channel_out = byte;
  } else if (address == 0x1087) {
    const bool on = (byte & 8U) != 0;
    if (on && !omni().streams) ++omni().openings;
    omni().streams = on;
  } else {
    ++omni().other_writes;
  }
  return 0;
}
int raw1394_channel_modify(raw1394handle_t handle, unsigned int channel, raw1394_modify_mode mode) {
  constexpr unsigned int kOnlyChannel = 5;
  if (handle->generation != omni().generation || channel > 62) return failWith(EAGAIN);
  if (has(test::kOmniNoChannels) && channel != kOnlyChannel) return failWith(EAGAIN);
  const std::uint64_t bit = std::uint64_t{1} << channel;
  const bool taken = (omni().channels_taken & bit) != 0;
  if (taken == (mode == RAW1394_MODIFY_ALLOC)) return failWith(EAGAIN);
  omni().channels_taken ^= bit;
  return 0;
}

int raw1394_iso_recv_init(raw1394handle_t handle, raw1394_iso_recv_handler_t receive, unsigned int buffer,
                          unsigned int most_bytes, unsigned char channel, raw1394_iso_dma_recv_mode, int) {
  if (handle->context != Context::none || most_bytes < kReadingBytes) return failWith(EBUSY);
  handle->context = Context::receives;
  handle->receive = receive;
  handle->buffer = buffer;
  handle->channel = channel;
  return 0;
}
int raw1394_iso_xmit_init(raw1394handle_t handle, raw1394_iso_xmit_handler_t fill, unsigned int buffer,
                          unsigned int most_bytes, unsigned char channel, raw1394_iso_speed speed,
                          int interval) {
  if (handle->context != Context::none || most_bytes < sizeof(CommandBytes) || interval < 1)
    return failWith(EBUSY);
  if (speed != RAW1394_ISO_SPEED_100) return failWith(EINVAL);
  handle->context = Context::sends;
  handle->fill = fill;
  handle->buffer = buffer;
  handle->channel = channel;
  return 0;
}
int raw1394_iso_recv_start(raw1394handle_t handle, int, int, int) {
  constexpr std::int64_t kInterrupt_ns = 500'000;
  handle->cycle = cycleNow();
  handle->runs = true;
  handle->tick(kInterrupt_ns);
  return 0;
}
int raw1394_iso_xmit_start(raw1394handle_t handle, int, int) {
  fillQueue(*handle);
  return raw1394_iso_recv_start(handle, 0, 0, 0);
}
void raw1394_iso_stop(raw1394handle_t handle) {
  handle->runs = false;
  handle->queue.clear();
  handle->tick(0);
}
void raw1394_iso_shutdown(raw1394handle_t handle) {
  raw1394_iso_stop(handle);
}

int raw1394_loop_iterate(raw1394handle_t handle) {
  std::uint64_t expirations = 0;
  if (::read(handle->timer, &expirations, sizeof expirations) != sizeof expirations) return -1;
  const unsigned int generation = omni().generation;
  if (handle->reset_seen != generation) {
    handle->reset_seen = generation;
    if (handle->on_reset != nullptr) return handle->on_reset(handle, generation);
  }
  if (!handle->runs) return 0;
  const std::int64_t cycles = cycleNow() - handle->cycle;
  int done = 0;
  if (handle->context == Context::sends) done = sendCycles(*handle, cycles);
  if (handle->context == Context::receives) receiveCycles(*handle, cycles);
  handle->cycle += cycles;
  return done;
}

}  // extern "C"

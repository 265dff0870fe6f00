// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/phantom_omni/link.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <utility>

#include "rt/base/clock.h"
#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools::phantom_omni {
namespace {

constexpr nodeaddr_t kDeviceAt = 0x1006000c;
constexpr nodeaddr_t kSerialAt = 0x10060010;
constexpr std::uint32_t kOmni = 0x000b9900;  // the upper 24 bits are SensAble's
constexpr nodeid_t kLocalBus = 1023 << 6;
constexpr int kMostPorts = 16;

/// A node of the kernel that this user may not open; empty: none.
std::string deniedNode() {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", ignored)) {
    const bool fire_wire = entry.path().filename().string().starts_with("fw");
    if (fire_wire && ::access(entry.path().c_str(), R_OK | W_OK) != 0) return entry.path().string();
  }
  return {};
}

/// Why there is no device, where `error` is errno of the library, or 0.
base::Error notThere(const std::string& what, int error) {
  std::string denied = deniedNode();
  if (denied.empty() && (error == EACCES || error == EPERM)) denied = "/dev/fw*";
  if (!denied.empty()) {
    return {denied, "this user may not open it",
            "permit the nodes of the card and of the device by a udev rule as in 73-vendor-handles.rules"};
  }
  return {"FireWire", error == 0 ? what : fmt::format("{}: {}", what, std::strerror(error)),
          "plug it in and switch it on; the kernel's driver is firewire-ohci"};
}

std::optional<std::uint32_t> quadletAt(raw1394_handle* handle, nodeid_t node, nodeaddr_t address) {
  quadlet_t quadlet = 0;
  const OutsideCall call("raw1394_read");
  if (raw1394_read(handle, node, address, sizeof quadlet, &quadlet) != 0) return std::nullopt;
  return ntohl(quadlet);
}

/// The serial number of the Omni at a node; nothing: it is none.
std::optional<std::string> serialAt(raw1394_handle* handle, nodeid_t node) {
  if (quadletAt(handle, node, kDeviceAt) != kOmni) return std::nullopt;
  const auto packed = quadletAt(handle, node, kSerialAt);
  return packed ? std::optional(serialText(*packed)) : std::nullopt;
}

std::optional<OmniNode> omniOnPort(raw1394_handle* handle, const std::string& serial) {
  const int nodes = raw1394_get_nodecount(handle);
  for (int i = 0; i < nodes; ++i) {
    const auto node = static_cast<nodeid_t>(kLocalBus | i);
    const auto found = serialAt(handle, node);
    if (found && (serial.empty() || *found == serial)) return OmniNode{0, node, *found};
  }
  return std::nullopt;
}

std::string nameOf(const std::string& serial) {
  return serial.empty() ? "no Phantom Omni is there"
                        : fmt::format("no Phantom Omni with serial number {} is there", serial);
}

}  // namespace

std::string serialText(std::uint32_t packed) {
  return fmt::format("{:1}{:02}{:02}{:1}{:05}", packed >> 23 & 0x7, packed >> 19 & 0xf, packed >> 14 & 0x1f,
                     packed >> 11 & 0x7, packed >> 1 & 0x3ff);
}

base::Result<FireWire> openPort(int port) {
  errno = 0;
  FireWire handle(raw1394_new_handle());
  if (!handle) return std::unexpected(notThere("cannot be used", errno));
  errno = 0;
  std::array<raw1394_portinfo, kMostPorts> ports{};
  if (raw1394_get_port_info(handle.get(), ports.data(), kMostPorts) <= port)
    return std::unexpected(notThere("there is no port", 0));
  if (raw1394_set_port(handle.get(), port) != 0)
    return std::unexpected(notThere(fmt::format("port {} cannot be opened", port), errno));
  return handle;
}

base::Result<OmniNode> findOmni(const std::string& serial) {
  errno = 0;
  const FireWire handle(raw1394_new_handle());
  if (!handle) return std::unexpected(notThere("cannot be used", errno));
  std::array<raw1394_portinfo, kMostPorts> infos{};
  const int ports = std::min(raw1394_get_port_info(handle.get(), infos.data(), kMostPorts), kMostPorts);
  if (ports <= 0) return std::unexpected(notThere("there is no port", 0));
  std::optional<base::Error> first;
  for (int port = 0; port < ports; ++port) {
    const auto opened = openPort(port);
    if (!opened) {
      if (!first) first = opened.error();
      continue;
    }
    if (auto found = omniOnPort(opened->get(), serial)) {
      found->port = port;
      return *found;
    }
  }
  return std::unexpected(first ? *first : notThere(nameOf(serial), 0));
}

base::Result<nodeid_t> nodeOf(raw1394_handle* handle, const std::string& serial) {
  const auto found = omniOnPort(handle, serial);
  if (!found) return std::unexpected(notThere(nameOf(serial), 0));
  return found->node;
}

namespace {

constexpr nodeaddr_t kChannelToDeviceAt = 0x1000;
constexpr nodeaddr_t kChannelFromDeviceAt = 0x1001;
constexpr nodeaddr_t kStreamsAt = 0x1087;
constexpr unsigned char kStreamsOn = 1U << 3;

// One source says that the device needs this quadlet, another that two devices on a bus run only without it.
constexpr bool kWritesDisputedQuadlet = false;
constexpr nodeaddr_t kDisputedAt = 0x20010;
constexpr quadlet_t kDisputed = 0xf80f0000;

constexpr int kChannels = 63;
constexpr int kReceiveBuffer = 32;
constexpr int kReceiveInterval = 4;
constexpr int kAnyCycle = -1;
constexpr int kAnyTag = -1;

bool isReady(const FireWire& handle, int wait_ms = 0) {
  pollfd descriptor{raw1394_get_fd(handle.get()), POLLIN, 0};
  return ::poll(&descriptor, 1, wait_ms) > 0;
}

/// By errno.
std::unexpected<base::Error> failed(const std::string& what) {
  return std::unexpected(base::Error{"Phantom Omni", fmt::format("{}: {}", what, std::strerror(errno)),
                                     "end other programs that use it, or unplug it and plug it in again"});
}

}  // namespace

base::Result<std::unique_ptr<OmniLink>> OmniLink::open(const std::string& serial) {
  auto node = findOmni(serial);
  if (!node) return std::unexpected(node.error());
  std::unique_ptr<OmniLink> link(new OmniLink(std::move(*node)));
  if (auto ok = link->start(); !ok) return std::unexpected(ok.error());
  return link;
}

OmniLink::~OmniLink() {
  if (sends_) letGo();
  stopDevice();
  if (sends_) raw1394_iso_shutdown(sending_.get());
  if (receives_) raw1394_iso_shutdown(receiving_.get());
  freeChannels();
}

base::Result<void> OmniLink::start() {
  for (FireWire* handle : {&control_, &receiving_, &sending_}) {
    auto opened = openPort(node_.port);
    if (!opened) return std::unexpected(opened.error());
    *handle = std::move(*opened);
    raw1394_set_userdata(handle->get(), this);
    raw1394_set_bus_reset_handler(handle->get(), [](raw1394handle_t reset, unsigned int generation) {
      raw1394_update_generation(reset, generation);
      static_cast<OmniLink*>(raw1394_get_userdata(reset))->reset_ = true;
      return 0;
    });
  }
  if (auto ok = assignChannels(); !ok) return ok;
  if (auto ok = startReceiving(); !ok) return ok;
  if (auto ok = startSending(); !ok) return ok;
  empty_ns_ = received_ns_ = rt::monotonicNow_ns();
  return writeRegister(kStreamsAt, kStreamsOn);
}

base::Result<void> OmniLink::assignChannels() {
  generation_ = raw1394_get_generation(control_.get());
  for (std::optional<int>* channel : {&channel_to_device_, &channel_from_device_}) {
    const auto allocated = allocateChannel();
    if (!allocated) return std::unexpected(allocated.error());
    *channel = *allocated;
  }
  // a program that was killed may have left the streams on, in channels that are not ours
  if (auto ok = writeRegister(kStreamsAt, 0); !ok) return ok;
  for (const auto& [address, channel] : {std::pair{kChannelToDeviceAt, *channel_to_device_},
                                         std::pair{kChannelFromDeviceAt, *channel_from_device_}}) {
    if (auto ok = writeRegister(address, static_cast<unsigned char>(channel)); !ok) return ok;
  }
  if constexpr (kWritesDisputedQuadlet) {
    quadlet_t quadlet = kDisputed;
    raw1394_write(control_.get(), node_.node, kDisputedAt, sizeof quadlet, &quadlet);
  }
  return {};
}

base::Result<void> OmniLink::startReceiving() {
  const auto receive = [](raw1394handle_t handle, unsigned char* data, unsigned int length, unsigned char,
                          unsigned char, unsigned char, unsigned int, unsigned int) {
    static_cast<OmniLink*>(raw1394_get_userdata(handle))->take({data, length});
    return RAW1394_ISO_OK;
  };
  if (raw1394_iso_recv_init(receiving_.get(), receive, kReceiveBuffer, kMostReadingBytes,
                            static_cast<unsigned char>(*channel_from_device_), RAW1394_DMA_PACKET_PER_BUFFER,
                            kReceiveInterval) != 0)
    return failed("nothing can be received from it");
  receives_ = true;
  if (raw1394_iso_recv_start(receiving_.get(), kAnyCycle, kAnyTag, 0) != 0)
    return failed("nothing can be received from it");
  return {};
}

base::Result<void> OmniLink::startSending() {
  const auto fill = [](raw1394handle_t handle, unsigned char* data, unsigned int* length, unsigned char* tag,
                       unsigned char* sy, int, unsigned int) {
    auto& link = *static_cast<OmniLink*>(raw1394_get_userdata(handle));
    std::ranges::copy(link.sent_, data);
    *length = kCommandBytes;
    *tag = *sy = 0;
    ++link.packets_sent_;
    return RAW1394_ISO_OK;
  };
  if (raw1394_iso_xmit_init(sending_.get(), fill, kSendBuffer, kCommandBytes,
                            static_cast<unsigned char>(*channel_to_device_), RAW1394_ISO_SPEED_100,
                            kSendInterval) != 0)
    return failed("nothing can be sent to it");
  sends_ = true;
  return resume();
}

base::Result<int> OmniLink::allocateChannel() {
  for (int channel = 0; channel < kChannels; ++channel) {
    if (raw1394_channel_modify(control_.get(), static_cast<unsigned int>(channel), RAW1394_MODIFY_ALLOC) == 0)
      return channel;
  }
  return std::unexpected(base::Error{
      "Phantom Omni", "the FireWire bus has no channel left for it",
      "unplug other devices of this bus, or unplug it and plug it in again, which frees channels that "
      "programs have left"});
}

base::Result<void> OmniLink::writeRegister(nodeaddr_t address, unsigned char value) {
  quadlet_t bytes = 0;
  std::memcpy(&bytes, &value, sizeof value);
  if (raw1394_write(control_.get(), node_.node, address, sizeof value, &bytes) != 0)
    return failed(fmt::format("its register 0x{:x} cannot be written", address));
  return {};
}

void OmniLink::interrupt() {
  raw1394_iso_stop(sending_.get());
  interrupted_ = true;
}

base::Result<void> OmniLink::resume() {
  interrupted_ = false;
  if (raw1394_iso_xmit_start(sending_.get(), kAnyCycle, kSendBuffer) != 0)
    return failed("nothing can be sent to it");
  return {};
}

base::Result<void> OmniLink::iterate(const FireWire& handle) {
  errno = 0;
  if (raw1394_loop_iterate(handle.get()) < 0) return failed("lost: the bus has failed");
  if (!reset_) return {};
  return std::unexpected(base::Error{"Phantom Omni", "lost: the FireWire bus was reset", ""});
}

base::Result<std::optional<TimedReading>> OmniLink::receive() {
  constexpr int kWait_ms = 5;
  constexpr int kMostEvents = 64;
  std::array<pollfd, 3> descriptors{pollfd{raw1394_get_fd(receiving_.get()), POLLIN, 0},
                                    pollfd{interrupted_ ? -1 : raw1394_get_fd(sending_.get()), POLLIN, 0},
                                    pollfd{raw1394_get_fd(control_.get()), POLLIN, 0}};
  ::poll(descriptors.data(), descriptors.size(), kWait_ms);
  if (descriptors[2].revents != 0) {
    if (auto ok = iterate(control_); !ok) return std::unexpected(ok.error());
  }
  newest_.reset();
  // The newest packet came after the last look that found nothing more: a packet that waits is no older.
  const std::int64_t measured_ns = empty_ns_;
  for (int events = 0; events < kMostEvents; ++events) {
    const std::int64_t looked_ns = rt::monotonicNow_ns();
    if (!isReady(receiving_)) {
      empty_ns_ = looked_ns;
      break;
    }
    if (auto ok = iterate(receiving_); !ok) return std::unexpected(ok.error());
  }
  if (silence_ns() > kLost_ns)
    return std::unexpected(base::Error{"Phantom Omni", "lost: it has sent nothing for 1 s", ""});
  if (!newest_) return std::nullopt;
  return TimedReading{*newest_, measured_ns};
}

base::Result<void> OmniLink::send(const OmniCommand& command) {
  sent_ = bytesOf(command);
  while (!interrupted_ && isReady(sending_)) {
    if (auto ok = iterate(sending_); !ok) return ok;
  }
  return {};
}

void OmniLink::take(std::span<const unsigned char> bytes) {
  const auto reading = readingIn(bytes);
  if (!reading) {
    ++foreign_;
    return;
  }
  // more would be a lost link: the counter has begun anew
  constexpr std::uint32_t kMostMissing = kLost_ns / kCycle_ns;
  const std::uint32_t missing = counter_ ? reading->counter - *counter_ - 1 : 0;
  if (missing < kMostMissing) lost_ += missing;
  counter_ = reading->counter;
  newest_ = reading;
  ++received_;
  received_ns_ = rt::monotonicNow_ns();
}

std::int64_t OmniLink::silence_ns() const {
  return rt::monotonicNow_ns() - received_ns_;
}

/// Packets without torque go out before the streams end.
void OmniLink::letGo() {
  constexpr std::int64_t kMost_ns = 50'000'000;
  sent_ = bytesOf({});
  if (interrupted_ && !resume()) return;
  const std::uint64_t until = packets_sent_ + 2 * kSendBuffer;  // then the first half has left the buffer
  const std::int64_t end_ns = rt::monotonicNow_ns() + kMost_ns;
  while (packets_sent_ < until && rt::monotonicNow_ns() < end_ns) {
    if (isReady(sending_, 1) && raw1394_loop_iterate(sending_.get()) < 0) return;
  }
}

void OmniLink::stopDevice() {
  if (!control_ || !channel_from_device_) return;
  // after a reset of the bus another device may have this node
  const auto node = nodeOf(control_.get(), node_.serial);
  if (!node) return;
  node_.node = *node;
  (void)writeRegister(kStreamsAt, 0);
}

/// A reset of the bus has freed them already, and somebody else may have them since.
void OmniLink::freeChannels() {
  if (!control_ || reset_ || raw1394_get_generation(control_.get()) != generation_) return;
  for (const auto& channel : {channel_to_device_, channel_from_device_}) {
    if (channel)
      raw1394_channel_modify(control_.get(), static_cast<unsigned int>(*channel), RAW1394_MODIFY_FREE);
  }
}

}  // namespace hapticd::tools::phantom_omni

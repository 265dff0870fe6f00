// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/vm/emulators/usbip/wire.h"

namespace hapticd::test::usbip {

/// The descriptors of a device, as they are sent.
struct Descriptors {
  std::vector<std::uint8_t> device;         ///< 18 bytes
  std::vector<std::uint8_t> configuration;  ///< the only one, with its interfaces and endpoints
  std::vector<std::uint8_t> qualifier;      ///< of the other speed; empty: none
  std::map<std::uint8_t, std::vector<std::uint8_t>> strings;  ///< by index; 0 lists the languages
};

/// The string descriptor of an ASCII text of at most 126 characters.
std::vector<std::uint8_t> stringDescriptor(const std::string& text);
/// String 0: U.S. English only.
std::vector<std::uint8_t> languageDescriptor();

/// One packet of a high-speed isochronous endpoint has at most 3 transactions of 1024 bytes.
inline constexpr std::size_t kMaxIsoPacketBytes = 3072;
using IsoPacketBuffer = std::span<std::uint8_t, kMaxIsoPacketBytes>;

/// The answer to a request at the control endpoint.
struct ControlAnswer {
  bool understood = false;                   ///< else the endpoint stalls
  std::span<const std::uint8_t> bytes = {};  ///< of an IN request; valid until the device's next call

  static ControlAnswer stall() { return {}; }
  static ControlAnswer done(std::span<const std::uint8_t> bytes = {}) { return {true, bytes}; }
};

/// The requests that the host has left with a device and that wait for being completed, oldest first per
/// endpoint.
class PendingUrbs {
 public:
  PendingUrbs() = default;
  PendingUrbs(const PendingUrbs&) = delete;
  PendingUrbs& operator=(const PendingUrbs&) = delete;

  virtual bool isPending(std::uint8_t endpoint) const = 0;
  /// Packets of the oldest isochronous URB of an endpoint; 0 when there is none.
  virtual std::size_t pendingIsoPackets(std::uint8_t endpoint) const = 0;
  /// Bytes that the oldest URB of an interrupt or bulk IN endpoint takes; 0 when there is none.
  virtual std::size_t pendingBytes(std::uint8_t endpoint) const = 0;
  /// Completes the oldest URB of an interrupt or bulk IN endpoint, which must be pending.
  virtual void complete(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) = 0;
  /// Completes the oldest isochronous IN URB, which must be pending, with UsbDevice::isoPacket() of each
  /// packet.
  virtual void completeIsochronous(std::uint8_t endpoint) = 0;

 protected:
  ~PendingUrbs() = default;
};

/// The behaviour of a device beyond that of every USB device. Override what the device supports.
/// Thread: all calls come from the one that runs the Emulator.
class UsbDevice {
 public:
  UsbDevice() = default;
  UsbDevice(const UsbDevice&) = delete;
  UsbDevice& operator=(const UsbDevice&) = delete;
  virtual ~UsbDevice() = default;

  virtual const Descriptors& descriptors() const = 0;
  /// It was plugged in or unplugged: everything that the host has set is forgotten.
  virtual void reset() {}
  virtual void configure(std::uint8_t /*configuration*/) {}

  /// Returns false if such a request at the control endpoint must stay pending until the host revokes it.
  virtual bool answers(const SetupPacket&) const { return true; }
  /// A request at the control endpoint that is not the same for all devices. `data`: of an OUT request.
  virtual ControlAnswer control(const SetupPacket&, std::span<const std::uint8_t> /*data*/) {
    return ControlAnswer::stall();
  }
  /// The host has sent to an interrupt or bulk OUT endpoint.
  virtual void receive(std::uint8_t /*endpoint*/, std::span<const std::uint8_t> /*data*/) {}
  /// Writes the next packet of an isochronous IN endpoint; returns its length, 0 for none.
  virtual std::size_t isoPacket(std::uint8_t /*endpoint*/, IsoPacketBuffer) { return 0; }

  /// The host has cleared the halt feature of an endpoint.
  virtual void clearHalt(std::uint8_t /*endpoint*/) {}

  /// Completes what is due. Called after each batch of requests and at due_ns(). now_ns: CLOCK_MONOTONIC.
  virtual void work(std::int64_t /*now_ns*/, PendingUrbs&) {}
  /// Returns when work() must be called next, CLOCK_MONOTONIC; nothing: after the next requests.
  virtual std::optional<std::int64_t> due_ns(const PendingUrbs&) const { return std::nullopt; }

  /// Executes a command of the control socket; "ok", or "error: ..." without the list of what is allowed.
  virtual std::string command(std::string_view line) = 0;
  /// The device's commands, as the error names them, separated by commas.
  virtual std::string commands() const = 0;
  /// Members of the status object in JSON, separated by commas; not empty.
  virtual std::string status() const = 0;
};

/// The requests that every device with one configuration answers in the same way. SET_ADDRESS is none of
/// them: vhci_hcd keeps it for itself.
class StandardRequests {
 public:
  explicit StandardRequests(UsbDevice& device) : device_(device) {}

  /// Returns the reply to a standard request; nothing if the request is the device's own.
  std::optional<ControlAnswer> answer(const SetupPacket& setup);
  /// Returns the configuration; 0 before the host has configured the device.
  std::uint8_t configuration() const { return configuration_; }

 private:
  ControlAnswer clearFeature(const SetupPacket& setup);
  std::optional<ControlAnswer> descriptor(const SetupPacket& setup) const;
  ControlAnswer setConfiguration(std::uint8_t value);

  UsbDevice& device_;
  std::uint8_t configuration_ = 0;
  std::array<std::uint8_t, 2> answer_{};
};

}  // namespace hapticd::test::usbip

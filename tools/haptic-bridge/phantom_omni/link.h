// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <libraw1394/raw1394.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "config/base/error.h"
#include "tools/haptic-bridge/phantom_omni/arm.h"

namespace hapticd::tools::phantom_omni {

struct CloseFireWire {
  void operator()(raw1394_handle* handle) const { raw1394_destroy_handle(handle); }
};
/// A handle of libraw1394 on one port, with at most one isochronous context. Thread: one.
using FireWire = std::unique_ptr<raw1394_handle, CloseFireWire>;

/// An Omni on a bus.
struct OmniNode {
  int port = 0;
  nodeid_t node = 0;  ///< until the bus is reset
  std::string serial;
};

/// Errors: there is no such port, or it may not be opened.
base::Result<FireWire> openPort(int port);

/// The Omni with this serial number, or the first one if it is empty.
/// Errors: there is none, or the nodes of the bus may not be opened.
base::Result<OmniNode> findOmni(const std::string& serial);

/// The node that the Omni has on the port of `handle` now.  Errors: it is not there.
base::Result<nodeid_t> nodeOf(raw1394_handle* handle, const std::string& serial);

/// The text of a register that holds a serial number.
std::string serialText(std::uint32_t packed);

struct TimedReading {
  OmniReading reading;
  std::int64_t measured_ns = 0;  ///< no later than the measurement
};

/// The isochronous streams to and from one device: from open() on it gets a packet in each cycle, without
/// torque until send() says otherwise. Thread: one.
class OmniLink {
 public:
  /// Packets that wait to be sent. The bus interrupts after half of them, so that the thread has the time of
  /// the other half for the next ones.
  static constexpr int kSendBuffer = 8;
  static constexpr int kSendInterval = kSendBuffer / 2;
  /// From send() until a packet with that command is sent: behind the packets that wait when there is room
  /// for new ones, and in a cycle of its own.
  static constexpr std::int64_t kSendDelay_ns = (kSendBuffer - kSendInterval + 1) * kCycle_ns;
  /// A link without packets for so long is lost.
  static constexpr std::int64_t kLost_ns = 1'000'000'000;

  /// `serial`: of the device; empty: the first one.
  /// Errors: there is none, it may not be opened, the bus has no channels left.
  static base::Result<std::unique_ptr<OmniLink>> open(const std::string& serial);
  /// Turns the motors off and ends the streams.
  ~OmniLink();
  OmniLink(const OmniLink&) = delete;
  OmniLink& operator=(const OmniLink&) = delete;

  const std::string& serial() const { return node_.serial; }
  /// Waits until something has arrived or may be sent, at most 5 ms. Returns the newest reading, if there is
  /// a new one.  Errors: the bus was reset, no packet has come for kLost_ns.
  base::Result<std::optional<TimedReading>> receive();
  /// From now on this is sent.  Errors: the bus takes no packets.
  base::Result<void> send(const OmniCommand& command);
  /// Sends nothing until resume(), as if this program had been killed.
  void interrupt();
  base::Result<void> resume();

  /// How long no packet of the device has come.
  std::int64_t silence_ns() const;
  std::uint64_t received() const { return received_; }
  std::uint64_t lost() const { return lost_; }        ///< packets that are missing between those received
  std::uint64_t foreign() const { return foreign_; }  ///< packets that are not an Omni's

 private:
  explicit OmniLink(OmniNode node) : node_(std::move(node)) {}
  base::Result<void> start();
  base::Result<void> assignChannels();
  base::Result<void> startReceiving();
  base::Result<void> startSending();
  base::Result<int> allocateChannel();
  base::Result<void> writeRegister(nodeaddr_t address, unsigned char value);
  base::Result<void> iterate(const FireWire& handle);
  void take(std::span<const unsigned char> bytes);
  void letGo();
  void stopDevice();
  void freeChannels();

  OmniNode node_;
  FireWire control_;
  FireWire receiving_;
  FireWire sending_;
  bool receives_ = false;  // its context exists
  bool sends_ = false;
  bool interrupted_ = false;
  std::optional<int> channel_to_device_;
  std::optional<int> channel_from_device_;
  unsigned int generation_ = 0;  // of the bus, in which the channels were allocated
  bool reset_ = false;           // the bus, since then

  std::array<unsigned char, kCommandBytes> sent_ = bytesOf({});  // in each packet
  std::uint64_t packets_sent_ = 0;
  std::optional<OmniReading> newest_;
  std::optional<std::uint32_t> counter_;  // of the packet received last
  std::int64_t empty_ns_ = 0;             // when nothing more was to be received last
  std::int64_t received_ns_ = 0;          // when something was received last
  std::uint64_t received_ = 0;
  std::uint64_t lost_ = 0;
  std::uint64_t foreign_ = 0;
};

}  // namespace hapticd::tools::phantom_omni

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/vm/emulators/usbip/usb_device.h"
#include "tests/vm/emulators/usbip/wire.h"

namespace hapticd::test::usbip {

/// More packets in one URB are refused; libfreenect uses 16.
inline constexpr std::size_t kMaxIsoPackets = 128;

/// A request of the host that has not been answered.
struct Urb {
  Command command;
  std::array<IsoDescriptor, kMaxIsoPackets> iso;  ///< the first command.iso_packets
};

/// The unanswered requests in the order of their arrival. Allocates only if more of them wait than ever
/// before.
class UrbQueue {
 public:
  explicit UrbQueue(std::size_t reserved) : free_(reserved) {}

  /// Appends a request and returns it; the caller fills in `iso`.
  Urb& add(const Command& command);
  /// Returns the oldest request of an endpoint; null if there is none.
  const Urb* oldest(std::uint8_t endpoint) const;
  /// Removes the request with that number; returns false if there is none.
  bool remove(std::uint32_t sequence);
  std::size_t size() const { return waiting_.size(); }

 private:
  std::list<Urb> waiting_;
  std::list<Urb> free_;
};

/// Takes one line about an event, without its end.
using Log = std::function<void(std::string_view)>;

struct UrbCounts {
  std::uint64_t submitted = 0;
  std::uint64_t completed = 0;
  std::uint64_t unlinked = 0;       ///< taken back by the host before they were completed
  std::uint64_t unlinked_late = 0;  ///< to be taken back, but completed before
};

/// The device's end of one attachment. Whatever is answered has been written when the next request is read,
/// so that an unlink never overtakes the reply that it asks about: the kernel gives up the device otherwise.
/// Thread: one.
class Connection final : public PendingUrbs {
 public:
  /// Owns `socket`, a connected stream socket. `device` and `counts` outlive it.
  Connection(int socket, UsbDevice& device, UrbCounts& counts, Log log);
  ~Connection();

  int socket() const { return socket_; }
  /// Returns false once the host has closed the connection or sent invalid data.
  bool isAlive() const { return alive_; }
  bool isConfigured() const { return standard_.configuration() != 0; }
  std::size_t pending() const { return urbs_.size(); }

  /// Answers what has arrived; does not wait for more.
  void receive();

  bool isPending(std::uint8_t endpoint) const override { return urbs_.oldest(endpoint) != nullptr; }
  std::size_t pendingIsoPackets(std::uint8_t endpoint) const override;
  std::size_t pendingBytes(std::uint8_t endpoint) const override;
  void complete(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) override;
  void completeIsochronous(std::uint8_t endpoint) override;

 private:
  std::size_t handleFirst(std::span<const std::uint8_t> bytes);
  void submit(const Command& command, std::span<const std::uint8_t> body);
  void control(const Command& command, std::span<const std::uint8_t> data);
  void unlink(const Command& command);
  void reply(const SubmitReply& reply, std::span<const std::uint8_t> data);
  void send(std::size_t count);
  void giveUp(std::string_view why);

  int socket_;
  UsbDevice& device_;
  UrbCounts& counts_;
  Log log_;
  bool alive_ = true;
  StandardRequests standard_;
  UrbQueue urbs_;
  std::vector<std::uint8_t> received_;  // a buffer of fixed size
  std::size_t received_bytes_ = 0;      // of it in use
  std::vector<std::uint8_t> reply_;     // a buffer of fixed size
};

}  // namespace hapticd::test::usbip

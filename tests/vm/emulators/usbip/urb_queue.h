// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <list>

#include "tests/vm/emulators/usbip/wire.h"

namespace hapticd::test::usbip {

/// More packets in one URB are refused; libfreenect uses 16.
inline constexpr std::size_t kMostIsoPackets = 128;

/// A request of the host that has not been answered.
struct Urb {
  Command command;
  std::array<IsoDescriptor, kMostIsoPackets> iso;  ///< the first command.iso_packets
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

}  // namespace hapticd::test::usbip

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <vector>

namespace hapticd::test {

using Bytes = std::vector<std::uint8_t>;

/// The part of vhci_hcd at its end of an attachment.  Thread: one.
class KernelSide {
 public:
  struct Reply {
    std::uint32_t command = 0;  ///< 3 RET_SUBMIT, 4 RET_UNLINK
    std::uint32_t sequence = 0;
    std::int32_t status = 0;
    std::uint32_t actual_length = 0;
    Bytes data = {};                  ///< of an IN transfer, joined
    std::vector<Bytes> packets = {};  ///< the same by isochronous packet
  };

  /// Owns `socket`.
  explicit KernelSide(int socket) : socket_(socket) {}
  ~KernelSide();
  KernelSide(const KernelSide&) = delete;
  KernelSide& operator=(const KernelSide&) = delete;

  /// Each returns the number of the request.
  std::uint32_t submitIn(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                         std::uint16_t length, std::uint16_t index = 0);
  std::uint32_t submitOut(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                          const Bytes& data, std::uint16_t index = 0);
  std::uint32_t submitBulk(std::uint8_t endpoint, std::uint32_t bytes);
  std::uint32_t submitIso(std::uint8_t endpoint, std::size_t packets, std::uint32_t packet_bytes = 1920);
  std::uint32_t unlink(std::uint32_t sequence);
  void send(const Bytes& bytes);

  /// The next reply; waits for it, and throws when none comes.
  Reply next();
  /// Whether nothing has been sent that next() has not returned.
  bool hasNothing() const;
  /// Whether the device has hung up; waits for it.
  bool isHungUp() const;
  /// Ends the attachment as the kernel does it.
  void hangUp();

 private:
  struct Submitted {
    bool in;
    std::size_t packets;
  };
  std::uint32_t submit(bool in, std::uint8_t endpoint, std::uint32_t length, const Bytes& setup,
                       std::size_t packets, const Bytes& body);
  Bytes receive(std::size_t count) const;

  int socket_;
  std::uint32_t newest_ = 0;
  std::map<std::uint32_t, Submitted> submitted_;
};

/// A connected pair of stream sockets.
struct SocketPair {
  SocketPair();
  int kernel = -1;
  int device = -1;
};

}  // namespace hapticd::test

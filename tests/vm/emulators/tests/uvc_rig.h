// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <bit>
#include <memory>
#include <string>

#include "tests/vm/emulators/tests/kernel_side.h"
#include "tests/vm/emulators/uvc/uvc_device.h"

namespace hapticd::test {

/// As uvcvideo chooses them at a high-speed bulk endpoint.
inline constexpr std::uint32_t kUrbBytes = 16384;

/// One mode of few pixels, so that tests are fast.
inline uvc::CameraModel smallCamera(uvc::CameraModel model = uvc::realsenseD435()) {
  model.modes = {{128, 96, {30, 90}}, {64, 48, {30}}};
  return model;
}

/// The depth camera and the kernel's side of it.
class UvcRig {
 public:
  explicit UvcRig(uvc::CameraModel model = smallCamera())
      : device_(std::move(model), [](std::string_view) {}) {
    plug();
  }

  void plug() {
    const SocketPair sockets;
    connection_ =
        std::make_unique<usbip::Connection>(sockets.device, device_, counts_, [](std::string_view) {});
    host_ = std::make_unique<KernelSide>(sockets.kernel);
  }
  KernelSide& host() { return *host_; }
  uvc::UvcDevice& device() { return device_; }
  void tell(std::string_view line) { EXPECT_EQ(device_.command(line), "ok") << line; }

  void serve() {
    connection_->receive();
    device_.work(now_ns_, *connection_);
  }
  void advance(std::int64_t by_ns) {
    now_ns_ += by_ns;
    serve();
  }

  KernelSide::Reply descriptor(std::uint16_t value, std::uint16_t length = 4096) {
    host_->submitIn(0x80, 6, value, length);
    serve();
    return host_->next();
  }
  /// entity: of the control interface (0), or interface 1.
  KernelSide::Reply get(std::uint8_t request, std::uint8_t selector, std::uint16_t index,
                        std::uint16_t length) {
    host_->submitIn(0xa1, request, static_cast<std::uint16_t>(selector << 8), length, index);
    serve();
    return host_->next();
  }
  KernelSide::Reply set(std::uint8_t selector, std::uint16_t index, const Bytes& data) {
    host_->submitOut(0x21, 1, static_cast<std::uint16_t>(selector << 8), data, index);
    serve();
    return host_->next();
  }
  /// Commits mode `frame` (1 for the first) at the interval in units of 100 ns.
  void commit(std::uint8_t frame, std::uint32_t interval) {
    Bytes proposal = get(0x81, 1, 1, 34).data;
    ASSERT_EQ(proposal.size(), 34U);
    proposal[2] = 1;
    proposal[3] = frame;
    for (unsigned i = 0; i < 4; ++i) proposal[4 + i] = static_cast<std::uint8_t>(interval >> 8 * i & 0xff);
    EXPECT_EQ(set(2, 1, proposal).status, 0);
  }
  /// The next payload: URBs until one is not full.
  Bytes payload() {
    Bytes joined;
    for (;;) {
      host_->submitBulk(0x82, kUrbBytes);
      serve();
      if (host_->hasNothing()) advance(1'000'000'000 / 30);
      const KernelSide::Reply reply = host_->next();
      joined.insert(joined.end(), reply.data.begin(), reply.data.end());
      if (reply.data.size() < kUrbBytes) return joined;
    }
  }

 private:
  usbip::UrbCounts counts_;
  uvc::UvcDevice device_;
  std::unique_ptr<usbip::Connection> connection_;
  std::unique_ptr<KernelSide> host_;
  std::int64_t now_ns_ = 5'000'000'000;
};

/// Little-endian numbers, read without the emulator's own code.
inline std::uint32_t word(const Bytes& bytes, std::size_t at, std::size_t count = 4) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value |= std::uint32_t{bytes.at(at + i)} << 8 * i;
  return value;
}
inline float real(const Bytes& bytes, std::size_t at) {
  return std::bit_cast<float>(word(bytes, at));
}

}  // namespace hapticd::test

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "tests/vm/emulators/usbip/connection.h"
#include "tests/vm/emulators/usbip/usb_device.h"
#include "tests/vm/emulators/uvc/depth_stream.h"
#include "tests/vm/emulators/uvc/extension_unit.h"

namespace hapticd::test::uvc {

/// A depth camera of the USB video class. Its commands are described in README.md.
class UvcDevice final : public usbip::UsbDevice {
 public:
  UvcDevice(CameraModel model, usbip::Log log);

  const usbip::Descriptors& descriptors() const override { return descriptors_; }
  void reset() override;
  bool answers(const usbip::SetupPacket& setup) const override;
  usbip::ControlAnswer control(const usbip::SetupPacket& setup, std::span<const std::uint8_t> data) override;
  void clearHalt(std::uint8_t endpoint) override;
  void work(std::int64_t now_ns, usbip::PendingUrbs& urbs) override { stream_.work(now_ns, urbs); }
  std::optional<std::int64_t> due_ns(const usbip::PendingUrbs& urbs) const override;
  std::string command(std::string_view line) override;
  std::string commands() const override;
  std::string status() const override;

 private:
  usbip::ControlAnswer streaming(const usbip::SetupPacket& setup, std::span<const std::uint8_t> data);
  usbip::ControlAnswer extension(const usbip::SetupPacket& setup, std::span<const std::uint8_t> data);
  usbip::ControlAnswer reply(Bytes bytes);
  usbip::ControlAnswer refuse(std::uint8_t error_code);
  std::string setFault(std::string_view arguments);
  std::string freeze(std::string_view argument);
  std::string offerModes(std::string_view argument);

  const CameraModel full_model_;
  CameraModel model_;  ///< with the modes that are offered now
  usbip::Log log_;
  Faults faults_;
  std::unique_ptr<ExtensionUnit> unit_;
  StreamingControl negotiation_;
  DepthStream stream_;
  usbip::Descriptors descriptors_;
  std::string offered_ = "all";  // what `modes` has asked for
  Bytes reply_;
  std::uint8_t error_code_ = 0;  // why the last request was refused
};

}  // namespace hapticd::test::uvc

// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/usbip/usb_device.h"

#include <linux/usb/ch9.h>

namespace hapticd::test::usbip {

std::vector<std::uint8_t> stringDescriptor(const std::string& text) {
  std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), USB_DT_STRING};
  for (const char letter : text) {
    bytes.push_back(static_cast<std::uint8_t>(letter));
    bytes.push_back(0);
  }
  return bytes;
}

std::vector<std::uint8_t> languageDescriptor() {
  return {4, USB_DT_STRING, 0x09, 0x04};
}

namespace {

constexpr std::size_t kConfigurationValueAt = 5;  // in the configuration's descriptor

ControlAnswer orStall(const std::vector<std::uint8_t>& bytes) {
  return bytes.empty() ? ControlAnswer::stall() : ControlAnswer::done(bytes);
}

}  // namespace

std::optional<ControlAnswer> StandardRequests::answer(const SetupPacket& setup) {
  if ((setup.request_type & USB_TYPE_MASK) != USB_TYPE_STANDARD) return std::nullopt;
  switch (setup.request) {
    case USB_REQ_GET_DESCRIPTOR:
      return descriptor(setup);
    case USB_REQ_SET_CONFIGURATION:
      return setConfiguration(static_cast<std::uint8_t>(setup.value & 0xff));
    case USB_REQ_GET_CONFIGURATION:
      answer_ = {configuration_, 0};
      return ControlAnswer::done(std::span(answer_).first(1));
    case USB_REQ_SET_INTERFACE:
      return setup.value == 0 ? ControlAnswer::done() : ControlAnswer::stall();
    case USB_REQ_GET_INTERFACE:
      answer_ = {};
      return ControlAnswer::done(std::span(answer_).first(1));
    case USB_REQ_GET_STATUS:
      answer_ = {};
      return ControlAnswer::done(answer_);
    case USB_REQ_CLEAR_FEATURE:
      return clearFeature(setup);
    case USB_REQ_SET_FEATURE:
      return ControlAnswer::done();
    default:
      return std::nullopt;
  }
}

std::optional<ControlAnswer> StandardRequests::descriptor(const SetupPacket& setup) const {
  const Descriptors& all = device_.descriptors();
  const auto index = static_cast<std::uint8_t>(setup.value & 0xff);
  switch (setup.value >> 8) {
    case USB_DT_DEVICE:
      return ControlAnswer::done(all.device);
    case USB_DT_CONFIG:
      return index == 0 ? ControlAnswer::done(all.configuration) : ControlAnswer::stall();
    case USB_DT_DEVICE_QUALIFIER:
      return orStall(all.qualifier);
    case USB_DT_STRING: {
      const auto found = all.strings.find(index);
      return found != all.strings.end() ? ControlAnswer::done(found->second) : ControlAnswer::stall();
    }
    default:
      return std::nullopt;
  }
}

ControlAnswer StandardRequests::clearFeature(const SetupPacket& setup) {
  const bool endpoint = (setup.request_type & USB_RECIP_MASK) == USB_RECIP_ENDPOINT;
  if (endpoint && setup.value == USB_ENDPOINT_HALT) {
    device_.clearHalt(static_cast<std::uint8_t>(setup.index & 0xff));
  }
  return ControlAnswer::done();
}

ControlAnswer StandardRequests::setConfiguration(std::uint8_t value) {
  if (value != 0 && value != device_.descriptors().configuration[kConfigurationValueAt]) {
    return ControlAnswer::stall();
  }
  configuration_ = value;
  device_.configure(value);
  return ControlAnswer::done();
}

}  // namespace hapticd::test::usbip

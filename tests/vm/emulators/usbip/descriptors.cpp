// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/usbip/descriptors.h"

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

}  // namespace hapticd::test::usbip

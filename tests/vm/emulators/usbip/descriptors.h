// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

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

}  // namespace hapticd::test::usbip

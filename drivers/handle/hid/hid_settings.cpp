// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/hid/hid_settings.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>

#include "config/base/value_text.h"

namespace hapticd::drivers {
namespace {

constexpr std::size_t kDigits = 4;

std::optional<std::uint16_t> numberFrom(std::string_view digits) {
  std::uint16_t number = 0;
  const char* const end = digits.data() + digits.size();
  const auto [read_to, failure] = std::from_chars(digits.data(), end, number, 16);
  return failure == std::errc() && read_to == end ? std::optional(number) : std::nullopt;
}

}  // namespace

base::Result<HidId> hidIdFrom(std::string_view text) {
  if (text.size() == 2 * kDigits + 1 && text[kDigits] == ':') {
    const auto vendor = numberFrom(text.substr(0, kDigits));
    const auto product = numberFrom(text.substr(kDigits + 1));
    if (vendor && product && *vendor != 0) return HidId{*vendor, *product};
  }
  return std::unexpected(
      base::Error{"", fmt::format("{} names no USB vendor and product", base::inQuotes(text)),
                  "write them as lsusb shows them, four hexadecimal digits each: 046d:c626"});
}

std::string textOf(const HidId& id) {
  return fmt::format("{:04x}:{:04x}", id.vendor, id.product);
}

void checkHidHandle(const config::Settings& settings, std::vector<config::Conflict>& conflicts) {
  const base::Result<HidId> id = hidIdFrom(settings.handle.of<HidHandleSettings>().device);
  if (!id) config::addConflict(conflicts, {"hid_handle.device"}, id.error().what, id.error().remedy);
}

}  // namespace hapticd::drivers

// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/hid/hid_handle.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <hidapi.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>
#include <vector>

namespace hapticd::drivers {
namespace {

constexpr std::size_t kMaxReportBytes = 64;

/// Converts to ASCII; anything not printable becomes '?'.
std::string plainText(const wchar_t* text) {
  std::string plain;
  for (; text != nullptr && *text != L'\0'; ++text) {
    plain += *text >= L' ' && *text <= L'~' ? static_cast<char>(*text) : '?';
  }
  return plain;
}

class HidapiPort final : public HidPort {
 public:
  explicit HidapiPort(hid_device* device) : device_(device) {}
  ~HidapiPort() override { hid_close(device_); }
  HidapiPort(const HidapiPort&) = delete;
  HidapiPort& operator=(const HidapiPort&) = delete;

  base::Result<std::size_t> read(std::span<std::uint8_t> buffer, std::chrono::milliseconds wait) override {
    const int count = hid_read_timeout(device_, buffer.data(), buffer.size(), static_cast<int>(wait.count()));
    if (count < 0) return failure("reading from");
    return static_cast<std::size_t>(count);
  }

  base::Result<void> write(std::span<const std::uint8_t> report) override {
    std::array<std::uint8_t, 1 + kMaxReportBytes> bytes{};  // begins with the report id, 0 if there is none
    const std::size_t size = std::min(report.size(), kMaxReportBytes);
    std::copy_n(report.begin(), size, bytes.begin() + 1);
    if (hid_write(device_, bytes.data(), size + 1) < 0) return failure("writing to");
    return {};
  }

 private:
  std::unexpected<base::Error> failure(const char* what) const {
    return std::unexpected(
        base::Error{"hidraw", fmt::format("{} the handle failed ({})", what, plainText(hid_error(device_))),
                    "check its cable; hapticd searches for it twice a second"});
  }

  hid_device* device_;
};

struct Candidate {
  std::string path;
  std::string serial;
};

std::vector<Candidate> candidatesFor(const HidSelection& selection) {
  std::vector<Candidate> found;
  hid_device_info* const all = hid_enumerate(selection.id.vendor, selection.id.product);
  for (const hid_device_info* device = all; device != nullptr; device = device->next) {
    if (device->usage_page != selection.usage_page || device->usage != selection.usage) continue;
    found.push_back({device->path, plainText(device->serial_number)});
  }
  hid_free_enumeration(all);
  std::ranges::sort(found, {}, &Candidate::serial);
  return found;
}

std::vector<std::string> serialsOf(const std::vector<Candidate>& candidates) {
  std::vector<std::string> serials;
  for (const Candidate& candidate : candidates) {
    serials.push_back(candidate.serial.empty() ? "without a serial number" : candidate.serial);
  }
  return serials;
}

base::Error notFound(const HidSelection& selection, const std::vector<Candidate>& others) {
  if (others.empty()) {
    return {"hidraw",
            fmt::format("there is no HID device {} with usage {:04x}:{:04x}", textOf(selection.id),
                        selection.usage_page, selection.usage),
            "connect the handle, or set hid_handle.device and hid_handle.kind to what it is"};
  }
  return {"hidraw",
          fmt::format("no handle {} has the serial number {}; found: {}", textOf(selection.id),
                      selection.serial, fmt::join(serialsOf(others), ", ")),
          "set handle.serial to one of these"};
}

/// hidapi does not keep errno, so the reason is determined by another attempt to open the device.
base::Error notOpened(const HidSelection& selection, const Candidate& candidate) {
  const std::string what =
      fmt::format("{} cannot be opened ({})", candidate.path, plainText(hid_error(nullptr)));
  if (::access(candidate.path.c_str(), R_OK | W_OK) == 0 || errno != EACCES) {
    return {"hidraw", what, "unplug the handle and plug it in again"};
  }
  return {"hidraw", what,
          fmt::format("give the group hapticd the device: in /etc/udev/rules.d/73-handle.rules write "
                      "SUBSYSTEM==\"hidraw\", KERNELS==\"0003:{:04X}:{:04X}.*\", GROUP=\"hapticd\", "
                      "MODE=\"0660\", then udevadm control --reload && udevadm trigger",
                      selection.id.vendor, selection.id.product)};
}

std::string adviceOn(const std::vector<Candidate>& candidates, const Candidate& chosen) {
  if (candidates.size() < 2) return {};
  return fmt::format("{} handles found ({}), {} is used (name the right one in handle.serial)",
                     candidates.size(), fmt::join(serialsOf(candidates), ", "),
                     chosen.serial.empty() ? chosen.path : chosen.serial);
}

}  // namespace

base::Result<OpenedHid> openThroughHidapi(const HidSelection& selection) {
  const std::vector<Candidate> candidates = candidatesFor(selection);
  const auto chosen = std::ranges::find_if(candidates, [&](const Candidate& candidate) {
    return selection.serial.empty() || candidate.serial == selection.serial;
  });
  if (chosen == candidates.end()) return std::unexpected(notFound(selection, candidates));
  hid_device* const device = hid_open_path(chosen->path.c_str());
  if (device == nullptr) return std::unexpected(notOpened(selection, *chosen));
  return OpenedHid{std::make_unique<HidapiPort>(device), chosen->serial,
                   selection.serial.empty() ? adviceOn(candidates, *chosen) : ""};
}

}  // namespace hapticd::drivers

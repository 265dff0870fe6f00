// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/hid/gadget_link.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace hapticd::test::hid {

config::Result<std::unique_ptr<GadgetLink>> GadgetLink::open(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) {
    return std::unexpected(config::Error{path.string(), std::strerror(errno), "make the gadget first"});
  }
  return std::make_unique<GadgetLink>(file);
}

GadgetLink::~GadgetLink() {
  ::close(file_);
}

config::Result<void> GadgetLink::plug(const Identity& /*identity*/) {
  return {};
}

config::Result<void> GadgetLink::unplug() {
  return std::unexpected(config::Error{"a gadget", "is unplugged through its UDC attribute", ""});
}

bool GadgetLink::send(std::span<const std::uint8_t> report) {
  return ::write(file_, report.data(), report.size()) == static_cast<ssize_t>(report.size());
}

std::optional<Bytes> GadgetLink::receive() {
  std::array<std::uint8_t, 512> bytes{};
  const ssize_t count = ::read(file_, bytes.data(), bytes.size());
  if (count <= 0) return std::nullopt;
  return Bytes(bytes.begin(), bytes.begin() + count);
}

}  // namespace hapticd::test::hid

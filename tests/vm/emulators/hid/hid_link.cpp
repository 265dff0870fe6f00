// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/hid/hid_link.h"

#include <fcntl.h>
#include <linux/uhid.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>

namespace hapticd::test::hid {

HidLink::~HidLink() {
  ::close(file_);
}

base::Result<std::unique_ptr<GadgetLink>> GadgetLink::open(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) {
    return std::unexpected(base::Error{path.string(), std::strerror(errno), "make the gadget first"});
  }
  return std::make_unique<GadgetLink>(file);
}

base::Result<void> GadgetLink::plug(const Identity& /*identity*/) {
  return {};
}

base::Result<void> GadgetLink::unplug() {
  return std::unexpected(base::Error{"a gadget", "is unplugged through its UDC attribute", ""});
}

bool GadgetLink::send(std::span<const std::uint8_t> report) {
  return ::write(file(), report.data(), report.size()) == static_cast<ssize_t>(report.size());
}

std::optional<Bytes> GadgetLink::receive() {
  std::array<std::uint8_t, 512> bytes{};
  const ssize_t count = ::read(file(), bytes.data(), bytes.size());
  if (count <= 0) return std::nullopt;
  return Bytes(bytes.begin(), bytes.begin() + count);
}

namespace {

std::unexpected<base::Error> failure(const std::string& where) {
  return std::unexpected(base::Error{where, std::strerror(errno), "load the module uhid, and be root"});
}

/// The first `size` bytes of an event; the kernel takes the rest for zero.
bool put(int file, const uhid_event& event, std::size_t size) {
  return ::write(file, &event, size) == static_cast<ssize_t>(size);
}

template <std::size_t kSize>
void copyText(__u8 (&to)[kSize], const std::string& text) {
  std::copy_n(text.begin(), std::min(text.size(), kSize - 1), to);
}

/// Nobody asks a device of ours for feature reports: it has none.
void refuse(int file, const uhid_event& request) {
  uhid_event reply{};
  if (request.type == UHID_GET_REPORT) {
    reply.type = UHID_GET_REPORT_REPLY;
    reply.u.get_report_reply.id = request.u.get_report.id;
    reply.u.get_report_reply.err = EIO;
  } else {
    reply.type = UHID_SET_REPORT_REPLY;
    reply.u.set_report_reply.id = request.u.set_report.id;
    reply.u.set_report_reply.err = EIO;
  }
  put(file, reply, sizeof reply);
}

}  // namespace

base::Result<std::unique_ptr<UhidLink>> UhidLink::open(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return failure(path.string());
  return std::make_unique<UhidLink>(file);
}

base::Result<void> UhidLink::plug(const Identity& identity) {
  uhid_event event{};
  event.type = UHID_CREATE2;
  uhid_create2_req& create = event.u.create2;
  copyText(create.name, identity.name);
  copyText(create.uniq, identity.serial);
  create.bus = BUS_USB;
  create.vendor = identity.vendor;
  create.product = identity.product;
  create.rd_size = static_cast<__u16>(identity.descriptor.size());
  std::ranges::copy(identity.descriptor, create.rd_data);
  if (!put(file(), event, sizeof event)) return failure("creating a device with uhid");
  return {};
}

base::Result<void> UhidLink::unplug() {
  uhid_event event{};
  event.type = UHID_DESTROY;
  if (!put(file(), event, sizeof event.type)) return failure("destroying a device with uhid");
  return {};
}

bool UhidLink::send(std::span<const std::uint8_t> report) {
  uhid_event event{};
  event.type = UHID_INPUT2;
  event.u.input2.size = static_cast<__u16>(report.size());
  std::ranges::copy(report, event.u.input2.data);
  return put(file(), event, offsetof(uhid_event, u.input2.data) + report.size());
}

std::optional<Bytes> UhidLink::receive() {
  uhid_event event{};
  if (::read(file(), &event, sizeof event) <= 0) return std::nullopt;
  if (event.type == UHID_GET_REPORT || event.type == UHID_SET_REPORT) refuse(file(), event);
  if (event.type != UHID_OUTPUT) return std::nullopt;
  const std::size_t size = std::min<std::size_t>(event.u.output.size, UHID_DATA_MAX);
  Bytes report(event.u.output.data, event.u.output.data + size);
  if (!report.empty() && report.front() == 0) report.erase(report.begin());  // no id
  return report;
}

}  // namespace hapticd::test::hid

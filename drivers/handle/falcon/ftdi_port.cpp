// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/falcon/ftdi_port.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <libusb.h>

#include <optional>
#include <vector>

#include "drivers/handle/falcon/falcon_arm.h"

namespace hapticd::drivers {
namespace {

constexpr std::uint16_t kVendor = 0x0403;
constexpr std::uint16_t kProduct = 0xCB48;
constexpr int kInterface = 0;
constexpr std::uint8_t kBulkOut = 0x02;
constexpr std::uint8_t kBulkIn = 0x81;

// Vendor requests of FTDI's serial chips.
constexpr std::uint8_t kToChip = 0x40;
constexpr std::uint8_t kReset = 0;
constexpr std::uint8_t kModemControl = 1;
constexpr std::uint8_t kFlowControl = 2;
constexpr std::uint8_t kBaudDivisor = 3;
constexpr std::uint8_t kDataFormat = 4;
constexpr std::uint8_t kLatencyTimer = 9;
constexpr std::uint16_t kPurgeReceived = 1;
constexpr std::uint16_t kPurgeSent = 2;
constexpr std::uint16_t kEightBits = 0x0008;

constexpr const char* kNotFoundRemedy = "plug in its USB cable and its power supply";
constexpr const char* kForbiddenRemedy =
    "install the udev rule 72-hapticd.rules (0403:cb48), let the daemon run as a member of the group "
    "hapticd, and "
    "plug the device in again";
constexpr const char* kInUseRemedy = "end other programs that use it";
constexpr const char* kGoneRemedy = "check its USB cable and its power supply";

base::Error failure(std::string what, int status, const char* remedy) {
  return {"falcon", fmt::format("{} ({})", what, libusb_error_name(status)), remedy};
}

std::string serialOf(libusb_device_handle* device, std::uint8_t string_index) {
  unsigned char text[256] = {};
  if (string_index == 0) return {};
  const int length = libusb_get_string_descriptor_ascii(device, string_index, text, sizeof text - 1);
  return length > 0 ? std::string(reinterpret_cast<const char*>(text), static_cast<std::size_t>(length))
                    : std::string();
}

/// Opens one Falcon after the other until the serial number matches.
class Search {
 public:
  explicit Search(const std::string& requested_serial) : requested_serial_(requested_serial) {}

  /// Returns true, leaving the device open, if it is the requested one.
  bool tryDevice(libusb_device* device) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(device, &descriptor) < 0) return false;
    if (descriptor.idVendor != kVendor || descriptor.idProduct != kProduct) return false;
    libusb_device_handle* opened = nullptr;
    if (const int status = libusb_open(device, &opened); status < 0) {
      refusal_ = status;
      return false;
    }
    serial_ = serialOf(opened, descriptor.iSerialNumber);
    if (requested_serial_.empty() || serial_ == requested_serial_) {
      handle_ = opened;
      return true;
    }
    others_.push_back(serial_);
    libusb_close(opened);
    return false;
  }

  base::Error error() const {
    if (refusal_ == LIBUSB_ERROR_ACCESS) {
      return failure("this process may not open the device", refusal_, kForbiddenRemedy);
    }
    if (refusal_ != 0) return failure("the device cannot be opened", refusal_, kInUseRemedy);
    if (others_.empty()) return {"falcon", "no Falcon found", kNotFoundRemedy};
    return {"falcon",
            fmt::format("no Falcon has the serial number {}; found: {}", requested_serial_,
                        fmt::join(others_, ", ")),
            "set handle.serial to one of these"};
  }

  libusb_device_handle* handle() const { return handle_; }
  const std::string& serial() const { return serial_; }

 private:
  const std::string& requested_serial_;
  libusb_device_handle* handle_ = nullptr;
  std::string serial_;
  std::vector<std::string> others_;
  int refusal_ = 0;
};

}  // namespace

base::Result<std::unique_ptr<FtdiPort>> FtdiPort::open(const std::string& serial) {
  std::unique_ptr<FtdiPort> port(new FtdiPort);
  if (auto ready = port->initialise(serial); !ready) return std::unexpected(ready.error());
  if (auto claimed = port->claim(); !claimed) return std::unexpected(claimed.error());
  return port;
}

FtdiPort::~FtdiPort() {
  if (claimed_) libusb_release_interface(device_, kInterface);
  if (device_ != nullptr) libusb_close(device_);
  if (context_ != nullptr) libusb_exit(context_);
}

base::Result<void> FtdiPort::initialise(const std::string& serial) {
  if (const int status = libusb_init(&context_); status < 0) {
    context_ = nullptr;
    return std::unexpected(failure("USB cannot be used", status,
                                   "check that /dev/bus/usb exists and that the daemon may read it"));
  }
  libusb_device** list = nullptr;
  const ssize_t devices = libusb_get_device_list(context_, &list);
  if (devices < 0) {
    return std::unexpected(failure("the USB devices cannot be listed", static_cast<int>(devices),
                                   "check that the daemon may read /dev/bus/usb"));
  }
  Search search(serial);
  for (ssize_t i = 0; i < devices && !search.tryDevice(list[i]); ++i) {
  }
  libusb_free_device_list(list, 1);
  device_ = search.handle();
  if (device_ == nullptr) return std::unexpected(search.error());
  serial_ = search.serial();
  return {};
}

base::Result<void> FtdiPort::claim() {
  if (libusb_kernel_driver_active(device_, kInterface) == 1) {
    libusb_detach_kernel_driver(device_, kInterface);  // if this fails, so does the claim
  }
  if (const int status = libusb_claim_interface(device_, kInterface); status < 0) {
    return std::unexpected(failure("another program holds the device", status, kInUseRemedy));
  }
  claimed_ = true;
  return {};
}

base::Result<void> FtdiPort::request(std::uint8_t request, std::uint16_t value, const char* what) {
  const int status = libusb_control_transfer(device_, kToChip, request, value, 0, nullptr, 0,
                                             static_cast<unsigned>(kRequestLimit.count()));
  if (status < 0) return std::unexpected(failure(fmt::format("{} failed", what), status, kGoneRemedy));
  return {};
}

base::Result<void> FtdiPort::purge() {
  if (auto done = request(kReset, kPurgeReceived, "purging what was received"); !done) return done;
  return request(kReset, kPurgeSent, "purging what was sent");
}

base::Result<void> FtdiPort::setLatency(std::uint16_t latency_ms) {
  return request(kLatencyTimer, latency_ms, "setting the latency timer");
}

base::Result<void> FtdiPort::setBaud(Baud baud) {
  return request(kBaudDivisor, static_cast<std::uint16_t>(baud), "setting the baud rate");
}

base::Result<void> FtdiPort::setPlainFormat() {
  if (auto done = request(kDataFormat, kEightBits, "setting the data format"); !done) return done;
  return request(kFlowControl, 0, "switching flow control off");
}

base::Result<void> FtdiPort::setRts(bool high) {
  return request(kModemControl, high ? 0x0202 : 0x0200, "setting RTS");
}

base::Result<void> FtdiPort::setDtr(bool high) {
  return request(kModemControl, high ? 0x0101 : 0x0100, "setting DTR");
}

base::Result<void> FtdiPort::write(std::span<const std::uint8_t> bytes, std::chrono::milliseconds limit) {
  int sent = 0;
  // libusb only reads the buffer of an OUT transfer.
  auto* const data = const_cast<std::uint8_t*>(bytes.data());
  const int status = libusb_bulk_transfer(device_, kBulkOut, data, static_cast<int>(bytes.size()), &sent,
                                          static_cast<unsigned>(limit.count()));
  if (status < 0) return std::unexpected(failure("sending failed", status, kGoneRemedy));
  if (static_cast<std::size_t>(sent) != bytes.size()) {
    return std::unexpected(base::Error{
        "falcon", fmt::format("only {} of {} bytes could be sent", sent, bytes.size()), kGoneRemedy});
  }
  return {};
}

base::Result<std::span<const std::uint8_t>> FtdiPort::read(std::chrono::milliseconds limit) {
  int received = 0;
  const int status = libusb_bulk_transfer(device_, kBulkIn, received_, static_cast<int>(kReadBytes),
                                          &received, static_cast<unsigned>(limit.count()));
  if (status < 0 && status != LIBUSB_ERROR_TIMEOUT && status != LIBUSB_ERROR_OVERFLOW) {
    return std::unexpected(failure("receiving failed", status, kGoneRemedy));
  }
  const std::span<std::uint8_t> transfer(received_, static_cast<std::size_t>(received));
  return std::span<const std::uint8_t>(received_, removeStatusBytes(transfer));
}

}  // namespace hapticd::drivers

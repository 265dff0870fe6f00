// SPDX-License-Identifier: Apache-2.0
// The functions of libusb-1.0 that the driver `falcon` uses, with one FakeFalcon on the bus. Built as
// libusb-1.0.so.0, so that the real driver meets a device with faults that cannot be produced with a real
// one. A device unplugged by the test disappears in the middle of any operation.

#include <libusb.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "fake_falcon.h"

struct libusb_context {};
struct libusb_device {};
struct libusb_device_handle {};

using hapticd::test::FakeFalcon;

namespace {

constexpr std::chrono::microseconds kLatency{500};

libusb_context context;
libusb_device device;
libusb_device_handle handle;

bool ask(bool FakeFalcon::*member) {
  FakeFalcon& falcon = *hapticdFakeFalcon();
  const std::lock_guard lock(falcon.mutex);
  return falcon.*member;
}

}  // namespace

FakeFalcon* hapticdFakeFalcon() {
  static FakeFalcon only;
  return &only;
}

extern "C" {

int libusb_init(libusb_context** created) {
  *created = &context;
  return 0;
}

void libusb_exit(libusb_context*) {}

ssize_t libusb_get_device_list(libusb_context*, libusb_device*** list) {
  const bool listed = ask(&FakeFalcon::plugged);
  *list = static_cast<libusb_device**>(std::calloc(2, sizeof(libusb_device*)));
  (*list)[0] = listed ? &device : nullptr;
  return listed ? 1 : 0;
}

void libusb_free_device_list(libusb_device** list, int) {
  std::free(list);
}

int libusb_get_device_descriptor(libusb_device*, libusb_device_descriptor* descriptor) {
  *descriptor = {};
  descriptor->idVendor = 0x0403;
  descriptor->idProduct = 0xCB48;
  descriptor->iSerialNumber = 3;
  return 0;
}

int libusb_get_string_descriptor_ascii(libusb_device_handle*, std::uint8_t index, unsigned char* text,
                                       int length) {
  if (index != 3) return LIBUSB_ERROR_PIPE;
  std::strncpy(reinterpret_cast<char*>(text), FakeFalcon::kSerial, static_cast<std::size_t>(length));
  return static_cast<int>(std::strlen(FakeFalcon::kSerial));
}

int libusb_open(libusb_device*, libusb_device_handle** opened) {
  if (!ask(&FakeFalcon::may_be_opened)) return LIBUSB_ERROR_ACCESS;
  FakeFalcon& falcon = *hapticdFakeFalcon();
  const std::lock_guard lock(falcon.mutex);
  ++falcon.openings;
  *opened = &handle;
  return 0;
}

void libusb_close(libusb_device_handle*) {
  FakeFalcon& falcon = *hapticdFakeFalcon();
  const std::lock_guard lock(falcon.mutex);
  --falcon.openings;
}

int libusb_kernel_driver_active(libusb_device_handle*, int) {
  return ask(&FakeFalcon::held_by_kernel) ? 1 : 0;
}

int libusb_detach_kernel_driver(libusb_device_handle*, int) {
  FakeFalcon& falcon = *hapticdFakeFalcon();
  const std::lock_guard lock(falcon.mutex);
  falcon.held_by_kernel = false;
  falcon.detached = true;
  return 0;
}

int libusb_claim_interface(libusb_device_handle*, int interface_number) {
  if (interface_number != 0) return LIBUSB_ERROR_NOT_FOUND;
  return ask(&FakeFalcon::held_by_kernel) || ask(&FakeFalcon::in_use) ? LIBUSB_ERROR_BUSY : 0;
}

int libusb_release_interface(libusb_device_handle*, int) {
  return 0;
}

int libusb_control_transfer(libusb_device_handle*, std::uint8_t request_type, std::uint8_t request,
                            std::uint16_t value, std::uint16_t index, unsigned char*, std::uint16_t length,
                            unsigned timeout_ms) {
  if (!ask(&FakeFalcon::plugged)) return LIBUSB_ERROR_NO_DEVICE;
  if (request_type != 0x40 || index != 0 || length != 0 || timeout_ms == 0) return LIBUSB_ERROR_PIPE;
  hapticdFakeFalcon()->take({request, value});
  return 0;
}

int libusb_bulk_transfer(libusb_device_handle*, unsigned char endpoint, unsigned char* data, int length,
                         int* transferred, unsigned timeout_ms) {
  *transferred = 0;
  if (!ask(&FakeFalcon::plugged)) return LIBUSB_ERROR_NO_DEVICE;
  if (timeout_ms == 0) return LIBUSB_ERROR_INVALID_PARAM;  // it would wait forever
  const auto bytes = static_cast<std::size_t>(length);
  if (endpoint == 0x02) {
    hapticdFakeFalcon()->take(std::span<const std::uint8_t>(data, bytes));
    *transferred = length;
    return 0;
  }
  if (endpoint != 0x81 || bytes < 64) return LIBUSB_ERROR_OVERFLOW;
  std::this_thread::sleep_for(kLatency);
  *transferred = static_cast<int>(hapticdFakeFalcon()->give({data, bytes}));
  return 0;
}

const char* libusb_error_name(int code) {
  return code == LIBUSB_ERROR_ACCESS ? "LIBUSB_ERROR_ACCESS" : "an error";
}

}  // extern "C"

// SPDX-License-Identifier: Apache-2.0
// The functions of libusb-1.0 that libfreenect uses, with one FakeKinectCamera on the bus. Built as
// libusb-1.0.so.0, so that the real libfreenect meets cameras with faults that cannot be produced with a real
// one.
// Thread: libfreenect's only.

#include <libusb.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <span>
#include <thread>

#include "fake_kinect_camera.h"
#include "tests/support/kinect/kinect_protocol.h"

struct libusb_context {};
struct libusb_device {};
struct libusb_device_handle {};

namespace {

using hapticd::test::FakeKinectCamera;
namespace kinect = hapticd::test::kinect;

struct Bus {
  FakeKinectCamera camera;
  libusb_context context;
  libusb_device device;
  libusb_device_handle handle;
  std::deque<libusb_transfer*> transfers;
};

/// Never destroyed: a thread that waits for a dead camera outlives the end of main().
Bus& bus() {
  static Bus& only = *new Bus;
  return only;
}

void fillWithPackets(libusb_transfer& transfer) {
  std::uint8_t* out = transfer.buffer;
  for (int index = 0; index < transfer.num_iso_packets; ++index) {
    libusb_iso_packet_descriptor& descriptor = transfer.iso_packet_desc[index];
    const std::span<std::uint8_t, kinect::kMaxPacketBytes> packet(out, kinect::kMaxPacketBytes);
    descriptor.actual_length = static_cast<unsigned>(bus().camera.nextPacket(packet));
    descriptor.status = LIBUSB_TRANSFER_COMPLETED;
    out += descriptor.length;
  }
}

bool isCancelled(const libusb_transfer* transfer) {
  return transfer->status == LIBUSB_TRANSFER_CANCELLED;
}

/// Completes the next transfer, about as fast as the bus does.
void handleOneEvent() {
  std::this_thread::sleep_for(std::chrono::milliseconds(1));
  auto& transfers = bus().transfers;
  const auto cancelled = std::ranges::find_if(transfers, isCancelled);
  const bool gone = bus().camera.isGone();
  const bool quiet = !bus().camera.streams() || bus().camera.isMute();
  if (transfers.empty() || (cancelled == transfers.end() && quiet && !gone)) return;
  const auto next = cancelled != transfers.end() ? cancelled : transfers.begin();
  libusb_transfer* const transfer = *next;
  transfers.erase(next);
  if (!isCancelled(transfer)) {
    transfer->status = gone ? LIBUSB_TRANSFER_NO_DEVICE : LIBUSB_TRANSFER_COMPLETED;
    if (!gone) fillWithPackets(*transfer);
  }
  transfer->callback(transfer);
}

}  // namespace

extern "C" {

int libusb_init(libusb_context** context) {
  *context = &bus().context;
  return 0;
}

void libusb_exit(libusb_context*) {}

ssize_t libusb_get_device_list(libusb_context*, libusb_device*** list) {
  const bool listed = bus().camera.isListed();
  *list = static_cast<libusb_device**>(std::calloc(2, sizeof(libusb_device*)));
  (*list)[0] = listed ? &bus().device : nullptr;
  return listed ? 1 : 0;
}

void libusb_free_device_list(libusb_device** list, int) {
  std::free(list);
}

int libusb_get_device_descriptor(libusb_device*, libusb_device_descriptor* descriptor) {
  *descriptor = {};
  descriptor->idVendor = kinect::kVendor;
  descriptor->idProduct = kinect::kProduct;
  descriptor->bcdDevice = kinect::kRelease;
  descriptor->iSerialNumber = kinect::kSerialString;
  return 0;
}

int libusb_get_string_descriptor_ascii(libusb_device_handle*, std::uint8_t, unsigned char* text, int length) {
  std::strncpy(reinterpret_cast<char*>(text), FakeKinectCamera::kSerial, static_cast<std::size_t>(length));
  return static_cast<int>(std::strlen(FakeKinectCamera::kSerial));
}

int libusb_open(libusb_device*, libusb_device_handle** handle) {
  *handle = &bus().handle;
  return 0;
}

void libusb_close(libusb_device_handle*) {}
libusb_device* libusb_get_device(libusb_device_handle*) {
  return &bus().device;
}
libusb_device* libusb_get_parent(libusb_device*) {
  return nullptr;
}
std::uint8_t libusb_get_bus_number(libusb_device*) {
  return 1;
}
int libusb_get_max_iso_packet_size(libusb_device*, unsigned char) {
  return static_cast<int>(kinect::kMaxPacketBytes);
}

int libusb_claim_interface(libusb_device_handle*, int) {
  bus().camera.connect();
  return 0;
}

int libusb_release_interface(libusb_device_handle*, int) {
  return 0;
}
int libusb_kernel_driver_active(libusb_device_handle*, int) {
  return 0;
}
int libusb_detach_kernel_driver(libusb_device_handle*, int) {
  return 0;
}
int libusb_attach_kernel_driver(libusb_device_handle*, int) {
  return 0;
}
int libusb_set_interface_alt_setting(libusb_device_handle*, int, int) {
  return 0;
}
int libusb_reset_device(libusb_device_handle*) {
  return 0;
}
const char* libusb_error_name(int) {
  return "an error";
}

int libusb_get_active_config_descriptor(libusb_device*, libusb_config_descriptor** descriptor) {
  *descriptor = static_cast<libusb_config_descriptor*>(std::calloc(1, sizeof(libusb_config_descriptor)));
  (*descriptor)->bNumInterfaces = 1;
  return 0;
}

void libusb_free_config_descriptor(libusb_config_descriptor* descriptor) {
  std::free(descriptor);
}

int libusb_bulk_transfer(libusb_device_handle*, unsigned char, unsigned char*, int, int*, unsigned) {
  return LIBUSB_ERROR_NOT_SUPPORTED;
}

int libusb_control_transfer(libusb_device_handle*, std::uint8_t request_type, std::uint8_t, std::uint16_t,
                            std::uint16_t, unsigned char* data, std::uint16_t length, unsigned) {
  if (bus().camera.isGone()) return LIBUSB_ERROR_NO_DEVICE;
  if ((request_type & LIBUSB_ENDPOINT_IN) == 0) {
    bus().camera.command({data, length});
    return length;
  }
  while (bus().camera.isDead()) ::pause();
  const std::span<const std::uint8_t> reply = bus().camera.reply();
  std::ranges::copy(reply, data);
  return static_cast<int>(reply.size());
}

libusb_transfer* libusb_alloc_transfer(int packets) {
  const std::size_t bytes =
      sizeof(libusb_transfer) + static_cast<std::size_t>(packets) * sizeof(libusb_iso_packet_descriptor);
  return static_cast<libusb_transfer*>(std::calloc(1, bytes));
}

void libusb_free_transfer(libusb_transfer* transfer) {
  std::free(transfer);
}

int libusb_submit_transfer(libusb_transfer* transfer) {
  if (bus().camera.isGone()) return LIBUSB_ERROR_NO_DEVICE;
  transfer->status = LIBUSB_TRANSFER_COMPLETED;
  bus().transfers.push_back(transfer);
  return 0;
}

int libusb_cancel_transfer(libusb_transfer* transfer) {
  if (std::ranges::find(bus().transfers, transfer) == bus().transfers.end()) return LIBUSB_ERROR_NOT_FOUND;
  transfer->status = LIBUSB_TRANSFER_CANCELLED;
  return 0;
}

int libusb_handle_events(libusb_context*) {
  handleOneEvent();
  return 0;
}

int libusb_handle_events_timeout(libusb_context*, timeval*) {
  handleOneEvent();
  return 0;
}

}  // extern "C"

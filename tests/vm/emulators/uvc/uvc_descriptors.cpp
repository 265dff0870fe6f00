// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/uvc/uvc_descriptors.h"

#include <linux/usb/ch9.h>
#include <linux/usb/video.h>

#include "tests/vm/emulators/uvc/byte_writer.h"

namespace hapticd::test::uvc {
namespace {

constexpr std::uint8_t kInterface = USB_TYPE_CLASS | USB_DT_INTERFACE;  // a descriptor of the class
constexpr std::uint8_t kCameraTerminal = 1;
constexpr std::uint8_t kProcessingUnit = 2;
constexpr std::uint8_t kOutputTerminal = 4;
constexpr std::uint16_t kBulkPacketBytes = 512;  // of a high-speed endpoint
constexpr std::uint8_t kUndefined = 0;

constexpr std::uint8_t kManufacturerString = 1;
constexpr std::uint16_t kUvcVersion = 0x0110;
constexpr std::uint8_t kProductString = 2;
constexpr std::uint8_t kSerialString = 3;
constexpr std::uint8_t kFunctionString = 4;

/// C9606CCB-594C-4D25-AF47-CCC496435995 as the descriptor has it.
constexpr std::array<std::uint8_t, 16> kUnitGuid{0xcb, 0x6c, 0x60, 0xc9, 0x4c, 0x59, 0x25, 0x4d,
                                                 0xaf, 0x47, 0xcc, 0xc4, 0x96, 0x43, 0x59, 0x95};

void addInterface(Bytes& bytes, std::uint8_t number, std::uint8_t endpoints, std::uint8_t subclass) {
  ByteWriter out(bytes);
  out.u8(USB_DT_INTERFACE_SIZE).u8(USB_DT_INTERFACE).u8(number).u8(0).u8(endpoints);
  out.u8(USB_CLASS_VIDEO).u8(subclass).u8(kUndefined).u8(kFunctionString);
}

void addAssociation(Bytes& bytes) {
  ByteWriter out(bytes);
  out.u8(8).u8(USB_DT_INTERFACE_ASSOCIATION).u8(kControlInterface).u8(2).u8(USB_CLASS_VIDEO);
  out.u8(UVC_SC_VIDEO_INTERFACE_COLLECTION).u8(kUndefined).u8(kFunctionString);
}

Bytes terminalsAndUnits(std::uint32_t selectors, const Faults& faults) {
  Bytes bytes;
  constexpr std::uint8_t kControlBytes = 3;
  ByteWriter out(bytes);
  out.u8(UVC_DT_CAMERA_TERMINAL_SIZE(kControlBytes)).u8(kInterface).u8(UVC_VC_INPUT_TERMINAL);
  out.u8(kCameraTerminal).u16(UVC_ITT_CAMERA).u8(0).u8(0).u16(0).u16(0).u16(0).u8(kControlBytes).zeros(3);

  constexpr std::uint8_t kProcessingBytes = 2;
  out.u8(10 + kProcessingBytes);
  out.u8(kInterface).u8(UVC_VC_PROCESSING_UNIT).u8(kProcessingUnit).u8(kCameraTerminal).u16(0);
  out.u8(kProcessingBytes).zeros(kProcessingBytes).u8(0).u8(0);

  std::uint8_t last = kProcessingUnit;
  if (!faults.has(Fault::no_unit)) {
    constexpr std::uint8_t kSelectorBytes = 3;
    out.u8(UVC_DT_EXTENSION_UNIT_SIZE(1, kSelectorBytes)).u8(kInterface).u8(UVC_VC_EXTENSION_UNIT);
    out.u8(kExtensionUnit).append(kUnitGuid);
    std::uint8_t controls = 0;
    for (std::uint32_t rest = selectors; rest != 0; rest &= rest - 1) ++controls;
    out.u8(controls).u8(1).u8(kProcessingUnit).u8(kSelectorBytes);
    for (int byte = 0; byte < kSelectorBytes; ++byte) {
      out.u8(static_cast<std::uint8_t>(selectors >> 8 * byte & 0xffU));
    }
    out.u8(0);
    last = kExtensionUnit;
  }
  out.u8(UVC_DT_OUTPUT_TERMINAL_SIZE).u8(kInterface).u8(UVC_VC_OUTPUT_TERMINAL);
  out.u8(kOutputTerminal).u16(UVC_TT_STREAMING).u8(0).u8(last).u8(0);
  return bytes;
}

void addControlInterface(Bytes& bytes, std::uint32_t selectors, const Faults& faults) {
  addInterface(bytes, kControlInterface, 0, UVC_SC_VIDEOCONTROL);
  const Bytes rest = terminalsAndUnits(selectors, faults);
  ByteWriter out(bytes);
  out.u8(UVC_DT_HEADER_SIZE(1)).u8(kInterface).u8(UVC_VC_HEADER).u16(kUvcVersion);
  out.u16(static_cast<std::uint16_t>(UVC_DT_HEADER_SIZE(1) + rest.size())).u32(kClockHz);
  out.u8(1).u8(kStreamingInterface).append(rest);
}

void addFormatGuid(ByteWriter& out, const std::string& fourcc, bool unknown) {
  constexpr std::array<std::uint8_t, 12> kTail{0, 0, 0x10, 0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71};
  const std::string code = unknown ? "!?!?" : fourcc;
  for (const char letter : code) out.u8(static_cast<std::uint8_t>(letter));
  out.append(kTail);
}

void addFrame(ByteWriter& out, std::uint8_t index, const DepthMode& mode, const Faults& faults) {
  const bool zero = faults.has(Fault::frame_zero);
  const auto rates = static_cast<std::uint8_t>(mode.rates_hz.size());
  const std::uint32_t bytes = frameBytes(mode);
  const std::uint32_t bits = bytes * 8;
  out.u8(static_cast<std::uint8_t>(UVC_DT_FRAME_UNCOMPRESSED_SIZE(rates)));
  out.u8(kInterface).u8(UVC_VS_FRAME_UNCOMPRESSED).u8(index).u8(0);
  out.u16(zero ? 0 : mode.width_px).u16(zero ? 0 : mode.height_px);
  out.u32(bits * mode.rates_hz.back()).u32(bits * mode.rates_hz.front());
  out.u32(faults.has(Fault::lies_about_size) ? bytes / 2 : bytes);
  out.u32(intervalOf(mode.rates_hz.front())).u8(rates);
  for (const std::uint16_t rate : mode.rates_hz) {
    out.u32(faults.has(Fault::interval_zero) ? 0 : intervalOf(rate));
  }
}

Bytes formatAndFrames(const CameraModel& model, const Faults& faults) {
  Bytes bytes;
  ByteWriter out(bytes);
  const bool none = faults.has(Fault::no_frames);
  out.u8(UVC_DT_FORMAT_UNCOMPRESSED_SIZE).u8(kInterface).u8(UVC_VS_FORMAT_UNCOMPRESSED).u8(1);
  out.u8(static_cast<std::uint8_t>(none ? 0 : model.modes.size()));
  addFormatGuid(out, model.format, faults.has(Fault::unknown_format));
  out.u8(16).u8(1).zeros(4);  // bits per pixel, the first frame is the default
  std::uint8_t index = 0;
  if (!none) {
    for (const DepthMode& mode : model.modes) addFrame(out, ++index, mode, faults);
  }
  out.u8(UVC_DT_COLOR_MATCHING_SIZE).u8(kInterface).u8(UVC_VS_COLORFORMAT).zeros(3);
  return bytes;
}

void addStreamingInterface(Bytes& bytes, const CameraModel& model, const Faults& faults) {
  const bool endpoint = !faults.has(Fault::no_endpoint);
  addInterface(bytes, kStreamingInterface, endpoint ? 1 : 0, UVC_SC_VIDEOSTREAMING);
  const Bytes rest = formatAndFrames(model, faults);
  ByteWriter out(bytes);
  out.u8(UVC_DT_INPUT_HEADER_SIZE(1, 1)).u8(kInterface).u8(UVC_VS_INPUT_HEADER).u8(1);
  out.u16(static_cast<std::uint16_t>(UVC_DT_INPUT_HEADER_SIZE(1, 1) + rest.size())).u8(kStreamEndpoint);
  out.u8(0).u8(kOutputTerminal).zeros(3).u8(1).u8(0).append(rest);
  if (!endpoint) return;
  out.u8(USB_DT_ENDPOINT_SIZE).u8(USB_DT_ENDPOINT).u8(kStreamEndpoint).u8(USB_ENDPOINT_XFER_BULK);
  out.u16(kBulkPacketBytes).u8(0);
}

Bytes configurationDescriptor(const CameraModel& model, std::uint32_t selectors, const Faults& faults) {
  constexpr std::uint8_t kMilliamps = 250;  // in units of 2 mA
  Bytes bytes;
  ByteWriter out(bytes);
  out.u8(USB_DT_CONFIG_SIZE).u8(USB_DT_CONFIG).u16(0).u8(2).u8(1).u8(0).u8(USB_CONFIG_ATT_ONE).u8(kMilliamps);
  addAssociation(bytes);
  addControlInterface(bytes, selectors, faults);
  addStreamingInterface(bytes, model, faults);
  if (faults.has(Fault::descriptor_cut)) bytes.resize(bytes.size() * 2 / 3);
  put16(bytes, 2, static_cast<std::uint16_t>(bytes.size()));
  return bytes;
}

Bytes deviceDescriptor(const CameraModel& model) {
  Bytes bytes;
  ByteWriter out(bytes);
  out.u8(USB_DT_DEVICE_SIZE).u8(USB_DT_DEVICE).u16(0x0200);
  out.u8(USB_CLASS_MISC).u8(2).u8(1).u8(64);  // a device with interface associations
  out.u16(model.vendor).u16(model.product).u16(0x5010);
  out.u8(kManufacturerString).u8(kProductString).u8(kSerialString).u8(1);
  return bytes;
}

}  // namespace

usbip::Descriptors describeCamera(const CameraModel& model, std::uint32_t extension_selectors,
                                  const Faults& faults) {
  return {.device = deviceDescriptor(model),
          .configuration = configurationDescriptor(model, extension_selectors, faults),
          .qualifier = {10, USB_DT_DEVICE_QUALIFIER, 0x00, 0x02, USB_CLASS_MISC, 2, 1, 64, 1, 0},
          .strings = {{std::uint8_t{0}, usbip::languageDescriptor()},
                      {kManufacturerString, usbip::stringDescriptor(model.manufacturer)},
                      {kProductString, usbip::stringDescriptor(model.product_name)},
                      {kSerialString, usbip::stringDescriptor(model.serial)},
                      {kFunctionString, usbip::stringDescriptor(model.function_name)}}};
}

std::uint32_t intervalOf(std::uint16_t rate_hz) {
  return 10'000'000U / rate_hz;
}

std::uint32_t frameBytes(const DepthMode& mode) {
  return std::uint32_t{mode.width_px} * mode.height_px * 2U;
}

}  // namespace hapticd::test::uvc

// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/kinect/kinect_device.h"

#include <fmt/format.h>
#include <linux/usb/ch9.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "tests/support/kinect/kinect_protocol.h"
#include "tests/vm/emulators/usbip/control_socket.h"

namespace hapticd::test {

static_assert(kinect::kPixels == drivers::kKinectPixels);

base::Result<PackedRecording> PackedRecording::load(const std::filesystem::path& folder,
                                                    std::size_t most_frames) {
  const auto reader = drivers::RecordingReader::open(folder);
  if (!reader) return std::unexpected(reader.error());
  const std::size_t frames = std::min(most_frames, reader->frames().size());
  const auto frame = std::make_unique<rt::DepthFrame>();
  PackedRecording recording;
  recording.packed_.resize(frames * kinect::kPackedFrameBytes);
  for (std::size_t index = 0; index < frames; ++index) {
    if (const auto read = reader->read(index, *frame); !read) return std::unexpected(read.error());
    kinect::packDepth(frame->image().first<drivers::kKinectPixels>(),
                      std::span(recording.packed_)
                          .subspan(index * kinect::kPackedFrameBytes)
                          .first<kinect::kPackedFrameBytes>());
  }
  return recording;
}

namespace {

constexpr std::size_t kFirstLost = 100;  // or earlier, where so many are lost
constexpr std::size_t kShort = 50;
// Less often than once per frame, so that some frames stay whole; a prime, so that the place changes.
constexpr std::uint64_t kGarbageEach = 401;

}  // namespace

void StreamFaults::clear() {
  lose_next_ = 0;
  garbage_ = short_ = false;
  since_garbage_ = 0;
}

std::size_t StreamFaults::apply(std::size_t index, std::span<std::uint8_t> packet) noexcept {
  const std::size_t first = std::min(kFirstLost, kinect::kPacketsPerFrame - lose_now_);
  if (index >= first && index < first + lose_now_) return 0;
  if (garbage_ && ++since_garbage_ % kGarbageEach == 0) spoilHeader(packet.first(kinect::kPacketHeaderBytes));
  return short_ && index == kShort ? packet.size() / 2 : packet.size();
}

/// Every second header keeps its magic, so that a receiver looks at the rest.
void StreamFaults::spoilHeader(std::span<std::uint8_t> header) noexcept {
  constexpr std::size_t kMagicBytes = 2;
  const std::size_t kept = garbage_packets_++ % 2 == 0 ? 0 : kMagicBytes;
  for (std::uint8_t& byte : header.subspan(kept)) byte = randomByte();
}

/// xorshift32
std::uint8_t StreamFaults::randomByte() noexcept {
  random_ ^= random_ << 13;
  random_ ^= random_ >> 17;
  random_ ^= random_ << 5;
  return static_cast<std::uint8_t>(random_ >> 24);
}

namespace {

using kinect::kPacketsPerFrame;
using usbip::ControlAnswer;

constexpr std::int64_t kMicroframeNs = 125'000;
constexpr double kMicroframesPerFrame = 8000.0 / 30;
constexpr std::uint32_t kTicksPerMicroframe = 7500;  // of the camera's clock of 60 MHz
constexpr std::int64_t kUsualUrbPackets = 16;

constexpr std::uint8_t low(std::uint16_t value) {
  return static_cast<std::uint8_t>(value & 0xff);
}
constexpr std::uint8_t high(std::uint16_t value) {
  return static_cast<std::uint8_t>(value >> 8);
}

/// Two transactions of half the packet per microframe.
void addEndpoint(std::vector<std::uint8_t>& configuration, std::uint8_t address) {
  constexpr std::uint16_t kPacketSize = kinect::kMaxPacketBytes / 2 | 1U << 11;
  configuration.insert(configuration.end(), {USB_DT_ENDPOINT_SIZE, USB_DT_ENDPOINT, address,
                                             USB_ENDPOINT_XFER_ISOC, low(kPacketSize), high(kPacketSize), 1});
}

std::vector<std::uint8_t> configurationDescriptor() {
  constexpr std::uint8_t kLength = USB_DT_CONFIG_SIZE + USB_DT_INTERFACE_SIZE + 2 * USB_DT_ENDPOINT_SIZE;
  constexpr std::uint8_t kSelfPowered = USB_CONFIG_ATT_ONE | USB_CONFIG_ATT_SELFPOWER;
  std::vector<std::uint8_t> bytes{USB_DT_CONFIG_SIZE, USB_DT_CONFIG, kLength, 0, 1, 1, 0, kSelfPowered, 8};
  const std::uint8_t any = USB_CLASS_VENDOR_SPEC;
  bytes.insert(bytes.end(), {USB_DT_INTERFACE_SIZE, USB_DT_INTERFACE, 0, 0, 2, any, any, any, 0});
  addEndpoint(bytes, kinect::kVideoEndpoint);
  addEndpoint(bytes, kinect::kDepthEndpoint);
  return bytes;
}

usbip::Descriptors describe(const std::string& serial) {
  constexpr std::uint8_t kManufacturer = 2;
  constexpr std::uint8_t kProductName = 1;
  using namespace kinect;
  return {.device = {USB_DT_DEVICE_SIZE, USB_DT_DEVICE, 0x00, 0x02, 0, 0, 0, 64, low(kVendor), high(kVendor),
                     low(kProduct), high(kProduct), low(kRelease), high(kRelease), kManufacturer,
                     kProductName, kSerialString, 1},
          .configuration = configurationDescriptor(),
          .qualifier = {10, USB_DT_DEVICE_QUALIFIER, 0x00, 0x02, 0, 0, 0, 64, 1, 0},
          .strings = {{std::uint8_t{0}, usbip::languageDescriptor()},
                      {kManufacturer, usbip::stringDescriptor("Microsoft")},
                      {kProductName, usbip::stringDescriptor("Xbox NUI Camera")},
                      {kSerialString, usbip::stringDescriptor(serial)}}};
}

}  // namespace

KinectDevice::KinectDevice(PackedRecording recording, const std::string& serial, usbip::Log log)
    : recording_(std::move(recording)), log_(std::move(log)), descriptors_(describe(serial)) {}

void KinectDevice::reset() {
  commands_ = {};
  packets_ = {};
  video_.busy_until_ns = depth_.busy_until_ns = std::nullopt;
}

bool KinectDevice::answers(const usbip::SetupPacket& setup) const {
  return !mute_ || (setup.request_type & USB_TYPE_MASK) != USB_TYPE_VENDOR;
}

ControlAnswer KinectDevice::control(const usbip::SetupPacket& setup, std::span<const std::uint8_t> data) {
  const bool own = (setup.request_type & USB_TYPE_MASK) == USB_TYPE_VENDOR && setup.request == 0;
  if (!own) return ControlAnswer::stall();
  if ((setup.request_type & USB_DIR_IN) != 0) return ControlAnswer::done(commands_.takeReply());
  execute(data);
  return ControlAnswer::done();
}

void KinectDevice::execute(std::span<const std::uint8_t> command) {
  const bool streamed = commands_.streamsDepth();
  commands_.command(command);
  if (commands_.streamsDepth() == streamed) return;
  if (streamed) return log_(fmt::format("depth stopped after {} frames", frames_sent_));
  packets_ = {};
  microframe_ = frames_begun_ = frames_sent_ = 0;
  log_("depth started");
}

std::uint64_t KinectDevice::nextFrameAt() const {
  return static_cast<std::uint64_t>(std::llround(static_cast<double>(frames_begun_) * kMicroframesPerFrame));
}

void KinectDevice::beginFrame() {
  packets_.begin(recording_.frame(next_frame_),
                 static_cast<std::uint32_t>(microframe_) * kTicksPerMicroframe);
  if (!frozen_) next_frame_ = (next_frame_ + 1) % recording_.frames();
  faults_.beginFrame();
  ++frames_begun_;
}

std::size_t KinectDevice::isoPacket(std::uint8_t endpoint, usbip::IsoPacketBuffer out) {
  if (endpoint != kinect::kDepthEndpoint || !commands_.streamsDepth()) return 0;
  if (packets_.done() && microframe_ >= nextFrameAt()) beginFrame();
  ++microframe_;
  if (packets_.done()) return 0;
  const std::size_t index = packets_.index();
  const std::size_t bytes = packets_.next(out.first<kinect::kMaxPacketBytes>());
  if (packets_.done()) ++frames_sent_;
  return faults_.apply(index, out.first(bytes));
}

void KinectDevice::work(std::int64_t now_ns, usbip::PendingUrbs& urbs) {
  poll(video_, now_ns, urbs);
  poll(depth_, now_ns, urbs);
}

/// A URB takes as many microframes as it has packets. Where the emulator itself is late it catches up; where
/// the host is, the schedule restarts.
void KinectDevice::poll(Schedule& schedule, std::int64_t now_ns, usbip::PendingUrbs& urbs) {
  auto& busy_until_ns = schedule.busy_until_ns;
  if (stall_) {
    busy_until_ns.reset();
    return;
  }
  while (const std::size_t packets = urbs.pendingIsoPackets(schedule.endpoint)) {
    const std::int64_t end_ns =
        busy_until_ns.value_or(now_ns) + static_cast<std::int64_t>(packets) * kMicroframeNs;
    if (!busy_until_ns) busy_until_ns = now_ns;
    if (end_ns > now_ns) return;
    urbs.completeIsochronous(schedule.endpoint);
    busy_until_ns = end_ns;
  }
  if (!busy_until_ns || now_ns < *busy_until_ns + kUsualUrbPackets * kMicroframeNs) return;
  busy_until_ns.reset();
}

std::optional<std::int64_t> KinectDevice::due_ns(const usbip::PendingUrbs& urbs) const {
  std::optional<std::int64_t> due;
  for (const Schedule* schedule : {&video_, &depth_}) {
    if (!schedule->busy_until_ns) continue;
    const auto pending = static_cast<std::int64_t>(urbs.pendingIsoPackets(schedule->endpoint));
    const std::int64_t end_ns =
        *schedule->busy_until_ns + (pending != 0 ? pending : kUsualUrbPackets) * kMicroframeNs;
    due = std::min(due.value_or(end_ns), end_ns);
  }
  return due;
}

std::string KinectDevice::command(std::string_view line) {
  if (const auto arguments = usbip::argumentsOf(line, "lose")) return lose(*arguments);
  if (const auto argument = usbip::argumentsOf(line, "freeze")) return freeze(*argument);
  if (line == "play") {
    frozen_ = false;
  } else if (line == "mute") {
    mute_ = true;
  } else if (line == "stall") {
    stall_ = true;
  } else if (line == "garbage") {
    faults_.sendGarbage();
  } else if (line == "short") {
    faults_.sendShortPackets();
  } else if (line == "resume") {
    resume();
  } else {
    return fmt::format("error: unknown command \"{}\"", line);
  }
  return "ok";
}

void KinectDevice::resume() {
  mute_ = false;
  stall_ = false;
  faults_.clear();
}

std::string KinectDevice::lose(std::string_view argument) {
  const auto packets = argument == "off" ? 0 : usbip::wholeNumber(argument);
  if (!packets || *packets > kPacketsPerFrame) {
    return fmt::format("error: \"{}\" packets cannot be lost of a frame, 0 to {} can", argument,
                       kPacketsPerFrame);
  }
  faults_.lose(*packets);
  return "ok";
}

std::string KinectDevice::freeze(std::string_view argument) {
  const auto frame = usbip::wholeNumber(argument);
  if (!frame || *frame >= recording_.frames()) {
    return fmt::format("error: there is no frame \"{}\", there are 0 to {}", argument,
                       recording_.frames() - 1);
  }
  frozen_ = true;
  next_frame_ = *frame;
  return "ok";
}

std::string KinectDevice::commands() const {
  return "lose N, lose off, short, garbage, stall, mute, resume, freeze FRAME, play";
}

std::string KinectDevice::status() const {
  return fmt::format(R"("streaming":{},"frames":{})", commands_.streamsDepth(), frames_sent_);
}

}  // namespace hapticd::test

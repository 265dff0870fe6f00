#include "fake_kinect_camera.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "tests/support/made_up_pixel.h"

namespace hapticd::test {
namespace {

constexpr std::size_t kPixels = 640 * 480;
constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kDataBytes = 1748;  // of every packet but the last
constexpr std::size_t kFrameBytes = kPixels * 11 / 8;
constexpr std::size_t kPackets = (kFrameBytes + kDataBytes - 1) / kDataBytes;
static_assert(kPackets == 242);

constexpr std::uint32_t kFramesUntilTrouble = 6;

void put16(std::vector<std::uint8_t>& bytes, std::size_t value) {
  bytes.push_back(static_cast<std::uint8_t>(value & 0xff));
  bytes.push_back(static_cast<std::uint8_t>(value >> 8 & 0xff));
}

void putFloat(std::vector<std::uint8_t>& bytes, std::size_t at, float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  for (std::size_t byte = 0; byte < 4; ++byte) bytes[at + byte] = static_cast<std::uint8_t>(bits >> 8 * byte);
}

std::size_t word(const std::uint8_t* bytes, std::size_t index) {
  return bytes[2 * index] | static_cast<std::size_t>(bytes[2 * index + 1]) << 8;
}

/// Which packets of a lossy camera never arrive: some in the middle of frame 5, and some around the boundary
/// of the frames 8 and 9.
bool isLost(std::uint32_t frame, std::size_t packet) {
  return (frame == 5 && packet >= 100 && packet < 103) || (frame == 8 && packet >= kPackets - 2) ||
         (frame == 9 && packet < 2);
}

bool isShort(std::uint32_t frame, std::size_t packet) {
  return frame == 12 && packet == 50;
}

}  // namespace

FakeKinectCamera::FakeKinectCamera() {
  const char* const script = std::getenv("FAKE_KINECT");
  script_ = script != nullptr ? script : "steady";
}

bool FakeKinectCamera::isFrameWhole(std::uint32_t number) {
  return number != 5 && number != 8 && number != 9 && number != 12;
}

bool FakeKinectCamera::isListed() {
  ++listings_;
  if (script_ == "late") return listings_ > 2;
  if (isGone()) {
    connections_ = 2;  // back the next time
    streams_ = false;
    return false;
  }
  return true;
}

bool FakeKinectCamera::isGone() const {
  return script_ == "unplugged" && connections_ == 1 && frame_ > kFramesUntilTrouble;
}

bool FakeKinectCamera::isMute() const {
  return script_ == "mute" && connections_ == 1 && frame_ > kFramesUntilTrouble;
}

void FakeKinectCamera::connect() {
  ++connections_;
  streams_ = false;
}

void FakeKinectCamera::command(const std::uint8_t* bytes, std::size_t count) {
  constexpr std::size_t kReadRegister = 0x02;
  constexpr std::size_t kWriteRegister = 0x03;
  constexpr std::size_t kZeroPlane = 0x04;
  constexpr std::size_t kRegistration = 0x16;
  if (count < 10 || std::memcmp(bytes, "GM", 2) != 0) return;
  const auto command = static_cast<std::uint16_t>(word(bytes, 2));
  const auto tag = static_cast<std::uint16_t>(word(bytes, 3));
  const std::size_t first = word(bytes, 4);
  switch (command) {
    case kReadRegister:
      return answer(command, tag, std::vector<std::uint8_t>(4));
    case kWriteRegister:
      if (first == 0x06) {
        streams_ = word(bytes, 5) == 2;
        if (streams_) beginFrame();
      }
      return answer(command, tag, std::vector<std::uint8_t>(2));
    case kZeroPlane: {
      std::vector<std::uint8_t> payload(322);
      putFloat(payload, 94, 7.5F);
      putFloat(payload, 98, 2.3F);
      putFloat(payload, 102, 120.0F);
      putFloat(payload, 106, 0.1042F);
      return answer(command, tag, payload);
    }
    case kRegistration:
      return answer(command, tag, std::vector<std::uint8_t>(first == 0x41 ? 8 : first == 0x40 ? 118 : 4));
    default:
      return answer(command, tag, std::vector<std::uint8_t>(2));
  }
}

void FakeKinectCamera::answer(std::uint16_t command, std::uint16_t tag, std::vector<std::uint8_t> payload) {
  reply_ = {'R', 'B'};
  put16(reply_, payload.size() / 2);
  put16(reply_, command);
  put16(reply_, tag);
  reply_.insert(reply_.end(), payload.begin(), payload.end());
}

std::vector<std::uint8_t> FakeKinectCamera::reply() {
  return std::exchange(reply_, {});
}

void FakeKinectCamera::beginFrame() {
  ++frame_;
  packet_ = 0;
  packed_.assign(kFrameBytes, 0);
  for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
    const unsigned value = madeUpPixel(frame_, pixel);
    for (unsigned bit = 0; bit < 11; ++bit) {
      if ((value >> (10 - bit) & 1U) == 0) continue;
      const std::size_t at = pixel * 11 + bit;
      packed_[at / 8] = static_cast<std::uint8_t>(packed_[at / 8] | 0x80U >> at % 8);
    }
  }
}

std::vector<std::uint8_t> FakeKinectCamera::nextPacket() {
  const bool last = packet_ + 1 == kPackets;
  const std::uint8_t flag = packet_ == 0 ? 0x71 : last ? 0x75 : 0x72;
  std::vector<std::uint8_t> packet{'R', 'B', 0, flag, 0, packet_sequence_++, 0, 0};
  put16(packet, frame_);  // the ticks name the frame
  put16(packet, 0);
  const bool lossy = script_ == "lossy";
  const std::size_t begin = packet_ * kDataBytes;
  std::size_t end = std::min(begin + kDataBytes, kFrameBytes);
  if (lossy && isShort(frame_, packet_)) end = begin + kDataBytes / 2;
  packet.insert(packet.end(), packed_.begin() + static_cast<std::ptrdiff_t>(begin),
                packed_.begin() + static_cast<std::ptrdiff_t>(end));
  const bool lost = lossy && isLost(frame_, packet_);
  ++packet_;
  if (last) beginFrame();
  return lost ? std::vector<std::uint8_t>{} : packet;
}

}  // namespace hapticd::test

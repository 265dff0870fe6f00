// SPDX-License-Identifier: Apache-2.0
#include "fake_kinect_camera.h"

#include <cstdlib>

#include "tests/support/made_up_pixel.h"

namespace hapticd::test {
namespace {

using kinect::kPacketsPerFrame;

constexpr std::uint32_t kFramesUntilTrouble = 6;

/// Defines which packets of a lossy camera never arrive: some in the middle of frame 5, and some around the
/// boundary between frames 8 and 9.
bool isLost(std::uint32_t frame, std::size_t packet) {
  return (frame == 5 && packet >= 100 && packet < 103) || (frame == 8 && packet >= kPacketsPerFrame - 2) ||
         (frame == 9 && packet < 2);
}

bool isShort(std::uint32_t frame, std::size_t packet) {
  return frame == 12 && packet == 50;
}

}  // namespace

FakeKinectCamera::FakeKinectCamera() : raw_(kinect::kPixels), packed_(kinect::kPackedFrameBytes) {
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
    connections_ = 2;  // reconnected at the next listing
    commands_ = {};
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
  commands_ = {};
}

void FakeKinectCamera::command(std::span<const std::uint8_t> bytes) {
  const bool streamed = streams();
  commands_.command(bytes);
  if (streams() && !streamed) beginFrame();
}

void FakeKinectCamera::beginFrame() {
  ++frame_;
  for (std::size_t pixel = 0; pixel < raw_.size(); ++pixel) raw_[pixel] = madeUpPixel(frame_, pixel);
  const std::span<std::uint8_t, kinect::kPackedFrameBytes> packed(packed_);
  kinect::packDepth(std::span<const std::uint16_t, kinect::kPixels>(raw_), packed);
  packets_.begin(packed, frame_);  // the ticks identify the frame
}

std::size_t FakeKinectCamera::nextPacket(std::span<std::uint8_t, kinect::kMaxPacketBytes> out) {
  const std::size_t index = packets_.index();
  const std::uint32_t frame = frame_;
  const std::size_t bytes = packets_.next(out);
  if (packets_.done()) beginFrame();
  if (script_ != "lossy") return bytes;
  if (isLost(frame, index)) return 0;
  return isShort(frame, index) ? kinect::kPacketHeaderBytes + kinect::kPacketDataBytes / 2 : bytes;
}

}  // namespace hapticd::test

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tests/support/kinect/kinect_protocol.h"

namespace hapticd::test {

/// A Kinect v1's depth camera that plays synthetic frames and fails as selected by the environment variable
/// FAKE_KINECT:
/// - steady: no fault.
/// - late: the camera is missing in the first two listings of the bus.
/// - lossy: packets of the frames 5, 8, 9 and 12 are lost or short (see isFrameWhole).
/// - unplugged: it disappears after 6 frames of the first connection; it is missing in the next listing and
/// then reconnected.
/// - mute: after 6 frames of the first connection it sends no more data.
/// - dead: it never responds to a command.
class FakeKinectCamera {
 public:
  FakeKinectCamera();

  static constexpr const char* kSerial = "A00000000000001A";

  /// Returns whether frame `number` (starting at 1) of a lossy camera is undamaged.
  static bool isFrameWhole(std::uint32_t number);

  /// Called once for each listing of the bus.
  bool isListed();
  bool isDead() const { return script_ == "dead"; }
  /// Returns whether it has just been unplugged, so that transfers fail.
  bool isGone() const;
  bool isMute() const;
  /// Returns whether depth has been started.
  bool streams() const { return commands_.streamsDepth(); }

  void connect();
  void command(std::span<const std::uint8_t> bytes);
  /// Returns the reply to the newest command once, then nothing.
  std::span<const std::uint8_t> reply() { return commands_.takeReply(); }
  /// Returns the length of the next isochronous packet; 0 for a lost one.
  std::size_t nextPacket(std::span<std::uint8_t, kinect::kMaxPacketBytes> out);

 private:
  void beginFrame();

  std::string script_;
  int listings_ = 0;
  int connections_ = 0;
  kinect::KinectCommands commands_;
  kinect::DepthPackets packets_;
  std::vector<std::uint16_t> raw_;    // frame in progress
  std::vector<std::uint8_t> packed_;  // the same in the camera's format
  std::uint32_t frame_ = 0;           // its number
};

}  // namespace hapticd::test

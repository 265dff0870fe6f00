// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tests/support/kinect/depth_packets.h"
#include "tests/support/kinect/kinect_commands.h"

namespace hapticd::test {

/// A Kinect v1's depth camera that plays made-up frames and fails as the environment variable FAKE_KINECT
/// says:
/// - steady: nothing.
/// - late: the camera is not there the first two times somebody looks.
/// - lossy: packets of the frames 5, 8, 9 and 12 are lost or short (see isFrameWhole).
/// - unplugged: after 6 frames of the first connection it is gone; the next time somebody looks it is
/// missing,
///   then it is back.
/// - mute: after 6 frames of the first connection no more data come.
/// - dead: it never answers a command.
class FakeKinectCamera {
 public:
  FakeKinectCamera();

  static constexpr const char* kSerial = "A00000000000001A";

  /// Whether frame `number` (1 for the first) leaves a lossy camera undamaged.
  static bool isFrameWhole(std::uint32_t number);

  /// To be asked once for each listing of the bus.
  bool isListed();
  bool isDead() const { return script_ == "dead"; }
  /// It has just been unplugged: transfers fail.
  bool isGone() const;
  bool isMute() const;
  /// It has been told to send depth.
  bool streams() const { return commands_.streamsDepth(); }

  void connect();
  void command(std::span<const std::uint8_t> bytes);
  /// The reply to the newest command, once; then nothing.
  std::span<const std::uint8_t> reply() { return commands_.takeReply(); }
  /// The next isochronous packet; returns its length, 0 for one that is lost.
  std::size_t nextPacket(std::span<std::uint8_t, kinect::kMostPacketBytes> out);

 private:
  void beginFrame();

  std::string script_;
  int listings_ = 0;
  int connections_ = 0;
  kinect::KinectCommands commands_;
  kinect::DepthPackets packets_;
  std::vector<std::uint16_t> raw_;    // the frame in progress
  std::vector<std::uint8_t> packed_;  // the same as it is sent
  std::uint32_t frame_ = 0;           // its number
};

}  // namespace hapticd::test

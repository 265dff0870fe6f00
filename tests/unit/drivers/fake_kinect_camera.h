#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hapticd::test {

/// What a Kinect v1's depth camera does at its USB connection: it answers the commands with which libfreenect
/// opens it and sends depth packets. The environment variable FAKE_KINECT chooses what goes wrong:
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
  static constexpr std::size_t kMostPacketBytes = 1920;

  /// Whether frame `number` (1 for the first) leaves a lossy camera undamaged.
  static bool isFrameWhole(std::uint32_t number);

  /// To be asked once for each listing of the bus.
  bool isListed();
  bool isDead() const { return script_ == "dead"; }
  /// It has just been unplugged: transfers fail.
  bool isGone() const;
  bool isMute() const;
  /// It has been told to send depth.
  bool streams() const { return streams_; }

  void connect();
  void command(const std::uint8_t* bytes, std::size_t count);
  /// The reply to the newest command, once; then nothing.
  std::vector<std::uint8_t> reply();
  /// The bytes of the next isochronous packet; empty for one that is lost.
  std::vector<std::uint8_t> nextPacket();

 private:
  void answer(std::uint16_t command, std::uint16_t tag, std::vector<std::uint8_t> payload);
  void beginFrame();

  std::string script_;
  int listings_ = 0;
  int connections_ = 0;
  bool streams_ = false;
  std::vector<std::uint8_t> reply_;
  std::vector<std::uint8_t> packed_;  // the frame in progress, 11 bits per pixel
  std::uint32_t frame_ = 0;           // number of the frame in progress
  std::size_t packet_ = 0;            // index of its next packet
  std::uint8_t packet_sequence_ = 0;
};

}  // namespace hapticd::test

// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "child_process.h"
#include "drivers/camera/freenect/frame_integrity.h"
#include "drivers/camera/freenect/freenect_camera.h"
#include "drivers/camera/kinect_image.h"
#include "fake_kinect_camera.h"
#include "frame_collector.h"
#include "tests/support/made_up_pixel.h"

// Which frames are complete; then the driver `freenect` with the real libfreenect and a camera on an emulated
// USB bus (fake_libusb.cpp). Each test runs in a process of its own, because the bus is chosen at its start.
namespace hapticd::drivers {
namespace {

using Damage = std::optional<std::string>;

/// Log lines of libfreenect 0.5.3 before a frame is delivered, and what they say of the frame.
struct Case {
  std::vector<const char*> lines;
  Damage damage;
};
constexpr const char* kAll = "Got depth frame of size 422400/422400, 242/242 packets arrived, TS 00002a10\n";
constexpr const char* kSome = "Got depth frame of size 422400/422400, 240/242 packets arrived, TS 00002a10\n";

TEST(FrameIntegrity, IsWhatTheLogLinesBeforeAFrameSay) {
  const Case cases[] = {
      {{}, {}},
      {{kAll}, {}},
      {{"[Stream 70] Lost 2 packets\n", "[Stream 70] Lost 2 total packets in 7 frames (0.285714 lppf)\n",
        kSome},
       "240 of 242 packets arrived"},
      {{"[Stream 70] Lost 1 packets\n"}, "Lost 1 packets"},
      {{"[Stream 70] Expected 1748 data bytes, but got 900\n", kAll},
       "Expected 1748 data bytes, but got 900"},
      // the frame with the loss is abandoned, and the next one is delivered
      {{"[Stream 70] Lost 60 packets\n", "[Stream 70] Lost too many packets, resyncing...\n"}, {}},
      {{"[Stream 80] Lost 3 packets\n"}, {}}};  // the colour stream
  for (const auto& [lines, damage] : cases) {
    FrameIntegrity integrity;
    for (const char* line : lines) integrity.noteLogLine(line);
    EXPECT_EQ(integrity.takeDamage(), damage) << (lines.empty() ? "no line" : lines.front());
    EXPECT_EQ(integrity.takeDamage(), std::nullopt) << "of the next frame";
  }
}

TEST(FrameIntegrity, RejectsBothFramesWhenPacketsAreLostAcrossTheirBoundary) {
  FrameIntegrity integrity;
  integrity.noteLogLine("[Stream 70] Lost 4 packets\n");
  integrity.noteLogLine(kSome);
  EXPECT_NE(integrity.takeDamage(), std::nullopt);
  integrity.noteLogLine(kSome);
  EXPECT_NE(integrity.takeDamage(), std::nullopt);
}

using test::FakeKinectCamera;
using test::FrameCollector;

int runWithCamera(const std::string& script) {
  return test::runInChild({"LD_LIBRARY_PATH=" HAPTICD_FAKE_LIBUSB_FOLDER, "FAKE_KINECT=" + script});
}

/// The fake camera's ticks are the frame's number, which determines its pixels.
void expectPixelsOfTheirFrame(FrameCollector& frames) {
  for (std::size_t index = 0; index < frames.count(); ++index) {
    const rt::DepthFrame& frame = frames.frame(index);
    std::size_t different = 0;
    for (std::size_t pixel = 0; pixel < kKinectPixels; ++pixel) {
      different += frame.raw[pixel] != test::madeUpPixel(frame.device_ticks, pixel);
    }
    EXPECT_EQ(different, 0U) << "frame " << frame.device_ticks;
    EXPECT_EQ(frame.sequence, index + 1);
  }
}

TEST(FakeKinect, DeliversExactFramesAndNamesTheCameraBySerialNumber) {
  if (!test::isChild()) {
    EXPECT_EQ(runWithCamera("steady"), 0);
    return;
  }
  FrameCollector frames;
  FreenectCamera camera("");
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(frames.waitForFrames(5));
  EXPECT_EQ(camera.status().state, CameraState::streaming);
  EXPECT_EQ(camera.status().identity, std::string("freenect ") + FakeKinectCamera::kSerial);
  camera.stop();
  expectPixelsOfTheirFrame(frames);
  EXPECT_EQ(camera.status().damaged_frames, 0U);
}

TEST(FakeKinect, OpensTheCameraWithTheGivenSerialNumberAndNoOther) {
  if (!test::isChild()) {
    EXPECT_EQ(runWithCamera("steady"), 0);
    return;
  }
  FrameCollector frames;
  FreenectCamera camera(FakeKinectCamera::kSerial);
  ASSERT_TRUE(camera.start(frames));
  EXPECT_TRUE(frames.waitForFrames(1));
  camera.stop();

  FrameCollector none;
  FreenectCamera other("B");
  ASSERT_TRUE(other.start(none));
  EXPECT_TRUE(
      test::eventually([&] { return other.status().detail.find("serial number B") != std::string::npos; }));
  EXPECT_EQ(other.status().state, CameraState::absent);
  other.stop();
  EXPECT_EQ(none.count(), 0U);
}

TEST(FakeKinect, FindsACameraThatIsConnectedAfterTheStart) {
  if (!test::isChild()) {
    EXPECT_EQ(runWithCamera("late"), 0);
    return;
  }
  FrameCollector frames;
  FreenectCamera camera("");
  ASSERT_TRUE(camera.start(frames));
  EXPECT_TRUE(
      test::eventually([&] { return camera.status().detail.find("no Kinect found") != std::string::npos; }));
  EXPECT_EQ(camera.status().state, CameraState::absent);
  ASSERT_TRUE(frames.waitForFrames(2));
  EXPECT_EQ(camera.status().state, CameraState::streaming);
  camera.stop();
  expectPixelsOfTheirFrame(frames);
}

TEST(FakeKinect, DeliversNoFrameThatLostPackets) {
  if (!test::isChild()) {
    EXPECT_EQ(runWithCamera("lossy"), 0);
    return;
  }
  FrameCollector frames;
  FreenectCamera camera("");
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(frames.waitForFrames(10));
  camera.stop();
  expectPixelsOfTheirFrame(frames);
  std::uint32_t expected = 1;
  for (std::size_t index = 0; index < 10; ++index) {
    while (!FakeKinectCamera::isFrameWhole(expected)) ++expected;
    EXPECT_EQ(frames.frame(index).device_ticks, expected++) << "every whole frame is delivered";
  }
  EXPECT_EQ(camera.status().damaged_frames, 4U);
}

TEST(FakeKinect, IsLostWhenUnpluggedAndComesBackByItself) {
  if (!test::isChild()) {
    EXPECT_EQ(runWithCamera("unplugged"), 0);
    return;
  }
  FrameCollector frames;
  FreenectCamera camera("");
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(test::eventually([&] { return camera.status().state == CameraState::lost; }));
  EXPECT_FALSE(camera.status().detail.empty());
  const std::size_t before = frames.count();
  ASSERT_TRUE(frames.waitForFrames(before + 3));
  EXPECT_EQ(camera.status().state, CameraState::streaming);
  camera.stop();
  expectPixelsOfTheirFrame(frames);
}

TEST(FakeKinect, IsLostWhenNoMoreFramesComeAndComesBackByItself) {
  if (!test::isChild()) {
    EXPECT_EQ(runWithCamera("mute"), 0);
    return;
  }
  FrameCollector frames;
  FreenectCamera camera("");
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(test::eventually([&] { return camera.status().state == CameraState::lost; }));
  EXPECT_NE(camera.status().detail.find("stopped sending frames"), std::string::npos);
  const std::size_t before = frames.count();
  ASSERT_TRUE(frames.waitForFrames(before + 3));
  camera.stop();
  expectPixelsOfTheirFrame(frames);
}

TEST(FakeKinect, StopReturnsAlthoughTheCameraNeverResponds) {
  if (!test::isChild()) {
    EXPECT_EQ(runWithCamera("dead"), 0);
    return;
  }
  FrameCollector frames;
  FreenectCamera camera("", std::chrono::milliseconds(50));
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(
      test::eventually([&] { return camera.status().detail.find("does not respond") != std::string::npos; }));
  EXPECT_EQ(camera.status().state, CameraState::absent);
  camera.stop();
  EXPECT_EQ(frames.count(), 0U);
}

}  // namespace
}  // namespace hapticd::drivers

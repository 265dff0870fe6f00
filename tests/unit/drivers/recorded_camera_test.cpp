// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/recorded_camera.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <string>

#include "drivers/camera/kinect_image.h"
#include "frame_collector.h"
#include "rt/base/clock.h"
#include "tests/support/recordings/scratch_recording.h"

namespace hapticd::drivers {
namespace {

using test::FrameCollector;
using test::ScratchRecording;

bool isMadeUpFrame(const rt::DepthFrame& frame, std::uint32_t number) {
  for (std::size_t pixel = 0; pixel < kKinectPixels; ++pixel) {
    if (frame.raw[pixel] != test::madeUpPixel(number, pixel)) return false;
  }
  return true;
}

TEST(RecordedCamera, PlaysEveryFrameOnceAndIsThenLost) {
  ScratchRecording recording;
  test::fillRecording(recording, 5);
  FrameCollector frames;
  RecordedCamera camera(recording.path(), false, 1);
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(test::eventually([&] { return camera.status().state == CameraState::lost; }));
  camera.stop();

  ASSERT_EQ(frames.count(), 5U);
  for (std::uint32_t index = 0; index < 5; ++index) {
    EXPECT_EQ(frames.frame(index).sequence, index + 1);
    EXPECT_EQ(frames.frame(index).device_ticks, 1000 + index);
    EXPECT_TRUE(isMadeUpFrame(frames.frame(index), index));
  }
  EXPECT_EQ(camera.status().detail, "the recording has ended");
  EXPECT_EQ(camera.status().frames, 5U);
  EXPECT_EQ(camera.status().damaged_frames, 0U);
}

TEST(RecordedCamera, RestartsAtTheEndOfALoop) {
  ScratchRecording recording;
  test::fillRecording(recording, 3);
  FrameCollector frames;
  RecordedCamera camera(recording.path(), true, 10);
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(frames.waitForFrames(8));
  EXPECT_EQ(camera.status().state, CameraState::streaming);
  camera.stop();
  EXPECT_EQ(frames.frame(7).sequence, 8U);
  EXPECT_TRUE(isMadeUpFrame(frames.frame(7), 7 % 3));
}

TEST(RecordedCamera, PlaysNoFrameBeforeItsTime) {
  ScratchRecording recording;
  recording.add(0, "10.0", 1);
  recording.add(1, "14.0", 2);
  recording.writeIndex();
  FrameCollector frames;
  RecordedCamera camera(recording.path(), false, 100);
  const std::int64_t before_start_ns = rt::monotonicNow_ns();
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(frames.waitForFrames(2));
  camera.stop();
  EXPECT_GE(frames.frame(1).arrival_ns, before_start_ns + 40'000'000) << "4 s, 100 times faster";
}

TEST(RecordedCamera, SkipsADamagedFrameAndContinues) {
  ScratchRecording recording;
  recording.add(0, "1.00", 1);
  const auto damaged = recording.add(1, "1.01", 2);
  const auto truncated = recording.add(2, "1.02", 3);
  recording.add(3, "1.03", 4);
  recording.writeIndex();
  std::string bytes = test::pgmBytes(1);
  bytes[test::kPgmHeader.size() + 1] = '\x7f';
  test::writeFile(damaged, bytes);
  test::writeFile(truncated, test::pgmBytes(2).substr(0, 5000));

  FrameCollector frames;
  RecordedCamera camera(recording.path(), false, 1);
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(test::eventually([&] { return camera.status().state == CameraState::lost; }));
  camera.stop();
  ASSERT_EQ(frames.count(), 2U);
  EXPECT_TRUE(isMadeUpFrame(frames.frame(0), 0));
  EXPECT_TRUE(isMadeUpFrame(frames.frame(1), 3));
  EXPECT_EQ(frames.frame(1).sequence, 2U);
  EXPECT_EQ(camera.status().damaged_frames, 2U);
}

TEST(RecordedCamera, StopsWhileItWaitsForAFrameOfTomorrow) {
  ScratchRecording recording;
  recording.add(0, "1.0", 1);
  recording.add(1, "86401.0", 2);
  recording.writeIndex();
  FrameCollector frames;
  RecordedCamera camera(recording.path(), false, 1);
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(frames.waitForFrames(1));
  camera.stop();
  EXPECT_EQ(frames.count(), 1U);
}

TEST(RecordedCamera, StartsAgainAfterAStop) {
  ScratchRecording recording;
  test::fillRecording(recording, 2);
  FrameCollector first;
  FrameCollector second;
  RecordedCamera camera(recording.path(), false, 1);
  ASSERT_TRUE(camera.start(first));
  ASSERT_TRUE(first.waitForFrames(2));
  EXPECT_FALSE(camera.start(second)) << "it is running";
  camera.stop();
  ASSERT_TRUE(camera.start(second));
  ASSERT_TRUE(second.waitForFrames(1));
  camera.stop();
  EXPECT_EQ(second.frame(0).sequence, 1U);
}

TEST(RecordedCamera, DoesNotStartWithoutAValidRecording) {
  const test::TemporaryFolder folder;
  FrameCollector frames;
  RecordedCamera camera(folder.path(), true, 1);
  EXPECT_FALSE(camera.start(frames));
  camera.stop();
}

TEST(RecordedCamera, TheFirstFrameMayBeDamagedToo) {
  ScratchRecording recording;
  const auto file = recording.add(0, "1.0", 1);
  recording.add(1, "1.01", 2);
  recording.writeIndex();
  test::writeFile(file, "P5 640 480 65535\n");
  std::ofstream(recording.path() / "INDEX.txt", std::ios::app) << "d-1.02";
  FrameCollector frames;
  RecordedCamera camera(recording.path(), false, 1);
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(frames.waitForFrames(1));
  EXPECT_TRUE(isMadeUpFrame(frames.frame(0), 1));
  ASSERT_TRUE(test::eventually([&] { return camera.status().state == CameraState::lost; }));
  camera.stop();
  EXPECT_EQ(frames.count(), 1U);
  EXPECT_EQ(camera.status().damaged_frames, 2U) << "a frame, and the line that was cut off";
}

TEST(RecordedCamera, NamesWhatWasDamagedWhileItPlays) {
  ScratchRecording recording;
  const auto file = recording.add(0, "1.0", 1);
  recording.add(1, "1.01", 2);
  recording.add(2, "1000.0", 3);
  recording.writeIndex();
  test::writeFile(file, "P5 640 480 65535\n");
  FrameCollector frames;
  RecordedCamera camera(recording.path(), false, 1);
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(frames.waitForFrames(1));
  ASSERT_TRUE(test::eventually([&] { return camera.status().state == CameraState::streaming; }));
  EXPECT_NE(camera.status().detail.find("d-1.0-1.pgm"), std::string::npos) << camera.status().detail;
  camera.stop();
}

TEST(RecordedCamera, IsLostWhereNoFrameCanBeRead) {
  ScratchRecording recording;
  recording.addBytes("P5", "1.0", 1);
  recording.addBytes("P5", "1.01", 2);
  recording.writeIndex();
  FrameCollector frames;
  RecordedCamera camera(recording.path(), true, 1);
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(test::eventually([&] { return camera.status().state == CameraState::lost; }));
  EXPECT_NE(camera.status().detail.find("none of the 2 frames"), std::string::npos) << camera.status().detail;
  camera.stop();
}

TEST(RecordedCamera, DoesNotStartAtASpeedThatIsNotAboveZero) {
  ScratchRecording recording;
  test::fillRecording(recording, 1);
  FrameCollector frames;
  for (const double speed :
       {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    RecordedCamera camera(recording.path(), true, speed);
    EXPECT_FALSE(camera.start(frames)) << speed;
  }
}

}  // namespace
}  // namespace hapticd::drivers

// SPDX-License-Identifier: Apache-2.0
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "child_process.h"
#include "drivers/camera/freenect/freenect_camera.h"
#include "drivers/camera/kinect_image.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "drivers/camera/recorded/recording_writer.h"
#include "fake_kinect_camera.h"
#include "frame_collector.h"
#include "tests/support/made_up_pixel.h"
#include "tests/support/recordings/recording.h"
#include "tests/support/recordings/scratch_recording.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::drivers {

// Which frames are complete; then the driver `freenect` with the real libfreenect and a camera on an emulated
// USB bus (fake_libusb.cpp). Each test runs in a process of its own, because the bus is chosen at its start.
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

/// Runs the current test in a child with the camera of `script`; returns true in that child.
bool isChildWithCamera(const std::string& script) {
  if (test::isChild()) return true;
  EXPECT_EQ(test::runInChild({"LD_LIBRARY_PATH=" HAPTICD_FAKE_LIBUSB_FOLDER, "FAKE_KINECT=" + script}), 0);
  return false;
}

/// The driver, started.
struct RunningCamera {
  explicit RunningCamera(const std::string& serial = "",
                         std::chrono::milliseconds stop_limit = std::chrono::milliseconds(3000))
      : camera(serial, stop_limit) {
    EXPECT_TRUE(camera.start(frames));
  }
  ~RunningCamera() { camera.stop(); }
  bool becomes(CameraState state) {
    return test::eventually([&] { return camera.status().state == state; });
  }
  bool says(const std::string& part) {
    return test::eventually([&] { return camera.status().detail.find(part) != std::string::npos; });
  }

  FrameCollector frames;
  FreenectCamera camera;
};

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
  if (!isChildWithCamera("steady")) return;
  RunningCamera running;
  auto& [frames, camera] = running;
  ASSERT_TRUE(frames.waitForFrames(5));
  EXPECT_EQ(camera.status().state, CameraState::streaming);
  EXPECT_EQ(camera.status().identity, std::string("freenect ") + FakeKinectCamera::kSerial);
  camera.stop();
  expectPixelsOfTheirFrame(frames);
  EXPECT_EQ(camera.status().damaged_frames, 0U);
}

TEST(FakeKinect, OpensTheCameraWithTheGivenSerialNumberAndNoOther) {
  if (!isChildWithCamera("steady")) return;
  EXPECT_TRUE(RunningCamera(FakeKinectCamera::kSerial).frames.waitForFrames(1));
  RunningCamera other("B");
  EXPECT_TRUE(other.says("serial number B"));
  EXPECT_EQ(other.camera.status().state, CameraState::absent);
  other.camera.stop();
  EXPECT_EQ(other.frames.count(), 0U);
}

TEST(FakeKinect, FindsACameraThatIsConnectedAfterTheStart) {
  if (!isChildWithCamera("late")) return;
  RunningCamera running;
  auto& [frames, camera] = running;
  EXPECT_TRUE(running.says("no Kinect found"));
  EXPECT_EQ(camera.status().state, CameraState::absent);
  ASSERT_TRUE(frames.waitForFrames(2));
  EXPECT_EQ(camera.status().state, CameraState::streaming);
  camera.stop();
  expectPixelsOfTheirFrame(frames);
}

TEST(FakeKinect, DeliversNoFrameThatLostPackets) {
  if (!isChildWithCamera("lossy")) return;
  RunningCamera running;
  auto& [frames, camera] = running;
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
  if (!isChildWithCamera("unplugged")) return;
  RunningCamera running;
  auto& [frames, camera] = running;
  ASSERT_TRUE(running.becomes(CameraState::lost));
  EXPECT_FALSE(camera.status().detail.empty());
  const std::size_t before = frames.count();
  ASSERT_TRUE(frames.waitForFrames(before + 3));
  EXPECT_EQ(camera.status().state, CameraState::streaming);
  camera.stop();
  expectPixelsOfTheirFrame(frames);
}

TEST(FakeKinect, IsLostWhenNoMoreFramesComeAndComesBackByItself) {
  if (!isChildWithCamera("mute")) return;
  RunningCamera running;
  auto& [frames, camera] = running;
  ASSERT_TRUE(running.becomes(CameraState::lost));
  EXPECT_NE(camera.status().detail.find("stopped sending frames"), std::string::npos);
  const std::size_t before = frames.count();
  ASSERT_TRUE(frames.waitForFrames(before + 3));
  camera.stop();
  expectPixelsOfTheirFrame(frames);
}

TEST(FakeKinect, StopReturnsAlthoughTheCameraNeverResponds) {
  if (!isChildWithCamera("dead")) return;
  RunningCamera running("", std::chrono::milliseconds(50));
  auto& [frames, camera] = running;
  ASSERT_TRUE(running.says("does not respond"));
  EXPECT_EQ(camera.status().state, CameraState::absent);
  camera.stop();
  EXPECT_EQ(frames.count(), 0U);
}

// The driver `freenect` with libfreenect's own player, which replaces the library at the start of a process,
// plays one recording per process and may end it; hence one process per test.

/// Returns the folder of libfreenect's player `fakenect`, next to libfreenect itself.
std::string fakenectFolder() {
  Dl_info info{};
  void* const function = ::dlsym(RTLD_DEFAULT, "freenect_init");
  if (function == nullptr || ::dladdr(function, &info) == 0) return {};
  const std::filesystem::path folder = std::filesystem::path(info.dli_fname).parent_path() / "fakenect";
  return std::filesystem::exists(folder / "libfreenect.so.0.5") ? folder.string() : std::string{};
}

/// Runs the current test in a child that plays `recording`.
int playInChild(const std::filesystem::path& recording) {
  const std::string player = fakenectFolder();
  EXPECT_FALSE(player.empty()) << "fakenect is part of the Debian package libfreenect0.5";
  return test::runInChild({"LD_LIBRARY_PATH=" + player, "FAKENECT_PATH=" + recording.string()});
}

/// Runs in the child: plays the recording to its end and compares every frame with the files.
void expectEveryFrameOfTheRecording() {
  const auto reader = RecordingReader::open(std::getenv("FAKENECT_PATH"));
  ASSERT_TRUE(reader) << reader.error().text();
  RunningCamera running;
  auto& [frames, camera] = running;
  ASSERT_TRUE(frames.waitForFrames(reader->frames().size()));
  ASSERT_TRUE(running.becomes(CameraState::lost));
  camera.stop();

  ASSERT_EQ(frames.count(), reader->frames().size());
  const auto expected = std::make_unique<rt::DepthFrame>();
  for (std::size_t index = 0; index < frames.count(); ++index) {
    ASSERT_TRUE(reader->read(index, *expected));
    const rt::DepthFrame& frame = frames.frame(index);
    EXPECT_TRUE(std::ranges::equal(frame.image(), expected->image())) << "frame " << index;
    EXPECT_EQ(frame.device_ticks, expected->device_ticks);
    EXPECT_EQ(frame.sequence, index + 1);
    EXPECT_GT(frame.arrival_ns, index == 0 ? 0 : frames.frame(index - 1).arrival_ns);
  }
  EXPECT_EQ(camera.status().frames, frames.count());
  EXPECT_EQ(camera.status().damaged_frames, 0U);
}

TEST(Fakenect, DeliversTheBytesOfARecordingThatWeMade) {
  if (test::isChild()) return expectEveryFrameOfTheRecording();
  const test::TemporaryFolder folder;
  auto writer = RecordingWriter::create(folder.path() / "a.depth", 1'700'000'000'000'000'000);
  ASSERT_TRUE(writer) << writer.error().text();
  const auto frame = std::make_unique<rt::DepthFrame>();
  for (std::uint32_t number = 0; number < 12; ++number) {
    for (std::size_t i = 0; i < kKinectPixels; ++i) frame->raw[i] = test::madeUpPixel(number, i);
    frame->arrival_ns = 1'000'000 * (std::int64_t{number} + 1);
    frame->device_ticks = 1000 + number;
    ASSERT_TRUE((*writer)->write(*frame));
  }
  EXPECT_EQ(playInChild(folder.path() / "a.depth"), 0);
}

TEST(Fakenect, DeliversTheBytesOfARecordedSceneAndIsLostAtItsEnd) {
  if (test::isChild()) return expectEveryFrameOfTheRecording();
  const test::Recording recording("01_raw11_room_gesture/room_gesture.tar.xz");
  EXPECT_EQ(playInChild(recording.path()), 0);
}

TEST(Fakenect, CountsFramesWithImpossibleValuesAndDoesNotDeliverThem) {
  if (!test::isChild()) {
    test::ScratchRecording recording;
    recording.add(0, "1.00", 1);
    const auto damaged = recording.add(1, "1.01", 2);
    recording.add(2, "1.02", 3);
    recording.writeIndex();
    std::string bytes = test::pgmBytes(1);
    bytes.back() = '\x08';  // the last pixel is 2048 or more
    test::writeFile(damaged, bytes);
    EXPECT_EQ(playInChild(recording.path()), 0);
    return;
  }
  RunningCamera running;
  auto& [frames, camera] = running;
  ASSERT_TRUE(running.becomes(CameraState::lost));
  camera.stop();
  ASSERT_EQ(frames.count(), 2U);
  EXPECT_EQ(frames.frame(0).device_ticks, 1U);
  EXPECT_EQ(frames.frame(1).device_ticks, 3U);
  EXPECT_EQ(frames.frame(1).sequence, 2U);
  EXPECT_EQ(camera.status().damaged_frames, 1U);
}

TEST(Fakenect, PublishesNothingAfterStopInTheMiddleOfARecording) {
  if (!test::isChild()) {
    test::ScratchRecording recording;
    test::fillRecording(recording, 40);
    EXPECT_EQ(playInChild(recording.path()), 0);
    return;
  }
  RunningCamera running;
  auto& [frames, camera] = running;
  ASSERT_TRUE(frames.waitForFrames(3));
  camera.stop();
  const std::size_t at_stop = frames.count();
  EXPECT_LT(at_stop, 40U);
  camera.stop();
  EXPECT_EQ(frames.count(), at_stop);
  EXPECT_EQ(camera.status().frames, at_stop);
}

}  // namespace
}  // namespace hapticd::drivers

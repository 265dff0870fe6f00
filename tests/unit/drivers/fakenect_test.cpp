// SPDX-License-Identifier: Apache-2.0
// The driver `freenect` with libfreenect's own player, which replaces the library at the start of a process,
// plays one recording per process and may end it; hence one process per test.

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include "child_process.h"
#include "drivers/camera/freenect/freenect_camera.h"
#include "drivers/camera/kinect_image.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "drivers/camera/recorded/recording_writer.h"
#include "frame_collector.h"
#include "tests/support/recordings/recording.h"
#include "tests/support/recordings/scratch_recording.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::drivers {
namespace {

using test::FrameCollector;

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
  FrameCollector frames;
  FreenectCamera camera("");
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(frames.waitForFrames(reader->frames().size()));
  ASSERT_TRUE(test::eventually([&] { return camera.status().state == CameraState::lost; }));
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
  FrameCollector frames;
  FreenectCamera camera("");
  ASSERT_TRUE(camera.start(frames));
  ASSERT_TRUE(test::eventually([&] { return camera.status().state == CameraState::lost; }));
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
  FrameCollector frames;
  FreenectCamera camera("");
  ASSERT_TRUE(camera.start(frames));
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

// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/recorded/recorded_camera.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "drivers/camera/recorded/recording_writer.h"
#include "frame_collector.h"
#include "tests/support/made_up_pixel.h"
#include "tests/support/program.h"
#include "tests/support/rerun.h"
#include "tests/support/temporary_folder.h"
#include "tools/lib/truth/any_camera.h"

// Recordings of any camera, from the writer through the reader and the driver.
namespace hapticd::drivers {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kRealtimeOffset_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t kFirst_ns = 12'000'000'007;

std::unique_ptr<rt::DepthFrame> madeUpFrame(std::uint32_t number) {
  auto frame = std::make_unique<rt::DepthFrame>();
  for (std::size_t pixel = 0; pixel < kKinectPixels; ++pixel) {
    frame->raw[pixel] = test::madeUpPixel(number % 100, pixel);
  }
  frame->sequence = number + 1;
  frame->arrival_ns = kFirst_ns + std::int64_t{number} * 33'000'001;
  frame->device_ticks = 4'294'967'290U + number;  // wraps around
  return frame;
}

void add(RecordingWriter& writer, const rt::DepthFrame& frame) {
  const auto written = writer.write(frame);
  ASSERT_TRUE(written) << written.error().text();
}

void expectFrame(const RecordingReader& reader, std::uint32_t number) {
  const auto expected = madeUpFrame(number), read = std::make_unique<rt::DepthFrame>();
  const auto readable = reader.read(number, *read);
  ASSERT_TRUE(readable) << readable.error().text();
  EXPECT_TRUE(std::ranges::equal(read->image(), expected->image())) << number;
  EXPECT_EQ(read->device_ticks, expected->device_ticks);
  EXPECT_EQ(reader.frames()[number].realtime_ns, expected->arrival_ns + kRealtimeOffset_ns);
  EXPECT_EQ(reader.frames()[number].host_ns, expected->arrival_ns - kFirst_ns);
}

TEST(RecordingWriter, ReadsBackToThePixelAndNanosecond) {
  const test::TemporaryFolder folder;
  auto writer = RecordingWriter::create(folder.path() / "a.depth", kRealtimeOffset_ns);
  ASSERT_TRUE(writer) << writer.error().text();
  for (std::uint32_t number = 0; number < 20; ++number) add(**writer, *madeUpFrame(number));
  EXPECT_EQ((*writer)->frames(), 20U);
  const auto reader = RecordingReader::open(folder.path() / "a.depth");
  ASSERT_TRUE(reader) << reader.error().text();
  ASSERT_EQ(reader->frames().size(), 20U);
  for (std::uint32_t number = 0; number < 20; ++number) expectFrame(*reader, number);
}

TEST(RecordingWriter, RefusesAFolderThatExistsOrCannotBeCreated) {
  const test::TemporaryFolder folder;
  folder.write("mine", "mine");
  EXPECT_FALSE(RecordingWriter::create(folder.path(), 0));
  EXPECT_FALSE(RecordingWriter::create(folder.path() / "mine", 0));
  EXPECT_FALSE(RecordingWriter::create(folder.path() / "nowhere" / "a.depth", 0));
}

/// Runs in a child: writes until it is killed.
void writeForever(const fs::path& folder) {
  auto writer = RecordingWriter::create(folder, kRealtimeOffset_ns);
  ASSERT_TRUE(writer);
  for (std::uint32_t number = 0;; ++number) add(**writer, *madeUpFrame(number));
}

TEST(RecordingWriter, IsReadableWheneverItIsKilled) {
  if (!test::rerunPart().empty()) return writeForever(test::rerunPart());
  for (const std::size_t lines : {1U, 5U, 9U}) {
    const test::TemporaryFolder folder;
    const fs::path recording = folder.path() / "a.depth";
    test::Program child({"/proc/self/exe", "--gtest_filter=RecordingWriter.IsReadableWheneverItIsKilled"},
                        {.environment = {std::string(test::kRerunVariable) + "=" + recording.string()}});
    const auto indexed = [&] {
      std::ifstream index(recording / "INDEX.txt");
      return static_cast<std::size_t>(std::count(std::istreambuf_iterator<char>(index), {}, '\n'));
    };
    ASSERT_TRUE(test::becomesTrue([&] { return indexed() >= lines; })) << child.output();
    child.signal(SIGKILL);
    child.wait();
    const auto reader = RecordingReader::open(recording);
    ASSERT_TRUE(reader) << reader.error().text();
    EXPECT_GE(reader->frames().size(), lines);
    for (std::uint32_t number = 0; number < reader->frames().size(); ++number) expectFrame(*reader, number);
  }
}

/// Runs in a child whose files may not become as large as an image.
void writeOnAFullDisk(const fs::path& folder) {
  std::signal(SIGXFSZ, SIG_IGN);
  auto writer = RecordingWriter::create(folder, kRealtimeOffset_ns);
  ASSERT_TRUE(writer);
  EXPECT_FALSE((*writer)->write(*madeUpFrame(0)));
  EXPECT_EQ((*writer)->frames(), 0U);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1) << "no half image";
  EXPECT_EQ(fs::file_size(folder / "INDEX.txt"), 0U);
}

TEST(RecordingWriter, ReportsAFullDiskAndLeavesNoPartialImage) {
  if (!test::rerunPart().empty()) return writeOnAFullDisk(test::rerunPart());
  const test::TemporaryFolder folder;
  const auto child = test::runToEnd(
      {"/proc/self/exe", "--gtest_filter=RecordingWriter.ReportsAFullDiskAndLeavesNoPartialImage"},
      {.environment = {std::string(test::kRerunVariable) + "=" + (folder.path() / "a.depth").string()},
       .largest_file_bytes = 300'000});
  EXPECT_EQ(child.ending, test::exitedWith(0)) << child.output;
}

namespace fs = std::filesystem;

constexpr std::int64_t kOffset_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t kLag_ns = 20'000'003;
constexpr DepthLimits kLimits{0.07, 1.5};

std::vector<rt::DepthModelParameters> cameras() {
  return {tools::stereoCamera(848, 480, 69, 0.018, 0.0001, 0.07, 1.5),
          tools::stereoCamera(424, 240, 69, 0.05, 0.001, 0.07, 1.5),
          tools::stereoCamera(1280, 720, 69, 0.05, 0.001, 0.07, 1.5), tools::timeOfFlightCamera(1280, 800)};
}

/// Frame `number` of a camera; even ones know their exposure.
std::unique_ptr<rt::DepthFrame> frameNumber(const rt::DepthModelParameters& camera, std::uint32_t number) {
  auto frame = tools::frameOf(camera, tools::ball(camera, {0, 0, -0.6}, 0.1 + 0.01 * number));
  frame->arrival_ns = 5'000'000'007 + std::int64_t{number} * 1'000'003;
  frame->exposure_ns = number % 2 == 0 ? frame->arrival_ns - kLag_ns : 0;
  frame->device_ticks = number * 1000;
  frame->sequence = number + 1;
  return frame;
}

void writeRecording(const fs::path& folder, const rt::DepthModelParameters& camera, std::uint32_t frames) {
  const auto writer = CameraRecordingWriter::create(
      folder, {.camera = camera, .near_m = {}, .far_m = {}, .serial = "0123"}, kOffset_ns);
  ASSERT_TRUE(writer) << writer.error().text();
  for (std::uint32_t number = 0; number < frames; ++number) {
    const auto written = (*writer)->write(*frameNumber(camera, number));
    ASSERT_TRUE(written) << written.error().text();
  }
  EXPECT_EQ((*writer)->frames(), frames);
}

class CameraRecording : public testing::Test {
 protected:
  fs::path path() const { return folder.path() / "recording"; }
  std::string openError() const {
    const auto reader = RecordingReader::open(path());
    return reader ? "" : reader.error().text();
  }
  const test::TemporaryFolder folder;
};

TEST_F(CameraRecording, ReadsBackEveryPixelAndTimeOfEachCamera) {
  for (rt::DepthModelParameters camera : cameras()) {
    camera.near_m = kLimits.near_m;
    camera.far_m = kLimits.far_m;
    const fs::path recording = folder.path() / std::to_string(camera.width_px);
    writeRecording(recording, camera, 3);
    const auto reader = RecordingReader::open(recording, kLimits);
    ASSERT_TRUE(reader) << reader.error().text();
    EXPECT_EQ(reader->camera(), camera);
    EXPECT_EQ(reader->serial(), "0123");
    ASSERT_EQ(reader->frames().size(), 3U);
    const auto read = std::make_unique<rt::DepthFrame>();
    for (std::uint32_t number = 0; number < 3; ++number) {
      const auto expected = frameNumber(camera, number);
      const auto done = reader->read(number, *read);
      ASSERT_TRUE(done) << done.error().text();
      EXPECT_EQ(read->camera, camera);
      EXPECT_TRUE(std::ranges::equal(read->image(), expected->image())) << number;
      EXPECT_EQ(reader->frames()[number].realtime_ns, expected->arrival_ns + kOffset_ns);
      EXPECT_EQ(read->arrival_ns, std::int64_t{number} * 1'000'003);
      EXPECT_EQ(read->exposure_ns, number % 2 == 0 ? read->arrival_ns - kLag_ns : 0);
      EXPECT_EQ(read->device_ticks, expected->device_ticks);
    }
    fs::remove_all(recording);
  }
}

TEST_F(CameraRecording, AcceptsWhatBothCameraAndConfigurationAccept) {
  ASSERT_TRUE(CameraRecordingWriter::create(
      path(), {.camera = cameras()[1], .near_m = 0.2, .far_m = 3, .serial = {}}, 0));
  EXPECT_NE(openError().find("names no depth frame"), std::string::npos) << openError();
  fs::remove_all(path());
  {
    const auto writer = CameraRecordingWriter::create(
        path(), {.camera = cameras()[1], .near_m = 0.2, .far_m = 3, .serial = {}}, 0);
    ASSERT_TRUE((*writer)->write(*frameNumber(cameras()[1], 0)));
  }
  const auto narrow = RecordingReader::open(path(), {0.5, 1});
  ASSERT_TRUE(narrow);
  EXPECT_EQ(narrow->camera()->near_m, 0.5);
  EXPECT_EQ(narrow->camera()->far_m, 1);
  const auto wide = RecordingReader::open(path(), {0.1, 4});
  ASSERT_TRUE(wide);
  EXPECT_EQ(wide->camera()->near_m, 0.2);
  EXPECT_EQ(wide->camera()->far_m, 3);
  const auto none = RecordingReader::open(path(), {3.5, 4});
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().text().find("measures no depth within 3.5 to 4 m"), std::string::npos);
}

TEST_F(CameraRecording, RefusesAFrameOfAnotherCamera) {
  const auto writer = CameraRecordingWriter::create(
      path(), {.camera = cameras()[1], .near_m = {}, .far_m = {}, .serial = {}}, 0);
  ASSERT_TRUE((*writer)->write(*frameNumber(cameras()[1], 0)));
  const auto written = (*writer)->write(*frameNumber(cameras()[0], 1));
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().text().find("is of another camera or mode"), std::string::npos);
  EXPECT_EQ((*writer)->frames(), 1U);
}

TEST_F(CameraRecording, RefusesAFrameThatIsNotLater) {
  const auto writer = CameraRecordingWriter::create(
      path(), {.camera = cameras()[1], .near_m = {}, .far_m = {}, .serial = {}}, 0);
  ASSERT_TRUE((*writer)->write(*frameNumber(cameras()[1], 1)));
  EXPECT_FALSE((*writer)->write(*frameNumber(cameras()[1], 1)));
  EXPECT_FALSE((*writer)->write(*frameNumber(cameras()[1], 0)));
  EXPECT_EQ(openError(), "");
}

TEST_F(CameraRecording, ReplacesNoFolder) {
  EXPECT_FALSE(CameraRecordingWriter::create(folder.path(), {}, 0));
  EXPECT_FALSE(CameraRecordingWriter::create(folder.path() / "none" / "a", {}, 0));
}

TEST_F(CameraRecording, RefusesAFolderWithTwoIndexes) {
  writeRecording(path(), cameras()[1], 1);
  folder.write("recording/INDEX.txt", "");
  EXPECT_NE(openError().find("holds both camera.yaml and INDEX.txt"), std::string::npos) << openError();
}

TEST_F(CameraRecording, PlaysFramesOfTheCameraWithTheirAge) {
  rt::DepthModelParameters camera = cameras()[1];
  camera.near_m = kLimits.near_m;
  camera.far_m = kLimits.far_m;
  writeRecording(path(), camera, 3);
  test::FrameCollector frames;
  RecordedCamera player(path(), false, 1, kLimits);
  const auto started = player.start(frames);
  ASSERT_TRUE(started) << started.error().text();
  ASSERT_TRUE(frames.waitForFrames(3));
  EXPECT_NE(player.status().identity.find("camera 0123"), std::string::npos) << player.status().identity;
  player.stop();
  for (std::uint32_t number = 0; number < 3; ++number) {
    const rt::DepthFrame& frame = frames.frame(number);
    EXPECT_EQ(frame.camera, camera);
    EXPECT_TRUE(std::ranges::equal(frame.image(), frameNumber(camera, number)->image()));
    EXPECT_EQ(frame.exposure_ns, number % 2 == 0 ? frame.arrival_ns - kLag_ns : 0);
  }
}

}  // namespace
}  // namespace hapticd::drivers

// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/recorded/depth_image.h"
#include "drivers/camera/recorded/recorded_camera.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "frame_collector.h"
#include "rt/base/clock.h"
#include "tests/support/recordings/depth_images.h"
#include "tests/support/recordings/recording.h"
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

/// A recording that is played.
class PlayedRecording : public testing::Test {
 protected:
  void play(bool loop = false, double speed = 1) {
    camera_.emplace(recording_.path(), loop, speed);
    const auto started = camera_->start(frames_);
    ASSERT_TRUE(started) << started.error().text();
  }
  void playToTheEnd(bool loop = false) {
    play(loop);
    ASSERT_TRUE(test::eventually([&] { return camera_->status().state == CameraState::lost; }));
    camera_->stop();
  }
  CameraStatus status() const { return camera_->status(); }

  ScratchRecording recording_;
  FrameCollector frames_;
  std::optional<RecordedCamera> camera_;
};

TEST_F(PlayedRecording, PlaysEveryFrameOnceAndIsThenLost) {
  test::fillRecording(recording_, 5);
  playToTheEnd();

  ASSERT_EQ(frames_.count(), 5U);
  for (std::uint32_t index = 0; index < 5; ++index) {
    EXPECT_EQ(frames_.frame(index).sequence, index + 1);
    EXPECT_EQ(frames_.frame(index).device_ticks, 1000 + index);
    EXPECT_TRUE(isMadeUpFrame(frames_.frame(index), index));
  }
  EXPECT_EQ(status().detail, "the recording has ended");
  EXPECT_EQ(status().frames, 5U);
  EXPECT_EQ(status().damaged_frames, 0U);
}

TEST_F(PlayedRecording, RestartsAtTheEndOfALoop) {
  test::fillRecording(recording_, 3);
  play(true, 10);
  ASSERT_TRUE(frames_.waitForFrames(8));
  EXPECT_EQ(status().state, CameraState::streaming);
  camera_->stop();
  EXPECT_EQ(frames_.frame(7).sequence, 8U);
  EXPECT_TRUE(isMadeUpFrame(frames_.frame(7), 7 % 3));
}

TEST_F(PlayedRecording, PlaysNoFrameBeforeItsTime) {
  recording_.add(0, "10.0", 1);
  recording_.add(1, "14.0", 2);
  recording_.writeIndex();
  const std::int64_t before_start_ns = rt::monotonicNow_ns();
  play(false, 100);
  ASSERT_TRUE(frames_.waitForFrames(2));
  camera_->stop();
  EXPECT_GE(frames_.frame(1).arrival_ns, before_start_ns + 40'000'000) << "4 s, 100 times faster";
}

TEST_F(PlayedRecording, SkipsADamagedFrameAndContinues) {
  recording_.add(0, "1.00", 1);
  const auto damaged = recording_.add(1, "1.01", 2);
  const auto truncated = recording_.add(2, "1.02", 3);
  recording_.add(3, "1.03", 4);
  recording_.writeIndex();
  std::string bytes = test::pgmBytes(1);
  bytes[test::kPgmHeader.size() + 1] = '\x7f';
  test::writeFile(damaged, bytes);
  test::writeFile(truncated, test::pgmBytes(2).substr(0, 5000));

  playToTheEnd();
  ASSERT_EQ(frames_.count(), 2U);
  EXPECT_TRUE(isMadeUpFrame(frames_.frame(0), 0));
  EXPECT_TRUE(isMadeUpFrame(frames_.frame(1), 3));
  EXPECT_EQ(frames_.frame(1).sequence, 2U);
  EXPECT_EQ(status().damaged_frames, 2U);
}

TEST_F(PlayedRecording, StopsWhileItWaitsForAFrameOfTomorrow) {
  recording_.add(0, "1.0", 1);
  recording_.add(1, "86401.0", 2);
  recording_.writeIndex();
  play();
  ASSERT_TRUE(frames_.waitForFrames(1));
  camera_->stop();
  EXPECT_EQ(frames_.count(), 1U);
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

TEST_F(PlayedRecording, TheFirstFrameMayBeDamagedToo) {
  const auto file = recording_.add(0, "1.0", 1);
  recording_.add(1, "1.01", 2);
  recording_.writeIndex();
  test::writeFile(file, "P5 640 480 65535\n");
  std::ofstream(recording_.path() / "INDEX.txt", std::ios::app) << "d-1.02";
  play();
  ASSERT_TRUE(frames_.waitForFrames(1));
  EXPECT_TRUE(isMadeUpFrame(frames_.frame(0), 1));
  ASSERT_TRUE(test::eventually([&] { return status().state == CameraState::lost; }));
  camera_->stop();
  EXPECT_EQ(frames_.count(), 1U);
  EXPECT_EQ(status().damaged_frames, 2U) << "a frame, and the line that was cut off";
}

TEST_F(PlayedRecording, NamesWhatWasDamagedWhileItPlays) {
  const auto file = recording_.add(0, "1.0", 1);
  recording_.add(1, "1.01", 2);
  recording_.add(2, "1000.0", 3);
  recording_.writeIndex();
  test::writeFile(file, "P5 640 480 65535\n");
  play();
  ASSERT_TRUE(frames_.waitForFrames(1));
  ASSERT_TRUE(test::eventually([&] { return status().state == CameraState::streaming; }));
  EXPECT_NE(status().detail.find("d-1.0-1.pgm"), std::string::npos) << status().detail;
  camera_->stop();
}

TEST_F(PlayedRecording, IsLostWhereNoFrameCanBeRead) {
  recording_.addBytes("P5", "1.0", 1);
  recording_.addBytes("P5", "1.01", 2);
  recording_.writeIndex();
  playToTheEnd(true);
  EXPECT_NE(status().detail.find("none of the 2 frames"), std::string::npos) << status().detail;
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

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// Returns the error of opening the folder, or "" if it opens.
std::string openError(const std::filesystem::path& folder) {
  const auto reader = RecordingReader::open(folder);
  return reader ? "" : reader.error().text();
}

/// Returns the error of reading one image, or "" if it is read.
std::string imageError(const std::filesystem::path& file) {
  const auto frame = std::make_unique<rt::DepthFrame>();
  const auto read = readKinectImage(file, *frame);
  return read ? "" : read.error().text();
}

TEST(RecordingReader, DeliversEveryPixelTimeAndTickOfTheFiles) {
  ScratchRecording recording;
  recording.add(0, "1513096835.219278", 4294967290U);
  recording.addIndexLine("a-1513096835.22-1.dump");
  recording.addIndexLine("r-1513096835.23-1.ppm");
  recording.add(1, "1513096835.246917", 3);
  recording.writeIndex();

  const auto reader = RecordingReader::open(recording.path());
  ASSERT_TRUE(reader) << reader.error().text();
  ASSERT_EQ(reader->frames().size(), 2U);
  EXPECT_EQ(reader->frames()[0].host_ns, 0);
  EXPECT_EQ(reader->frames()[1].host_ns, 27'639'000);  // .246917 - .219278 s

  const auto frame = std::make_unique<rt::DepthFrame>();
  for (std::uint32_t index = 0; index < 2; ++index) {
    ASSERT_TRUE(reader->read(index, *frame));
    EXPECT_EQ(frame->sequence, index + 1);
    EXPECT_EQ(frame->device_ticks, index == 0 ? 4294967290U : 3U);
    std::size_t different = 0;
    for (std::size_t pixel = 0; pixel < kKinectPixels; ++pixel) {
      different += frame->raw[pixel] != test::madeUpPixel(index, pixel);
    }
    EXPECT_EQ(different, 0U) << "frame " << index;
  }
}

TEST(RecordingReader, KeepsTimeConstantWhereTheHostClockWasSetBack) {
  ScratchRecording recording;
  recording.add(0, "100.5", 1);
  recording.add(1, "90", 2);
  recording.add(2, "100.75", 3);
  recording.writeIndex();
  const auto reader = RecordingReader::open(recording.path());
  ASSERT_TRUE(reader);
  EXPECT_EQ(reader->frames()[1].host_ns, 0);
  EXPECT_EQ(reader->frames()[2].host_ns, 250'000'000);
}

/// A clock that is set while a recording is made, as where the network is found late.
TEST(RecordingReader, AGapOfMoreThanADayCountsAsAFramePeriod) {
  ScratchRecording recording;
  recording.add(0, "12.0", 1);          // 1970
  recording.add(1, "1790000000.0", 2);  // 2026
  recording.add(2, "1790000000.25", 3);
  recording.add(3, "14.0", 4);     // and back
  recording.add(4, "86414.0", 5);  // a day later
  recording.writeIndex();
  const auto reader = RecordingReader::open(recording.path());
  ASSERT_TRUE(reader) << reader.error().text();
  std::vector<std::int64_t> times_ms;
  for (const RecordedFrame& frame : reader->frames()) times_ms.push_back(frame.host_ns / 1'000'000);
  EXPECT_EQ(times_ms, (std::vector<std::int64_t>{0, 33, 283, 316, 86'400'316}));
}

TEST(RecordingReader, TakesTheNamesThatLibfreenectsPlayerTakes) {
  struct Name {
    const char* name;
    std::int64_t time_ms;
    std::uint32_t ticks;
  };
  for (const auto& [name, time_ms, ticks] :
       {Name{"d-1.5-7.pgm", 1500, 7}, Name{"d-1.5-7.dump", 1500, 7}, Name{"d-1.5-7", 1500, 7},
        Name{"d-1.5-7-614400", 1500, 7}, Name{"d-1.5-4294967295-614400.pgm", 1500, 4294967295U},
        Name{"d-2.-8.png", 2000, 8}, Name{"d-.25-8 .pgm", 250, 8}, Name{"d-1e3-8.pgm", 1'000'000, 8},
        Name{"d-2.5e-1-8.pgm", 250, 8}}) {
    ScratchRecording recording;
    test::writeFile(recording.path() / name, test::pgmBytes(0));
    recording.addIndexLine(name);
    recording.writeIndex();
    const auto reader = RecordingReader::open(recording.path());
    ASSERT_TRUE(reader) << name << ": " << reader.error().text();
    EXPECT_EQ(reader->frames()[0].realtime_ns, time_ms * 1'000'000) << name;
    EXPECT_EQ(reader->frames()[0].device_ticks, ticks) << name;
    const auto frame = std::make_unique<rt::DepthFrame>();
    EXPECT_TRUE(reader->read(0, *frame)) << name;
  }
}

TEST(RecordingReader, LeavesOutALastLineThatWasCutOffAndNamesIt) {
  const std::string whole = "d-1.033000-20";
  for (std::size_t length = 1; length <= whole.size(); ++length) {
    ScratchRecording recording;
    recording.add(0, "1.0", 1);
    recording.writeIndex();
    std::ofstream(recording.path() / "INDEX.txt", std::ios::app) << whole.substr(0, length);
    const auto reader = RecordingReader::open(recording.path());
    ASSERT_TRUE(reader) << reader.error().text();
    EXPECT_EQ(reader->frames().size(), 1U);
    EXPECT_TRUE(contains(reader->cutOff(), "INDEX.txt:2")) << length << ": " << reader->cutOff();
    std::ofstream(recording.path() / "INDEX.txt", std::ios::app) << "\n";
    EXPECT_TRUE(contains(openError(recording.path()), "INDEX.txt:2")) << "a whole line is an error";
  }
}

TEST(RecordingReader, RefusesWhatIsNoRecordingAndSaysWhatIsMissing) {
  const test::TemporaryFolder folder;
  EXPECT_TRUE(contains(openError(folder.path() / "nowhere"), "nowhere"));
  test::writeFile(folder.path() / "archive.tar", "x");
  EXPECT_TRUE(contains(openError(folder.path() / "archive.tar"), "not a folder"));
  EXPECT_TRUE(contains(openError(folder.path()), "INDEX.txt"));
  for (const char* index : {"", "\n", "a-1.5-7.dump\n"}) {
    test::writeFile(folder.path() / "INDEX.txt", index);
    EXPECT_TRUE(contains(openError(folder.path()), "no depth frame")) << index;
  }
}

TEST(RecordingReader, NamesTheLineOfAMissingFile) {
  ScratchRecording recording;
  recording.add(0, "1.0", 1);
  recording.addIndexLine("d-1.033000-2.pgm");
  recording.writeIndex();
  const std::string error = openError(recording.path());
  EXPECT_TRUE(contains(error, "INDEX.txt:2")) << error;
  EXPECT_TRUE(contains(error, "d-1.033000-2.pgm")) << error;
}

TEST(RecordingReader, ExplainsHowToConvertCrlfLineEndings) {
  ScratchRecording recording;
  recording.add(0, "1.0", 1);
  recording.writeIndex("\r\n");
  const std::string error = openError(recording.path());
  EXPECT_TRUE(contains(error, "INDEX.txt:1")) << error;
  EXPECT_TRUE(contains(error, "CRLF")) << error;
  EXPECT_TRUE(contains(error, "sed -i")) << error;
}

TEST(RecordingReader, RefusesNamesThatAreNotThoseOfARecording) {
  for (const char* line : {"frame.pgm", "d-1.0.pgm", "d--1.pgm", "d-1.0-x.pgm", "d-1.0-4294967296.pgm",
                           "d-1.0-", "d-x-1.pgm", "d-1.0-1/../../../../etc/passwd",
                           "d-../../etc/passwd-1.pgm", "d-.pgm", "d-nan-1", "d-1e99-1", "\xff\x01"}) {
    ScratchRecording recording;
    recording.addIndexLine(line);
    recording.writeIndex();
    const std::string error = openError(recording.path());
    EXPECT_TRUE(contains(error, "not the name of a recorded file")) << line << ": " << error;
  }
}

/// The bytes of an image of libfreenect with some of its pixels changed.
std::string imageWith(auto change) {
  std::string bytes = test::pgmBytes(0);
  change(bytes.data() + test::kPgmHeader.size());
  return bytes;
}

TEST(KinectImage, IsRefusedWithWhatIsWrongAndWhatIsExpected) {
  const test::TemporaryFolder folder;
  EXPECT_FALSE(imageError(folder.path() / "missing.pgm").empty());
  EXPECT_FALSE(imageError(folder.path()).empty());
  const std::string other_header = R"("P5 640 480 65535")";
  const std::pair<std::string, std::string> cases[] = {
      {"", "has 0 bytes, expected 614417"},
      {"P5 640", "has 6 bytes, expected 614417"},
      {test::pgmBytes(0).substr(0, 1000), "image.pgm: has 1000 bytes, expected 614417"},
      {test::pgmBytes(0) + "x", "more than the expected 614417 bytes"},
      {test::pgmBytes(0, "P5\n640 480\n65535\n"), "one single line"},
      {test::pgmBytes(0, "P5\n640 480\n2047\n"), "one single line"},
      {test::pgmBytes(0, "P5 640 480 2047\n"), other_header},
      {test::pgmBytes(0, "P5 320 240 65535\n"), other_header},
      {test::pgmBytes(0, "P2 640 480 65535\n"), "not a PGM image"},
      {test::pgmBytes(0, "\x89PNG"), "not a PGM image"},
      {test::pgmBytes(0, "P5 640 480 65535\r\n"), "CRLF"},
      {imageWith([](char* pixels) { pixels[1] = pixels[3] = pixels[5] = '\x08'; }), "3 of 307200 pixels"},
      {imageWith([](char* pixels) {
         for (std::size_t at = 0; at < 2 * kKinectPixels; at += 2) std::swap(pixels[at], pixels[at + 1]);
       }),
       "big-endian"}};
  for (const auto& [bytes, expected] : cases) {
    test::writeFile(folder.path() / "image.pgm", bytes);
    const std::string error = imageError(folder.path() / "image.pgm");
    EXPECT_TRUE(contains(error, expected)) << expected << " is not in: " << error;
  }
}

TEST(RecordingReader, EscapesTextOfAnIndexAndAnImageInMessages) {
  for (const std::string& line : {std::string("\x1b[2Jd-1.pgm\xc2\x9b"), std::string(3000, 'x'),
                                  "d-1." + std::string(3000, '0') + "-1.pgm"}) {
    ScratchRecording recording;
    recording.addIndexLine(line);
    recording.writeIndex();
    const std::string error = openError(recording.path());
    EXPECT_FALSE(contains(error, "\x1b") || contains(error, "\xc2\x9b")) << error;
    EXPECT_LT(error.size(), 500U) << error;
  }
  const test::TemporaryFolder folder;
  test::writeFile(folder.path() / "header.pgm", test::pgmBytes(0, "P5 \x1b[2J 640 480 65535\n"));
  const std::string error = imageError(folder.path() / "header.pgm");
  EXPECT_TRUE(contains(error, R"(\x1b[2J)")) << error;
  EXPECT_FALSE(contains(error, "\x1b")) << error;
}

TEST(RecordingReader, ReadsEveryFrameAsItIsInItsFile) {
  const test::Recording recording("02_raw11_desk_near/desk_near.tar.xz");
  const auto reader = RecordingReader::open(recording.path());
  ASSERT_TRUE(reader) << reader.error().text();
  std::ifstream index(recording.path() / "INDEX.txt");
  const auto frame = std::make_unique<rt::DepthFrame>();
  std::size_t number = 0;
  for (std::string name; std::getline(index, name);) {
    if (!name.starts_with("d-")) continue;
    ASSERT_TRUE(reader->read(number, *frame)) << name;
    EXPECT_TRUE(std::ranges::equal(frame->image(), test::rawPixelsOf(recording.path() / name))) << name;
    EXPECT_EQ(reader->frames()[number].device_ticks, std::stoul(name.substr(name.rfind('-') + 1))) << name;
    ++number;
  }
  EXPECT_EQ(reader->frames().size(), number);
  EXPECT_GE(number, 30U);
  if (!recording.isReal()) return;

  // values known of the real recording, frame 0: lowest raw value 405, median of the valid ones 702, 35.2 %
  // invalid
  ASSERT_EQ(number, 60U);
  ASSERT_TRUE(reader->read(0, *frame));
  std::vector<std::uint16_t> valid;
  std::ranges::copy_if(frame->image(), std::back_inserter(valid), [](auto value) { return value < 2047; });
  std::ranges::sort(valid);
  EXPECT_EQ(valid.front(), 405);
  EXPECT_EQ(valid[valid.size() / 2], 702);
  EXPECT_NEAR(1 - static_cast<double>(valid.size()) / 307200, 0.352, 0.0005);  // half of its last digit
  EXPECT_EQ(reader->frames()[1].host_ns, 27'639'000);
  EXPECT_EQ(reader->frames()[1].device_ticks - reader->frames()[0].device_ticks, 2002155U);
}

}  // namespace
}  // namespace hapticd::drivers

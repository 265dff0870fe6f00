// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/export/trace_export.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "daemon/trace/format/depth_codec.h"
#include "daemon/trace/writer/trace_writer.h"
#include "drivers/camera/kinect_image.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "tests/support/file_content.h"
#include "tests/support/made_up_pixel.h"
#include "tests/support/temporary_folder.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::trace {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kOffset_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t kPeriod_ns = 33'000'001;

class RecordingExport : public testing::Test {
 protected:
  static std::unique_ptr<rt::DepthFrame> frame(std::uint32_t number) {
    auto frame = std::make_unique<rt::DepthFrame>();
    for (std::size_t i = 0; i < drivers::kKinectPixels; ++i) frame->raw[i] = test::madeUpPixel(number, i);
    frame->sequence = number;
    frame->arrival_ns = number * kPeriod_ns;
    frame->device_ticks = 1000 + number;
    return frame;
  }
  /// A trace with so many frames, and ticks at the times of the frames.
  fs::path writeTrace(std::uint32_t frames) const {
    const auto writer =
        TraceWriter::create(path("a.mcap"), {.realtime_offset_ns = kOffset_ns, .depth = frames > 0});
    EXPECT_TRUE(writer) << writer.error().text();
    DepthEncoder encoder;
    for (std::uint32_t number = 1; number <= std::max(frames, 2U); ++number) {
      rt::Tick tick;
      tick.number = number;
      tick.planned_ns = number * kPeriod_ns;
      EXPECT_TRUE((*writer)->write(tick));
      if (number > frames) continue;
      const auto raw = frame(number);
      DepthRecord record;
      encoder.encode(headerOf({}, *raw), std::as_bytes(raw->image()), record);
      EXPECT_TRUE((*writer)->write(record));
    }
    EXPECT_TRUE((*writer)->close());
    return path("a.mcap");
  }
  fs::path path(const char* name) const { return folder_.path() / name; }
  static std::string errorOf(const base::Result<std::uint64_t>& result) {
    return result ? "" : result.error().text();
  }

  const test::TemporaryFolder folder_;
};

TEST_F(RecordingExport, GivesEveryFrameAsItWasRecorded) {
  const auto frames = exportRecording(writeTrace(12), path("out"), {}, {});
  ASSERT_TRUE(frames) << frames.error().text();
  EXPECT_EQ(*frames, 12U);
  const auto reader = drivers::RecordingReader::open(path("out"));
  ASSERT_TRUE(reader) << reader.error().text();
  ASSERT_EQ(reader->frames().size(), 12U);
  const auto read = std::make_unique<rt::DepthFrame>();
  for (std::uint32_t number = 1; number <= 12; ++number) {
    const auto expected = frame(number);
    ASSERT_TRUE(reader->read(number - 1, *read));
    EXPECT_EQ(std::memcmp(read->raw, expected->raw, read->image().size_bytes()), 0) << number;
    EXPECT_EQ(read->device_ticks, expected->device_ticks);
    EXPECT_EQ(reader->frames()[number - 1].realtime_ns, expected->arrival_ns + kOffset_ns);
  }
}

TEST_F(RecordingExport, GivesAnotherCamerasFramesWithTheCamera) {
  const rt::DepthModelParameters camera = tools::stereoCamera(424, 240, 69, 0.05, 0.001, 0.4, 4);
  const auto raw = tools::frameOf(camera, tools::ball(camera, {0, 0, -0.6}, 0.1));
  raw->arrival_ns = kPeriod_ns;
  {
    const auto writer =
        TraceWriter::create(path("a.mcap"), {.realtime_offset_ns = kOffset_ns, .depth = true});
    ASSERT_TRUE(writer) << writer.error().text();
    rt::Tick tick;
    tick.number = 1;
    tick.planned_ns = kPeriod_ns;
    ASSERT_TRUE((*writer)->write(tick));
    DepthRecord record;
    DepthEncoder().encode(headerOf({}, *raw), std::as_bytes(raw->image()), record);
    ASSERT_TRUE((*writer)->write(record));
    ASSERT_TRUE((*writer)->close());
  }
  const auto frames = exportRecording(path("a.mcap"), path("out"), {}, {});
  ASSERT_TRUE(frames) << frames.error().text();
  const auto reader = drivers::RecordingReader::open(path("out"));
  ASSERT_TRUE(reader) << reader.error().text();
  ASSERT_TRUE(reader->camera());
  EXPECT_EQ(reader->camera()->fx_px, camera.fx_px);
  EXPECT_EQ(reader->camera()->unit_m, camera.unit_m);
  const auto read = std::make_unique<rt::DepthFrame>();
  ASSERT_TRUE(reader->read(0, *read));
  EXPECT_TRUE(std::ranges::equal(read->image(), raw->image()));
  EXPECT_EQ(reader->frames()[0].realtime_ns, kPeriod_ns + kOffset_ns);
}

TEST_F(RecordingExport, GivesTheTimeThatIsWanted) {
  constexpr double kPeriod_s = 1e-9 * static_cast<double>(kPeriod_ns);
  const TraceSelection selection{.from_s = 1.5 * kPeriod_s, .to_s = 3.5 * kPeriod_s};
  const auto frames = exportRecording(writeTrace(6), path("out"), selection, {});
  ASSERT_TRUE(frames) << frames.error().text();
  const auto reader = drivers::RecordingReader::open(path("out"));
  ASSERT_TRUE(reader) << reader.error().text();
  ASSERT_EQ(reader->frames().size(), 2U);
  EXPECT_EQ(reader->frames()[0].device_ticks, 1003U) << "the first tick is that of the first frame";
}

TEST_F(RecordingExport, SaysWhatIsMissingAndLeavesNothingBehind) {
  const fs::path trace = writeTrace(0);
  EXPECT_NE(errorOf(exportRecording(trace, path("out"), {}, {})).find("holds no depth"), std::string::npos);
  EXPECT_FALSE(fs::exists(path("out")));
}

TEST_F(RecordingExport, ReplacesNothing) {
  const fs::path trace = writeTrace(1);
  for (const char* taken : {"out", "out.part"}) {
    fs::create_directory(path(taken));
    const std::string error = errorOf(exportRecording(trace, path("out"), {}, {}));
    EXPECT_NE(error.find("exists"), std::string::npos) << error;
    EXPECT_TRUE(fs::exists(path(taken)));
    fs::remove(path(taken));
  }
}

TEST_F(RecordingExport, LeavesNothingOfADamagedTrace) {
  const fs::path trace = writeTrace(8);
  std::string bytes = test::contentOf(trace);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  const fs::path damaged = folder_.write("damaged.mcap", bytes);
  EXPECT_FALSE(exportRecording(damaged, path("out"), {}, {}));
  EXPECT_FALSE(fs::exists(path("out")));
  EXPECT_FALSE(fs::exists(path("out.part")));
}

}  // namespace
}  // namespace hapticd::trace

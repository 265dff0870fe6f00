// SPDX-License-Identifier: Apache-2.0
// The stated upper bound of what a trace writes, against files and against the documentation.
#include "daemon/trace/writer/trace_writer.h"
#include "drivers/camera/v4l2/camera_report.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <vector>

#include "daemon/trace/format/messages.h"
#include "rt/base/clock.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::trace {
namespace {

constexpr int kTicksPerSecond = 1000;
constexpr std::uint64_t kSecondsPerHour = 3600;

/// Writes a trace of some seconds without compression, with everything that comes by itself, as often as it
/// may come. Returns the size of its file.
std::uint64_t bytesOfATrace(const std::filesystem::path& file, int seconds, bool depth) {
  TraceOptions options;
  options.compress = false;
  options.scene = true;
  options.depth = depth;
  auto writer = TraceWriter::create(file, options);
  EXPECT_TRUE(writer) << writer.error().text();
  const auto accept = [](const base::Result<void>& written) {
    ASSERT_TRUE(written) << written.error().text();
  };
  DepthRecord frame;
  frame.header.width_px = 640;
  frame.header.height_px = 480;
  frame.header.stride_bytes = 2 * 640;
  frame.image.bytes.assign(std::size_t{2} * 640 * 480, 'x');
  for (int i = 0; i < seconds * kTicksPerSecond; ++i) {
    rt::Tick tick;
    tick.number = static_cast<std::uint64_t>(i) + 1;
    tick.planned_ns = std::int64_t{i} * 1'000'000;
    tick.mode = rt::Mode::engaged;
    tick.law = rt::ForceLaw::surface;
    tick.contact = rt::ContactState::contact;
    tick.command_force_n_in_world = {0.1, 2, 0.3};
    accept((*writer)->write(tick));
    const bool is_frame = (i + 1) * 30 / kTicksPerSecond != i * 30 / kTicksPerSecond;
    for (int model = 0; is_frame && model < 2; ++model) {
      ModelRecord record;
      record.time_ns = tick.planned_ns;
      record.radius_m = 0.1;
      accept((*writer)->write(record));
    }
    if (is_frame && depth) {
      frame.header.arrival_ns = tick.planned_ns;
      accept((*writer)->write(frame));
    }
    const int snapshot_period = depth ? kTicksPerSecond : 10 * kTicksPerSecond;
    if (i % snapshot_period == snapshot_period / 2)
      accept((*writer)->write(SnapshotRecord{tick.planned_ns, {}}));
  }
  EXPECT_TRUE((*writer)->close());
  return std::filesystem::file_size(file);
}

/// The bytes that a file grows by in a second, without what it has at its begin and its end.
double growthPerSecond(int seconds, bool depth) {
  const test::TemporaryFolder folder;
  const std::uint64_t shorter = bytesOfATrace(folder.path() / "shorter.mcap", seconds, depth);
  const std::uint64_t longer = bytesOfATrace(folder.path() / "longer.mcap", 2 * seconds, depth);
  return static_cast<double>(longer - shorter) / seconds;
}

double perSecond(std::uint64_t bytes_per_hour) {
  return static_cast<double>(bytes_per_hour) / static_cast<double>(kSecondsPerHour);
}

TEST(TraceVolume, BoundsWhatATraceWithoutDepthWrites) {
  const double bound = perSecond(mostPerHour({}, false).total());
  const double growth = growthPerSecond(10, false);
  EXPECT_LE(growth, bound);
  EXPECT_GT(growth, 0.95 * bound) << "a bound that is far off says nothing";
}

TEST(TraceVolume, BoundsWhatATraceWithDepthWrites) {
  const double bound = perSecond(mostPerHour({}, true).total());
  const double growth = growthPerSecond(2, true);
  EXPECT_LE(growth, bound);
  EXPECT_GT(growth, 0.95 * bound);
}

TEST(TraceVolume, BoundsAWholeFileWithItsBeginAndItsEnd) {
  const test::TemporaryFolder folder;
  const std::uint64_t bytes = bytesOfATrace(folder.path() / "trace.mcap", 60, false);
  config::Settings settings;
  settings.trace.max_file_mb = static_cast<double>(bytes) / 1e6;  // a file a minute
  EXPECT_LE(bytes * 60, mostPerHour(settings, false).total());
}

TEST(TraceVolume, FollowsTheConfiguration) {
  config::Settings settings;
  const TraceVolume usual = mostPerHour(settings, true);
  settings.loop.rate_hz = 4000;
  // models and snapshots of the core, 7.5 % of it, do not follow the rate of the loop
  EXPECT_NEAR(static_cast<double>(mostPerHour(settings, true).ticks), 4.0 * static_cast<double>(usual.ticks),
              0.25 * static_cast<double>(usual.ticks));
  settings = {};
  settings.trace.scene = config::TraceScene::off;
  EXPECT_EQ(mostPerHour(settings, true).scene, 0U);
  settings.trace.scene = config::TraceScene::cloud;
  EXPECT_GT(mostPerHour(settings, true).clouds, usual.depth) << "12 bytes of a point for 2 of a pixel";
  EXPECT_EQ(mostPerHour(settings, false).clouds, 0U);
  settings = {};
  settings.camera.driver = "v4l2";
  settings.camera.of<drivers::V4l2Settings>().rate_hz = 60;
  const TraceVolume at_60_hz = mostPerHour(settings, true);
  settings.camera.of<drivers::V4l2Settings>().rate_hz = 30;
  EXPECT_NEAR(static_cast<double>(at_60_hz.depth),
              2.0 * static_cast<double>(mostPerHour(settings, true).depth), 2);
}

TEST(TraceVolume, IsAsDocumented) {
  std::ostringstream text;
  text << std::ifstream(TRACES_DOCUMENT).rdbuf();
  config::Settings settings;
  settings.trace.scene = config::TraceScene::cloud;
  const TraceVolume most = mostPerHour(settings, true);
  const auto row = [](const char* what, std::uint64_t bytes) {
    return fmt::format("| {} | {:.2f} GB |", what, static_cast<double>(bytes) / 1e9);
  };
  std::string tick;
  encode(rt::Tick{}, 0, tick);
  for (const std::string& line :
       {fmt::format("A tick is {} bytes", tick.size()), row("ticks, at 1 kHz", mostPerHour({}, false).ticks),
        row("3D picture", most.scene), row("depth of a Kinect, at 30 Hz", most.depth),
        row("points within reach, with depth", most.clouds)}) {
    EXPECT_NE(text.str().find(line), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace hapticd::trace

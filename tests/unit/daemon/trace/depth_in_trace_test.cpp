// SPDX-License-Identifier: Apache-2.0
// Raw depth in a channel of a trace.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "daemon/trace/format/depth_codec.h"
#include "daemon/trace/format/trace_format.h"
#include "daemon/trace/reader/trace_reader.h"
#include "daemon/trace/recovery/trace_recovery.h"
#include "daemon/trace/writer/trace_writer.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::trace {
namespace {

namespace fs = std::filesystem;
using test::bitsOf;

test::MadeUpRecords recordsWithDepth(std::size_t frames) {
  std::mt19937_64 random(11);
  test::MadeUpRecords records = test::madeUpRecords(2, 20);
  for (std::size_t i = 0; i < frames; ++i) records.depth.push_back(test::madeUpDepth(random));
  std::ranges::stable_sort(records.depth, {}, [](const DepthRecord& record) { return timeOf(record); });
  return records;
}

TEST(DepthInTrace, EveryFrameReadsBackBitByBit) {
  const test::TemporaryFolder folder(test::memoryFolder());
  const fs::path file = folder.path() / "a.mcap";
  const test::MadeUpRecords written = recordsWithDepth(30);
  test::writeTrace(file, written, 20);
  std::vector<DepthRecord> read;
  const auto info =
      readTrace(file, {.depth = [&](const DepthRecord& record) { return read.push_back(record), true; }});
  ASSERT_TRUE(info) << info.error().text();
  EXPECT_EQ(info->depth_frames, 30U);
  EXPECT_EQ(readTrace(file)->depth_frames, 30U);
  ASSERT_EQ(read.size(), 30U);
  for (std::size_t i = 0; i < read.size(); ++i) EXPECT_EQ(bitsOf(read[i]), bitsOf(written.depth[i])) << i;
}

TEST(DepthInTrace, OtherHeaderVersionsAreRefusedByNameWhereImagesAreRequested) {
  const test::TemporaryFolder folder(test::memoryFolder());
  const fs::path file = folder.path() / "a.mcap";
  test::MadeUpRecords records = recordsWithDepth(1);
  records.depth[0].header.version = 7;
  test::writeTrace(file, records, 20, {.metadata = {{"hapticd_version", "9.1"}}});
  const auto read = readTrace(file, {.depth = [](const DepthRecord&) { return true; }});
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().text().find("a depth frame of header version 7; this hapticd reads 2"),
            std::string::npos)
      << read.error().text();
  EXPECT_NE(read.error().text().find("\"9.1\""), std::string::npos) << read.error().text();
  EXPECT_TRUE(readTrace(file)) << "the ticks can be read";
}

TEST(DepthInTrace, IsDetectedFromTheBeginningOfAFileEvenWhileItIsWritten) {
  const test::TemporaryFolder folder(test::memoryFolder());
  const auto with = TraceWriter::create(folder.path() / "with.mcap", {.depth = true});
  const auto without = TraceWriter::create(folder.path() / "without.mcap", {});
  ASSERT_TRUE(with && without);
  EXPECT_TRUE(readTraceHead(folder.path() / "with.mcap.part").depth);
  EXPECT_FALSE(readTraceHead(folder.path() / "without.mcap.part").depth);
  ASSERT_TRUE((*with)->close());
  EXPECT_TRUE(readTraceHead(folder.path() / "with.mcap").depth);
  EXPECT_FALSE(readTraceHead(folder.write("none.mcap", "none")).depth);
  std::mt19937_64 random(1);
  EXPECT_FALSE((*without)->write(test::madeUpDepth(random)));
}

TEST(DepthInTrace, LargeFramesCloseTheirChunkEarlyAndSurviveACrash) {
  const test::TemporaryFolder folder(test::memoryFolder());
  std::mt19937_64 random(2);
  std::string image(614'400, '\0');
  for (char& byte : image) byte = static_cast<char>(random());
  rt::DepthFrameHeader header;
  header.width_px = 640;
  header.height_px = 480;
  header.stride_bytes = 1280;
  DepthRecord record;
  DepthEncoder().encode(header, std::as_bytes(std::span(image)), record);
  {
    const auto writer = TraceWriter::create(folder.path() / "a.mcap", {.depth = true});
    ASSERT_TRUE(writer);
    for (int frame = 0; frame < 30; ++frame) {
      record.header.arrival_ns = frame * std::int64_t{1'000'000};  // all within the duration of one chunk
      ASSERT_TRUE((*writer)->write(record));
    }
  }
  const auto recovered = finishTrace(folder.path() / "a.mcap.part");
  ASSERT_TRUE(recovered) << recovered.error().text();
  EXPECT_GE(recovered->chunks, 3U);
  std::string back;
  DepthDecoder decoder;
  const auto info = readTrace(recovered->file, {.depth = [&](const DepthRecord& read) {
                                return decoder.decode(read, back).empty() && back == image;
                              }});
  ASSERT_TRUE(info) << info.error().text();
  EXPECT_TRUE(info->complete) << "every frame is as it was";
  EXPECT_GE(info->depth_frames, 20U);
}

}  // namespace
}  // namespace hapticd::trace

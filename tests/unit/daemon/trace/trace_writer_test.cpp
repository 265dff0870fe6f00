// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/writer/trace_writer.h"

#include <gtest/gtest.h>

#include <csignal>
#include <iterator>
#include <limits>
#include <random>
#include <string>

#include "daemon/trace/mcap/trace_file.h"
#include "daemon/trace/reader/trace_reader.h"
#include "daemon/trace/recovery/trace_recovery.h"
#include "tests/support/file_content.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/program.h"
#include "tests/support/rerun.h"
#include "tests/support/strict_mcap.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::trace {
namespace {

namespace fs = std::filesystem;
using test::contentOf;
using test::MadeUpRecords;
using test::TemporaryFolder;

std::string errorOf(const fs::path& file) {
  const auto info = readTrace(file);
  return info ? "" : info.error().text();
}

/// Returns a tick of a loop at 1 kHz that begins at zero.
rt::Tick tickOf(std::uint64_t number) {
  rt::Tick tick;
  tick.number = number;
  tick.planned_ns = static_cast<std::int64_t>(number) * 1'000'000;
  return tick;
}

class TraceWriterCompression : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Both, TraceWriterCompression, testing::Bool());

TEST_P(TraceWriterCompression, EveryRecordReadsBackBitByBit) {
  const TemporaryFolder folder(test::memoryFolder());
  const MadeUpRecords written = test::madeUpRecords(3, 50);
  test::writeTrace(folder.path() / "a.mcap", written, 50, {.compress = GetParam()});
  EXPECT_EQ(test::differenceOf(test::recordsIn(folder.path() / "a.mcap"), written), "");
}

TEST_P(TraceWriterCompression, AFlippedBitAnywhereInTheFileIsFound) {
  const TemporaryFolder folder(test::memoryFolder());
  const fs::path file = folder.path() / "a.mcap";
  test::writeTrace(file, test::madeUpRecords(2, 2), 2, {.compress = GetParam()});
  const std::string whole = contentOf(file);
  ASSERT_EQ(errorOf(file), "");
  constexpr std::size_t kStep = 31;  // no divisor of the length of any record
  for (std::size_t at = 0; at < whole.size(); at += kStep) {
    std::string flipped = whole;
    flipped[at] = static_cast<char>(flipped[at] ^ (1 << at % 8));
    folder.write("a.mcap", flipped);
    EXPECT_NE(errorOf(file), "") << "byte " << at;
  }
}

TEST(TraceWriter, RecordsInformationAboutTheTrace) {
  const TemporaryFolder folder(test::memoryFolder());
  const fs::path file = folder.path() / "a.mcap";
  const TraceOptions options{.realtime_offset_ns = 1'700'000'000'000'000'000,
                             .metadata = {{"version", "1.2"}, {"kernel", ""}},
                             .attachments = {{"hapticd.yaml", "application/yaml", "a: 1\n"}, {"b", "", ""}}};
  test::writeTrace(file, test::madeUpRecords(4, 5), 5, options);
  const auto info = readTrace(file);
  ASSERT_TRUE(info) << info.error().text();
  EXPECT_EQ(info->bytes, fs::file_size(file));
  EXPECT_EQ(info->ticks, 20U);
  EXPECT_EQ(info->ticks_dropped, 0U);
  EXPECT_EQ(info->models, 3U);
  EXPECT_EQ(info->directives, 3U);
  EXPECT_EQ(info->additions, 3U);
  EXPECT_EQ(info->events, 3U);
  EXPECT_EQ(info->snapshots, 3U);
  EXPECT_EQ(info->chunks, 4U);
  EXPECT_EQ(info->realtime_offset_ns, options.realtime_offset_ns);
  EXPECT_TRUE(info->complete);
  EXPECT_EQ(info->metadata, options.metadata);
  ASSERT_EQ(info->attachments.size(), 2U);
  EXPECT_EQ(info->attachments[0].name, "hapticd.yaml");
  EXPECT_EQ(info->attachments[0].media_type, "application/yaml");
  EXPECT_EQ(info->attachments[0].data, "a: 1\n");
}

TEST(TraceWriter, CountsMissingTicksAndUsesWallClockTimes) {
  const TemporaryFolder folder(test::memoryFolder());
  auto writer = TraceWriter::create(folder.path() / "a.mcap", {.realtime_offset_ns = 1'000});
  ASSERT_TRUE(writer) << writer.error().text();
  for (const std::uint64_t number : {5U, 6U, 9U, 10U, 12U}) {
    rt::Tick tick;
    tick.number = number;
    tick.planned_ns = static_cast<std::int64_t>(number * 10);
    ASSERT_TRUE((*writer)->write(tick));
  }
  ASSERT_TRUE((*writer)->close());
  const auto info = readTrace(folder.path() / "a.mcap");
  ASSERT_TRUE(info);
  EXPECT_EQ(info->ticks_dropped, 3U);  // 7, 8, 11
  EXPECT_EQ(info->first_ns, 1'050);
  EXPECT_EQ(info->last_ns, 1'120);
}

TEST(TraceWriter, BeginsAChunkWhenTheOneBeforeIsLongEnough) {
  const TemporaryFolder folder(test::memoryFolder());
  auto writer = TraceWriter::create(folder.path() / "a.mcap", {.chunk_ns = 10'000'000});
  ASSERT_TRUE(writer);
  for (std::uint64_t number = 1; number <= 25; ++number) {
    ASSERT_TRUE((*writer)->write(tickOf(number)));
  }
  // after 10 ms, of which the last one is held back for late records
  EXPECT_EQ((*writer)->ticks(), 20U);
  EXPECT_EQ((*writer)->ticksPending(), 5U);
  EXPECT_EQ((*writer)->bytes(), fs::file_size(folder.path() / "a.mcap.part"));
  ASSERT_TRUE((*writer)->flush());
  EXPECT_EQ((*writer)->ticks(), 25U);
  EXPECT_EQ((*writer)->ticksPending(), 0U);
  ASSERT_TRUE((*writer)->close());
  EXPECT_EQ(readTrace(folder.path() / "a.mcap")->chunks, 3U);
}

TEST(TraceWriter, KeepsChunksShortEvenWhenTicksLagBehindOtherRecords) {
  const TemporaryFolder folder(test::memoryFolder());
  auto writer = TraceWriter::create(folder.path() / "a.mcap", {.chunk_ns = 10'000'000});
  ASSERT_TRUE(writer);
  ASSERT_TRUE((*writer)->write(EventRecord{.time_ns = 9'000'000}));
  for (std::uint64_t number = 1; number <= 15; ++number) {
    ASSERT_TRUE((*writer)->write(tickOf(number)));
    EXPECT_LE((*writer)->ticksPending(), 10U);
  }
  EXPECT_EQ((*writer)->ticks(), 10U);
}

TEST(TraceWriter, NeverWritesAChunkThatBeginsBeforeTheEndOfTheOneBefore) {
  constexpr std::int64_t kChunk_ns = 300'000'000;
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const TemporaryFolder folder(test::memoryFolder());
    std::mt19937_64 random(seed);
    auto writer = TraceWriter::create(folder.path() / "a.mcap",
                                      {.chunk_ns = kChunk_ns, .first_chunk_ns = kChunk_ns / 10});
    ASSERT_TRUE(writer);
    // as at the begin of a trace: what is in force, then the ticks that waited meanwhile
    ASSERT_TRUE((*writer)->write(DirectiveRecord{.time_ns = tickOf(500).planned_ns}));
    std::vector<std::int64_t> times_ns;
    for (std::uint64_t number = 1; number <= 3000; ++number) {
      ASSERT_TRUE((*writer)->write(tickOf(number)));
      if (random() % 10 != 0) continue;
      const std::int64_t most_ns = random() % 2 == 0 ? kChunk_ns / 10 : 5 * kChunk_ns;
      const auto late_ns = static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(most_ns));
      times_ns.push_back(std::max<std::int64_t>(tickOf(number).planned_ns - late_ns, 0));
      ASSERT_TRUE((*writer)->write(EventRecord{.time_ns = times_ns.back()}));
    }
    ASSERT_TRUE((*writer)->close());
    EXPECT_EQ(test::readStrictly(folder.path() / "a.mcap").allText(), "");
    const MadeUpRecords read = test::recordsIn(folder.path() / "a.mcap");
    EXPECT_EQ(read.ticks.size(), 3000U);
    EXPECT_EQ(read.directives.size(), 1U);
    std::vector<std::int64_t> read_ns;
    for (const EventRecord& event : read.events) read_ns.push_back(event.time_ns);
    std::ranges::sort(times_ns);
    std::ranges::sort(read_ns);
    EXPECT_EQ(read_ns, times_ns);
  }
}

/// Records in order of arrival: other records are up to 20 ms earlier or later than the ticks next to them.
TEST(TraceWriter, SortsMessagesByTimeAcrossChunks) {
  const TemporaryFolder folder(test::memoryFolder());
  std::mt19937_64 random(5);
  auto writer = TraceWriter::create(folder.path() / "a.mcap", {.chunk_ns = 300'000'000});
  ASSERT_TRUE(writer);
  for (std::uint64_t number = 1; number <= 3000; ++number) {
    ASSERT_TRUE((*writer)->write(tickOf(number)));
    if (number % 10 != 0) continue;
    const auto off_ns = static_cast<std::int64_t>(random() % 40'000'000) - 20'000'000;
    const std::int64_t time_ns = std::max<std::int64_t>(tickOf(number).planned_ns + off_ns, 0);
    ASSERT_TRUE((*writer)->write(EventRecord{.time_ns = time_ns}));
  }
  ASSERT_TRUE((*writer)->close());
  const auto strict = test::readStrictly(folder.path() / "a.mcap");
  EXPECT_EQ(strict.allText(), "");
  EXPECT_EQ(strict.messages.size(), 3300U);
  EXPECT_GT(strict.chunks, 8U);
}

/// Readers refuse files that become far longer when they are decompressed (mcap_format.h): as the same label
/// image again and again does, with which a program moves fixtures.
TEST(TraceWriter, WhatCompressesBeyondMeasureCanStillBeRead) {
  const TemporaryFolder folder(test::memoryFolder());
  constexpr std::uint64_t kRecords = 300;
  AdditionsRecord additions{.labels = {std::string(640 * 480, '\1')}};
  for (const std::uint64_t ticks_per_record : {10U, 0U}) {
    const fs::path file = folder.path() / (std::to_string(ticks_per_record) + ".mcap");
    auto writer = TraceWriter::create(file, {});
    ASSERT_TRUE(writer);
    std::mt19937_64 random(1);
    for (std::uint64_t number = 1; number <= kRecords; ++number) {
      for (std::uint64_t i = 0; i < ticks_per_record; ++i)
        ASSERT_TRUE((*writer)->write(test::madeUpTick(random, 10 * number + i)));
      additions.time_ns = tickOf(10 * number).planned_ns;
      ASSERT_TRUE((*writer)->write(additions));
    }
    ASSERT_TRUE((*writer)->close());
    std::uint64_t read = 0;
    const auto info = readTrace(file, {.additions = [&](const AdditionsRecord&) { return ++read > 0; }});
    ASSERT_TRUE(info) << info.error().text();
    EXPECT_EQ(read, kRecords);
    const bool compressed = fs::file_size(file) < kRecords * additions.labels.bytes.size() / 10;
    EXPECT_EQ(compressed, ticks_per_record > 0) << fs::file_size(file);
  }
}

TEST(TraceWriter, LocksItsFileWhileItIsOpen) {
  const TemporaryFolder folder(test::memoryFolder());
  const fs::path part = folder.path() / "a.mcap.part";
  auto writer = TraceWriter::create(folder.path() / "a.mcap", {.chunk_ns = 1});
  ASSERT_TRUE(writer && (*writer)->write(tickOf(1)) && (*writer)->write(tickOf(2)) && (*writer)->flush());
  EXPECT_TRUE(isBeingWritten(part));
  EXPECT_NE(errorOf(part).find("still being written"), std::string::npos) << errorOf(part);
  for (const auto& refused : {recoverTrace(part, folder.path() / "b.mcap"), finishTrace(part)}) {
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().text().find("being written"), std::string::npos) << refused.error().text();
  }
  EXPECT_FALSE(fs::exists(folder.path() / "b.mcap"));
  ASSERT_TRUE((*writer)->close());
  writer->reset();
  EXPECT_FALSE(isBeingWritten(folder.path() / "a.mcap"));
  EXPECT_EQ(errorOf(folder.path() / "a.mcap"), "");
}

TEST(TraceWriter, HasItsNameOnlyWhenItIsClosed) {
  const TemporaryFolder folder(test::memoryFolder());
  const fs::path file = folder.path() / "a.mcap";
  auto writer = TraceWriter::create(file, {});
  ASSERT_TRUE(writer);
  ASSERT_TRUE((*writer)->write(rt::Tick{}));
  EXPECT_FALSE(fs::exists(file));
  EXPECT_NE(errorOf(folder.path() / "a.mcap.part").find("being written"), std::string::npos);
  ASSERT_TRUE((*writer)->close());
  ASSERT_TRUE((*writer)->close()) << "a second time changes nothing";
  EXPECT_FALSE(fs::exists(folder.path() / "a.mcap.part"));
  EXPECT_EQ(errorOf(file), "");
}

TEST(TraceWriter, OverwritesNoFile) {
  const TemporaryFolder folder(test::memoryFolder());
  folder.write("a.mcap", "mine");
  folder.write("b.mcap.part", "mine");
  for (const char* name : {"a.mcap", "b.mcap"}) {
    EXPECT_FALSE(TraceWriter::create(folder.path() / name, {})) << name;
  }
  EXPECT_EQ(contentOf(folder.path() / "a.mcap"), "mine");
  EXPECT_EQ(contentOf(folder.path() / "b.mcap.part"), "mine");
  EXPECT_FALSE(fs::exists(folder.path() / "a.mcap.part"));

  auto writer = TraceWriter::create(folder.path() / "c.mcap", {});
  ASSERT_TRUE(writer && (*writer)->write(rt::Tick{}));
  folder.write("c.mcap", "mine");
  EXPECT_FALSE((*writer)->close());
  EXPECT_EQ(contentOf(folder.path() / "c.mcap"), "mine");
  fs::remove(folder.path() / "c.mcap");
  EXPECT_TRUE((*writer)->close()) << "it may be tried again";
  EXPECT_EQ(errorOf(folder.path() / "c.mcap"), "");
}

TEST(TraceWriter, ReportsAFolderThatIsMissingOrHasVanished) {
  const TemporaryFolder folder(test::memoryFolder());
  const fs::path file = folder.path() / "nowhere" / "a.mcap";
  const auto missing = TraceWriter::create(file, {});
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().text().find("nowhere"), std::string::npos) << missing.error().text();

  fs::create_directory(file.parent_path());
  auto writer = TraceWriter::create(file, {});
  ASSERT_TRUE(writer) << writer.error().text();
  fs::remove_all(file.parent_path());
  ASSERT_TRUE((*writer)->write(rt::Tick{}));
  const auto closed = (*writer)->close();
  ASSERT_FALSE(closed);
  EXPECT_NE(closed.error().text().find("nowhere"), std::string::npos) << closed.error().text();
}

TEST(TraceWriter, RefusesAMessageTooLargeForReadersAndContinues) {
  const TemporaryFolder folder(test::memoryFolder());
  auto writer = TraceWriter::create(folder.path() / "a.mcap", {});
  ASSERT_TRUE(writer);
  EXPECT_FALSE((*writer)->write(EventRecord{0, "long", std::string(5 << 20, 'x'), {}}));
  EXPECT_TRUE((*writer)->write(EventRecord{0, "short", "x", {}}));
  EXPECT_TRUE((*writer)->close());
  EXPECT_EQ(readTrace(folder.path() / "a.mcap")->events, 1U);
}

constexpr std::uint64_t kTicksThatFit = 182;

/// Runs in a child whose files may not exceed a limit: writes until that fails, then closes.
void writeUntilTheDiskIsFull(const fs::path& file) {
  std::signal(SIGXFSZ, SIG_IGN);
  auto writer = TraceWriter::create(file, {.compress = false, .chunk_ns = 100'000'000});
  ASSERT_TRUE(writer) << writer.error().text();
  rt::Tick tick;
  base::Result<void> written;
  while (written && tick.number < 10'000) {
    ++tick.number;
    tick.planned_ns += 1'000'000;
    written = (*writer)->write(tick);
  }
  ASSERT_FALSE(written);
  EXPECT_FALSE(written.error().remedy.empty()) << written.error().text();
  EXPECT_FALSE((*writer)->write(tick)) << "nothing more is written";
  EXPECT_FALSE((*writer)->flush());
  EXPECT_EQ((*writer)->ticks(), kTicksThatFit);
  EXPECT_EQ((*writer)->bytes(), fs::file_size(file.string() + ".part"));
  EXPECT_EQ((*writer)->close().has_value(), file.stem() == "room");
}

void fillTheDisk(const fs::path& file, std::size_t largest_file_bytes) {
  const auto child = test::runToEnd(
      {"/proc/self/exe", "--gtest_filter=TraceWriter.EndsWithItsLastWholeChunkWhenTheDiskIsFull"},
      {.environment = {std::string(test::kRerunVariable) + "=" + file.string()},
       .largest_file_bytes = largest_file_bytes});
  EXPECT_EQ(child.ending, test::exitedWith(0)) << child.output;
}

TEST(TraceWriter, EndsWithItsLastWholeChunkWhenTheDiskIsFull) {
  if (!test::rerunPart().empty()) return writeUntilTheDiskIsFull(test::rerunPart());
  const TemporaryFolder folder(test::memoryFolder());
  const fs::path with_room = folder.path() / "room.mcap", without = folder.path() / "none.mcap";
  fillTheDisk(with_room, 175'000);  // 9 kB before the chunks, 48 kB each, 10 kB after them
  ASSERT_EQ(errorOf(with_room), "");
  EXPECT_EQ(readTrace(with_room)->ticks, kTicksThatFit);

  fillTheDisk(without, fs::file_size(with_room) - 1);  // the ending does not fit either
  EXPECT_FALSE(fs::exists(without));
  ASSERT_TRUE(finishTrace(without.string() + ".part"));
  EXPECT_EQ(contentOf(without), contentOf(with_room));
}

TEST(TraceReader, StopsWhenAVisitorReturnsFalse) {
  const TemporaryFolder folder(test::memoryFolder());
  const fs::path file = folder.path() / "a.mcap";
  test::writeTrace(file, test::madeUpRecords(3, 5), 5);
  int seen = 0;
  const auto info = readTrace(file, {.tick = [&](const rt::Tick&) { return ++seen < 7; }});
  ASSERT_TRUE(info) << info.error().text();
  EXPECT_EQ(seen, 7);
  EXPECT_EQ(info->ticks, 7U);
  EXPECT_FALSE(info->complete);
}

TEST(TraceReader, ReportsWhatAFileIsInstead) {
  const TemporaryFolder folder(test::memoryFolder());
  EXPECT_NE(errorOf(folder.path() / "none.mcap").find("none.mcap"), std::string::npos);
  EXPECT_NE(errorOf(folder.path()).find("not a regular file"), std::string::npos) << errorOf(folder.path());
  EXPECT_NE(errorOf(folder.write("text.mcap", "hello, world")).find("not an MCAP file"), std::string::npos);
  EXPECT_NE(errorOf(folder.write("empty.mcap", "")).find("truncated"), std::string::npos);
}

TEST(TraceReader, RefusesLengthsBeyondAnyFileWithoutAllocating) {
  const TemporaryFolder folder(test::memoryFolder());
  const std::string magic = "\x89MCAP0\r\n";
  for (const char last : {'\x7f', '\x00'}) {
    std::string bytes = magic + "\x01" + std::string(7, '\xff') + last;
    EXPECT_NE(errorOf(folder.write("long.mcap", bytes)), "");
  }
}

}  // namespace
}  // namespace hapticd::trace

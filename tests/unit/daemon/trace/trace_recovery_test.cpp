// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/recovery/trace_recovery.h"

#include <gtest/gtest.h>

#include <iterator>
#include <string>

#include "daemon/trace/reader/trace_reader.h"
#include "tests/support/file_content.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/raw_mcap.h"
#include "tests/support/strict_mcap.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::trace {
namespace {

namespace fs = std::filesystem;
using test::bitsOf;
using test::contentOf;
using test::MadeUpRecords;
using test::TemporaryFolder;

constexpr std::size_t kChunks = 3, kTicksPerChunk = 2;

/// A closed trace, and where its records end.
struct WholeTrace {
  MadeUpRecords records = test::madeUpRecords(kChunks, kTicksPerChunk);
  std::string bytes;
  std::vector<std::size_t> chunk_begins, chunk_ends;
  std::size_t data_end = 0;

  WholeTrace() : WholeTrace(bytesOf(test::madeUpRecords(kChunks, kTicksPerChunk))) {}
  explicit WholeTrace(std::string content) : bytes(std::move(content)) {
    for (const auto& [opcode, begin, end] : test::raw_mcap::recordsOf(bytes)) {
      if (opcode == 15) data_end = begin;
      if (opcode != 6) continue;
      chunk_begins.push_back(begin);
      chunk_ends.push_back(end);
    }
  }

  static std::string bytesOf(const MadeUpRecords& records) {
    const TemporaryFolder folder(test::memoryFolder());
    test::writeTrace(folder.path() / "a.mcap", records, kTicksPerChunk,
                     {.attachments = {{"name", "type", "data"}}});
    return contentOf(folder.path() / "a.mcap");
  }
  std::size_t chunksWithin(std::size_t cut) const {
    std::size_t chunks = 0;
    for (const std::size_t end : chunk_ends) chunks += end <= cut;
    return chunks;
  }
};

const WholeTrace& wholeTrace() {
  static const WholeTrace trace;
  return trace;
}

/// Expects that the file is complete and holds exactly the first `chunks` chunks.
void expectChunks(const fs::path& file, std::size_t chunks) {
  std::vector<rt::Tick> ticks;
  const auto info = readTrace(file, {.tick = [&](const rt::Tick& tick) {
                                ticks.push_back(tick);
                                return true;
                              }});
  ASSERT_TRUE(info) << info.error().text();
  EXPECT_TRUE(info->complete);
  EXPECT_EQ(info->chunks, chunks);
  EXPECT_EQ(info->attachments.size(), 1U);
  ASSERT_EQ(ticks.size(), chunks * kTicksPerChunk);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    EXPECT_EQ(bitsOf(ticks[i]), bitsOf(wholeTrace().records.ticks[i]));
  }
}

using Outcome = RecoveredTrace::Outcome;

TEST(TraceRecovery, KeepsExactlyTheCompleteChunksOfAFileTruncatedAnywhere) {
  const WholeTrace& whole = wholeTrace();
  ASSERT_EQ(whole.chunk_ends.size(), kChunks);
  const TemporaryFolder folder(test::memoryFolder());
  const fs::path part = folder.path() / "a.mcap.part", file = folder.path() / "a.mcap";
  constexpr std::size_t kStep = 7;  // less than the head of a record
  for (std::size_t cut = 0; cut < whole.bytes.size(); cut += kStep) {
    SCOPED_TRACE(cut);
    folder.write("a.mcap.part", whole.bytes.substr(0, cut));
    const auto finished = finishTrace(part);
    ASSERT_TRUE(finished) << finished.error().text();
    ASSERT_FALSE(fs::exists(part));
    const std::size_t chunks = whole.chunksWithin(cut);
    ASSERT_EQ(finished->chunks, chunks);
    if (finished->outcome == Outcome::hopeless) {
      ASSERT_EQ(chunks, 0U);
      ASSERT_EQ(contentOf(finished->original), whole.bytes.substr(0, cut)) << "it is kept all the same";
      fs::remove(finished->original);
      continue;
    }
    ASSERT_EQ(finished->outcome, chunks == 0 ? Outcome::empty : Outcome::ended);
    ASSERT_EQ(finished->file, file);
    ASSERT_FALSE(finished->damages.empty());
    ASSERT_EQ(test::readStrictly(file).text(), "");
    const std::string bytes = contentOf(file);
    // what follows from the intact chunks does not depend on where the file was truncated
    if (chunks == kChunks) {
      ASSERT_EQ(bytes, whole.bytes);
    }
    if (chunks > 0) {
      ASSERT_TRUE(bytes.starts_with(whole.bytes.substr(0, whole.chunk_ends[chunks - 1])));
      expectChunks(file, chunks);
    }
    if (testing::Test::HasFailure()) return;
    fs::remove(file);
  }
}

TEST(TraceRecovery, KeepsACompleteFileAndRemovesPartFromItsName) {
  const TemporaryFolder folder(test::memoryFolder());
  const fs::path file = folder.write("a.mcap", wholeTrace().bytes), out = folder.path() / "out.mcap";
  const auto recovered = recoverTrace(file, out);
  ASSERT_TRUE(recovered) << recovered.error().text();
  EXPECT_EQ(recovered->outcome, Outcome::intact);
  EXPECT_EQ(recovered->chunks, kChunks);
  EXPECT_FALSE(fs::exists(out));
  fs::rename(file, folder.path() / "a.mcap.part");
  const auto finished = finishTrace(folder.path() / "a.mcap.part");
  ASSERT_TRUE(finished) << finished.error().text();
  EXPECT_EQ(finished->outcome, Outcome::intact);
  EXPECT_EQ(finished->file, file);
  EXPECT_EQ(contentOf(file), wholeTrace().bytes);
}

TEST(TraceRecovery, KeepsAllOtherChunksOfAFileWithOneDamagedChunkAndTheFileToo) {
  const WholeTrace& whole = wholeTrace();
  const TemporaryFolder folder(test::memoryFolder());
  const fs::path out = folder.path() / "out.mcap";
  for (std::size_t damaged = 0; damaged < kChunks; ++damaged) {
    SCOPED_TRACE(damaged);
    std::string bytes = whole.bytes;
    bytes[whole.chunk_ends[damaged] - 10] ^= 1;
    const fs::path file = folder.write("a.mcap", bytes);
    const auto recovered = recoverTrace(file, out);
    ASSERT_TRUE(recovered) << recovered.error().text();
    EXPECT_EQ(recovered->outcome, Outcome::rewritten);
    EXPECT_EQ(contentOf(file), bytes) << "the original is only read";
    EXPECT_EQ(recovered->chunks, kChunks - 1);
    EXPECT_EQ(recovered->bytes_lost, whole.chunk_ends[damaged] - whole.chunk_begins[damaged]);
    EXPECT_EQ(recovered->messages_lost, damaged == 0 ? kTicksPerChunk + 18 : kTicksPerChunk);
    EXPECT_EQ(recovered->ticks_missing, damaged == 1 ? kTicksPerChunk : 0);
    ASSERT_EQ(recovered->damages.size(), 1U);
    EXPECT_EQ(recovered->damages[0].offset, whole.chunk_begins[damaged]);
    EXPECT_EQ(test::readStrictly(out).text(), "");
    std::vector<std::uint64_t> ticks;
    ASSERT_TRUE(
        readTrace(out, {.tick = [&](const rt::Tick& tick) { return ticks.push_back(tick.number), true; }}));
    std::vector<std::uint64_t> expected;
    for (const rt::Tick& tick : whole.records.ticks) {
      if ((tick.number - 1) / kTicksPerChunk != damaged) expected.push_back(tick.number);
    }
    EXPECT_EQ(ticks, expected);
    fs::remove(out);
  }
}

TEST(TraceRecovery, FinishesADamagedLeftoverInANewFileAndKeepsTheDamagedOne) {
  const WholeTrace& whole = wholeTrace();
  const TemporaryFolder folder(test::memoryFolder());
  std::string bytes = whole.bytes.substr(0, whole.data_end);
  bytes[whole.chunk_ends[1] - 10] ^= 1;
  const fs::path part = folder.write("a.mcap.part", bytes);
  const auto finished = finishTrace(part);
  ASSERT_TRUE(finished) << finished.error().text();
  EXPECT_EQ(finished->outcome, Outcome::rewritten);
  EXPECT_EQ(finished->file, folder.path() / "a.mcap");
  EXPECT_EQ(finished->original, folder.path() / "a.mcap.damaged");
  EXPECT_EQ(contentOf(finished->original), bytes);
  EXPECT_FALSE(fs::exists(part));
  EXPECT_EQ(readTrace(finished->file)->ticks, (kChunks - 1) * kTicksPerChunk);
  EXPECT_EQ(test::readStrictly(finished->file).text(), "");
}

TEST(TraceRecovery, StopsWhenItIsAskedToAndGoesOnTheNextTime) {
  const WholeTrace& whole = wholeTrace();
  std::string damaged = whole.bytes.substr(0, whole.data_end);
  damaged[whole.chunk_ends[1] - 10] ^= 1;
  for (const std::string& bytes : {whole.bytes.substr(0, whole.data_end), damaged, whole.bytes}) {
    const TemporaryFolder folder(test::memoryFolder());
    const fs::path part = folder.write("a.mcap.part", bytes);
    int calls = 0;
    while (true) {
      int left = calls++;
      const auto finished = finishTrace(part, [&left](double) { return left-- > 0; });
      if (finished) break;
      ASSERT_TRUE(fs::exists(part)) << finished.error().text();
      ASSERT_EQ(contentOf(part), bytes);
      ASSERT_FALSE(fs::exists(folder.path() / "a.mcap"));
      ASSERT_LT(calls, 1000);
    }
    EXPECT_GT(calls, 2);
    EXPECT_EQ(test::readStrictly(folder.path() / "a.mcap").text(), "");
  }
}

TEST(TraceRecovery, WritesDamagedIndexesAgain) {
  const WholeTrace& whole = wholeTrace();
  const TemporaryFolder folder(test::memoryFolder());
  const fs::path out = folder.path() / "out.mcap";
  for (const std::size_t chunk_end : whole.chunk_ends) {
    std::string bytes = whole.bytes;
    bytes[chunk_end] ^= 1;       // the opcode of the first index
    bytes[chunk_end + 20] ^= 1;  // and something in it
    const auto recovered = recoverTrace(folder.write("a.mcap", bytes), out);
    ASSERT_TRUE(recovered) << recovered.error().text();
    EXPECT_EQ(recovered->bytes_lost, 0U);
    EXPECT_FALSE(recovered->damages.empty());
    EXPECT_EQ(recovered->messages_lost, 0U);
    EXPECT_EQ(test::readStrictly(out).text(), "");
    expectChunks(out, kChunks);
    fs::remove(out);
  }
}

TEST(TraceRecovery, TruncatesWhatFollowsTheIntactChunks) {
  const WholeTrace& whole = wholeTrace();
  const TemporaryFolder folder(test::memoryFolder());
  for (const std::string& tail :
       {std::string(5000, '\0'), std::string(5000, '\xff'), std::string("\x06 text")}) {
    folder.write("a.mcap.part", whole.bytes.substr(0, whole.data_end) + tail);
    const auto finished = finishTrace(folder.path() / "a.mcap.part");
    ASSERT_TRUE(finished) << finished.error().text();
    EXPECT_EQ(finished->outcome, Outcome::ended);
    EXPECT_EQ(finished->bytes_lost, tail.size());
    EXPECT_EQ(contentOf(folder.path() / "a.mcap"), whole.bytes);
    fs::remove(folder.path() / "a.mcap");
  }
}

TEST(TraceRecovery, RefusesAndKeepsWhatItCannotRecover) {
  const WholeTrace& whole = wholeTrace();
  const TemporaryFolder folder(test::memoryFolder());
  std::string foreign = whole.bytes.substr(0, whole.data_end);
  for (const std::string_view ours : {"hapticd_trace", "/hapticd/"}) {
    for (std::size_t at = 0; (at = foreign.find(ours, at)) != std::string::npos;) foreign[at] = 'H';
  }
  const std::string no_chunk = whole.bytes.substr(0, whole.chunk_begins[0] + 5);
  for (const std::string& bytes : {std::string("hello, world"), foreign, no_chunk, std::string()}) {
    const fs::path file = folder.write("a.mcap", bytes), out = folder.path() / "out.mcap";
    EXPECT_FALSE(recoverTrace(file, out));
    EXPECT_EQ(contentOf(file), bytes);
    EXPECT_FALSE(fs::exists(out));
  }
  EXPECT_FALSE(finishTrace(folder.path() / "none.mcap.part"));
}

TEST(TraceRecovery, ReadsTheChunksOfAFileWhoseBeginIsDamaged) {
  const WholeTrace& whole = wholeTrace();
  const TemporaryFolder folder(test::memoryFolder());
  for (const std::size_t at :
       {std::size_t{0}, whole.bytes.find("data"), whole.bytes.find("hapticd_msgs/msg/Tick"),
        whole.bytes.find("hapticd_trace")}) {
    SCOPED_TRACE(at);
    std::string bytes = whole.bytes;
    bytes[at] ^= 1;
    const fs::path out = folder.path() / "out.mcap";
    const auto recovered = recoverTrace(folder.write("a.mcap", bytes), out);
    ASSERT_TRUE(recovered) << recovered.error().text();
    EXPECT_FALSE(recovered->damages.empty());
    EXPECT_EQ(readTrace(out)->ticks, kChunks * kTicksPerChunk);
    EXPECT_EQ(test::readStrictly(out).text(), "");
    fs::remove(out);
  }
}

TEST(TraceRecovery, OverwritesNoFile) {
  const WholeTrace& whole = wholeTrace();
  const TemporaryFolder folder(test::memoryFolder());
  folder.write("a.mcap", "mine");
  const fs::path part = folder.write("a.mcap.part", whole.bytes.substr(0, whole.data_end));
  EXPECT_FALSE(recoverTrace(part, folder.path() / "a.mcap"));
  ASSERT_FALSE(finishTrace(part));
  EXPECT_EQ(contentOf(folder.path() / "a.mcap"), "mine");
  fs::remove(folder.path() / "a.mcap");
  ASSERT_TRUE(finishTrace(part)) << "it may be tried again";
  EXPECT_EQ(contentOf(folder.path() / "a.mcap"), whole.bytes);
}

TEST(TraceRecovery, NamesItsFilesAfterTheTrace) {
  for (const char* name : {"/f/a.mcap", "/f/a.mcap.part", "/f/a.mcap.damaged"}) {
    EXPECT_EQ(recoveredName(name), "/f/a-recovered.mcap");
  }
}

TEST(TraceRecovery, GivesTheSameResultAfterAnInterruption) {
  const WholeTrace& whole = wholeTrace();
  const TemporaryFolder folder(test::memoryFolder());
  // two chunks without the indexes of the second: interrupted at any state of the repair in between
  const std::size_t cut = whole.chunk_ends[1];
  folder.write("b.mcap.part", whole.bytes.substr(0, cut));
  ASSERT_TRUE(finishTrace(folder.path() / "b.mcap.part"));
  const std::string expected = contentOf(folder.path() / "b.mcap");
  for (std::size_t written = cut; written < expected.size(); written += 97) {
    // Bytes that had not reached the disk, with or without earlier ones.
    for (const std::size_t hole : {cut, written}) {
      std::string state = expected.substr(0, written);
      std::fill(state.begin() + static_cast<std::ptrdiff_t>(cut),
                state.begin() + static_cast<std::ptrdiff_t>(written - (hole - cut)), '\0');
      folder.write("a.mcap.part", state);
      const auto finished = finishTrace(folder.path() / "a.mcap.part");
      ASSERT_TRUE(finished) << finished.error().text();
      ASSERT_EQ(contentOf(folder.path() / "a.mcap"), expected) << written;
      fs::remove(folder.path() / "a.mcap");
    }
  }
}

}  // namespace
}  // namespace hapticd::trace

#include "drivers/trace/trace_recovery.h"

#include <gtest/gtest.h>

#include <cstring>
#include <iterator>
#include <string>

#include "drivers/trace/trace_reader.h"
#include "tests/support/file_content.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::drivers {
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

  WholeTrace() {
    const TemporaryFolder folder(test::memoryFolder());
    test::writeTrace(folder.path() / "a.mcap", records, kTicksPerChunk,
                     {.attachments = {{"name", "type", "data"}}});
    bytes = contentOf(folder.path() / "a.mcap");
    for (std::size_t at = 8; at + 8 < bytes.size();) {  // behind the magic, in front of the other
      std::uint64_t length = 0;
      std::memcpy(&length, &bytes[at + 1], sizeof length);
      const char opcode = bytes[at];
      if (opcode == 6) chunk_begins.push_back(at);
      if (opcode == 15) data_end = at;
      at += 9 + length;
      if (opcode == 6) chunk_ends.push_back(at);
    }
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

/// The file is complete and holds exactly the first `chunks` chunks.
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

TEST(TraceRecovery, KeepsExactlyTheWholeChunksOfAFileCutAnywhere) {
  const WholeTrace& whole = wholeTrace();
  ASSERT_EQ(whole.chunk_ends.size(), kChunks);
  const TemporaryFolder folder(test::memoryFolder());
  const fs::path part = folder.path() / "a.mcap.part", file = folder.path() / "a.mcap";
  for (std::size_t cut = 0; cut < whole.bytes.size(); ++cut) {
    SCOPED_TRACE(cut);
    folder.write("a.mcap.part", whole.bytes.substr(0, cut));
    const auto recovered = recoverTrace(part);
    ASSERT_TRUE(recovered) << recovered.error().text();
    ASSERT_FALSE(fs::exists(part));
    const std::size_t chunks = whole.chunksWithin(cut);
    ASSERT_EQ(recovered->chunks, chunks);
    ASSERT_EQ(recovered->file, chunks > 0 ? file : fs::path());
    ASSERT_EQ(fs::exists(file), chunks > 0);
    if (chunks == 0) {
      ASSERT_EQ(recovered->bytes_cut, cut);
      continue;
    }
    const std::string bytes = contentOf(file);
    // what follows from the whole chunks does not depend on where the file was cut
    if (chunks == kChunks) {
      ASSERT_EQ(bytes, whole.bytes);
    }
    ASSERT_TRUE(bytes.starts_with(whole.bytes.substr(0, whole.chunk_ends[chunks - 1])));
    expectChunks(file, chunks);
    if (testing::Test::HasFailure()) return;
    fs::remove(file);
  }
}

TEST(TraceRecovery, LeavesACompleteFileAloneAndTakesPartOffItsName) {
  const TemporaryFolder folder(test::memoryFolder());
  for (const char* name : {"a.mcap.part", "a.mcap", "a.mcap"}) {
    if (std::string_view(name).ends_with("part")) folder.write(name, wholeTrace().bytes);
    const auto recovered = recoverTrace(folder.path() / name);
    ASSERT_TRUE(recovered) << recovered.error().text();
    EXPECT_EQ(recovered->file, folder.path() / "a.mcap");
    EXPECT_EQ(recovered->chunks, kChunks);
    EXPECT_EQ(recovered->bytes_cut, 0U);
    EXPECT_EQ(contentOf(folder.path() / "a.mcap"), wholeTrace().bytes);
  }
}

TEST(TraceRecovery, KeepsWhatIsBeforeADamagedChunkAndSaysHowMuchIsLost) {
  const WholeTrace& whole = wholeTrace();
  const TemporaryFolder folder(test::memoryFolder());
  for (std::size_t damaged = 1; damaged < kChunks; ++damaged) {
    std::string bytes = whole.bytes;
    bytes[whole.chunk_ends[damaged] - 10] ^= 1;
    const fs::path file = folder.write("a.mcap", bytes);
    const auto recovered = recoverTrace(file);
    ASSERT_TRUE(recovered) << recovered.error().text();
    EXPECT_EQ(recovered->chunks, damaged);
    EXPECT_EQ(recovered->bytes_cut, bytes.size() - whole.chunk_begins[damaged]);
    expectChunks(file, damaged);
  }
}

TEST(TraceRecovery, WritesDamagedIndexesAgain) {
  const WholeTrace& whole = wholeTrace();
  const TemporaryFolder folder(test::memoryFolder());
  for (const std::size_t chunk_end : whole.chunk_ends) {
    std::string bytes = whole.bytes;
    bytes[chunk_end] ^= 1;       // the opcode of the first index
    bytes[chunk_end + 20] ^= 1;  // and something in it
    const fs::path file = folder.write("a.mcap", bytes);
    const auto recovered = recoverTrace(file);
    ASSERT_TRUE(recovered) << recovered.error().text();
    EXPECT_EQ(recovered->bytes_cut, 0U);
    EXPECT_EQ(contentOf(file), whole.bytes);
  }
}

TEST(TraceRecovery, CutsOffWhatFollowsTheWholeChunks) {
  const WholeTrace& whole = wholeTrace();
  const TemporaryFolder folder(test::memoryFolder());
  for (const std::string& tail :
       {std::string(5000, '\0'), std::string(5000, '\xff'), std::string("\x06 text")}) {
    folder.write("a.mcap.part", whole.bytes.substr(0, whole.data_end) + tail);
    const auto recovered = recoverTrace(folder.path() / "a.mcap.part");
    ASSERT_TRUE(recovered) << recovered.error().text();
    EXPECT_EQ(recovered->bytes_cut, tail.size());
    EXPECT_EQ(contentOf(folder.path() / "a.mcap"), whole.bytes);
    fs::remove(folder.path() / "a.mcap");
  }
}

TEST(TraceRecovery, LeavesAloneWhatItCannotMend) {
  const WholeTrace& whole = wholeTrace();
  const TemporaryFolder folder(test::memoryFolder());
  std::string first_damaged = whole.bytes;
  first_damaged[whole.chunk_ends[0] - 10] ^= 1;
  std::string head_damaged = whole.bytes;
  head_damaged[whole.bytes.find("data")] ^= 1;  // of the attachment
  std::string foreign = whole.bytes;
  foreign[whole.bytes.find("hapticd_trace")] = 'H';
  for (const std::string& bytes : {std::string("hello, world"), first_damaged, head_damaged, foreign}) {
    for (const char* name : {"a.mcap", "a.mcap.part"}) {
      const fs::path file = folder.write(name, bytes);
      const auto recovered = recoverTrace(file);
      EXPECT_FALSE(recovered) << name;
      EXPECT_EQ(contentOf(file), bytes) << name;
      fs::remove(file);
    }
  }
  EXPECT_FALSE(recoverTrace(folder.path() / "none.mcap.part"));
}

TEST(TraceRecovery, RemovesNoFinishedFileThatBrokeOffBeforeItsFirstChunk) {
  const TemporaryFolder folder(test::memoryFolder());
  const std::string bytes = wholeTrace().bytes.substr(0, wholeTrace().chunk_begins[0] + 5);
  const fs::path file = folder.write("a.mcap", bytes);
  EXPECT_FALSE(recoverTrace(file));
  EXPECT_EQ(contentOf(file), bytes);
}

TEST(TraceRecovery, OverwritesNoFileWithTheNameThatItWouldGive) {
  const TemporaryFolder folder(test::memoryFolder());
  folder.write("a.mcap", "mine");
  folder.write("a.mcap.part", wholeTrace().bytes.substr(0, wholeTrace().data_end));
  const auto recovered = recoverTrace(folder.path() / "a.mcap.part");
  ASSERT_FALSE(recovered);
  EXPECT_EQ(contentOf(folder.path() / "a.mcap"), "mine");
  fs::remove(folder.path() / "a.mcap");
  ASSERT_TRUE(recoverTrace(folder.path() / "a.mcap.part")) << "it may be tried again";
  EXPECT_EQ(contentOf(folder.path() / "a.mcap"), wholeTrace().bytes);
}

TEST(TraceRecovery, IsTheSameWhenItWasCutShortItself) {
  const WholeTrace& whole = wholeTrace();
  const TemporaryFolder folder(test::memoryFolder());
  // two chunks without the indexes of the second: cut at any state of the mending in between
  const std::size_t cut = whole.chunk_ends[1];
  folder.write("b.mcap.part", whole.bytes.substr(0, cut));
  ASSERT_TRUE(recoverTrace(folder.path() / "b.mcap.part"));
  const std::string expected = contentOf(folder.path() / "b.mcap");
  for (std::size_t written = cut; written < expected.size(); written += 97) {
    for (const std::size_t hole : {cut, written}) {  // bytes that were not on the disk yet, in front or none
      std::string state = expected.substr(0, written);
      std::fill(state.begin() + static_cast<std::ptrdiff_t>(cut),
                state.begin() + static_cast<std::ptrdiff_t>(written - (hole - cut)), '\0');
      folder.write("a.mcap.part", state);
      const auto recovered = recoverTrace(folder.path() / "a.mcap.part");
      ASSERT_TRUE(recovered) << recovered.error().text();
      ASSERT_EQ(contentOf(folder.path() / "a.mcap"), expected) << written;
      fs::remove(folder.path() / "a.mcap");
    }
  }
}

}  // namespace
}  // namespace hapticd::drivers

// SPDX-License-Identifier: Apache-2.0
// A thousand traces with different damage: bits flipped, bytes overwritten, the end truncated, a piece
// removed, chunks swapped and removed. Nothing intact that can be found is lost, and all damage is
// reported.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <random>
#include <set>
#include <string>

#include "daemon/trace/reader/trace_reader.h"
#include "daemon/trace/recovery/trace_recovery.h"
#include "tests/support/file_content.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/raw_mcap.h"
#include "tests/support/strict_mcap.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::trace {
namespace {

namespace fs = std::filesystem;
using test::StrictMcap;
using test::TemporaryFolder;

constexpr unsigned kFiles = 1200;
constexpr std::size_t kDamagedChunks = 24, kDamagedTicksPerChunk = 6;

/// A chunk record in the undamaged file with the messages in it.
struct Piece {
  std::string bytes;  ///< of the record
  std::size_t begin = 0;
  std::vector<StrictMcap::Message> messages;
};

class Damaging {
 public:
  explicit Damaging(bool compress) : folder_(test::memoryFolder()) {
    const fs::path file = folder_.path() / "whole.mcap";
    test::writeTrace(file, test::madeUpRecords(kDamagedChunks, kDamagedTicksPerChunk, 3),
                     kDamagedTicksPerChunk,
                     {.compress = compress,
                      .metadata = {{"hapticd_version", "1"}},
                      .attachments = {{"settings.yaml", "application/yaml", std::string(500, 'y')}}});
    whole_ = test::contentOf(file);
    auto message = test::readStrictly(file).messages;
    for (const auto& [opcode, begin, end] : test::raw_mcap::recordsOf(whole_))
      if (opcode == 6) pieces_.push_back({whole_.substr(begin, end - begin), begin, {}});
    // all except those of the first chunk are ticks
    const std::size_t first = message.size() - (pieces_.size() - 1) * kDamagedTicksPerChunk;
    for (std::size_t i = 0; i < message.size(); ++i) {
      const std::size_t chunk = i < first ? 0 : 1 + (i - first) / kDamagedTicksPerChunk;
      pieces_[chunk].messages.push_back(std::move(message[i]));
    }
  }

  std::string damaged(std::mt19937_64& random, std::string& how) const {
    switch (random() % 7) {
      case 0:
        how = "one bit flipped";
        return flipped(whole_, random, 1);
      case 1:
        how = "several bits flipped";
        return flipped(whole_, random, 2 + random() % 6);
      case 2:
        how = "cut";
        return whole_.substr(0, random() % whole_.size());
      case 3:
        how = "overwritten";
        return overwritten(random);
      case 4:
        how = "a piece taken out";
        return whole_.substr(0, place(random)) + whole_.substr(place(random));
      case 5:
        how = "chunks swapped";
        return swapped(random);
      default:
        how = "a chunk removed";
        return removed(random);
    }
  }

  /// Returns the messages of the chunks whose records are still intact and that a reader can find: by the
  /// lengths of the records from the begin of the file on, or where the intact summary says.
  std::vector<StrictMcap::Message> intactMessages(const std::string& bytes) const {
    std::set<std::size_t> places;
    for (std::size_t at = 8, length = 0; at + 9 <= bytes.size(); at += 9 + length) {
      places.insert(at);
      std::memcpy(&length, &bytes[at + 1], sizeof length);
      if (length > bytes.size() - at - 9) break;
    }
    const std::size_t summary = whole_.find(std::string("\x0f\x04\0\0\0\0\0\0\0", 9), pieces_.back().begin);
    const bool has_summary =
        bytes.size() == whole_.size() && bytes.compare(summary, std::string::npos, whole_, summary) == 0;
    std::vector<StrictMcap::Message> messages;
    for (const Piece& piece : pieces_) {
      if (has_summary) places.insert(piece.begin);
      const auto isThere = [&](std::size_t at) {
        return at < bytes.size() && bytes.compare(at, piece.bytes.size(), piece.bytes) == 0;
      };
      if (std::ranges::none_of(places, isThere)) continue;
      messages.insert(messages.end(), piece.messages.begin(), piece.messages.end());
    }
    return messages;
  }

  const std::string& whole() const { return whole_; }
  const fs::path& folder() const { return folder_.path(); }
  const TemporaryFolder& temporary() const { return folder_; }

 private:
  std::size_t place(std::mt19937_64& random) const { return random() % whole_.size(); }

  static std::string flipped(std::string bytes, std::mt19937_64& random, std::size_t times) {
    for (; times > 0; --times) bytes[random() % bytes.size()] ^= static_cast<char>(1 << random() % 8);
    return bytes;
  }
  std::string overwritten(std::mt19937_64& random) const {
    std::string bytes = whole_;
    const bool zeros = random() % 2 == 0;
    for (std::size_t at = place(random), left = 1 + random() % 3000; left > 0 && at < bytes.size();
         --left, ++at) {
      bytes[at] = zeros ? '\0' : static_cast<char>(random());
    }
    return bytes;
  }
  std::string swapped(std::mt19937_64& random) const {
    const std::size_t a = random() % (pieces_.size() - 1), b = a + 1 + random() % (pieces_.size() - 1 - a);
    const Piece &first = pieces_[a], &second = pieces_[b];
    std::string bytes = whole_;
    bytes.replace(second.begin, second.bytes.size(), first.bytes);
    bytes.replace(first.begin, first.bytes.size(), second.bytes);
    return bytes;
  }
  std::string removed(std::mt19937_64& random) const {
    const Piece& piece = pieces_[random() % pieces_.size()];
    std::string bytes = whole_;
    return bytes.erase(piece.begin, piece.bytes.size());
  }

  TemporaryFolder folder_;
  std::string whole_;
  std::vector<Piece> pieces_;
};

/// Returns whether all of `expected` are among `found`.
bool includes(std::vector<StrictMcap::Message> found, std::vector<StrictMcap::Message> expected) {
  std::ranges::sort(found);
  std::ranges::sort(expected);
  return std::ranges::includes(found, expected);
}

std::string damagesOf(const RecoveredTrace& recovered) {
  std::string text;
  for (const mcap::Damage& damage : recovered.damages) {
    text += "byte " + std::to_string(damage.offset) + ", " + std::to_string(damage.bytes) +
            " bytes: " + damage.what + "\n";
  }
  return text;
}

/// Recovers a damaged file and checks the result. Returns true if there was something to recover.
bool recoverAndCheck(const Damaging& damaging, const std::string& bytes) {
  const fs::path file = damaging.temporary().write("damaged.mcap", bytes),
                 out = damaging.folder() / "out.mcap";
  EXPECT_FALSE(readTrace(file)) << "damage that is not noticed";
  const auto recovered = recoverTrace(file, out);
  EXPECT_EQ(test::contentOf(file), bytes) << "the original is only read";
  const auto intact = damaging.intactMessages(bytes);
  if (!recovered) {
    EXPECT_TRUE(intact.empty()) << recovered.error().text();
    EXPECT_FALSE(fs::exists(out));
    return false;
  }
  EXPECT_FALSE(recovered->damages.empty()) << "damage that is not named";
  for (const mcap::Damage& damage : recovered->damages) {
    EXPECT_LE(damage.offset + damage.bytes, std::max<std::size_t>(bytes.size(), damaging.whole().size()));
  }
  const StrictMcap strict = test::readStrictly(out);
  EXPECT_EQ(strict.text(), "");
  EXPECT_TRUE(includes(strict.messages, intact)) << "something intact is lost: " << damagesOf(*recovered);
  EXPECT_LE(strict.messages.size(), test::readStrictly(damaging.folder() / "whole.mcap").messages.size());
  fs::remove(out);
  return true;
}

TEST(RandomDamage, LosesNothingThatIsIntactAndIsNamed) {
  const Damaging compressed(true), plain(false);
  std::map<std::string, int> recovered;
  for (unsigned seed = 0; seed < kFiles; ++seed) {
    std::mt19937_64 random(seed);
    const Damaging& damaging = seed % 2 == 0 ? compressed : plain;
    std::string how;
    const std::string bytes = damaging.damaged(random, how);
    if (bytes == damaging.whole()) continue;  // a piece of length zero
    SCOPED_TRACE(testing::Message() << "seed " << seed << ": " << how);
    recovered[how] += recoverAndCheck(damaging, bytes);
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_EQ(recovered.size(), 7U);
  for (const auto& [how, count] : recovered) EXPECT_GT(count, 50) << how;
}

}  // namespace
}  // namespace hapticd::trace

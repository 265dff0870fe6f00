// SPDX-License-Identifier: Apache-2.0
#include "tests/support/strict_mcap.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "tests/support/file_content.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/raw_mcap.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

/// The oracle of other tests must find faults: they are planted where no other checksum reveals them.
class StrictReader : public testing::Test {
 protected:
  StrictReader() {
    writeTrace(folder_.path() / "a.mcap", madeUpRecords(3, 4), 4,
               {.compress = false, .attachments = {{"name", "type", "data"}}});
    whole_ = contentOf(folder_.path() / "a.mcap");
    for (const raw_mcap::RawRecord& record : raw_mcap::recordsOf(whole_))
      records_[record.opcode].push_back(record);
  }

  std::string faults(const std::string& bytes) const {
    return readStrictly(folder_.write("b.mcap", bytes)).text();
  }
  /// Returns the file with a byte of the content of the n-th record of that opcode changed.
  std::string changed(char opcode, std::size_t n, std::size_t at) const {
    std::string bytes = whole_;
    bytes[records_.at(opcode).at(n).begin + 9 + at] ^= 1;
    return bytes;
  }
  void expectFound(const std::string& bytes, const std::string& fault) const {
    const std::string found = faults(bytes);
    EXPECT_NE(found.find(fault), std::string::npos) << found << " instead of " << fault;
  }

  const TemporaryFolder folder_{memoryFolder()};
  std::string whole_;
  std::map<char, std::vector<raw_mcap::RawRecord>> records_;  ///< by opcode
};

TEST_F(StrictReader, FindsNothingInAValidFile) {
  EXPECT_EQ(faults(whole_), "");
}

TEST_F(StrictReader, FindsABitFlippedAnywhere) {
  constexpr std::size_t kStep = 61;  // no divisor of the length of any record
  for (std::size_t at = 0; at < whole_.size(); at += kStep) {
    std::string bytes = whole_;
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << at % 8));
    ASSERT_NE(faults(bytes), "") << at;
  }
}

TEST_F(StrictReader, NamesMismatches) {
  expectFound(changed(6, 1, 0), "the times of a chunk");
  expectFound(changed(6, 1, 24), "the checksum of a chunk");
  expectFound(changed(7, 0, 6), "a message index does not match its chunk");
  expectFound(changed(8, 2, 0), "a chunk index does not match its chunk");
  expectFound(changed(8, 2, 16), "of a missing chunk");
  expectFound(changed(10, 0, 16), "an attachment index does not match");
  expectFound(changed(11, 0, 0), "the statistics count other messages");
  expectFound(changed(11, 0, 26), "the statistics have other times");
  expectFound(changed(13, 0, 0), "a metadata index does not match");
  expectFound(changed(14, 0, 1), "a summary offset does not match");
  expectFound(changed(15, 0, 0), "the checksum of the data");
  expectFound(changed(2, 0, 16), "the checksum of the summary");
  expectFound(changed(2, 0, 8), "not at the position given in the footer");
  expectFound(changed(9, 0, 0), "the checksum of an attachment");
}

TEST_F(StrictReader, FindsRecordsThatAreMissingOrMoved) {
  const auto without = [this](char opcode) {
    std::string bytes = whole_;
    const raw_mcap::RawRecord& record = records_.at(opcode).front();
    return bytes.erase(record.begin, record.end - record.begin);
  };
  expectFound(without(7), "without an index for each of its channels");
  expectFound(without(3), "a channel before its schema");
  expectFound(without(4), "a message before its channel");
  expectFound(without(11), "there are no statistics");
  expectFound(without(15), "in the data section");
  expectFound(without(2), "there is no footer");
  expectFound(whole_.substr(0, whole_.size() / 2), "the closing magic is missing");
}

TEST_F(StrictReader, FindsMessagesThatAreNotInTheOrderOfTime) {
  // the first two ticks of the second chunk are swapped; they have the same length
  const std::size_t first = whole_.find('\x05', records_.at(6)[1].begin + 40);
  std::uint64_t length = 0;
  std::memcpy(&length, &whole_[first + 1], sizeof length);
  std::string bytes = whole_;
  for (std::size_t i = 0; i < 9 + length; ++i) std::swap(bytes[first + i], bytes[first + 9 + length + i]);
  const std::string found = faults(bytes);
  EXPECT_NE(found, "");
}

}  // namespace
}  // namespace hapticd::test

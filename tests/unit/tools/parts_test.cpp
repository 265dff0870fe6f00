// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/parts/parts.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <set>

#include "tools/lib/parts/fields.h"

namespace hapticd::tools {
namespace {

constexpr const char* kProgram = "program study";
constexpr const char* kVersion = "1.2.3";

TEST(Part, HasEveryCaseInExactlyOne) {
  for (const std::size_t count : {1U, 2U, 3U, 7U, 60U}) {
    for (std::size_t index = 0; index < 50; ++index) {
      int times = 0;
      for (std::size_t number = 1; number <= count; ++number) times += Part{number, count}.has(index) ? 1 : 0;
      EXPECT_EQ(times, 1) << index << " of " << count;
    }
  }
}

TEST(Part, SharesACostThatRecursWithItsCount) {
  for (std::size_t number = 1; number <= 4; ++number) {
    std::size_t costly = 0;
    for (std::size_t index = 0; index < 64; index += 4) costly += Part{number, 4}.has(index) ? 1U : 0U;
    EXPECT_EQ(costly, 4U) << number;
  }
}

TEST(ParsePart, ReadsKOfNAndNothingElse) {
  EXPECT_EQ(parsePart("3/8"), (Part{3, 8}));
  EXPECT_EQ(parsePart("100000/100000"), (Part{100000, 100000}));
  for (const char* wrong : {"", "3", "/8", "3/", "0/4", "5/4", "0/0", "x", "3/8/1", "a/b", "-1/8", "3 /8",
                            "+3/8", "1/100001", "99999999999999999999/8"}) {
    const auto part = parsePart(wrong);
    ASSERT_FALSE(part) << wrong;
    EXPECT_NE(part.error().text().find("N in 1..100000 and K in 1..N"), std::string::npos) << wrong;
    EXPECT_NE(part.error().text().find(wrong), std::string::npos);
  }
}

/// A part of a run of ten cases, whose results are three times their numbers.
PartFile part(std::size_t number, std::size_t count) {
  PartFile file{.name = "part" + std::to_string(number),
                .run = {kProgram, kVersion, {"--quick=true"}, {{"digest", "0"}}, 10},
                .part = {number, count}};
  for (std::size_t index = 0; index < file.run.cases; ++index) {
    if (file.part.has(index)) file.results.emplace_back(3 * index);
  }
  return file;
}

std::string errorOfJoining(const std::vector<PartFile>& parts) {
  const auto joined = joinParts(parts);
  return joined ? "" : joined.error().text();
}

base::Result<PartFile> readBack(const PartFile& file, const std::string& program = kProgram,
                                const std::string& version = kVersion) {
  return parsePartFile(file.name, partText(file), program, version);
}

TEST(PartFile, ReadsBackAsWritten) {
  const PartFile written = part(2, 3);
  const auto read = readBack(written);
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read->name, "part2");
  EXPECT_EQ(read->run, written.run);
  EXPECT_EQ(read->part, written.part);
  EXPECT_EQ(read->results, written.results);
}

TEST(PartFile, IsRefusedWhereItIsNone) {
  const std::string whole = partText(part(1, 2));
  for (const std::string& text : {std::string(), std::string("{}"), std::string("[1]"), std::string("7"),
                                  whole.substr(0, whole.size() / 2), std::string(R"({"part_of": 3})")}) {
    const auto read = parsePartFile("odd.json", text, kProgram, kVersion);
    ASSERT_FALSE(read) << text;
    EXPECT_TRUE(read.error().text().starts_with("odd.json: is not a part of program study"))
        << read.error().text();
  }
}

TEST(PartFile, IsRefusedByOtherProgramsAndVersions) {
  EXPECT_TRUE(readBack(part(1, 2), "program other")
                  .error()
                  .text()
                  .starts_with("part1: is a part of program study, not of program other"));
  EXPECT_TRUE(
      readBack(part(1, 2), kProgram, "1.2.4").error().text().starts_with("part1: is of version 1.2.3"));
}

TEST(PartFile, IsRefusedWithAnImpossibleNumberOrWithoutAllItsCases) {
  PartFile odd = part(1, 2);
  odd.part.number = 3;
  EXPECT_TRUE(readBack(odd).error().text().starts_with("part1: has the impossible part number"));
  PartFile short_one = part(2, 2);
  short_one.results.pop_back();
  EXPECT_TRUE(readBack(short_one).error().text().starts_with("part2: holds 4 cases, part 2/2 has 5"));
}

TEST(JoinParts, JoinsInTheOrderOfTheCasesWhateverTheOrderOfTheParts) {
  const auto joined = joinParts({part(3, 3), part(1, 3), part(2, 3)});
  ASSERT_TRUE(joined) << joined.error().text();
  EXPECT_EQ(joined->results, part(1, 1).results);
  EXPECT_EQ(joined->run, part(1, 1).run);
}

TEST(JoinParts, JoinsMorePartsThanCases) {
  std::vector<PartFile> parts;
  for (std::size_t number = 1; number <= 12; ++number) parts.push_back(part(number, 12));
  const auto joined = joinParts(parts);
  ASSERT_TRUE(joined) << joined.error().text();
  EXPECT_EQ(joined->results, part(1, 1).results);
}

TEST(JoinParts, NamesWhatIsMissingOrDoubled) {
  EXPECT_TRUE(
      errorOfJoining({part(1, 4), part(3, 4)}).starts_with("--join: these parts are missing: 2/4 4/4 "));
  PartFile copy = part(1, 2);
  copy.name = "copy";
  EXPECT_TRUE(
      errorOfJoining({part(1, 2), copy, part(2, 2)}).starts_with("copy: is part 1/2, and so is part1"));
}

TEST(JoinParts, NamesThePartOfAnotherRun) {
  EXPECT_TRUE(
      errorOfJoining({part(1, 2), part(2, 3)}).starts_with("part2: is part 2/3, but part1 is part 1/2"));
  PartFile other = part(2, 2);
  other.run.options = {"--delay=3"};
  EXPECT_TRUE(errorOfJoining({part(1, 2), other})
                  .starts_with("part2: was computed with --delay=3, but part1 with --quick=true"));
  other = part(2, 2);
  other.run.input = {{"digest", "1"}};
  EXPECT_TRUE(
      errorOfJoining({part(1, 2), other}).starts_with("part2: was computed from other input than part1"));
  other = part(2, 2);
  other.run.cases = 11;
  EXPECT_TRUE(errorOfJoining({part(1, 2), other}).starts_with("part2: is of 11 cases, but part1 of 10"));
}

TEST(JoinFiles, NamesAFileThatCannotBeRead) {
  EXPECT_TRUE(joinFiles({"/nowhere/part.json"}, kProgram, kVersion)
                  .error()
                  .text()
                  .starts_with("/nowhere/part.json: cannot be read"));
}

struct Inner {
  double number = 0;
  std::array<int, 2> pair{};
};
auto fieldsOf(Is<Inner> auto& inner) {
  auto& [number, pair] = inner;
  return std::tie(number, pair);
}
struct Outer {
  std::string word;
  std::optional<Inner> maybe;
  std::vector<Inner> list;
  std::set<std::uint64_t> numbers;
};
auto fieldsOf(Is<Outer> auto& outer) {
  auto& [word, maybe, list, numbers] = outer;
  return std::tie(word, maybe, list, numbers);
}

template <typename Value>
Value thereAndBack(const Value& value) {
  Value read{};
  fromFields(nlohmann::json::parse(toFields(value).dump()), read);
  return read;
}

TEST(Fields, KeepEveryBitOfANumber) {
  using Limits = std::numeric_limits<double>;
  for (const double number :
       {0.0, -0.0, 1.0, 0.1, 1.0 / 3, -2e-308, Limits::denorm_min(), Limits::max(), Limits::min(),
        Limits::infinity(), -Limits::infinity(), Limits::quiet_NaN(), -Limits::quiet_NaN()}) {
    const double read = thereAndBack(number);
    EXPECT_EQ(std::bit_cast<std::uint64_t>(read), std::bit_cast<std::uint64_t>(number)) << number;
  }
  std::mt19937_64 random(1);
  for (int i = 0; i < 10'000; ++i) {
    const std::uint64_t bits = random();
    EXPECT_EQ(std::bit_cast<std::uint64_t>(thereAndBack(std::bit_cast<double>(bits))), bits);
  }
}

TEST(Fields, KeepStructures) {
  const Outer outer{"word \"\xC3\xA4\"", Inner{0.1, {1, -2}}, {{0.2, {3, 4}}, {}}, {7, 1ULL << 63}};
  const Outer read = thereAndBack(outer);
  EXPECT_EQ(read.word, outer.word);
  ASSERT_TRUE(read.maybe);
  EXPECT_EQ(read.maybe->number, 0.1);
  EXPECT_EQ(read.maybe->pair, outer.maybe->pair);
  ASSERT_EQ(read.list.size(), 2U);
  EXPECT_EQ(read.list[0].number, 0.2);
  EXPECT_EQ(read.numbers, outer.numbers);
  EXPECT_FALSE(thereAndBack(Outer{}).maybe);
}

TEST(Fields, RefuseWhatTheyHaveNotWritten) {
  Inner inner;
  EXPECT_ANY_THROW(fromFields(nlohmann::json::parse("[1]"), inner));
  EXPECT_ANY_THROW(fromFields(nlohmann::json::parse("{}"), inner));
  EXPECT_ANY_THROW(fromFields(nlohmann::json::parse(R"(["inf", [1, 2]])"), inner));
  EXPECT_ANY_THROW(fromFields(nlohmann::json::parse(R"([null, [1, 2]])"), inner));
}

}  // namespace
}  // namespace hapticd::tools

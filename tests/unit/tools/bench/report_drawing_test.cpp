// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/engine/report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "tools/lib/plot/gnuplot.h"

namespace hapticd::tools {
namespace {

struct Line {
  std::string law;
  int delay_ticks = 0;
  Figure error_n;
};

std::size_t countOf(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

Report reportOf(const std::vector<Line>& lines) {
  Report report;
  report.table("limits", "", rowsOf(lines, [](const Line& line) {
                 return Row{{"/law", "law", 0, line.law},
                            {"/delay_ticks", "t_d ms", 0, line.delay_ticks},
                            {"/error_n", "error, mN", 1, line.error_n, 1000}};
               }));
  return report;
}

TEST(ReportDrawing, ShowsEveryNumberOfRandomTables) {
  std::mt19937 random(1);
  for (int round = 0; round < 100; ++round) {
    std::vector<Line> rows;
    std::size_t numbers = 0;
    const int count = std::uniform_int_distribution(1, 40)(random);
    for (int i = 0; i < count; ++i) {
      Figure error;
      if (std::bernoulli_distribution(0.7)(random))
        error = std::uniform_real_distribution(0.001, 0.002)(random);
      if (error.number()) ++numbers;
      rows.push_back({"surface", i, std::move(error)});
    }
    const std::string script = reportOf(rows).drawing("picture.svg");
    EXPECT_EQ(numbers > 0 ? 2U : 1U, countOf(script, "\nplot "));
    const std::size_t begin = script.find("$p0_1 << END\n");
    ASSERT_EQ(numbers > 0, begin != std::string::npos);
    if (numbers == 0) continue;
    const std::string data = script.substr(begin, script.find("END\nset", begin) - begin);
    EXPECT_EQ(numbers, countOf(data, "\n") - 1);
  }
}

TEST(ReportDrawing, NamesRowsByTheirWordsAndByNumbersWhereWordsAreAlike) {
  const std::string script =
      reportOf({{"surface", 1, 0.5}, {"surface", 2, 0.5}, {"proxy's", 1, 0.5}}).drawing("picture.png");
  EXPECT_NE(std::string::npos, script.find("'surface, 1' 0, 'surface, 2' 1, 'proxy''s, 1' 2"));
  EXPECT_NE(std::string::npos, reportOf({{"surface", 1, 0.5}, {"proxy", 1, 0.5}})
                                   .drawing("picture.png")
                                   .find("'surface' 0, 'proxy' 1"));
}

TEST(ReportDrawing, HasLogarithmicAxesOnlyForWideRangesOfPositiveNumbers) {
  const auto logarithmic = [](double first, double second) {
    return countOf(reportOf({{"a", 1, first}, {"b", 1, second}}).drawing("picture.png"), "\nset logscale x");
  };
  EXPECT_EQ(1U, logarithmic(0.001, 1));
  EXPECT_EQ(0U, logarithmic(0.1, 1));
  EXPECT_EQ(0U, logarithmic(0, 1));
  EXPECT_EQ(0U, logarithmic(-0.001, 1));
}

TEST(ReportDrawing, MakesPicturesOfEveryKind) {
  const Report report = reportOf({{"surface", 1, 0.5}, {"it's a proxy", 2, 0.001}});
  for (const auto& [file, magic] :
       {std::pair("a.png", "\x89PNG"), std::pair("a.svg", "<?xml"), std::pair("a.pdf", "%PDF")}) {
    const auto picture = drawnByGnuplot(report.drawing(file), "");
    ASSERT_TRUE(picture) << file << picture.error().text();
    EXPECT_TRUE(picture->starts_with(magic)) << file;
    EXPECT_GT(picture->size(), 1000U) << file;
  }
}

TEST(ReportDrawing, LetsAStudyDrawItself) {
  Report report = reportOf({{"surface", 1, 0.5}});
  report.drawAs([](const std::filesystem::path& image) { return "own script for " + image.string(); });
  EXPECT_EQ("own script for a.svg", report.drawing("a.svg"));
}

}  // namespace
}  // namespace hapticd::tools

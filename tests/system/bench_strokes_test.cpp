// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd {
namespace {

using nlohmann::json;

TEST(BenchStrokes, ReportsEveryFigureForPeopleAndForPrograms) {
  const test::TemporaryFolder folder;
  const std::string report = (folder.path() / "strokes.json").string();
  const test::Finished finished =
      test::runToEnd({HAPTICBENCH_PROGRAM, "strokes", "--quick", "--json", report});
  ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
  EXPECT_EQ(finished.errors, "");
  for (const char* part : {"proxy", "surface", "auto", "plane0", "rod40", "over_edge", "requirements"}) {
    EXPECT_NE(finished.output.find(part), std::string::npos) << part;
  }

  std::ifstream file(report);
  const json document = json::parse(file);
  std::set<std::string> noises;
  for (const json& row : document.at("rows")) {
    noises.insert(row.at("noise").get<std::string>());
    EXPECT_EQ(row.at("strokes"), 1);
    EXPECT_GT(row.at("contact_ticks").get<int>(), 0);
    EXPECT_GT(row.at("free_ticks").get<int>(), 0);
    EXPECT_EQ(row.contains("end_mm"), row.at("scene") == "over_edge");
    EXPECT_EQ(row.at("error_by_floor").is_null(), row.at("noise") == "none");
  }
  EXPECT_EQ(noises, (std::set<std::string>{"none", "sensor", "harsh"}));
  EXPECT_EQ(document.at("rows").size(), 3U * 3U * 3U);  // scenes, noises, laws
  EXPECT_FALSE(document.at("requirements").empty());
}

TEST(BenchStrokes, EndsWithAStatusOfItsOwnWhereARequirementIsNotKeptAndThatIsRequested) {
  // No law looks farther ahead than 0.1 s; what a camera shows 0.2 s late is 30 mm or 15 N away at 0.3 m/s.
  std::vector<std::string> words{
      HAPTICBENCH_PROGRAM, "strokes", "--scenes", "moving0.3", "--laws",    "proxy",
      "--distances",       "1",       "--noises", "none",      "--latency", "200"};
  EXPECT_EQ(test::runToEnd(words).ending, test::exitedWith(0));
  words.emplace_back("--check");
  EXPECT_EQ(test::runToEnd(words).ending, test::exitedWith(1));
}

TEST(BenchStrokes, RefusesASceneThatItDoesNotKnowAndNamesTheOption) {
  const test::Finished finished = test::runToEnd({HAPTICBENCH_PROGRAM, "strokes", "--scenes", "dragon"});
  EXPECT_EQ(finished.ending, test::exitedWith(64));
  EXPECT_NE(finished.errors.find("--scenes"), std::string::npos);
}

}  // namespace
}  // namespace hapticd

// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd {
namespace {

using nlohmann::json;

TEST(BenchAccuracy, ReportsEveryLawForPeopleAndForPrograms) {
  const test::TemporaryFolder folder;
  const std::string report = (folder.path() / "accuracy.json").string();
  const test::Finished finished =
      test::runToEnd({HAPTICBENCH_PROGRAM, "accuracy", "--quick", "--json", report});
  ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
  EXPECT_EQ(finished.errors, "");
  for (const char* part :
       {"nearest_springs", "smooth_springs", "proxy", "surface", "all scenes", "requirements"}) {
    EXPECT_NE(finished.output.find(part), std::string::npos) << part;
  }

  std::ifstream file(report);
  const json document = json::parse(file);
  std::set<std::string> laws;
  for (const json& row : document.at("rows")) {
    laws.insert(row.at("law").get<std::string>());
    EXPECT_GT(row.at("against_surface").at("samples").get<int>(), 0);
    EXPECT_EQ(row.at("pushes"), 1);
  }
  EXPECT_EQ(laws.size(), 4U);
  EXPECT_EQ(document.at("rows").size(),
            2U * 2U * (2U * 3U + 1U));  // scenes, noises, laws with and without filter, surface
  EXPECT_FALSE(document.at("requirements").empty());
}

TEST(BenchAccuracy, MeasuresOnlyWhatIsChosen) {
  const test::TemporaryFolder folder;
  const std::string report = (folder.path() / "accuracy.json").string();
  const test::Finished finished =
      test::runToEnd({HAPTICBENCH_PROGRAM, "accuracy", "--quick", "--scenes", "bowl", "--laws", "proxy",
                      "--distances", "0.8", "--noises", "quantised", "--filters", "off", "--json", report});
  ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
  std::ifstream file(report);
  const json rows = json::parse(file).at("rows");
  ASSERT_EQ(rows.size(), 1U);
  for (const json& row : rows) {
    EXPECT_EQ(row.at("scene"), "bowl");
    EXPECT_EQ(row.at("law"), "proxy");
    EXPECT_EQ(row.at("noise"), "quantised");
    EXPECT_DOUBLE_EQ(row.at("distance_m").get<double>(), 0.8);
  }
  EXPECT_EQ(rows.at(0).at("filtered"), false);
}

TEST(BenchAccuracy, RefusesASceneThatItDoesNotKnowAndNamesTheOption) {
  const test::Finished finished = test::runToEnd({HAPTICBENCH_PROGRAM, "accuracy", "--scenes", "dragon"});
  EXPECT_EQ(finished.ending, test::exitedWith(64));
  EXPECT_NE(finished.errors.find("--scenes"), std::string::npos);
}

TEST(BenchAccuracy, SaysSoWhereTheReportCannotBeWritten) {
  const test::Finished finished =
      test::runToEnd({HAPTICBENCH_PROGRAM, "accuracy", "--quick", "--scenes", "plane", "--laws",
                      "nearest_springs", "--json", "/nowhere/report.json"});
  EXPECT_EQ(finished.ending, test::exitedWith(73));
  EXPECT_NE(finished.errors.find("/nowhere/report.json"), std::string::npos);
}

}  // namespace
}  // namespace hapticd

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

TEST(BenchOcclusion, ReportsPassagesEntriesAndLimitsForPeopleAndForPrograms) {
  const test::TemporaryFolder folder;
  const std::string report = (folder.path() / "occlusion.json").string();
  const test::Finished finished =
      test::runToEnd({HAPTICBENCH_PROGRAM, "occlusion", "--quick", "--json", report});
  ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
  EXPECT_EQ(finished.errors, "");
  EXPECT_NE(finished.output.find("requirements"), std::string::npos);

  std::ifstream file(report);
  const json document = json::parse(file);
  std::set<std::string> laws;
  for (const json& row : document.at("passages")) {
    laws.insert(row.at("law").get<std::string>());
    EXPECT_EQ(row.at("passages"), 1);
  }
  EXPECT_EQ(laws, (std::set<std::string>{"auto", "proxy", "surface"}));
  EXPECT_EQ(document.at("passages").size(), 3U * 2U * 2U);  // laws, hands, gaps
  for (const json& row : document.at("entries")) EXPECT_GT(row.at("ticks_inside"), 0) << row;
  EXPECT_EQ(document.at("near").size(), 3U * 3U);  // laws, speeds
  for (const json& row : document.at("pushes")) EXPECT_GT(row.at("pushes"), 0) << row;
  EXPECT_FALSE(document.at("requirements").empty());
}

TEST(BenchOcclusion, MeasuresOnlyWhatIsChosen) {
  const test::TemporaryFolder folder;
  const std::string report = (folder.path() / "occlusion.json").string();
  const test::Finished finished =
      test::runToEnd({HAPTICBENCH_PROGRAM, "occlusion", "--quick", "--parts", "passages", "--laws", "proxy",
                      "--hands", "stroking", "--gaps", "150", "--json", report});
  ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
  std::ifstream file(report);
  const json document = json::parse(file);
  ASSERT_EQ(document.at("passages").size(), 1U);
  EXPECT_EQ(document.at("passages").at(0).at("hand"), "stroking");
  EXPECT_DOUBLE_EQ(document.at("passages").at(0).at("gap_m").get<double>(), 0.15);
  EXPECT_TRUE(document.at("entries").empty());
}

TEST(BenchOcclusion, RefusesAHandThatItDoesNotKnowAndNamesTheOption) {
  const test::Finished finished = test::runToEnd({HAPTICBENCH_PROGRAM, "occlusion", "--hands", "third"});
  EXPECT_EQ(finished.ending, test::exitedWith(64));
  EXPECT_NE(finished.errors.find("--hands"), std::string::npos);
}

}  // namespace
}  // namespace hapticd

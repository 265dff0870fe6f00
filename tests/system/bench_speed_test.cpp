// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd {
namespace {

using nlohmann::json;

// A force below 20 N summed over 100 terms in double precision is off by about 100 * 20 N * 2^-52 = 5e-13 N;
// ten times that is still far from any wrong choice of a point, which costs 1e-3 N and more.
constexpr double kRounding_n = 5e-12;

TEST(BenchSpeed, ReportsForcesThatAreTheBruteForceUpToRoundingBesideTheirTimes) {
  const test::TemporaryFolder folder;
  const std::string report = (folder.path() / "speed.json").string();
  const test::Finished finished =
      test::runToEnd({HAPTICBENCH_PROGRAM, "speed", "--positions", "100", "--frames", "3", "--recordings",
                      (folder.path() / "none").string(), "--json", report});
  ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
  EXPECT_NE(finished.output.find("nanoflann tree"), std::string::npos);
  EXPECT_NE(finished.errors.find("no recordings"), std::string::npos);

  std::ifstream file(report);
  const json document = json::parse(file);
  ASSERT_EQ(document.at("scenes").size(), 1);
  const json& scene = document.at("scenes").front();
  for (const char* positions : {"force_scattered", "force_path"}) {
    for (const std::size_t ours : {0U, 1U}) {  // reach only, whole frame
      const json& row = scene.at(positions).at(ours);
      EXPECT_LT(row.at("largest_force_error_n").get<double>(), kRounding_n) << positions << row.at("what");
      EXPECT_GT(row.at("median_us").get<double>(), 0) << positions << row.at("what");
    }
  }
}

TEST(BenchSpeed, RefusesWhatIsOutOfRangeAndNamesIt) {
  const test::Finished finished = test::runToEnd({HAPTICBENCH_PROGRAM, "speed", "--positions", "1"});
  EXPECT_EQ(finished.ending, test::exitedWith(64));
  EXPECT_NE(finished.errors.find("--positions"), std::string::npos);
}

}  // namespace
}  // namespace hapticd

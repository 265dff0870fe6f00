// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd {
namespace {

TEST(BenchCameras, ReportsTheCostOfFramesOfEachSize) {
  const test::TemporaryFolder folder;
  const std::string report = (folder.path() / "cameras.json").string();
  const test::Finished finished =
      test::runToEnd({HAPTICBENCH_PROGRAM, "cameras", "--quick", "--json", report});
  ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
  EXPECT_NE(finished.output.find("tree/reach"), std::string::npos);
  std::ifstream stream(report);
  const auto rows = nlohmann::json::parse(stream).at("rows");
  std::set<std::string> cameras;
  for (const auto& row : rows) {
    cameras.insert(row.at("camera").get<std::string>());
    EXPECT_GT(row.at("pixels_in_reach"), 100);
    EXPECT_GT(row.at("reach_ns"), 0);
    EXPECT_GT(row.at("surface_ns"), 0);
    EXPECT_GT(row.at("tree_ns"), row.at("reach_ns"));
  }
  EXPECT_EQ(cameras.size(), 6U);
}

}  // namespace
}  // namespace hapticd

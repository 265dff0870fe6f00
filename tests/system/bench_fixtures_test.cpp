// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd {
namespace {

TEST(BenchFixtures, ReportsTheTimesOfTicksWithAndWithoutThem) {
  const test::TemporaryFolder folder;
  const std::string report = (folder.path() / "fixtures.json").string();
  const test::Finished finished =
      test::runToEnd({HAPTICBENCH_PROGRAM, "fixtures", "--quick", "--json", report});
  ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
  EXPECT_NE(finished.output.find("more, p99.9"), std::string::npos);
  std::ifstream stream(report);
  const auto rows = nlohmann::json::parse(stream).at("rows");
  ASSERT_EQ(rows.size(), 7U);
  for (const auto& row : rows) {
    EXPECT_GT(row.at("plain").at("median_ns"), 0);
    EXPECT_GE(row.at("added").at("p999_ns"), row.at("added").at("median_ns"));
    const std::string scene = row.at("scene");
    if (scene == "nothing" || scene == "apart") {
      EXPECT_EQ(row.at("acting_percent"), 0) << scene;
    } else {
      EXPECT_GT(row.at("acting_percent"), 5) << scene << ": the HIP meets what is measured";
    }
  }
}

}  // namespace
}  // namespace hapticd

// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd {
namespace {

using nlohmann::json;

// "In closed loop, every law is stable wherever the theory says a spring of that stiffness is, within 10 %,
// or the deviation is explained by measurement."
constexpr double kAllowed = 0.1;

TEST(BenchStability, FindsEachLawAsStableAsTheTheorySaysOrExplainsWhyNot) {
  const test::TemporaryFolder folder;
  const std::string report = (folder.path() / "stability.json").string();
  const test::Finished finished =
      test::runToEnd({HAPTICBENCH_PROGRAM, "stability", "--quick", "--json", report});
  ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;

  std::ifstream file(report);
  const json document = json::parse(file);
  ASSERT_EQ(document.at("limits").size(), 5 * 2);  // laws and the reference, delays
  for (const json& limit : document.at("limits")) {
    const double ratio =
        limit.at("found_n_per_m").get<double>() / limit.at("eigenvalue_n_per_m").get<double>();
    const std::string why = limit.at("explanation");
    EXPECT_TRUE(std::abs(ratio - 1) <= kAllowed || (!why.empty() && !why.starts_with("NOT")))
        << limit.at("law") << " " << ratio << " " << why;
    const bool constrains = limit.at("law") == "proxy" || limit.at("law") == "surface";
    EXPECT_TRUE(!constrains || std::abs(ratio - 1) <= kAllowed) << limit.at("law") << " " << ratio;
  }
}

TEST(BenchStability, RefusesAnUnknownLawAndNamesTheKnownOnes) {
  const test::Finished finished = test::runToEnd({HAPTICBENCH_PROGRAM, "stability", "--laws", "springs"});
  EXPECT_EQ(finished.ending, test::exitedWith(64));
  EXPECT_NE(finished.errors.find("nearest_springs"), std::string::npos);
}

}  // namespace
}  // namespace hapticd

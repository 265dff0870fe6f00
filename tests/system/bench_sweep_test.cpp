// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd {
namespace {

using nlohmann::json;

json contentOf(const std::string& file) {
  std::ifstream stream(file);
  return json::parse(stream);
}

TEST(BenchSweep, WritesPartsThatMergeOnlyWhenAllAreThere) {
  const test::TemporaryFolder folder;
  const auto file = [&folder](const char* name) { return (folder.path() / name).string(); };
  for (const auto& [shard, name] : {std::pair{"1/2", "a.json"}, std::pair{"2/2", "b.json"}}) {
    const test::Finished part = test::runToEnd({HAPTICBENCH_PROGRAM, "sweep", "--quick", "--recordings",
                                                file("none"), "--shard", shard, "--json", file(name)});
    ASSERT_EQ(part.ending, test::exitedWith(0)) << part.errors;
    EXPECT_NE(part.errors.find("no recordings"), std::string::npos);
  }
  const test::Finished merged = test::runToEnd(
      {HAPTICBENCH_PROGRAM, "sweep", "--merge", file("b.json"), file("a.json"), "--json", file("all.json")});
  ASSERT_EQ(merged.ending, test::exitedWith(0)) << merged.errors;
  EXPECT_NE(merged.output.find("the paper's"), std::string::npos);
  EXPECT_EQ(contentOf(file("all.json")).at("points").size(),
            contentOf(file("a.json")).at("points").size() + contentOf(file("b.json")).at("points").size());

  const test::Finished alone = test::runToEnd({HAPTICBENCH_PROGRAM, "sweep", "--merge", file("a.json")});
  EXPECT_EQ(alone.ending, test::exitedWith(65));
  EXPECT_NE(alone.errors.find("missing: 2/2"), std::string::npos) << alone.errors;
}

TEST(BenchSweep, RefusesAShardThatIsNone) {
  const test::Finished finished = test::runToEnd({HAPTICBENCH_PROGRAM, "sweep", "--shard", "3/2"});
  EXPECT_EQ(finished.ending, test::exitedWith(64));
  EXPECT_NE(finished.errors.find("--shard"), std::string::npos);
}

}  // namespace
}  // namespace hapticd

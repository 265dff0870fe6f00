// SPDX-License-Identifier: Apache-2.0
// Studies of hapticbench divided into parts and joined again.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/file_content.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

struct Study {
  const char* name;
  std::vector<std::string> options;
};

class BenchParts : public testing::TestWithParam<Study> {
 protected:
  std::string file(const std::string& name) const { return (folder_.path() / name).string(); }
  /// Runs the study with its options and `more`.
  Finished measured(std::vector<std::string> more) const {
    more.insert(more.begin(), GetParam().options.begin(), GetParam().options.end());
    return run(std::move(more));
  }
  /// Runs the study with `arguments` only.
  static Finished run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {HAPTICBENCH_PROGRAM, GetParam().name});
    return runToEnd(arguments);
  }

 private:
  const TemporaryFolder folder_;
};

TEST_P(BenchParts, JoinToTheBytesOfTheUndividedRun) {
  const Finished undivided = measured({"--json", file("undivided.json")});
  ASSERT_EQ(undivided.ending, exitedWith(0)) << undivided.errors;
  std::vector<std::string> join{"--join"};
  for (const std::string number : {"3", "1", "2"}) {
    join.push_back(file("part" + number + ".json"));
    const Finished part = measured({"--part", number + "/3", "--json", join.back()});
    ASSERT_EQ(part.ending, exitedWith(0)) << part.errors;
    EXPECT_TRUE(part.output.starts_with("part " + number + "/3: ")) << part.output;
  }
  join.insert(join.end(), {"--json", file("joined.json")});
  const Finished joined = run(join);
  ASSERT_EQ(joined.ending, exitedWith(0)) << joined.errors;
  EXPECT_EQ(joined.output, undivided.output);
  EXPECT_EQ(contentOf(file("joined.json")), contentOf(file("undivided.json")));

  const Finished alone = run({"--join", file("part1.json")});
  EXPECT_EQ(alone.ending, exitedWith(65));
  EXPECT_NE(alone.errors.find("missing: 2/3 3/3"), std::string::npos) << alone.errors;
}

INSTANTIATE_TEST_SUITE_P(
    Studies, BenchParts,
    testing::Values(Study{"accuracy",
                          {"--quick", "--noises", "none,harsh", "--laws", "nearest_springs,surface"}},
                    Study{"stability", {"--quick", "--delays", "0,2,5", "--laws", "reference,proxy"}}),
    [](const auto& parameter) { return std::string(parameter.param.name); });

TEST(BenchPart, IsRefusedWithAWrongNumberWithoutAFileAndTogetherWithJoin) {
  const auto errors = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {HAPTICBENCH_PROGRAM, "stability"});
    const Finished finished = runToEnd(arguments);
    EXPECT_EQ(finished.ending, exitedWith(64));
    return finished.errors;
  };
  for (const char* const wrong : {"0/4", "5/4", "x"}) {
    EXPECT_NE(errors({"--part", wrong, "--json", "never.json"}).find("N in 1..100000 and K in 1..N"),
              std::string::npos)
        << wrong;
  }
  EXPECT_NE(errors({"--part", "1/4"}).find("--part requires --json"), std::string::npos);
  EXPECT_NE(errors({"--join", "a.json", "--quick"}).find("--join excludes --quick"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::test

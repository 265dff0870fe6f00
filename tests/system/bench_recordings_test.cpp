// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/program.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace hapticd {
namespace {

using nlohmann::json;

TEST(BenchRecordings, ReportsEveryLawOnEverySessionOfAFolder) {
  const test::Recording recording("03_raw11_room_static/room_static.tar.xz");
  const test::TemporaryFolder folder;
  std::filesystem::create_directory_symlink(recording.path(), folder.path() / "a session");
  const std::string report = (folder.path() / "report.json").string();
  const test::Finished finished = test::runToEnd({HAPTICBENCH_PROGRAM, "recordings", "--quick",
                                                  "--recordings", folder.path().string(), "--json", report});
  ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
  EXPECT_EQ(finished.errors, "");
  EXPECT_NE(finished.output.find("requirements"), std::string::npos);
  std::ifstream file(report);
  const json document = json::parse(file);
  ASSERT_EQ(document.at("sessions").size(), 1U);
  const json& session = document.at("sessions").at(0);
  EXPECT_EQ(session.at("session"), "a session");
  ASSERT_FALSE(session.at("surfaces").empty());
  for (const json& row : session.at("surfaces")) {
    EXPECT_GT(row.at("fit_error_n").get<double>(), 0) << row;
    EXPECT_GT(row.at("stroke").at("ticks"), 0) << row;
    EXPECT_GT(row.at("still").at("new_frames"), 0) << row;
  }
  EXPECT_FALSE(document.at("requirements").empty());
}

TEST(BenchRecordings, SaysSoWhereThereAreNone) {
  const test::TemporaryFolder folder;
  const test::Finished finished =
      test::runToEnd({HAPTICBENCH_PROGRAM, "recordings", "--recordings", folder.path().string()});
  EXPECT_EQ(finished.ending, test::exitedWith(66));
  EXPECT_NE(finished.errors.find("--recordings"), std::string::npos);
}

}  // namespace
}  // namespace hapticd

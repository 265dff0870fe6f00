// SPDX-License-Identifier: Apache-2.0
#include "config/base/whole_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <iterator>

#include "tests/support/temporary_folder.h"

namespace hapticd::tools {
namespace {

namespace fs = std::filesystem;

std::ptrdiff_t filesIn(const fs::path& folder) {
  return std::distance(fs::directory_iterator(folder), {});
}

TEST(WholeFile, NeverReplacesWithoutBeingAskedTo) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.write("picture", "old");
  const auto refused = base::writeWholeFile(file, "new", base::IfExists::refuse);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().remedy.find("--force"), std::string::npos);
  EXPECT_EQ(fs::file_size(file), 3U);
  ASSERT_TRUE(base::writeWholeFile(file, "newer", base::IfExists::replace));
  EXPECT_EQ(fs::file_size(file), 5U);
  EXPECT_EQ(filesIn(folder.path()), 1);
}

TEST(WholeFile, DoesNotReplaceWhatAppearedMeanwhile) {
  const test::TemporaryFolder folder;
  auto whole = base::WholeFile::create(folder.path() / "rows");
  ASSERT_TRUE(whole);
  ASSERT_TRUE(whole->append("ours"));
  const fs::path theirs = folder.write("rows", "theirs");
  const auto finished = whole->finish();
  ASSERT_FALSE(finished);
  EXPECT_NE(finished.error().text().find("exists already"), std::string::npos) << finished.error().text();
  EXPECT_EQ(fs::file_size(theirs), 6U);
}

TEST(WholeFile, LeavesNothingBehindWhenItFails) {
  const test::TemporaryFolder folder;
  EXPECT_FALSE(base::writeWholeFile(folder.path() / "no" / "file", "bytes", base::IfExists::refuse));
  fs::create_directory(folder.path() / "folder");
  EXPECT_FALSE(base::writeWholeFile(folder.path() / "folder", "bytes", base::IfExists::replace));
  {
    auto never_finished = base::WholeFile::create(folder.path() / "file");
    ASSERT_TRUE(never_finished);
    ASSERT_TRUE(never_finished->append("half"));
    EXPECT_EQ(filesIn(folder.path()), 2);
  }
  EXPECT_EQ(filesIn(folder.path()), 1);
}

TEST(WholeFile, IsReadByThoseWhoMayReadOtherFiles) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "picture";
  const mode_t before = ::umask(0022);
  const auto written = base::writeWholeFile(file, "bytes", base::IfExists::refuse);
  ::umask(before);
  ASSERT_TRUE(written);
  struct stat status {};
  ASSERT_EQ(::stat(file.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0644U);
}

}  // namespace
}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#include "config/base/file_content.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cerrno>

#include "tests/support/temporary_folder.h"

namespace hapticd::config {
namespace {

using Reason = base::FileFault::Reason;

TEST(FileContent, IsAllOfTheFileUpToTheLongestAllowed) {
  const test::TemporaryFolder folder;
  const std::string long_text(200'000, 'x');
  EXPECT_EQ(base::fileContent(folder.write("a", long_text), {.longest = 200'000}).value_or(""), long_text);
  EXPECT_EQ(base::fileContent(folder.write("b", ""), {.longest = 0}).value_or("?"), "");
  const auto longer = base::fileContent(folder.write("c", long_text + "x"), {.longest = 200'000});
  ASSERT_FALSE(longer);
  EXPECT_EQ(longer.error().reason, Reason::too_long);
  EXPECT_EQ(longer.error().text(), "is longer than 200000 bytes");
}

// Without a writer, opening a pipe for reading waits forever; the test's time limit would end it.
TEST(FileContent, OfAPipeIsRefusedWithoutWaitingWhereARegularFileIsRequired) {
  const test::TemporaryFolder folder;
  const std::filesystem::path pipe = folder.path() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::filesystem::path& file : {pipe, std::filesystem::path("/dev/zero")}) {
    const auto content = base::fileContent(file, {.longest = 10});
    ASSERT_FALSE(content) << file;
    EXPECT_EQ(content.error().text(), "is not a regular file");
  }
}

TEST(FileContent, OfADeviceIsReadWhereAnyKindIsAllowed) {
  EXPECT_EQ(base::fileContent("/dev/null", {.longest = 10, .kind = base::FileKind::any}).value_or("?"), "");
}

TEST(FileContent, OfALinkIsReadUnlessLinksAreNotFollowed) {
  const test::TemporaryFolder folder;
  std::filesystem::create_symlink(folder.write("a", "text"), folder.path() / "link");
  EXPECT_EQ(base::fileContent(folder.path() / "link", {.longest = 10}).value_or("?"), "text");
  const auto refused = base::fileContent(folder.path() / "link", {.longest = 10, .follow_link = false});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().error_number, ELOOP);
}

TEST(FileContent, OfAFolderOrOfNothingIsNone) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(base::fileContent(folder.path(), {.longest = 10}).error().text(),
            "cannot be read: Is a directory");
  EXPECT_EQ(base::fileContent(folder.path() / "none", {.longest = 10}).error().error_number, ENOENT);
}

}  // namespace
}  // namespace hapticd::config

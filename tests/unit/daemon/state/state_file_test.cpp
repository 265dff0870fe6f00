// SPDX-License-Identifier: Apache-2.0
// Small files that are replaced as a whole.
#include "daemon/state/state_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>

#include "tests/support/temporary_folder.h"

namespace hapticd::daemon {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> namesIn(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
  return names;
}

std::string contentOf(const fs::path& file) {
  const auto content = readStateFile(file);
  EXPECT_TRUE(content && *content) << file;
  return content && *content ? **content : "";
}

TEST(StateFile, IsReplacedAsAWholeAndLeavesNothingBeside) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "a";
  ASSERT_TRUE(replaceFile(file, "first, which is longer"));
  ASSERT_TRUE(replaceFile(file, "second"));
  EXPECT_EQ(contentOf(file), "second");
  EXPECT_EQ(namesIn(folder.path()), std::vector<std::string>{"a"});
}

TEST(StateFile, IsReplacedBesideWhatACrashHasLeft) {
  const test::TemporaryFolder folder;
  folder.write("a.new", "half of");
  ASSERT_TRUE(replaceFile(folder.path() / "a", "whole"));
  EXPECT_EQ(namesIn(folder.path()), std::vector<std::string>{"a"});
}

TEST(StateFile, MakesTheFolderThatIsMissing) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "state" / "profiles" / "a";
  ASSERT_TRUE(replaceFile(file, "content"));
  EXPECT_EQ(contentOf(file), "content");
}

TEST(StateFile, DoesNotWriteThroughALink) {
  const test::TemporaryFolder folder;
  const fs::path other = folder.write("other", "untouched");
  fs::create_symlink(other, folder.path() / "a");
  fs::create_symlink(other, folder.path() / "a.new");
  ASSERT_TRUE(replaceFile(folder.path() / "a", "new"));
  EXPECT_EQ(contentOf(other), "untouched");
  EXPECT_EQ(contentOf(folder.path() / "a"), "new");
}

/// No file may grow beyond some bytes, as on a full disk.
class FullDisk {
 public:
  FullDisk() {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = 8;
    std::signal(SIGXFSZ, SIG_IGN);
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, SIG_DFL);
  }

 private:
  rlimit before_{};
};

TEST(StateFile, KeepsWhatItHadWhenThereIsNoSpace) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.write("a", "old");
  {
    const FullDisk full;
    const auto replaced = replaceFile(file, "more than eight bytes");
    ASSERT_FALSE(replaced);
    EXPECT_NE(replaced.error().text().find(file.string()), std::string::npos);
  }
  EXPECT_EQ(contentOf(file), "old");
  EXPECT_EQ(namesIn(folder.path()), std::vector<std::string>{"a"});
}

TEST(StateFile, SaysWhatToDoWhereItsFolderCannotBe) {
  const test::TemporaryFolder folder;
  const auto replaced = replaceFile(folder.write("file", "") / "a", "x");
  ASSERT_FALSE(replaced);
  EXPECT_NE(replaced.error().remedy.find("state.folder"), std::string::npos);
}

TEST(StateFile, IsNothingWhereThereIsNone) {
  const test::TemporaryFolder folder;
  const auto content = readStateFile(folder.path() / "a");
  ASSERT_TRUE(content);
  EXPECT_FALSE(*content);
  EXPECT_TRUE(removeFile(folder.path() / "a"));
}

TEST(StateFile, IsNoLinkFolderOrPipeAndNotEndless) {
  const test::TemporaryFolder folder;
  fs::create_symlink(folder.write("other", "x"), folder.path() / "link");
  fs::create_directory(folder.path() / "folder");
  ASSERT_EQ(::mkfifo((folder.path() / "pipe").c_str(), 0600), 0);
  constexpr std::size_t kLongest = std::size_t{1} << 20;
  folder.write("long", std::string(kLongest + 1, 'x'));
  for (const char* name : {"link", "folder", "pipe", "long"}) {
    EXPECT_FALSE(readStateFile(folder.path() / name)) << name;
  }
  folder.write("longest", std::string(kLongest, 'x'));
  EXPECT_EQ(contentOf(folder.path() / "longest").size(), kLongest);
}

}  // namespace
}  // namespace hapticd::daemon

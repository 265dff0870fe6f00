// SPDX-License-Identifier: Apache-2.0
// Small files that are replaced as a whole, and the thread that waits for the disk.

#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstddef>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "daemon/state/state_file.h"
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
  folder.write("long", std::string(1024 * 1024 + 1, 'x'));
  for (const char* name : {"link", "folder", "pipe", "long"}) {
    EXPECT_FALSE(readStateFile(folder.path() / name)) << name;
  }
  folder.write("longest", std::string(1024 * 1024, 'x'));
  EXPECT_EQ(contentOf(folder.path() / "longest").size(), 1024U * 1024);
}

using test::TemporaryFolder;

TEST(StateLock, OneHolderAtATimeAndTheOtherIsToldWhoItIs) {
  const TemporaryFolder folder;
  const auto state = folder.path() / "made/state";
  auto first = StateLock::take(state);
  ASSERT_TRUE(first) << first.error().text();
  EXPECT_TRUE(first->held());
  const auto second = StateLock::take(state);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().where, state.string());
  EXPECT_NE(second.error().what.find("process " + std::to_string(::getpid())), std::string::npos)
      << second.error().text();
  EXPECT_FALSE(second.error().remedy.empty());
  EXPECT_TRUE(StateLock::take(folder.path() / "other")) << "another folder is free";
}

TEST(StateLock, CanBeTakenByNobodyElse) {
  using std::filesystem::perms;
  const TemporaryFolder folder;
  const auto lock = StateLock::take(folder.path());
  ASSERT_TRUE(lock && lock->held());
  EXPECT_EQ(std::filesystem::status(folder.path() / "hapticd.lock").permissions(),
            perms::owner_read | perms::owner_write);
}

TEST(StateLock, EndsWithItsHolder) {
  const TemporaryFolder folder;
  { ASSERT_TRUE(StateLock::take(folder.path())); }
  const auto next = StateLock::take(folder.path());
  ASSERT_TRUE(next) << next.error().text();
  EXPECT_TRUE(next->held());
}

TEST(StateLock, RemovesWhatAKilledProcessHasLeftOfAReplacement) {
  const TemporaryFolder folder;
  const char* const left[] = {"profiles/soft.yaml.new", "solids/a.solid.new"};
  const char* const kept[] = {"profiles/soft.yaml", "solids/a.solid", "solids/notes.new", "mine.yaml.new"};
  for (const char* name : {"profiles", "solids"}) std::filesystem::create_directory(folder.path() / name);
  for (const char* name : left) folder.write(name, "");
  for (const char* name : kept) folder.write(name, "");
  ASSERT_TRUE(StateLock::take(folder.path()));
  for (const char* name : left) EXPECT_FALSE(std::filesystem::exists(folder.path() / name)) << name;
  for (const char* name : kept) EXPECT_TRUE(std::filesystem::exists(folder.path() / name)) << name;
}

TEST(StateLock, AFolderThatCannotBeMadeIsNoError) {
  const TemporaryFolder folder;
  const auto file = folder.write("file", "");
  const auto lock = StateLock::take(file / "state");
  ASSERT_TRUE(lock) << lock.error().text();
  EXPECT_FALSE(lock->held());
}

TEST(StateLock, SaysNothingOfAHolderThatTheFileDoesNotName) {
  const TemporaryFolder folder;
  auto first = StateLock::take(folder.path());
  ASSERT_TRUE(first);
  folder.write("hapticd.lock", "\x1b[31m12");
  const auto second = StateLock::take(folder.path());
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().what, "another hapticd keeps its state there");
}

}  // namespace

namespace {

using Done = base::Result<void>;

TEST(StateWorker, DoesJobsInTheirOrderInAnotherThread) {
  std::vector<int> done;
  StateWorker worker;
  std::promise<void> gate;
  auto first = worker.run([&, opened = gate.get_future().share()] {
    opened.wait();
    done.push_back(1);
    return base::Result<std::thread::id>(std::this_thread::get_id());
  });
  auto second = worker.run([&] {
    done.push_back(2);
    return base::Result<std::size_t>(done.size());
  });
  EXPECT_EQ(second.wait_for(std::chrono::seconds(0)), std::future_status::timeout);  // behind the first
  gate.set_value();
  EXPECT_EQ(second.get().value(), 2U);
  EXPECT_NE(first.get().value(), std::this_thread::get_id());
  EXPECT_EQ(done, (std::vector<int>{1, 2}));
}

TEST(StateWorker, DoesWhatWaitsBeforeItEnds) {
  int done = 0;
  {
    StateWorker worker;
    for (int i = 0; i < 100; ++i)
      worker.run([&] {
        ++done;
        return Done();
      });
  }
  EXPECT_EQ(done, 100);
}

// If the end waited for the job it would never come: the job goes on only after it.
TEST(StateWorker, EndsThoughAJobDoesNotAndLeavesOutThoseBehindIt) {
  std::promise<void> gate;
  std::future<Done> blocked;
  std::future<Done> behind;
  {
    StateWorker worker(std::chrono::milliseconds(10));
    blocked = worker.run([opened = gate.get_future().share()] {
      opened.wait();
      return Done();
    });
    behind = worker.run([] { return Done(); });
  }
  EXPECT_THROW(behind.get(), std::future_error);
  gate.set_value();
  EXPECT_TRUE(blocked.get());
}

/// While it lives, the system provides no thread: no stack is that large.
class NoThreads {
 public:
  NoThreads() {
    ::pthread_getattr_default_np(&before_);
    pthread_attr_t huge = before_;
    ::pthread_attr_setstacksize(&huge, std::size_t{1} << 60);
    ::pthread_setattr_default_np(&huge);
  }
  ~NoThreads() { ::pthread_setattr_default_np(&before_); }

 private:
  pthread_attr_t before_;
};

// The thread that calls also answers clients and stops the box.
TEST(StateWorker, LeavesAJobUndoneForWhichThereIsNoThreadAndSaysSo) {
  StateWorker worker;
  bool done = false;
  const auto job = [&] {
    done = true;
    return Done();
  };
  {
    const NoThreads no_threads;
    const Done refused = worker.run(job).get();
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().text().find("thread state: cannot be started"), std::string::npos)
        << refused.error().text();
  }
  EXPECT_FALSE(done);
  EXPECT_TRUE(worker.run(job).get());
  EXPECT_TRUE(done);
}

}  // namespace
}  // namespace hapticd::daemon

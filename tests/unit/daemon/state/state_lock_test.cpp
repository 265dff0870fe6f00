// SPDX-License-Identifier: Apache-2.0
#include "daemon/state/state_lock.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.h"

namespace hapticd::daemon {
namespace {

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
}  // namespace hapticd::daemon

// SPDX-License-Identifier: Apache-2.0
#include "daemon/box_warnings.h"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace hapticd::daemon {
namespace {

TEST(IsolatedCpu, IsTheLastOneOfTheKernelsList) {
  test::TemporaryFolder folder;
  EXPECT_EQ(lastIsolatedCpu(folder.write("several", "1,4-7,12\n")), 12);
}

TEST(IsolatedCpu, IsNoneWhereNoneIsKeptFreeOrTheKernelDoesNotSay) {
  test::TemporaryFolder folder;
  EXPECT_EQ(lastIsolatedCpu(folder.write("none", "\n")), -1);
  EXPECT_EQ(lastIsolatedCpu(folder.write("odd", "all\n")), -1);
  EXPECT_EQ(lastIsolatedCpu(folder.path() / "absent"), -1);
}

TEST(IsolatedCpu, IsOneOfTheKernelsList) {
  test::TemporaryFolder folder;
  const auto file = folder.write("several", "1,4-7,12\n");
  for (const int cpu : {1, 4, 5, 7, 12}) EXPECT_TRUE(isIsolated(cpu, file)) << cpu;
  for (const int cpu : {-1, 0, 2, 3, 8, 11, 13}) EXPECT_FALSE(isIsolated(cpu, file)) << cpu;
  EXPECT_FALSE(isIsolated(0, folder.write("none", "\n")));
  EXPECT_FALSE(isIsolated(0, folder.path() / "absent"));
}

}  // namespace
}  // namespace hapticd::daemon

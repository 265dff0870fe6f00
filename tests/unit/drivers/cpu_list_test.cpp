// SPDX-License-Identifier: Apache-2.0
#include "drivers/base/cpus.h"

#include <gtest/gtest.h>

namespace hapticd::drivers {
namespace {

TEST(CpuList, ReadsTheKernelsForm) {
  EXPECT_EQ(parseCpuList(""), CpuSet{});
  EXPECT_EQ(parseCpuList("3"), CpuSet{3});
  EXPECT_EQ(parseCpuList("0-2,5,8-9"), (CpuSet{0, 1, 2, 5, 8, 9}));
}

TEST(CpuList, RefusesEverythingElse) {
  for (const char* text : {"x", "-1", "1-", "2-1", "1,,2", "(null)", "99999999", "1 2", "1-2-3"}) {
    EXPECT_EQ(parseCpuList(text), std::nullopt) << text;
  }
}

TEST(CpuList, WritesWhatItReads) {
  for (const char* text : {"", "0", "0-1", "0-2,5,8-9"}) EXPECT_EQ(cpuListText(*parseCpuList(text)), text);
}

}  // namespace
}  // namespace hapticd::drivers

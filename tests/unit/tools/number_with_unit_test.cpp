// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/base/number_with_unit.h"

#include <gtest/gtest.h>

namespace hapticd::tools {
namespace {

TEST(NumberWithUnit, IsThatInTheUnitOfTheParameter) {
  EXPECT_EQ(inUnit("800N/m", "N/m"), "800");
  EXPECT_EQ(inUnit("0.8 N/mm", "N/m"), "800");
  EXPECT_EQ(inUnit("5mm", "m"), "0.005");
  EXPECT_EQ(inUnit("7 mm", "m"), "0.007");
  EXPECT_EQ(inUnit("1e3m", "m"), "1e3");
  EXPECT_EQ(inUnit("-20ms", "s"), "-0.02");
  EXPECT_EQ(inUnit("180deg", "rad"), "3.141592653589793");
}

TEST(NumberWithUnit, LeavesOtherTextToTheDaemon) {
  for (const char* text :
       {"", "800", "1e-3", "text", "info", "nanometres", "N/m", "1,5", "1.5.2", "0x10", "1,5 m", "true", "-"})
    EXPECT_EQ(inUnit(text, "N/m"), text);
  EXPECT_EQ(inUnit("800 ", "N/m"), "800");
}

TEST(NumberWithUnit, SaysWhichUnitsArePossible) {
  const auto wrong = inUnit("800kg", "N/m");
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error(), "\"kg\" is not a unit that it takes; write the number in N/m, or with N/mm");
  const auto only = inUnit("3m", "px");
  ASSERT_FALSE(only);
  EXPECT_EQ(only.error(), "\"m\" is not a unit that it takes; write the number in px");
  const auto none = inUnit("8px", "");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error(), "has no unit; write 8");
}

}  // namespace
}  // namespace hapticd::tools

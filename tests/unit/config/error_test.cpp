// SPDX-License-Identifier: Apache-2.0
#include "config/base/error.h"

#include <gtest/gtest.h>

namespace hapticd::config {
namespace {

TEST(Error, TextJoinsThePartsThatAreThere) {
  EXPECT_EQ((base::Error{"demo.yaml:7", "is wrong", "mend it"}.text()), "demo.yaml:7: is wrong (mend it)");
  EXPECT_EQ((base::Error{"demo.yaml:7", "is wrong", ""}.text()), "demo.yaml:7: is wrong");
  EXPECT_EQ((base::Error{"", "is wrong", "mend it"}.text()), "is wrong (mend it)");
  EXPECT_EQ((base::Error{"", "is wrong", ""}.text()), "is wrong");
}

}  // namespace
}  // namespace hapticd::config

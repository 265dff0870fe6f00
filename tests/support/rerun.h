// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/program.h"

namespace hapticd::test {

inline constexpr const char* kRerunVariable = "HAPTICD_TEST_RERUN";

/// Returns which part of the test a process started by rerunThisTest() must run; empty in the test itself.
inline std::string_view rerunPart() {
  const char* const part = std::getenv(kRerunVariable);
  return part == nullptr ? std::string_view() : part;
}

/// Runs the current test again in a process of its own, for behaviour that ends the process or shows at its
/// end. `environment`: "NAME=value", in addition to that of a Program.
inline Finished rerunThisTest(const std::string& part, std::vector<std::string> environment = {}) {
  environment.push_back(std::string(kRerunVariable) + "=" + part);
  const testing::TestInfo& test = *testing::UnitTest::GetInstance()->current_test_info();
  return runToEnd(
      {"/proc/self/exe", std::string("--gtest_filter=") + test.test_suite_name() + "." + test.name()},
      {.environment = environment});
}

/// Reports what the current test cannot check on this machine or in this build, and why.
inline void reportNotChecked(std::string_view what_and_why) {
  std::cout << "[NOT CHECKED] " << what_and_why << std::endl;
}

}  // namespace hapticd::test

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cstdint>
#include <string>
#include <vector>

#include "tests/support/sanitizer.h"

namespace hapticd::test {

/// Runs each test once with every SIMD target that is built in and supported by this machine.
class EachSimdTarget : public ::testing::TestWithParam<std::int64_t> {
 protected:
  EachSimdTarget() {
    hwy::SetSupportedTargetsForTest(GetParam());
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
  ~EachSimdTarget() override {
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().DeInit();
  }
};

/// ThreadSanitizer finds little in single-threaded tests and takes ten times as long, so it runs the best
/// target only.
inline std::vector<std::int64_t> simdTargetsToTest() {
  std::vector<std::int64_t> targets = hwy::SupportedAndGeneratedTargets();
  if (kThreadSanitizer) targets.resize(1);
  return targets;
}

inline std::string simdTargetName(const ::testing::TestParamInfo<std::int64_t>& info) {
  return hwy::TargetName(info.param);
}

}  // namespace hapticd::test

#define HAPTICD_FOR_EACH_SIMD_TARGET(suite)                                                      \
  INSTANTIATE_TEST_SUITE_P(Simd, suite, ::testing::ValuesIn(hapticd::test::simdTargetsToTest()), \
                           hapticd::test::simdTargetName)

// SPDX-License-Identifier: Apache-2.0
// Subnormal numbers are kept by every thread that computes forces and by every SIMD target, so that no
// processor and no library of the process changes what small numbers become.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/unit/rt/subnormal_test.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep

#include <array>
#include <cstddef>

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::test::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// values[i] = factor * values[i] + addend, for a whole number of vectors of up to 16 lanes.
void multiplyAndAdd(float factor, float addend, std::array<float, 16>& values) {
  const hn::CappedTag<float, 16> tag;
  for (std::size_t i = 0; i < values.size(); i += hn::Lanes(tag)) {
    const auto product = hn::Mul(hn::Set(tag, factor), hn::LoadU(tag, values.data() + i));
    hn::StoreU(hn::Add(product, hn::Set(tag, addend)), tag, values.data() + i);
  }
}

}  // namespace hapticd::test::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <gtest/gtest.h>

#include <limits>
#include <thread>

#include "rt/base/realtime_thread.h"
#include "tests/support/flush_to_zero.h"
#include "tests/unit/rt/simd_targets.h"

namespace hapticd::test {
namespace {

HWY_EXPORT(multiplyAndAdd);

constexpr float kMinNormal = std::numeric_limits<float>::min();
constexpr float kMin = std::numeric_limits<float>::denorm_min();

class SubnormalNumbers : public EachSimdTarget {};

TEST_P(SubnormalNumbers, AreKeptByVectorsToTheLastBit) {
  std::array<float, 16> values{};
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = kMinNormal * static_cast<float>(i + 1);
  const std::array<float, 16> before = values;
  HWY_DYNAMIC_DISPATCH(multiplyAndAdd)(0.0625F, 3 * kMin, values);
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_EQ(values[i], before[i] * 0.0625F + 3 * kMin) << i;  // exact: only the exponent changes
    EXPECT_GT(values[i], 0.0F) << i;
  }
}

TEST(DefaultFloatingPoint, ReplacesWhatAThreadInheritsFromItsCreator) {
  std::thread([] {
    flushSubnormalsToZero();
    ASSERT_FALSE(keepsSubnormals());
    std::thread([] {
      EXPECT_FALSE(keepsSubnormals()) << "a thread would not inherit the environment";
      rt::useDefaultFloatingPoint();
      EXPECT_TRUE(keepsSubnormals());
    }).join();
  }).join();
}

HAPTICD_FOR_EACH_SIMD_TARGET(SubnormalNumbers);

}  // namespace
}  // namespace hapticd::test
#endif

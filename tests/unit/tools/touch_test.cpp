// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/touch.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr Vec3 kPlace{0.1, -0.2, -0.9};
constexpr double kPeriod_s = 0.05;

/// A touch by a hand that is at position(t) after t seconds.
Touch touchOf(const std::function<Vec3(double)>& position) {
  Touch touch;
  for (int reading = 0; !touch.isComplete(); ++reading) touch.add(position(reading * kPeriod_s));
  return touch;
}

TEST(Touch, LastsASecond) {
  EXPECT_EQ(Touch::kReadings * Touch::kPeriod.count(), 1000);
}

TEST(Touch, OfARestingHandIsTheMeanOfAllReadings) {
  std::mt19937_64 random(1);  // NOLINT(cert-msc51-cpp): the same each time
  std::normal_distribution<double> noise_m(0, 1e-4);
  Vec3 sum;
  const Touch touch = touchOf([&](double) {
    const Vec3 position = kPlace + Vec3{noise_m(random), noise_m(random), noise_m(random)};
    sum += position;
    return position;
  });
  EXPECT_TRUE(touch.isSteady()) << touch.spread_m();
  EXPECT_LT(norm(touch.mean_m_in_world() - (1.0 / Touch::kReadings) * sum), 1e-12);
}

TEST(Touch, OfAMovingHandIsNotSteady) {
  // 5 mm/s: within the few milliseconds that twenty answers take it would be 0.1 mm
  const Touch gliding = touchOf([](double t_s) { return kPlace + Vec3{0.005 * t_s, 0, 0}; });
  EXPECT_NEAR(gliding.spread_m(), 0.005 * 0.95 / 2, 1e-9);
  EXPECT_FALSE(gliding.isSteady());
  // one reading alone, 4 mm away: the mean moves by a twentieth of it
  const Touch leaping = touchOf([](double t_s) {
    return kPlace + Vec3{0, t_s > 0.49 && t_s < 0.51 ? 0.004 : 0, 0};
  });
  EXPECT_NEAR(leaping.spread_m(), 0.004 * 19 / 20, 1e-9);
  EXPECT_FALSE(leaping.isSteady());
}

}  // namespace
}  // namespace hapticd::tools

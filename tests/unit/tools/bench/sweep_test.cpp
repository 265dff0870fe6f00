// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <tuple>

#include "tools/hapticbench/sweep.h"
#include "tools/lib/parts/fields.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::tools {
namespace {

TEST(SweepGrid, IsThePapersGridForItsLawAndWithoutTheAxesThatOthersDoNotRead) {
  std::array<std::size_t, 4> counts{};
  std::size_t papers = 0;
  const auto points = pointsOf({});
  for (const SweepPoint& point : points) {
    ++counts[static_cast<std::size_t>(point.law)];
    papers += point.isPapers() ? 1U : 0U;
  }
  EXPECT_EQ(counts, (std::array<std::size_t, 4>{6 * 5 * 6, 5 * 6, 5, 5}));
  EXPECT_EQ(papers, 1U);
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_EQ(points[i].index, i);
}

TEST(SweepGrid, OfTheQuickSweepHoldsThePapersSetToo) {
  const auto points = pointsOf(SweepGrid::quick());
  EXPECT_EQ(std::count_if(points.begin(), points.end(), [](const SweepPoint& p) { return p.isPapers(); }), 1);
}

/// Whether the results are the same in all but the times.
bool sameButTime(const SweepResult& a, const SweepResult& b) {
  const auto numbers = [](const SweepResult& r) {
    return std::array{r.feel.rendered_stiffness_n_per_m,
                      r.feel.steepest_stiffness_n_per_m,
                      r.feel.pop_through_n,
                      r.feel.edge_m,
                      r.feel.smallest_ridge_m,
                      r.feel.stroke_h_m,
                      r.noise.median_n,
                      r.noise.largest_n,
                      r.stability_margin};
  };
  return a.point.index == b.point.index && numbers(a) == numbers(b) && a.noise.sites == b.noise.sites;
}

TEST(SweepResult, ReadsBackEveryNumberAsWritten) {
  SweepResult result;
  result.feel = {.rendered_stiffness_n_per_m = 1000.0 / 3,
                 .steepest_stiffness_n_per_m = 0.1,
                 .pop_through_n = -0.0,
                 .edge_m = 5e-324,
                 .smallest_ridge_m = 1e300 / 7,
                 .stroke_h_m = -0.005,
                 .median_force_us = 2.0 / 3};
  result.noise = {.median_n = 0.1, .largest_n = 0.2, .sites = 3};
  result.stability_margin = std::numeric_limits<double>::infinity();
  SweepResult read;
  fromFields(nlohmann::json::parse(toFields(result).dump()), read);
  EXPECT_TRUE(sameButTime(read, result));
  EXPECT_TRUE(std::signbit(read.feel.pop_through_n));
  EXPECT_EQ(read.feel.median_force_us, result.feel.median_force_us);
  result.feel.median_force_us.reset();
  fromFields(toFields(result), read);
  EXPECT_FALSE(read.feel.median_force_us);
}

/// The paper's law on a plane at 1 m with `count` nearest points: the largest F_N(h) and where it is.
double popThrough_n(double stiffness, double radius, int count) {
  const double a_squared = count / (std::numbers::pi * 594.214342 * 591.040537);
  double largest = 0;
  for (double h = 0; h < radius; h += 1e-5) {
    largest = std::max(largest, stiffness * h * (2 * radius / (h + std::sqrt(h * h + a_squared)) - 1));
  }
  return largest;
}

rt::LiveParameters lawOf(rt::ForceLaw law) {
  rt::LiveParameters parameters;
  parameters.law = law;
  return parameters;
}

TEST(FeelProbe, HasThePopThroughForceOfTheClosedForm) {
  FeelProbe probe(3);
  for (const auto& [stiffness, radius, count] :
       {std::tuple{500.0, 0.04, 100}, std::tuple{300.0, 0.03, 50}, std::tuple{700.0, 0.05, 300}}) {
    rt::LiveParameters parameters = lawOf(rt::ForceLaw::nearest_springs);
    parameters.force = {
        {.stiffness_n_per_m = stiffness, .radius_m = radius, .min_points = 10, .max_points = count}, {}};
    const double expected = popThrough_n(stiffness, radius, count);
    if (expected > kNoPopThrough_n) continue;
    // 0.1 % for the lattice of pixels, and the push looks every 0.25 mm at a rounded peak
    EXPECT_NEAR(probe.measure(parameters).pop_through_n, expected, 0.003 * expected)
        << stiffness << " " << count;
  }
}

TEST(FeelProbe, FindsConstraintLawsAsStiffAsSetAndWithoutPopThrough) {
  FeelProbe probe(1.15);
  for (const rt::ForceLaw law : {rt::ForceLaw::proxy, rt::ForceLaw::surface}) {
    const Feel feel = probe.measure(lawOf(law));
    EXPECT_NEAR(feel.rendered_stiffness_n_per_m, 500, 5) << static_cast<int>(law);
    EXPECT_EQ(feel.pop_through_n, kNoPopThrough_n) << static_cast<int>(law);
    // a ridge of 20 mm lifts the proxy by its height: 500 N/m * height > 7 % of 2.5 N from 0.35 mm on; one
    // unit of the depth, 0.05 mm, and the factor 1.15 between the heights tried
    // The quadratics that `surface` fits overshoot at the ends of a ridge.
    EXPECT_GT(feel.smallest_ridge_m, law == rt::ForceLaw::surface ? 0.00020 : 0.00030)
        << static_cast<int>(law);
    EXPECT_LT(feel.smallest_ridge_m, 0.00050) << static_cast<int>(law);
  }
}

/// A frame whose every measurement is `raw`.
std::unique_ptr<rt::DepthFrame> flatFrame(std::uint16_t raw) {
  auto frame = std::make_unique<rt::DepthFrame>();
  std::fill(frame->image().begin(), frame->image().end(), raw);
  frame->sequence = 1;
  return frame;
}

TEST(NoiseProbe, MeasuresTheDeviationOfAWallThatJumpsBetweenTwoPlaces) {
  // raw 757 and 758: walls at depths that differ by about 3.1 mm, in turn
  std::vector<BenchSequence> sequences(1);
  for (int i = 0; i < 10; ++i) {
    sequences[0].frames.push_back(flatFrame(i % 2 == 0 ? 757 : 758));
    sequences[0].frames.back()->sequence = static_cast<std::uint64_t>(i + 1);
  }
  const NoiseProbe probe(std::move(sequences), 2);
  ASSERT_EQ(probe.sites().size(), 2U);
  const rt::DepthModelParameters model;
  const auto depth = [&model](double raw) { return 1 / (model.a_per_m * raw + model.b_per_m); };
  EXPECT_NEAR(-probe.sites()[0].surface_m_in_world.z, depth(757.5), 1e-5);
  // the newest frame alone: a mean over several would follow only a part of the jumps
  rt::LiveParameters newest = lawOf(rt::ForceLaw::surface);
  newest.surface.fusion_frames = 1;
  const ForceNoise noise = probe.measure(newest, -0.008);
  EXPECT_EQ(noise.sites, 2U);
  // the force goes up and down by k times the distance of the walls: its deviation is half of that
  EXPECT_NEAR(noise.median_n, 500 * (depth(758) - depth(757)) / 2, 0.01);
}

TEST(NoiseProbe, MeasuresTheSameOfACameraThatDeliversDepth) {
  constexpr double kUnit_m = 0.002;
  const rt::DepthModelParameters camera = stereoCamera(424, 240, 90, 0.05, kUnit_m, 0.3, 4);
  std::vector<BenchSequence> sequences(1);
  for (int i = 0; i < 10; ++i) {
    auto& frame = sequences[0].frames.emplace_back(std::make_unique<rt::DepthFrame>());
    frame->camera = camera;
    frame->sequence = static_cast<std::uint64_t>(i + 1);
    std::ranges::fill(frame->image(), camera.raw_no_measurement);
    for (std::size_t row = 0; row < 240; ++row)
      std::fill_n(frame->raw + row * 448, 424, static_cast<std::uint16_t>(400 + i % 2));  // rows are padded
  }
  const NoiseProbe probe(std::move(sequences), 2);
  ASSERT_EQ(probe.sites().size(), 2U);
  // single precision of the disparity adds 1e-7 of the depth
  EXPECT_NEAR(-probe.sites()[0].surface_m_in_world.z, 0.801, 2e-6);
  rt::LiveParameters newest = lawOf(rt::ForceLaw::surface);
  newest.surface.fusion_frames = 1;
  const ForceNoise noise = probe.measure(newest, -0.008);
  EXPECT_EQ(noise.sites, 2U);
  // half of k times the step, less what rounding to the core's raw disparities takes off: one is 0.26 mm
  EXPECT_NEAR(noise.median_n, 500 * kUnit_m / 2, 500 * 0.00026 / 2);
}

TEST(DigestOf, ChangesWithOnePixel) {
  std::vector<BenchSequence> sequences(1);
  sequences[0].frames.push_back(flatFrame(700));
  const std::string before = digestOf(sequences);
  sequences[0].frames[0]->raw[1234] = 701;
  EXPECT_EQ(before.size(), 16U);
  EXPECT_NE(digestOf(sequences), before);
}

TEST(NoiseProbe, TakesNoSiteOnWhatMoves) {
  std::vector<BenchSequence> sequences(1);
  for (int i = 0; i < 10; ++i)
    sequences[0].frames.push_back(flatFrame(static_cast<std::uint16_t>(700 + 5 * i)));
  EXPECT_TRUE(NoiseProbe(std::move(sequences), 2).sites().empty());
}

TEST(Sweep, GivesAPointTheSameResultWhateverWasMeasuredBefore) {
  std::vector<BenchSequence> sequences;
  sequences.push_back(syntheticSequence(3));
  const NoiseProbe noise(std::move(sequences), 1);
  ASSERT_EQ(noise.sites().size(), 1U);
  const SweepSettings settings{.quick = true, .timed = false};
  const auto points = pointsOf(SweepGrid::quick());
  Sweep all(settings, noise);
  for (const std::size_t index : {3U, 14U, 25U, 36U}) {
    const SweepResult later = all.measure(points.at(index));
    const SweepResult alone = Sweep(settings, noise).measure(points.at(index));
    EXPECT_TRUE(sameButTime(later, alone)) << index;
    EXPECT_FALSE(alone.feel.median_force_us);
  }
}

TEST(SweepReport, MarksThePapersSetAndLeavesTheTimeBlankWhereItWasNotMeasured) {
  std::vector<SweepResult> results;
  for (const SweepPoint& point : pointsOf(SweepGrid::quick())) results.push_back({.point = point});
  EXPECT_NE(sweepReport({.quick = true}, results).text().find("the paper's"), std::string::npos);
  EXPECT_EQ(sweepReport({.quick = true}, results).json().find("median_force_us"), std::string::npos);
  results.front().feel.median_force_us = 1.5;
  EXPECT_NE(sweepReport({.quick = true}, results).json().find("\"median_force_us\": 1.5"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::tools

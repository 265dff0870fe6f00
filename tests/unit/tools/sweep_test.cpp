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

#include "tools/hapticbench/sweep/sweep_file.h"

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

TEST(Shard, CoversEveryPointOnce) {
  for (std::size_t index = 0; index < 50; ++index) {
    int times = 0;
    for (std::size_t number = 1; number <= 7; ++number) times += Shard{number, 7}.has(index) ? 1 : 0;
    EXPECT_EQ(times, 1) << index;
  }
}

TEST(Shard, IsReadFromIOfNAndNothingElse) {
  const auto shard = parseShard("3/8");
  ASSERT_TRUE(shard);
  EXPECT_EQ(shard->number, 3U);
  EXPECT_EQ(shard->count, 8U);
  for (const char* wrong :
       {"", "3", "/8", "3/", "0/8", "9/8", "3/8/1", "a/b", "-1/8", "3 /8", "99999999999999999999/8"}) {
    EXPECT_FALSE(parseShard(wrong)) << wrong;
  }
}

/// Whether the results are the same in all but the times.
bool sameButTime(const SweepResult& a, const SweepResult& b) {
  const auto numbers = [](const SweepResult& r) {
    return std::array{r.feel.rendered_stiffness_n_per_m,
                      r.feel.steepest_stiffness_n_per_m,
                      r.feel.pop_through_n,
                      r.feel.edge_radius_m,
                      r.feel.smallest_ridge_m,
                      r.feel.stroke_h_m,
                      r.noise.median_n,
                      r.noise.largest_n,
                      r.stability_margin};
  };
  return a.point.index == b.point.index && numbers(a) == numbers(b) && a.noise.sites == b.noise.sites &&
         a.feel.edge_is_outside == b.feel.edge_is_outside;
}

/// A sweep of few points with synthetic figures, different at each point.
SweepPart madeUpPart(std::size_t number, std::size_t count) {
  SweepPart part{.name = "part" + std::to_string(number),
                 .settings = {.quick = true,
                              .filter = true,
                              .delay_ticks = 2,
                              .noise_source = "synthetic",
                              .noise_digest = "0"},
                 .shard = {number, count},
                 .results = {}};
  for (const SweepPoint& point : pointsOf(SweepGrid::quick())) {
    if (!part.shard.has(point.index)) continue;
    SweepResult result;
    result.point = point;
    const double i = static_cast<double>(point.index);
    result.feel = {.rendered_stiffness_n_per_m = 300 + i / 3,
                   .steepest_stiffness_n_per_m = 400 + i / 7,
                   .pop_through_n = 10,
                   .edge_radius_m = 0.01 / 3,
                   .edge_is_outside = point.index % 2 == 0,
                   .smallest_ridge_m = 0.001,
                   .stroke_h_m = -0.005,
                   .median_force_us = 2};
    result.noise = {.median_n = 0.1, .largest_n = 0.2, .sites = 3, .nearest_m = 1, .farthest_m = 2};
    result.stability_margin = 1000 / (300 + i);
    part.results.push_back(result);
  }
  return part;
}

std::string errorOfMerging(const std::vector<SweepPart>& parts) {
  const auto merged = mergeSweep(parts);
  return merged ? "" : merged.error().text();
}

TEST(SweepFile, ReadsBackEveryNumberAsWritten) {
  SweepPart part = madeUpPart(2, 3);
  part.results.front().stability_margin = std::numeric_limits<double>::infinity();
  const auto read = parseSweep("file", sweepJson(part));
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read->settings, part.settings);
  EXPECT_EQ(read->shard.number, 2U);
  EXPECT_EQ(read->shard.count, 3U);
  ASSERT_EQ(read->results.size(), part.results.size());
  for (std::size_t i = 0; i < part.results.size(); ++i) {
    EXPECT_TRUE(sameButTime(read->results[i], part.results[i])) << i;
    EXPECT_EQ(read->results[i].feel.median_force_us, part.results[i].feel.median_force_us);
  }
}

TEST(SweepFile, RefusesWhatIsNoPartOfASweep) {
  std::string other_point = sweepJson(madeUpPart(1, 1));
  other_point.replace(other_point.find("\"proxy\""), 7, "\"surface\"");
  for (const std::string& text : {std::string(), std::string("{}"), std::string("[1]"),
                                  std::string(R"({"benchmark": "pareto"})"), other_point}) {
    const auto read = parseSweep("odd.json", text);
    ASSERT_FALSE(read) << text.substr(0, 40);
    EXPECT_TRUE(read.error().text().starts_with("odd.json: is no part of a sweep")) << read.error().text();
  }
}

TEST(MergeSweep, JoinsThePartsInTheOrderOfTheGridWhateverTheirOrder) {
  const auto merged = mergeSweep({madeUpPart(3, 3), madeUpPart(1, 3), madeUpPart(2, 3)});
  ASSERT_TRUE(merged) << merged.error().text();
  const SweepPart whole = madeUpPart(1, 1);
  EXPECT_EQ(merged->shard.count, 1U);
  ASSERT_EQ(merged->results.size(), whole.results.size());
  for (std::size_t i = 0; i < whole.results.size(); ++i) {
    EXPECT_TRUE(sameButTime(merged->results[i], whole.results[i])) << i;
  }
}

TEST(MergeSweep, RefusesMissingParts) {
  EXPECT_EQ(errorOfMerging({madeUpPart(1, 4), madeUpPart(3, 4)}),
            "--merge: these parts are missing: 2/4 4/4");
}

TEST(MergeSweep, RefusesTheSamePartTwice) {
  EXPECT_EQ(errorOfMerging({madeUpPart(1, 2), madeUpPart(1, 2)}), "part1: is part 1/2, and so is part1");
}

TEST(MergeSweep, RefusesPartsOfAnotherDivision) {
  EXPECT_EQ(errorOfMerging({madeUpPart(1, 2), madeUpPart(2, 3)}),
            "part2: is part 2/3, but part1 is part 1/2");
}

TEST(MergeSweep, RefusesPartsOfAnotherSweep) {
  SweepPart foreign = madeUpPart(2, 2);
  foreign.settings.delay_ticks = 5;
  EXPECT_TRUE(
      errorOfMerging({madeUpPart(1, 2), foreign}).starts_with("part2: is of another sweep than part1"));
}

TEST(MergeSweep, RefusesPartsWithoutAllTheirPointsOrWithOthers) {
  SweepPart short_one = madeUpPart(2, 2);
  short_one.results.pop_back();
  EXPECT_TRUE(errorOfMerging({madeUpPart(1, 2), short_one}).starts_with("part2: lacks point"));
  SweepPart odd = madeUpPart(2, 2);
  odd.results.front() = madeUpPart(1, 2).results.front();
  EXPECT_TRUE(
      errorOfMerging({madeUpPart(1, 2), odd}).starts_with("part2: holds point 0, which is not of part 2/2"));
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
    parameters.springs = {
        .stiffness_n_per_m = stiffness, .radius_m = radius, .min_points = 10, .max_points = count};
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
  std::fill(std::begin(frame->raw), std::end(frame->raw), raw);
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

TEST(RunSweep, GivesAPointTheSameResultInShardsOfAnySize) {
  std::vector<BenchSequence> sequences;
  sequences.push_back(syntheticSequence(3));
  const NoiseProbe noise(std::move(sequences), 1);
  ASSERT_EQ(noise.sites().size(), 1U);
  const SweepSettings settings{
      .quick = true, .filter = false, .delay_ticks = 2, .noise_source = "synthetic", .noise_digest = "0"};
  const auto silent = [](std::size_t, std::size_t) {};
  const auto part = runSweep(settings, {4, 11}, noise, silent);
  const auto half = runSweep(settings, {4, 22}, noise, silent);
  ASSERT_FALSE(half.empty());
  EXPECT_EQ(part.size(), (pointsOf(SweepGrid::quick()).size() - 4) / 11 + 1) << "the 4th, the 15th, ...";
  for (const SweepResult& result : half) {
    const auto same = std::ranges::find_if(
        part, [&](const SweepResult& other) { return other.point.index == result.point.index; });
    ASSERT_NE(same, part.end()) << result.point.index;
    EXPECT_TRUE(sameButTime(result, *same)) << result.point.index;
  }
}

TEST(SweepText, MarksThePapersSet) {
  EXPECT_NE(sweepText(madeUpPart(1, 1)).find("the paper's"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::tools

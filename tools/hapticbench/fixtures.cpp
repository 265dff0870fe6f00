// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "rt/base/clock.h"
#include "rt/fixtures/fixture.h"
#include "tools/hapticbench/engine/study.h"
#include "tools/lib/truth/true_scene.h"

namespace hapticd::tools {
namespace {

/// What is added to the scene while the cost is measured.
enum class AddedScene : std::uint8_t {
  nothing,    ///< two equal cores: what the measurement itself adds
  apart,      ///< 16 regions of all shapes, none near the hand
  around,     ///< 16 regions of all shapes along the stroke, some of which hold the HIP
  standoff,   ///< a stand-off of 5 mm that holds the HIP
  solids,     ///< 16 solids of 128^3 samples along the stroke, some of which hold the HIP
  one_place,  ///< the same 16 at one place, where all of them hold the HIP at once
  paths,      ///< 16 paths of 256 points
  tissue,     ///< 32 tissue regions of all contact models along the stroke
  all,        ///< stand-off, 15 regions and paths, and 32 tissue regions
};
constexpr auto wordsOf(AddedScene) {
  return rt::words<AddedScene>("nothing", "apart", "around", "standoff", "solids", "one place", "paths",
                               "tissue", "all");
}

/// Times of ticks, in nanoseconds.
struct FixtureCost {
  AddedScene scene = AddedScene::nothing;
  double plain_median_ns = 0;
  double plain_p999_ns = 0;
  double added_median_ns = 0;
  double added_p999_ns = 0;
  double holding_percent = 0;  ///< ticks in which a fixture or region acted
};

using rt::FixtureKind;
using rt::Vec3;

constexpr double kDistance_m = 1;
constexpr int kTicksPerFrame = 33;
constexpr double kTick_s = 0.001;
/// The HIP strokes a figure of this size, and dips this far into the surface and out of it.
constexpr double kStroke_m = 0.04;
constexpr double kDip_m = 0.006;

Vec3 hipAt(int tick) {
  const double time_s = tick * kTick_s;
  return {kStroke_m * std::sin(2.3 * time_s), kStroke_m * std::sin(3.1 * time_s),
          -kDistance_m + 0.002 + kDip_m * std::sin(5.7 * time_s)};
}

/// Fixtures and regions; large, so on the heap.
class Additions {
 public:
  explicit Additions(AddedScene scene) {
    if (scene == AddedScene::standoff || scene == AddedScene::all) {
      add(FixtureKind::standoff).clearance_m = kClearance_m;
    }
    if (scene == AddedScene::apart) addShapes(16, 0.5);
    if (scene == AddedScene::around) addShapes(16, 0);
    if (scene == AddedScene::all) addShapes(8, 0);
    if (scene == AddedScene::solids) addSolids(kStroke_m, 0.015);
    if (scene == AddedScene::one_place) addSolids(0, 0.028);
    if (scene == AddedScene::paths) addPaths(16);
    if (scene == AddedScene::all) addPaths(7);
    if (scene == AddedScene::tissue || scene == AddedScene::all) addRegions();
  }
  void applyTo(OfflineBox& box) const {
    box.setAdditions(fixtures_.get(), tissue_.get());
    if (fixtures_->count > 0 && fixtures_->fixtures[0].kind == FixtureKind::standoff)
      box.parameters().standoff_clearance_m = kClearance_m;
  }

 private:
  static constexpr double kClearance_m = 0.005;

  rt::Fixture& add(FixtureKind kind) {
    rt::Fixture& fixture = fixtures_->fixtures[fixtures_->count++];
    fixture.kind = kind;
    fixture.identity = fixtures_->count;
    fixture.definition = fixtures_->count;
    ++fixtures_->generation;
    return fixture;
  }

  static Vec3 onStroke(int i, int count, double aside_m) {
    const double angle = 2 * std::numbers::pi * i / count;
    return {kStroke_m * std::cos(angle) + aside_m, kStroke_m * std::sin(angle), -kDistance_m - 0.01};
  }

  void addShapes(int count, double aside_m) {
    constexpr std::pair<FixtureKind, rt::ShapeKind> kKinds[] = {
        {FixtureKind::sphere, rt::ShapeKind::sphere},
        {FixtureKind::box, rt::ShapeKind::box},
        {FixtureKind::capsule, rt::ShapeKind::capsule},
        {FixtureKind::cone, rt::ShapeKind::cone}};
    for (int i = 0; i < count; ++i) {
      const auto& [kind, shape] = kKinds[i % 4];
      rt::Fixture& fixture = add(kind);
      fixture.shape.kind = shape;
      fixture.shape.position_m_in_world = onStroke(i, count, aside_m);
      fixture.shape.radius_m = 0.012;
      fixture.shape.length_m = 0.02;
      fixture.shape.axis_in_world = shape == rt::ShapeKind::cone ? Vec3{0, 0, -1} : Vec3{1, 0, 0};
      fixture.shape.half_size_m = {0.01, 0.01, 0.012};
      fixture.shape.half_angle_sine = std::numbers::sqrt2 / 2;
      fixture.shape.half_angle_cosine = std::numbers::sqrt2 / 2;
      fixture.stiffness_n_per_m = 300 + 20 * i;
    }
  }

  /// Bodies with bumps, each with memory of its own, as those of 16 organs.
  void addSolids(double stroke_m, double radius_m) {
    constexpr std::uint32_t kSamples = 128;
    constexpr double kSpacing_m = 0.0005, kScale_m = 5e-6;
    rt::DistanceGrid grid{.samples = {kSamples, kSamples, kSamples},
                          .spacing_m = kSpacing_m,
                          .origin_m = -0.5 * kSpacing_m * (kSamples - 1) * Vec3{1, 1, 1},
                          .scale_m = kScale_m};
    std::vector<float> samples;
    samples.reserve(grid.size());
    for (std::uint32_t z = 0; z < kSamples; ++z) {
      for (std::uint32_t y = 0; y < kSamples; ++y) {
        for (std::uint32_t x = 0; x < kSamples; ++x) {
          const Vec3 p = grid.origin_m + kSpacing_m * Vec3(x, y, z);
          const double bump_m = 0.0005 * std::sin(400 * p.x) * std::cos(300 * p.y);
          samples.push_back(static_cast<float>(norm(p) - radius_m + bump_m));
        }
      }
    }
    rt::toSplineCoefficients(samples, grid.samples);
    constexpr int kSolids = static_cast<int>(rt::kMaxFixtures);
    for (int i = 0; i < kSolids; ++i) {
      std::vector<std::int16_t>& coefficients = coefficients_.emplace_back();
      for (const float sample : samples)
        coefficients.push_back(static_cast<std::int16_t>(std::lround(double{sample} / kScale_m)));
      coefficients.push_back(0);
      rt::Fixture& fixture = add(FixtureKind::solid);
      fixture.grid = grid;
      fixture.grid.number = static_cast<std::uint64_t>(i) + 1;
      fixture.grid.coefficients = coefficients.data();
      fixture.shape.kind = rt::ShapeKind::box;
      const double angle = 2 * std::numbers::pi * i / kSolids;
      fixture.shape.position_m_in_world = {stroke_m * std::cos(angle), stroke_m * std::sin(angle),
                                           -kDistance_m - 0.01};
      fixture.stiffness_n_per_m = 300 + 20 * i;
    }
  }

  void addPaths(int count) {
    std::vector<Vec3> points;
    for (int k = 0; k < 256; ++k) {
      const double angle = 2 * std::numbers::pi * k / 255;
      points.push_back({kStroke_m * std::cos(angle), kStroke_m * std::sin(2 * angle), -kDistance_m + 0.002});
    }
    for (int i = 0; i < count; ++i) {
      rt::Fixture& path = add(FixtureKind::path);
      path.first_element = elements_;
      path.element_count = static_cast<std::uint32_t>(
          rt::smoothPath(points, 0.002, std::span(fixtures_->elements).subspan(elements_)));
      elements_ += path.element_count;
    }
  }

  void addRegions() {
    constexpr int kRegions = static_cast<int>(rt::kMaxTissueRegions);
    for (int i = 0; i < kRegions; ++i) {
      rt::TissueRegion& region = tissue_->regions[tissue_->count++];
      region.identity = tissue_->count;
      region.shape.position_m_in_world = onStroke(i, kRegions, 0) + Vec3{0, 0, 0.01};
      region.shape.radius_m = 0.01;
      region.model = static_cast<rt::ContactModel>(i % 3);
      region.stiffness_n_per_m = 300 + 20 * i;
      region.lower_stiffness_n_per_m = 900;
      region.cue_force_n = 0.1;
    }
    tissue_->generation = 1;
  }

  std::unique_ptr<rt::FixtureSet> fixtures_ = std::make_unique<rt::FixtureSet>();
  std::unique_ptr<rt::TissueMap> tissue_ = std::make_unique<rt::TissueMap>();
  std::vector<std::vector<std::int16_t>> coefficients_;  // of the solids
  std::uint32_t elements_ = 0;
};

/// One core and the times of its ticks.
class TimedBox {
 public:
  explicit TimedBox(const rt::DepthModelParameters& camera) : box_(camera, {}, {}) {
    box_.parameters().law = rt::ForceLaw::surface;
  }
  OfflineBox& box() { return box_; }

  rt::Tick tick(const Vec3& hip, const Vec3& velocity) {
    if (box_.wouldModel(hip)) box_.model(hip);  // the scene thread's work
    const std::int64_t begin_ns = rt::monotonicNow_ns();
    const rt::Tick tick = box_.tick(hip, kTick_s, velocity);
    times_ns_.push_back(static_cast<double>(rt::monotonicNow_ns() - begin_ns));
    return tick;
  }
  double quantile_ns(double share) const { return quantile(times_ns_, share); }

 private:
  OfflineBox box_;
  std::vector<double> times_ns_;
};

/// Measures `ticks` ticks of each core.
FixtureCost measureFixtureCost(AddedScene scene, int ticks) {
  TrueScene plane({.kind = SceneKind::plane, .distance_m = kDistance_m});
  const Additions additions(scene);
  TimedBox plain(plane.depthModel());
  TimedBox added(plane.depthModel());
  if (scene != AddedScene::nothing) additions.applyTo(added.box());
  auto frame = std::make_unique<rt::DepthFrame>();
  FixtureCost cost{.scene = scene};
  int acted = 0;
  Vec3 before = hipAt(0);
  for (int i = 0; i < ticks; ++i) {
    if (i % kTicksPerFrame == 0) {
      const auto number = static_cast<std::uint64_t>(i / kTicksPerFrame) + 1;
      plane.render(0, number, SceneNoise::sensor, *frame);
      frame->sequence = number;
      plain.box().show(*frame);
      added.box().show(*frame);
    }
    const Vec3 hip = hipAt(i);
    const Vec3 velocity = (1 / kTick_s) * (hip - before);
    before = hip;
    // In turns, because the first one after a new frame finds cold caches.
    if (i % 2 == 0) plain.tick(hip, velocity);
    const rt::Tick tick = added.tick(hip, velocity);
    if (i % 2 != 0) plain.tick(hip, velocity);
    acted += tick.fixtures_in_contact != 0 || tick.tissue_region >= 0 ? 1 : 0;
  }
  constexpr double kTail = 0.999;
  cost.plain_median_ns = plain.quantile_ns(0.5);
  cost.plain_p999_ns = plain.quantile_ns(kTail);
  cost.added_median_ns = added.quantile_ns(0.5);
  cost.added_p999_ns = added.quantile_ns(kTail);
  cost.holding_percent = percentOf(static_cast<std::size_t>(acted), static_cast<std::size_t>(ticks));
  return cost;
}

Row fixtureCells(const FixtureCost& row) {
  return {{"/scene", "added", 0, nameOf(row.scene)},
          {"/acting_percent", "acting %", 0, row.holding_percent},
          {"/plain/median_ns", "without ns", 0, row.plain_median_ns},
          {"/added/median_ns", "with ns", 0, row.added_median_ns},
          {"/plain/p999_ns", "p99.9 without", 0, row.plain_p999_ns},
          {"/added/p999_ns", "p99.9 with", 0, row.added_p999_ns},
          {"", "more, median", 0, row.added_median_ns - row.plain_median_ns},
          {"", "more, p99.9", 0, row.added_p999_ns - row.plain_p999_ns}};
}

}  // namespace

StudyCommand fixturesCommand(CLI::App& app) {
  const auto ticks = std::make_shared<int>(60'000);
  StudyCommand command(app, "fixtures", "what virtual fixtures and tissue regions cost in each tick");
  command.quick("2,000 ticks of each", [ticks] { *ticks = 2000; });
  command.onReport([ticks] {
    std::vector<FixtureCost> costs;
    for (const AddedScene scene : kAllOf<AddedScene>) {
      showProgress(std::string(nameOf(scene)));
      costs.push_back(measureFixtureCost(scene, *ticks));
    }
    Report report;
    report.note("/ticks", *ticks);
    report.table("rows", "ticks with and without fixtures and tissue regions, nanoseconds\n",
                 rowsOf(costs, fixtureCells));
    return report;
  });
  return command;
}

}  // namespace hapticd::tools

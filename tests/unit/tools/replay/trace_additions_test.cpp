// SPDX-License-Identifier: Apache-2.0
// Fixtures and tissue regions in traces: as records and back, and in ticks that are computed again.

#include "daemon/trace/format/additions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "config/settings/label_image.h"
#include "config/settings/yaml_text.h"
#include "daemon/trace/format/depth_codec.h"
#include "drivers/camera/common_depth_header.h"
#include "rt/depth/depth_model.h"
#include "rt/modelling/scene_builder.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/recordings/made_up_scene.h"
#include "tests/support/temporary_folder.h"
#include "tools/haptic-replay/trace_replay.h"

namespace hapticd::tools {
namespace {

constexpr std::int64_t kTick_ns = 1'000'000;
constexpr std::int64_t kBegin_ns = 1'000'000'000;
constexpr std::uint64_t kTicks = 600;
/// From this tick on the second set of fixtures is in effect.
constexpr std::uint64_t kChangeTick = 300;
constexpr std::uint16_t kWallRaw = 760;  // 1.003 m, out of reach of the hand

/// A ball, and a path whose points are not short numbers.
config::SceneAdditions firstAdditions() {
  config::SceneAdditions additions;
  config::FixtureSettings& ball = additions.fixtures.emplace_back();
  ball.name = "ball";
  ball.position_m = {0, 0, -0.7};
  ball.radius_m = 0.05;
  config::FixtureSettings& path = additions.fixtures.emplace_back();
  path.name = "lead";
  path.kind = rt::FixtureKind::path;
  path.points_m = {{-0.1, 1.0 / 3, -0.7}, {0.1, 0.2 / 7, -0.7}, {0.1, 0.1, -0.6}};
  path.stiffness_n_per_m = 100;
  config::RegionSettings& region = additions.regions.emplace_back();
  region.name = "liver";
  region.position_m = {0, 0, -0.7};
  region.radius_m = 0.1;
  return additions;
}

/// The same with a plane before the others, the ball disabled, and another stiffness.
config::SceneAdditions secondAdditions() {
  config::SceneAdditions additions = firstAdditions();
  config::FixtureSettings& plane = *additions.fixtures.emplace(additions.fixtures.begin());
  plane.name = "floor";
  plane.kind = rt::FixtureKind::plane;
  plane.position_m = {0, 0, -0.69};
  additions.fixtures[1].enabled = false;
  additions.regions[0].stiffness_n_per_m = 321.5;
  return additions;
}

/// Sets of the force loop that were changed twice, as in a running box.
struct Sets {
  std::unique_ptr<rt::FixtureSet> fixtures = std::make_unique<rt::FixtureSet>();
  std::unique_ptr<rt::TissueMap> tissue = std::make_unique<rt::TissueMap>();
  config::SceneAdditions current = {};

  void change(const config::SceneAdditions& to) {
    const config::Settings settings;
    config::toFixtureSet(to.fixtures, current.fixtures, {settings.camera.pose(), {}, {}}, *fixtures);
    config::toTissueMap(to.regions, current.regions, {}, settings.camera.pose(), *tissue);
    current = to;
  }
  trace::AdditionsRecord record(std::int64_t time_ns) const {
    return trace::recordOf(current, *fixtures, *tissue, {}, 0, time_ns);
  }
};

bool sameShape(const rt::Shape& a, const rt::Shape& b) {
  return a.kind == b.kind && a.position_m_in_world == b.position_m_in_world &&
         a.axis_in_world == b.axis_in_world && a.radius_m == b.radius_m && a.rotation == b.rotation &&
         a.half_size_m == b.half_size_m;
}

TEST(AdditionsRecord, GivesBackTheSetsOfTheForceLoopWithAllTheirNumbers) {
  Sets sets;
  sets.change(firstAdditions());
  sets.change(secondAdditions());
  const trace::AdditionsRecord record = sets.record(5);
  EXPECT_EQ(record.time_ns, 5);
  EXPECT_EQ(record.fixture_generation, 2U);
  ASSERT_EQ(record.fixtures.size(), 3U);
  EXPECT_EQ(record.fixtures[1].first, "ball");

  const config::Settings settings;
  const auto fixtures = std::make_unique<rt::FixtureSet>();
  const auto tissue = std::make_unique<rt::TissueMap>();
  ASSERT_TRUE(trace::restore(record, settings.camera.pose(), "a.mcap", {}, *fixtures));
  ASSERT_TRUE(trace::restore(record, settings.camera.pose(), "a.mcap", *tissue));
  EXPECT_EQ(fixtures->generation, 2U);
  ASSERT_EQ(fixtures->count, 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    const rt::Fixture &was = sets.fixtures->fixtures[i], &is = fixtures->fixtures[i];
    EXPECT_EQ(is.identity, was.identity) << i;
    EXPECT_EQ(is.definition, was.definition) << i;
    EXPECT_EQ(is.enabled, was.enabled) << i;
    EXPECT_TRUE(sameShape(is.shape, was.shape)) << i;
    ASSERT_EQ(is.element_count, was.element_count) << i;
    const std::size_t bytes = was.element_count * sizeof(rt::PathElement);
    EXPECT_EQ(std::memcmp(&fixtures->elements[is.first_element], &sets.fixtures->elements[was.first_element],
                          bytes),
              0)
        << i;
  }
  EXPECT_NE(fixtures->fixtures[1].identity, fixtures->fixtures[0].identity);
  EXPECT_EQ(tissue->generation, 2U);
  ASSERT_EQ(tissue->count, 1U);
  EXPECT_EQ(tissue->regions[0].identity, sets.tissue->regions[0].identity);
  EXPECT_EQ(tissue->regions[0].stiffness_n_per_m, 321.5);
}

TEST(AdditionsRecord, IsRefusedWhereItsPartsDoNotAgree) {
  Sets sets;
  sets.change(firstAdditions());
  const config::Settings settings;
  const auto fixtures = std::make_unique<rt::FixtureSet>();
  const auto tissue = std::make_unique<rt::TissueMap>();
  const auto refusal = [&](const trace::AdditionsRecord& record) {
    auto restored = trace::restore(record, settings.camera.pose(), "a.mcap", {}, *fixtures);
    if (restored) restored = trace::restore(record, settings.camera.pose(), "a.mcap", *tissue);
    return restored ? "" : restored.error().text();
  };
  const trace::AdditionsRecord whole = sets.record(0);
  EXPECT_EQ(refusal(whole), "");
  trace::AdditionsRecord record = whole;
  record.fixtures.pop_back();
  EXPECT_NE(refusal(record).find("do not agree"), std::string::npos) << refusal(record);
  record = whole;
  record.regions[0].second = "seven";
  EXPECT_NE(refusal(record).find("missing"), std::string::npos) << refusal(record);
  record = whole;
  record.text = "fixtures: [{name: ball, kind: hyperboloid}]\n";
  EXPECT_NE(refusal(record).find("hyperboloid"), std::string::npos) << refusal(record);
  record = whole;
  record.labels.bytes = "abc";
  EXPECT_NE(refusal(record).find("do not fit the size"), std::string::npos) << refusal(record);
}

/// Settings, a map and the record of a label image of a size.
struct RecordedLabels {
  explicit RecordedLabels(int width_px, int height_px) {
    config::LabelImage image{width_px, height_px,
                             std::string(static_cast<std::size_t>(width_px * height_px), 0)};
    for (std::size_t i = 0; i < image.labels.size(); ++i) image.labels[i] = static_cast<char>(i % 7);
    config::toTissueMap({}, {}, image, settings.camera.pose(), *sent);
    record = trace::recordOf({}, *std::make_unique<rt::FixtureSet>(), *sent, {}, 0, 0);
  }
  base::Result<void> restore() const {
    return trace::restore(record, settings.camera.pose(), "a.mcap", *back);
  }

  config::Settings settings;
  std::unique_ptr<rt::TissueMap> sent = std::make_unique<rt::TissueMap>();
  std::unique_ptr<rt::TissueMap> back = std::make_unique<rt::TissueMap>();
  trace::AdditionsRecord record;
};

TEST(AdditionsRecord, KeepsALabelImageOfAnySize) {
  for (const auto& [width_px, height_px] : {std::pair{640, 480}, {848, 480}, {1280, 800}, {1, 1}}) {
    const RecordedLabels labels(width_px, height_px);
    const auto restored = labels.restore();
    ASSERT_TRUE(restored) << restored.error().text();
    EXPECT_EQ(labels.back->label_width_px, width_px);
    EXPECT_EQ(labels.back->label_height_px, height_px);
    EXPECT_TRUE(std::ranges::equal(labels.back->usedLabels(), labels.sent->usedLabels()));
  }
}

TEST(AdditionsRecord, RefusesLabelsThatDoNotFitTheirSize) {
  for (const auto& [width_px, height_px] : {std::pair{640U, 479U}, {0U, 0U}, {307'200U, 1U}, {~0U, ~0U}}) {
    RecordedLabels labels(640, 480);
    labels.record.label_width_px = width_px;
    labels.record.label_height_px = height_px;
    const auto restored = labels.restore();
    ASSERT_FALSE(restored) << width_px;
    EXPECT_NE(restored.error().text().find("do not fit the size"), std::string::npos);
  }
}

/// A session of an engaged core in front of a wall: the hand presses into the ball, later through the floor.
test::MadeUpRecords session(const config::Settings& settings) {
  test::MadeUpRecords records;
  const rt::DepthModel model(settings.camera.effectiveDepthModel(), settings.camera.pose());
  rt::SceneBuilder builder(model, settings.grid);
  rt::SceneStorage storage(builder.shape(), builder.pointCapacity(), builder.model());
  rt::Scene scene;
  storage.attachTo(scene);
  const auto frame = std::make_unique<rt::DepthFrame>();
  std::ranges::copy(test::wallImage(kWallRaw), frame->image().begin());
  frame->sequence = 1;
  frame->arrival_ns = kBegin_ns - kTick_ns;
  trace::DepthEncoder().encode(
      trace::headerOf(drivers::commonDepthHeader(settings.camera, "synthetic"), *frame),
      std::as_bytes(frame->image()), records.depth.emplace_back());

  rt::Directive directive{.generation = 1,
                          .engage = true,
                          .engage_inside = true,
                          .engage_request = 1,
                          .parameters = settings.effectiveLive()};
  const rt::SceneNeeds needs = rt::SceneNeeds::of(directive.parameters);
  const trace::ModelRecord built{.model = 1,
                                 .time_ns = frame->arrival_ns,
                                 .frame = 1,
                                 .frame_time_ns = frame->arrival_ns,
                                 .centre_m_in_world = {0, 0, -0.7},
                                 .radius_m = 0.3,
                                 .generation = 1,
                                 .forgot = true,
                                 .depth_recorded = true};
  builder.build(*frame, built.centre_m_in_world, built.radius_m, scene, needs);
  scene.model = built.model;
  records.models.push_back(built);
  records.directives.push_back({.time_ns = frame->arrival_ns,
                                .generation = 1,
                                .engage = true,
                                .engage_inside = true,
                                .engage_request = 1});

  rt::HapticCore core(builder.pointCapacity());
  Sets sets;
  sets.change(firstAdditions());
  records.additions.push_back(sets.record(kBegin_ns));
  const rt::StartParameters start = settings.startParameters();
  records.snapshots.push_back({.time_ns = kBegin_ns, .snapshot = {1, 1, core.memory()}});
  for (std::uint64_t number = 1; number <= kTicks; ++number) {
    const std::int64_t now_ns = kBegin_ns + static_cast<std::int64_t>(number) * kTick_ns;
    if (number == kChangeTick) {
      sets.change(secondAdditions());
      records.additions.push_back(sets.record(now_ns));
    }
    // from 10 mm above the ball into it; halfway a plane 40 mm below its top replaces it
    const double depth_m = -0.01 + 0.07 * static_cast<double>(number) / kTicks;
    const rt::HandleState handle{{0.01, 0, -0.65 - depth_m}, {0, 0, -0.117}, number, now_ns};
    rt::Tick tick = core.step({.now_ns = now_ns,
                               .period_s = 1 / settings.loop.rate_hz,
                               .scene = scene,
                               .handle = handle,
                               .directive = directive,
                               .start = start,
                               .fixtures = sets.fixtures.get(),
                               .tissue = sets.tissue.get()});
    tick.number = number;
    tick.planned_ns = now_ns;
    records.ticks.push_back(tick);
  }
  return records;
}

class ReplayWithFixtures : public testing::Test {
 protected:
  ReplayWithFixtures() {
    settings_.live.safety.depth_timeout_s = 5;
    settings_.live.safety.engage_ramp_s = 0.01;
    settings_.loop.rate_hz = 1000;
    records_ = session(settings_);
  }
  TraceComparison replayed() {
    const auto file = folder_.path() / "a.mcap";
    std::filesystem::remove(file);
    test::writeTrace(file, records_, 100,
                     {.attachments = {{"settings.yaml", "application/yaml", config::yamlText(settings_)}}});
    auto replay = TraceReplay::open(file);
    EXPECT_TRUE(replay) << replay.error().text();
    if (!replay) return {};
    const auto comparison = replay->run();
    EXPECT_TRUE(comparison) << comparison.error().text();
    return comparison ? *comparison : TraceComparison{};
  }

  config::Settings settings_;
  test::MadeUpRecords records_;
  test::TemporaryFolder folder_;
};

TEST_F(ReplayWithFixtures, ReproducesEveryForceToTheBit) {
  const auto largest = std::ranges::max(records_.ticks, {}, [](const rt::Tick& tick) {
    return rt::norm(tick.fixture_force_n_in_world) + rt::norm(tick.guidance_force_n_in_world);
  });
  EXPECT_GT(rt::norm(largest.fixture_force_n_in_world), 0.1)
      << rt::wordOf(records_.ticks.back().mode) << ", " << rt::wordOf(records_.ticks.back().cause) << ", "
      << records_.ticks.back().fixture_distance_m << " m";
  const TraceComparison comparison = replayed();
  EXPECT_EQ(comparison.ticks, kTicks) << comparisonText(comparison);
  EXPECT_EQ(comparison.different, 0U) << comparisonText(comparison);
}

TEST_F(ReplayWithFixtures, FindsThatAnotherFixtureActed) {
  std::string& text = records_.additions.front().text;
  const std::size_t radius = text.find("radius_m: 0.05");
  ASSERT_NE(radius, std::string::npos) << text;
  text.replace(radius, 14, "radius_m: 0.04");
  const TraceComparison comparison = replayed();
  EXPECT_EQ(comparison.ticks, kTicks) << comparisonText(comparison);
  EXPECT_GT(comparison.different, 100U) << comparisonText(comparison);
}

TEST_F(ReplayWithFixtures, LeavesOutTicksWhoseFixturesAreNotInTheTrace) {
  records_.additions.pop_back();
  const TraceComparison comparison = replayed();
  EXPECT_EQ(comparison.ticks, kChangeTick - 1) << comparisonText(comparison);
  EXPECT_EQ(comparison.different, 0U);
  EXPECT_EQ(comparison.left_out[static_cast<std::size_t>(LeftOut::additions)], kTicks - kChangeTick + 1);
  EXPECT_NE(comparisonText(comparison).find("fixtures or tissue regions are not in the trace"),
            std::string::npos);
}

}  // namespace
}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/live/tick_summary.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace hapticd::tools::view {
namespace {

using nlohmann::json;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

rt::Tick proxyTick(std::uint64_t number) {
  rt::Tick tick;
  tick.number = number;
  tick.planned_ns = static_cast<std::int64_t>(number) * 1'000'000;
  tick.law = rt::ForceLaw::surface;
  tick.contact = rt::ContactState::contact;
  tick.hip_m_in_world = {0.1, 0, -0.8};
  tick.proxy_m_in_world = {0.1, 0, -0.795};
  tick.fixture_proxy_m_in_world = tick.hip_m_in_world;
  tick.command_force_n_in_world = {0, 0, 1.5};
  tick.gain = 0.5;
  tick.scene_frame = 7;
  tick.scene_age_ns = 30'000'000;
  tick.wakeup_latency_ns = 12'000;
  return tick;
}

json messageOf(const TickSummary& summary) {
  return json::parse(summary.message());
}

TEST(TickSummary, ShowsASingleTickAsItIs) {
  TickSummary summary;
  summary.add(proxyTick(42));
  const json expected = {{"type", "window"},
                         {"ticks", 1},
                         {"lost", 0},
                         {"number", 42},
                         {"timeNs", 42'000'000},
                         {"hip", {0.1, 0, -0.8}},
                         {"proxy", {0.1, 0, -0.795}},
                         {"force", {0, 0, 1.5}},
                         {"forceMaxN", 1.5},
                         {"penetrationMaxM", messageOf(summary)["penetrationMaxM"]},
                         {"sceneAgeMaxNs", 30'000'000},
                         {"wakeupLatencyMaxNs", 12'000},
                         {"contact", "contact"},
                         {"contactTicks", 1},
                         {"gain", 0.5},
                         {"law", "surface"},
                         {"sceneFrame", 7},
                         {"fixtureContacts", 0},
                         {"nearestFixture", -1},
                         {"fixtureDistanceM", nullptr},
                         {"fixtureProxy", nullptr},
                         {"fixtureForce", {0, 0, 0}},
                         {"guidanceForce", {0, 0, 0}},
                         {"tissueRegion", -1}};
  EXPECT_EQ(messageOf(summary), expected);
  EXPECT_NEAR(messageOf(summary)["penetrationMaxM"].get<double>(), 0.005,
              1e-12);  // rounding of the difference
}

TEST(TickSummary, ShowsTheForcesOfFixturesThatAreExerted) {
  rt::Tick tick = proxyTick(1);
  tick.fixtures_in_contact = 5;
  tick.fixture_force_n_in_world = {0, 0, 4};
  tick.guidance_force_n_in_world = {2, 0, 0};
  tick.stiffness_gain = 0.5;
  tick.gain = 0.25;  // half of the ramp
  TickSummary ramping;
  ramping.add(tick);
  EXPECT_EQ(messageOf(ramping)["fixtureForce"], json({0, 0, 2}));
  EXPECT_EQ(messageOf(ramping)["guidanceForce"], json({1, 0, 0}));
  EXPECT_EQ(messageOf(ramping)["fixtureContacts"], 5);
  tick.gain = 0;
  TickSummary idle;
  idle.add(tick);
  EXPECT_EQ(messageOf(idle)["fixtureForce"], json({0, 0, 0}));
  EXPECT_EQ(messageOf(idle)["fixtureContacts"], 0);
}

TEST(TickSummary, KeepsTheLargestValuesOfTicksThatNobodyIsShown) {
  TickSummary summary;
  rt::Tick peak = proxyTick(1);
  peak.command_force_n_in_world = {0, 3, 4};
  peak.proxy_m_in_world = {0.1, 0, -0.77};
  peak.scene_age_ns = 90'000'000;
  peak.wakeup_latency_ns = 800'000;
  summary.add(peak);
  rt::Tick last = proxyTick(2);
  last.contact = rt::ContactState::free;
  last.command_force_n_in_world = {};
  last.proxy_m_in_world = last.hip_m_in_world;
  summary.add(last);
  summary.addLost(3);

  const json message = messageOf(summary);
  EXPECT_EQ(message["ticks"], 2);
  EXPECT_EQ(message["lost"], 3);
  EXPECT_EQ(message["number"], 2);
  EXPECT_EQ(message["force"], json({0, 0, 0}));
  EXPECT_EQ(message["forceMaxN"], 5);
  EXPECT_NEAR(message["penetrationMaxM"].get<double>(), 0.03, 1e-12);
  EXPECT_EQ(message["sceneAgeMaxNs"], 90'000'000);
  EXPECT_EQ(message["wakeupLatencyMaxNs"], 800'000);
  EXPECT_EQ(message["contact"], "free");
  EXPECT_EQ(message["contactTicks"], 1);
}

TEST(TickSummary, HasNoProxyWhereTheLawHasNone) {
  TickSummary summary;
  rt::Tick tick = proxyTick(1);
  tick.law = rt::ForceLaw::nearest_springs;
  summary.add(tick);
  const json message = messageOf(summary);
  EXPECT_TRUE(message["proxy"].is_null());
  EXPECT_TRUE(message["contact"].is_null());
  EXPECT_TRUE(message["penetrationMaxM"].is_null());
  EXPECT_EQ(message["law"], "nearest_springs");
}

TEST(TickSummary, WritesNullForWhatIsNotFinite) {
  TickSummary summary;
  rt::Tick tick = proxyTick(1);
  tick.hip_m_in_world = {kNaN, std::numeric_limits<double>::infinity(), 1};
  tick.gain = kNaN;
  summary.add(tick);
  const json message = messageOf(summary);
  EXPECT_EQ(message["hip"], json({nullptr, nullptr, 1}));
  EXPECT_TRUE(message["gain"].is_null());
  EXPECT_EQ(message["forceMaxN"], 1.5);
}

TEST(TickSummary, IsEmptyUntilSomethingComesAndOnceItIsCleared) {
  TickSummary summary;
  EXPECT_TRUE(summary.empty());
  summary.addLost(1);
  EXPECT_FALSE(summary.empty());
  summary.clear();
  EXPECT_TRUE(summary.empty());
}

}  // namespace
}  // namespace hapticd::tools::view

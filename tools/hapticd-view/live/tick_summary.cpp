// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/live/tick_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rt/law_table.h"
#include "rt/words.h"

namespace hapticd::tools::view {
namespace {

std::string numberText(double number) {
  return std::isfinite(number) ? fmt::format("{}", number) : "null";  // the shortest that reads back
}

std::string vectorText(const rt::Vec3& vector) {
  return fmt::format("[{},{},{}]", numberText(vector.x), numberText(vector.y), numberText(vector.z));
}

/// Share of the forces of fixtures that is exerted: none while the box is not engaged. The stiffness limit,
/// which is in Tick::gain too, is in these forces already.
double fixtureShare(const rt::Tick& tick) {
  return tick.stiffness_gain > 0 ? tick.gain / tick.stiffness_gain : 0;
}

}  // namespace

void TickSummary::add(const rt::Tick& tick) {
  const double force_n = rt::norm(tick.command_force_n_in_world);
  if (force_n > max_force_n_) max_force_n_ = force_n;  // not of a value that is not a number
  if (rt::rowOf(tick.law).has_proxy) {
    const double penetration_m = rt::norm(tick.proxy_m_in_world - tick.hip_m_in_world);
    if (penetration_m > max_penetration_m_) max_penetration_m_ = penetration_m;
    has_penetration_ = true;
  }
  max_scene_age_ns_ = std::max(max_scene_age_ns_, tick.scene_age_ns);
  max_wakeup_latency_ns_ = std::max(max_wakeup_latency_ns_, tick.wakeup_latency_ns);
  if (rt::inContact(tick)) ++contact_ticks_;
  if (fixtureShare(tick) > 0) fixture_contacts_ |= tick.fixtures_in_contact;
  ++ticks_;
  newest_ = tick;
}

std::string TickSummary::message() const {
  const bool has_proxy = rt::rowOf(newest_.law).has_proxy;
  const double fixture_share = fixtureShare(newest_);
  const bool held_back = newest_.fixture_proxy_m_in_world != newest_.hip_m_in_world;
  return fmt::format(
      R"({{"type":"window","ticks":{},"lost":{},"number":{},"timeNs":{},"hip":{},"proxy":{},"force":{},)"
      R"("forceMaxN":{},"penetrationMaxM":{},"sceneAgeMaxNs":{},"wakeupLatencyMaxNs":{},"contact":{},)"
      R"("contactTicks":{},"gain":{},"law":"{}","sceneFrame":{},"fixtureContacts":{},"nearestFixture":{},)"
      R"("fixtureDistanceM":{},"fixtureProxy":{},"fixtureForce":{},"guidanceForce":{},"tissueRegion":{}}})",
      ticks_, lost_, newest_.number, newest_.planned_ns, vectorText(newest_.hip_m_in_world),
      has_proxy ? vectorText(newest_.proxy_m_in_world) : "null", vectorText(newest_.command_force_n_in_world),
      numberText(max_force_n_), has_penetration_ ? numberText(max_penetration_m_) : "null", max_scene_age_ns_,
      max_wakeup_latency_ns_, has_proxy ? fmt::format("\"{}\"", rt::wordOf(newest_.contact)) : "null",
      contact_ticks_, numberText(newest_.gain), rt::wordOf(newest_.law), newest_.scene_frame,
      fixture_contacts_, newest_.nearest_fixture, numberText(newest_.fixture_distance_m),
      held_back ? vectorText(newest_.fixture_proxy_m_in_world) : "null",
      vectorText(fixture_share * newest_.fixture_force_n_in_world),
      vectorText(fixture_share * newest_.guidance_force_n_in_world), newest_.tissue_region);
}

}  // namespace hapticd::tools::view

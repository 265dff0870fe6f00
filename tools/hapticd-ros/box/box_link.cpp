// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/box/box_link.h"

#include <algorithm>
#include <utility>

namespace hapticd::tools::ros {
namespace {

/// Between two batches of ticks: as short as hapticd sends them where the rate asks for that, else with some
/// ticks in each batch, because every batch costs a wake-up and the names of the fields.
int intervalMs(int rate_hz) {
  constexpr int kHighRate_hz = 250;
  return std::max(rate_hz > kHighRate_hz ? 5 : 10, 1000 / rate_hz);
}

Json tickFields() {
  return Json::array({"number", "planned_ns", "mode", "cause", "handle_position_m_in_world",
                      "handle_velocity_m_per_s_in_world", "handle_sequence", "handle_time_ns",
                      "handle_condition", "handle_buttons", "handle_has_orientation", "handle_has_gripper",
                      "handle_orientation_in_world_x", "handle_orientation_in_world_y",
                      "handle_orientation_in_world_z", "handle_orientation_in_world_w", "handle_gripper_rad",
                      "command_force_n_in_world"});
}

}  // namespace

ClientResult<BoxLink> BoxLink::open(const std::string& socket, int rate_hz, int interrupt) {
  auto ticks = VarlinkClient::connect(socket);
  if (!ticks) return std::unexpected(ticks.error());
  auto calls = VarlinkClient::connect(socket);
  if (!calls) return std::unexpected(calls.error());
  ticks->interruptBy(interrupt);
  calls->interruptBy(interrupt);
  const auto subscribed = ticks->subscribe("io.hapticd.Status.Ticks",
                                           {{"fields", tickFields()},
                                            {"intervalMs", intervalMs(rate_hz)},
                                            {"rateHz", rate_hz},
                                            {"orChanged", {"mode", "handle_buttons", "handle_condition"}}});
  if (!subscribed) return std::unexpected(subscribed.error());
  return BoxLink(std::move(*ticks), std::move(*calls));
}

ClientResult<Json> BoxLink::call(const std::string& method, const Json& parameters) {
  return calls_.call("io.hapticd.Status." + method, parameters, kSilence);
}

}  // namespace hapticd::tools::ros

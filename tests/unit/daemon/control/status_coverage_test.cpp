// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "daemon/control/status_json.h"
#include "tools/hapticctl/open_metrics.h"
#include "tools/hapticctl/status_text.h"

namespace hapticd::daemon {
namespace {

/// A status in which every number that may be absent is there.
BoxStatus statusWithEveryNumber() {
  BoxStatus status;
  status.force_thread_page_faults = 1;
  status.privileges.cpu = 1;
  status.camera.details = {"/dev/video2", "0123", "5.15.1.0", "Z16", 848, 480, 30, 41.5};
  status.handle.link.emplace();
  status.handle.last_hop.emplace();
  status.handle.scheduling.priority = 1;
  status.scene.ball = Ball{{1, 1, 1}, 1};
  status.law.distance_m = 1;
  status.law.expected_error_n = 1;
  rt::StiffnessRules& rules = status.loop.stiffness_rules;
  rules.ceiling_n_per_m = rules.stability_n_per_m = rules.device_n_per_m = 1;
  rules.noise_n_per_m = rules.slew_n_per_m = rules.surface.step_m = 1;
  status.trace.state = TraceState::writing;
  status.fixtures.count = 1;
  status.tissue.count = 1;
  status.tissue.feed.accepted = 1;
  status.trace.ticks_lost = 1;
  status.trace.free_bytes = 1'000'000'000;
  status.trace.limit_bytes = 1'000'000'000;
  return status;
}

void addNumbers(const OrderedJson& object, const std::string& above, std::vector<std::string>& paths) {
  for (auto member = object.begin(); member != object.end(); ++member) {
    const std::string path = above + "/" + member.key();
    if (member->is_number()) paths.push_back(path);
    if (member->is_object()) addNumbers(*member, path, paths);
  }
}

/// The numbers of the status, but for those of the newest tick, that make no difference to what `shown` makes
/// of it.
std::set<std::string> numbersWithoutEffect(const std::function<std::string(const OrderedJson&)>& shown) {
  const OrderedJson status = statusJson(statusWithEveryNumber());
  std::vector<std::string> paths;
  addNumbers(status, "", paths);
  EXPECT_GT(paths.size(), 90U);
  std::set<std::string> without_effect;
  for (const std::string& path : paths) {
    OrderedJson changed = status;
    OrderedJson& number = changed[OrderedJson::json_pointer(path)];
    number = number.get<double>() + 7e9;
    const bool is_of_tick = path.starts_with("/tick/");
    if (!is_of_tick && shown(changed) == shown(status)) without_effect.insert(path);
  }
  return without_effect;
}

TEST(StatusCoverage, MetricsShowEveryNumberButTheseFew) {
  // what follows from the settings, what the camera's count has too, and the trace that is being written
  const std::set<std::string> not_shown{"/camera/details/heightPx",
                                        "/camera/details/rateHz",
                                        "/camera/details/widthPx",
                                        "/fixtures/generation",
                                        "/tissue/generation",
                                        "/handle/wantedThreadPriority",
                                        "/law/distanceM",
                                        "/law/expectedErrorN",
                                        "/law/handStiffnessNPerM",
                                        "/law/maxErrorN",
                                        "/loop/cpu",
                                        "/loop/directiveGeneration",
                                        "/scene/ballCentreMInWorld/x",
                                        "/scene/ballCentreMInWorld/y",
                                        "/scene/ballCentreMInWorld/z",
                                        "/scene/ballRadiusM",
                                        "/scene/frames",
                                        "/stiffness/ceilingNPerM",
                                        "/stiffness/deviceNPerM",
                                        "/stiffness/noiseFrames",
                                        "/stiffness/noiseNPerM",
                                        "/stiffness/slewNPerM",
                                        "/stiffness/stabilityNPerM",
                                        "/stiffness/surfaceStepM",
                                        "/trace/bytes",
                                        "/trace/depthFrames",
                                        "/trace/durationS",
                                        "/trace/flightRecorderS",
                                        "/trace/ticks"};
  EXPECT_EQ(numbersWithoutEffect(tools::openMetricsOf), not_shown);
}

TEST(StatusCoverage, HapticctlStatusShowsEveryNumberButTheseFew) {
  const auto text = [](const OrderedJson& status) { return tools::statusText(status); };
  std::set<std::string> without_effect = numbersWithoutEffect(text);
  // counts of changes are shown by `hapticctl events`
  std::erase_if(without_effect,
                [](const std::string& path) { return path.starts_with("/loop/transitions/"); });
  // `hapticctl calibrate` shows the rules of the stiffness
  std::erase_if(without_effect, [](const std::string& path) { return path.starts_with("/stiffness/"); });
  // what follows from the settings, and what `hapticctl trace` and the metrics show
  const std::set<std::string> not_shown{
      "/fixtures/generation", "/tissue/generation",  "/control/longestGapNs", "/handle/wantedThreadPriority",
      "/law/distanceM",       "/law/expectedErrorN", "/law/maxErrorN",        "/loop/directiveGeneration",
      "/trace/deleted",       "/trace/depthFrames",  "/trace/dumps",          "/trace/flightRecorderS",
      "/trace/recovered",     "/trace/ticks"};
  EXPECT_EQ(without_effect, not_shown);
}

/// What `hapticctl status --all` says.
std::string textOf(const BoxStatus& status) {
  return tools::statusText(statusJson(status));
}

TEST(StatusText, SaysWhatActsWhileTheCameraIsLost) {
  BoxStatus status;
  status.loop.tick.mode = rt::Mode::engaged;
  status.loop.tick.cause = rt::Cause::depth_stale;
  const char* const acts = "only the fixtures act that go on without depth";
  EXPECT_NE(textOf(status).find("engaged: the camera is lost: " + std::string(acts)), std::string::npos);
  status.loop.tick.cause = rt::Cause::surface_too_near;
  EXPECT_NE(textOf(status).find("engaged: the surface is too near for the camera: " + std::string(acts)),
            std::string::npos);
  status.loop.tick.mode = rt::Mode::holding;
  EXPECT_EQ(textOf(status).find(acts), std::string::npos);
}

TEST(StatusText, ShowsTheForceAndTheStiffnessInEffectOfEachFixture) {
  BoxStatus status;
  status.fixtures.count = status.fixtures.enabled = 2;
  status.fixtures.in_contact = {"nerve", "way"};
  status.fixtures.each = {
      {.name = "nerve", .configured_n_per_m = 300, .stiffness_n_per_m = 300, .force_n = 1.5},
      {.name = "way", .configured_n_per_m = 250, .stiffness_n_per_m = 100, .force_n = 0.25}};
  EXPECT_NE(textOf(status).find("in contact: nerve 1.50 N at 300 N/m, way 0.25 N at 100 of 250 N/m"),
            std::string::npos)
      << textOf(status);
}

}  // namespace
}  // namespace hapticd::daemon

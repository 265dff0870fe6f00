// SPDX-License-Identifier: Apache-2.0
// The status as JSON, in the metrics and in the text of hapticctl: every number is there, or named as not
// shown.

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <functional>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/control/base/status_json.h"
#include "daemon/control/server/varlink_message.h"
#include "tests/support/golden_file.h"
#include "tools/hapticctl/text/open_metrics.h"
#include "tools/hapticctl/text/status_text.h"

namespace hapticd::daemon {
namespace {

/// A status in which every number that may be absent is there.
BoxStatus statusWithEveryNumber() {
  BoxStatus status;
  status.loop.page_faults = 1;
  status.loop.privileges.cpu = 1;
  status.camera.details = {"/dev/video2", "0123", "5.15.1.0", "Z16", 848, 480, 30, 41.5};
  status.handle.link.emplace();
  status.handle.last_hop.emplace();
  status.handle.scheduling.priority = 1;
  status.scene.ball = Ball{{1, 1, 1}, 1};
  status.law.distance_m = 1;
  status.law.expected_error_n = 1;
  rt::StiffnessRules& rules = status.loop.state.stiffness_rules;
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
  const auto metrics = [](const OrderedJson& status) { return tools::metricsOf(status); };
  EXPECT_EQ(numbersWithoutEffect(metrics), not_shown);
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

BoxStatus troubledStatus() {
  BoxStatus status;
  status.loop.state.tick.mode = rt::Mode::holding;
  status.loop.state.tick.cause = rt::Cause::depth_stale;
  status.loop.state.tick.command_force_n_in_world = {3, 0, 4};
  status.loop.state.tick.hip_m_in_world = {0.1, -0.02, -0.8};
  status.loop.state.tick.points_used = 57;
  status.loop.state.counters = {101, 102, 103, 104, 105, 106, 107, 108, 109, 110, 111, 132, 133, 134, 135};
  status.loop.trace_ticks_dropped = 113;
  status.loop.page_faults = 131;
  status.loop.rate_hz = 999.95;
  status.loop.wakeup_latency = {3'100, 8'000, 12'000, 4'560'000};
  status.handle.scheduling = {79, 79};
  status.handle.last_hop = rt::LatencySummary{250'000, 500'000, 900'000, 1'230'000};
  status.camera = {
      drivers::CameraState::lost, "the recording has ended", "evil\033[2J\x07name", 114, 115, 141, ""};
  status.camera.details = {"/dev/video2", "", "5.15.1.0", "Z16", 848, 480, 30, 41.5};
  status.scene = {116, 117, 118, 119, 120, 121, 122'000, 29.5, Ball{{0.1, 0.2, -0.3}, 0.08}};
  status.handle.state = drivers::HandlePresence::present;
  status.warnings = {"camera lost: the recording has ended", "the memory is not locked (raise LimitMEMLOCK)"};
  status.uptime_s = 60;
  return status;
}

using nlohmann::json;

/// As a client reads it.
json shown(const BoxStatus& status) {
  Reply reply;
  reply.parameters["status"] = statusJson(status);
  std::string message = serialise(reply);
  message.pop_back();  // the NUL
  return json::parse(message)["parameters"]["status"];
}

TEST(StatusJson, ShowsTheNewestTransitionsOldestFirst) {
  BoxStatus status;
  status.loop.state.transition_count = 18;
  for (std::uint64_t n = 3; n <= 18; ++n) {
    status.loop.state.transitions[n % rt::kTransitionsKept] = {n, 1000 + std::int64_t(n), rt::Mode::engaged,
                                                               rt::Mode::holding, rt::Cause::depth_stale};
  }
  status.loop.state.transitions_by_cause[3] = 17;
  const json transitions = shown(status)["loop"]["transitions"];
  EXPECT_EQ(18, transitions["count"]);
  EXPECT_EQ(17, transitions["byCause"]["depth_stale"]);
  ASSERT_EQ(16U, transitions["newest"].size());
  EXPECT_EQ(R"({"number":3,"timeNs":1003,"from":"engaged","to":"holding","cause":"depth_stale"})"_json,
            transitions["newest"].front());
  EXPECT_EQ(18, transitions["newest"].back()["number"]);
}

BoxStatus statusOfCounters() {
  BoxStatus status;
  status.loop.state.counters = {101, 102, 103, 104, 105, 106, 107, 108, 109, 110, 111, 132, 133, 134, 135};
  status.loop.state.directive_generation = 112;
  status.loop.trace_ticks_dropped = 113;
  status.loop.page_faults = 131;
  status.camera = {drivers::CameraState::lost,
                   "unplugged",
                   "v4l2 A00",
                   114,
                   115,
                   141,
                   "two found",
                   {"/dev/video2", "A00", "5.15.1.0", "Z16", 848, 480, 30, 41.5}};
  status.scene = {116, 117, 118, 119, 120, 121, 122, 29.5, Ball{{0.1, 0.2, -0.3}, 0.08}};
  status.loop.wakeup_latency = {123, 124, 125, 126};
  status.loop.compute_time = {127, 128, 129, 130};
  status.handle.scheduling = {79, 136};
  status.handle.last_hop = rt::LatencySummary{137, 138, 139, 140};
  status.loop.state.tick.handle.command_latency_ns = 141;
  return status;
}

/// What a status is changed to, by a name for it.
const std::map<std::string, std::function<void(BoxStatus&)>> kStatuses{
    {"nothing", [](BoxStatus&) {}},
    {"trouble", [](BoxStatus& status) { status = troubledStatus(); }},
    {"counters", [](BoxStatus& status) { status = statusOfCounters(); }},
    {"stiffness_by_mass",
     [](BoxStatus& status) {
       status.law.hand_stiffness_n_per_m = 125;
       status.loop.state.tick.stiffness_gain = 0.25;
       status.loop.state.tick.stiffness_rule = rt::StiffnessRule::mass;
       status.loop.state.tick.contact_damping_n_s_per_m = 2.625;
       status.loop.state.tick.handle.delay_s = 0.011;
     }},
    {"stiffness_by_delay",
     [](BoxStatus& status) {
       kStatuses.at("stiffness_by_mass")(status);
       status.loop.state.tick.stiffness_rule = rt::StiffnessRule::delay;
       status.loop.state.tick.handle.damps = true;
     }},
    {"leds",
     [](BoxStatus& status) {
       status.leds.panel = {drivers::LedState::lost, "the chip is gone", "gpiod box",
                            drivers::LedSet("1011")};
       status.leds.patterns = {LedPattern::on, LedPattern::double_blink, LedPattern::slow_blink,
                               LedPattern::fast_blink};
     }},
    {"camera_lost",
     [](BoxStatus& status) {
       status.loop.state.tick.mode = rt::Mode::engaged;
       status.loop.state.tick.cause = rt::Cause::depth_stale;
     }},
    {"camera_too_near",
     [](BoxStatus& status) {
       status.loop.state.tick.mode = rt::Mode::engaged;
       status.loop.state.tick.cause = rt::Cause::surface_too_near;
     }},
    {"camera_lost_holding",
     [](BoxStatus& status) {
       status.loop.state.tick.mode = rt::Mode::holding;
       status.loop.state.tick.cause = rt::Cause::depth_stale;
     }},
    {"fixtures",
     [](BoxStatus& status) {
       status.fixtures.count = status.fixtures.enabled = 2;
       status.fixtures.in_contact = {"nerve", "way"};
       status.fixtures.each = {
           {.name = "nerve", .configured_n_per_m = 300, .stiffness_n_per_m = 300, .force_n = 1.5},
           {.name = "way", .configured_n_per_m = 250, .stiffness_n_per_m = 100, .force_n = 0.25}};
     }},
    {"not_finite", [](BoxStatus& status) {
       constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
       status.loop.rate_hz = std::numeric_limits<double>::infinity();
       status.scene.frame_rate_hz = kNaN;
       status.loop.state.tick.hip_m_in_world = {kNaN, 1, 2};
       status.camera.identity = "recording \xff";
     }}};

/// `text NAME [BEGINNING]`: the lines of `hapticctl status --all` that begin so; `json NAME POINTER`: what a
/// client reads.
std::string shownAs(const std::string& command) {
  std::istringstream words(command);
  std::string form, name, part;
  words >> form >> name >> part;
  BoxStatus status;
  kStatuses.at(name)(status);
  if (form == "json") return shown(status).at(json::json_pointer(part)).dump();
  std::istringstream lines(tools::statusText(statusJson(status)));
  std::string text;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(part)) text += line + "\n";
  }
  return text;
}

TEST(Status, IsShownAsWritten) {
  hapticd::test::expectTranscript(HAPTICD_SOURCE_FOLDER "/tests/unit/daemon/control/sessions/status.golden",
                                  shownAs);
}

TEST(StatusJson, NamesEveryModeAndCause) {
  BoxStatus status;
  const char* modes[] = {"starting", "idle", "engaged", "holding", "faulted"};
  const char* causes[] = {"none",
                          "requested",
                          "no_scene",
                          "depth_stale",
                          "handle_stale",
                          "handle_invalid",
                          "force_not_finite",
                          "handle_too_fast",
                          "handle_clutched",
                          "handle_not_calibrated",
                          "handle_replaced",
                          "outside_workspace",
                          "inside_surface",
                          "overrun_burst",
                          "surface_too_near",
                          "handle_inconsistent",
                          "energy_debt",
                          "frame_lost"};
  static_assert(std::size(causes) == rt::kCauseCount);
  for (std::uint8_t i = 0; i < rt::kCauseCount; ++i) {
    status.loop.state.tick.mode = rt::Mode(i % 5);
    status.loop.state.tick.cause = rt::Cause(i);
    const json all = shown(status);
    EXPECT_EQ(modes[i % 5], all["mode"]);
    EXPECT_EQ(causes[i], all["cause"]);
  }
}

}  // namespace
}  // namespace hapticd::daemon

// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "daemon/control/base/status_json.h"
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

/// What `hapticctl status --all` says.
std::string textOf(const BoxStatus& status) {
  return tools::statusText(statusJson(status));
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

testing::AssertionResult contains(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "no '" << part << "' in:\n" << text;
}

TEST(StatusText, ShowsWhatIsWrongFirst) {
  EXPECT_TRUE(
      textOf(troubledStatus())
          .starts_with("! camera lost: the recording has ended\n! the memory is not locked (raise "
                       "LimitMEMLOCK)\nmode          holding: the newest depth frame is too old, up 60 s\n"))
      << textOf(troubledStatus());
  EXPECT_FALSE(contains(textOf({}), "!"));
}

TEST(StatusText, ShowsEveryCounterWithItsMeaningAndUnits) {
  for (const char* part :
       {"101 ticks, 102 overruns, 103 skipped periods, 131 page faults\n",
        "104 ticks in contact, 106 slew limited, 107 clamped, 108 not finite\n",
        "105 ticks outside the model, 109 with stale depth\n",
        "110 ticks stale, 111 ticks invalid, 135 releases\n",
        "132 ticks damped for passivity, 133 warm, 134 softened for delay", "113 ticks dropped\n",
        "114 frames, 115 damaged, 141 lost\n",
        "116 frames, 121 skipped, 117 models, 118 of them remodelled, 120 points over capacity\n",
        "29.5 frames per second, 119 points, modelled in 122.0 us",
        "within 80 mm of (0.1000, 0.2000, -0.3000) m in the world\n",
        "p50 3.1 us, p99 8.0 us, p99.9 12.0 us, max 4.56 ms", "5.000 N (3.000, 0.000, 4.000)",
        "from 57 points", "at (0.1000, -0.0200, -0.8000) m in the world",
        "no real-time scheduling, memory not locked",
        "last hop      p50 250.0 us, p99 500.0 us, p99.9 900.0 us, max 1.23 ms, at priority 79\n",
        "/dev/video2, Z16 848 x 480 at 30 Hz, firmware 5.15.1.0, 42 degrees Celsius\n",
        R"(evil\x1b[2J\x07name)"}) {
    EXPECT_TRUE(contains(textOf(troubledStatus()), part));
  }
}

TEST(StatusText, SaysWhatIsLeftOfTheStiffnessAndWhy) {
  BoxStatus status = troubledStatus();
  status.law.hand_stiffness_n_per_m = 125;
  status.loop.state.tick.stiffness_gain = 0.25;
  status.loop.state.tick.stiffness_rule = rt::StiffnessRule::mass;
  status.loop.state.tick.contact_damping_n_s_per_m = 2.625;
  status.loop.state.tick.handle.delay_s = 0.011;
  EXPECT_TRUE(
      contains(textOf(status),
               "125 of 500 N/m at the hand (mass of the device at 11.0 ms delay), 2.62 N s/m in contact\n"));
  status.loop.state.tick.stiffness_rule = rt::StiffnessRule::delay;
  status.loop.state.tick.handle.damps = true;
  EXPECT_TRUE(contains(textOf(status),
                       "125 of 500 N/m at the hand (damping of the hand at 11.0 ms delay), 2.62 N s/m in "
                       "contact by the device\n"));
}

TEST(StatusText, ShowsTheLedsThatThereAreAndTheirPatterns) {
  BoxStatus status;
  EXPECT_FALSE(contains(textOf(status), "leds"));
  status.leds.panel = {drivers::LedState::lost, "the chip is gone", "gpiod box", drivers::LedSet("1011")};
  status.leds.patterns = {LedPattern::on, LedPattern::double_blink, LedPattern::slow_blink,
                          LedPattern::fast_blink};
  EXPECT_TRUE(contains(textOf(status),
                       "leds          lost, gpiod box: power on, camera double_blink, fault fast_blink\n"));
}

TEST(StatusText, SaysWhatActsWhileTheCameraIsLost) {
  BoxStatus status;
  status.loop.state.tick.mode = rt::Mode::engaged;
  status.loop.state.tick.cause = rt::Cause::depth_stale;
  const char* const acts = "only the fixtures act that go on without depth";
  EXPECT_NE(textOf(status).find("engaged: the camera is lost: " + std::string(acts)), std::string::npos);
  status.loop.state.tick.cause = rt::Cause::surface_too_near;
  EXPECT_NE(textOf(status).find("engaged: the surface is too near for the camera: " + std::string(acts)),
            std::string::npos);
  status.loop.state.tick.mode = rt::Mode::holding;
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

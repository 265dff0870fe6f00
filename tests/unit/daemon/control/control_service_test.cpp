// SPDX-License-Identifier: Apache-2.0
// The effects of the methods, over the real sockets.
#include <gtest/gtest.h>
#include <unistd.h>

#include <limits>
#include <map>

#include "control_fixture.h"
#include "daemon/control/base/status_json.h"
#include "daemon/control/server/varlink_message.h"
#include "drivers/handle/simulated/simulated_hand.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;

/// The box begins with the first generation.
constexpr int kFirstChange = 2;

class ControlServiceTest : public ControlFixture {
 protected:
  json set(const std::string& values) {
    return askControl("io.hapticd.Control.SetParameters", R"({"parameters":)" + values + "}");
  }
  void expectNothingChanged() {
    EXPECT_EQ(0U, box.changes());
    EXPECT_TRUE(log().empty());
  }
};

TEST_F(ControlServiceTest, IntroducesItself) {
  start();
  const json info = askStatus("org.varlink.service.GetInfo")["parameters"];
  EXPECT_EQ("hapticd", info["vendor"]);
  EXPECT_EQ("hapticd", info["product"]);
  EXPECT_TRUE(info["version"].is_string());
  EXPECT_TRUE(info["url"].is_string());
  EXPECT_EQ(json({"org.varlink.service", "io.hapticd.Status", "io.hapticd.Control"}), info["interfaces"]);
}

TEST_F(ControlServiceTest, NamesTheInterfaceThatItDoesNotKnow) {
  start();
  const json expected = errorReply("org.varlink.service.InterfaceNotFound", {{"interface", "io.nobody"}});
  EXPECT_EQ(expected,
            askStatus("org.varlink.service.GetInterfaceDescription", R"({"interface":"io.nobody"})"));
  EXPECT_EQ(expected, askStatus("io.nobody.Method"));
}

TEST_F(ControlServiceTest, NamesTheMethodThatItDoesNotKnowInFull) {
  start();
  for (const std::string name :
       {"org.varlink.service.Nope", "io.hapticd.Status.getStatus", "io.hapticd.Control.", "GetStatus", ""}) {
    EXPECT_EQ(errorReply("org.varlink.service.MethodNotFound", {{"method", name}}), askStatus(name));
  }
}

TEST_F(ControlServiceTest, ReadsOnTheControlSocketToo) {
  start();
  EXPECT_TRUE(askControl("io.hapticd.Status.GetStatus")["parameters"]["status"].is_object());
  EXPECT_TRUE(askControl("io.hapticd.Status.GetParameters")["parameters"]["parameters"].is_array());
}

TEST_F(ControlServiceTest, SetsParametersAndReturnsTheGenerationAndWhatChanged) {
  start();
  const json changes{{{"name", "force.law"}, {"before", "nearest_springs"}, {"after", "proxy"}, {"unit", ""}},
                     {{"name", "force.min_points"}, {"before", 10}, {"after", 7}, {"unit", ""}},
                     {{"name", "force.stiffness_n_per_m"}, {"before", 500}, {"after", 800}, {"unit", "N/m"}}};
  EXPECT_EQ(json({{"parameters", {{"generation", kFirstChange}, {"changes", changes}}}}),
            set(R"({"force.stiffness_n_per_m":800,"force.min_points":7,"force.law":"proxy"})"));
  EXPECT_EQ(800, box.appliedSettings().live.force.stiffness_n_per_m);
  EXPECT_EQ(7, box.appliedSettings().live.force.min_points);
  EXPECT_EQ(0.04, box.appliedSettings().live.force.radius_m);
  const json rows = askStatus("io.hapticd.Status.GetParameters", R"({"names":["force.stiffness_n_per_m"]})");
  EXPECT_EQ(800, rows["parameters"]["parameters"][0]["value"]);
}

TEST_F(ControlServiceTest, LogsWhoChangedWhat) {
  start();
  set(R"({"force.stiffness_n_per_m":800})");
  askControl("io.hapticd.Control.Engage");
  askControl("io.hapticd.Control.Disengage");
  const std::string who = "uid " + std::to_string(::getuid()) + " (pid " + std::to_string(::getpid()) + ") ";
  const std::vector<JournalEntry> entries = log();
  std::vector<std::string> lines;
  for (const JournalEntry& entry : entries) lines.push_back(entry.text);
  EXPECT_EQ((std::vector<std::string>{who + "sets force.stiffness_n_per_m from 500 to 800", who + "engages",
                                      who + "disengages"}),
            lines);
  EXPECT_EQ(config::EventKind::parameter, entries.front().event);
  const std::map<std::string_view, std::string> fields(entries.front().fields.begin(),
                                                       entries.front().fields.end());
  EXPECT_EQ((std::map<std::string_view, std::string>{{"PARAMETER", "force.stiffness_n_per_m"},
                                                     {"OLD", "500"},
                                                     {"NEW", "800"},
                                                     {"UID", std::to_string(::getuid())},
                                                     {"PID", std::to_string(::getpid())}}),
            fields);
}

TEST_F(ControlServiceTest, SetsNothingWhenOneOfTheValuesIsWrongAndListsAllThatAre) {
  start();
  const json reply = set(
      R"({"force.stiffness_n_per_m":800,"force.radius_m":7,"force.min_points":"many","force.max_points":null,
          "force.stifness_n_per_m":1,"force.law":{"a":1},"camera.near_m":0.5})");
  EXPECT_EQ("io.hapticd.Control.InvalidValue", reply["error"]);
  std::map<std::string, json> problems;
  for (const json& problem : reply["parameters"]["problems"]) problems[problem["parameter"]] = problem;
  ASSERT_EQ(6U, problems.size()) << reply;
  EXPECT_EQ(7, problems["force.radius_m"]["value"]);
  EXPECT_EQ(json(config::findParameter("force.radius_m")->range()), problems["force.radius_m"]["allowed"]);
  EXPECT_EQ("many", problems["force.min_points"]["value"]);
  EXPECT_TRUE(problems["force.max_points"]["value"].is_null());
  EXPECT_TRUE(problems["force.law"]["value"].is_object());
  const auto reason = problems["force.stifness_n_per_m"]["reason"].get<std::string>();
  EXPECT_NE(std::string::npos, reason.find("force.stiffness_n_per_m")) << reason;
  EXPECT_NE("", problems["camera.near_m"]["reason"]);
  expectNothingChanged();
  EXPECT_EQ(500, box.appliedSettings().live.force.stiffness_n_per_m);
}

TEST_F(ControlServiceTest, RefusesNumbersOutsideOfEveryRange) {
  start();
  for (const std::string value : {"-1", "1e300", "18446744073709551615", "-9223372036854775808", "2.5"}) {
    EXPECT_EQ("io.hapticd.Control.InvalidValue", set(R"({"force.min_points":)" + value + "}")["error"])
        << value;
  }
  expectNothingChanged();
}

TEST_F(ControlServiceTest, RefusesValuesThatDoNotFitTogether) {
  start();
  const json reply = set(R"({"force.min_points":90,"force.max_points":80})");
  EXPECT_EQ("io.hapticd.Control.InvalidValue", reply["error"]);
  EXPECT_EQ(1U, reply["parameters"]["problems"].size()) << reply;
  expectNothingChanged();
}

TEST_F(ControlServiceTest, NamesTheParametersThatNeedARestart) {
  start();
  EXPECT_EQ(
      errorReply("io.hapticd.Control.RestartRequired", {{"parameters", {"camera.far_m", "camera.near_m"}}}),
      set(R"({"camera.near_m":0.5,"force.radius_m":0.03,"camera.far_m":3})"));
  expectNothingChanged();
}

TEST_F(ControlServiceTest, AnswersThousandsOfWrongNamesWithinItsBounds) {
  start();
  std::string values = "{\"x\":1";
  for (int i = 0; i < 6000; ++i) values += ",\"" + std::to_string(i) + "\":1";
  const json reply = set(values + "}");
  EXPECT_EQ("io.hapticd.Control.InvalidValue", reply["error"]);
  EXPECT_EQ(100U, reply["parameters"]["problems"].size());
}

TEST_F(ControlServiceTest, AnswersAChangeOnlyAfterTheLoopHasTakenIt) {
  start();
  box.holdAcknowledgements();
  RawClient changer = controlClient();
  changer.call(
      R"({"method":"io.hapticd.Control.SetParameters","parameters":{"parameters":{"force.radius_m":0.03}}})");
  changer.call(R"({"method":"io.hapticd.Status.Nope"})");
  EXPECT_TRUE(box.waitForChanges(1));
  // Others are served meanwhile.
  EXPECT_EQ("idle", askStatus("io.hapticd.Status.GetStatus")["parameters"]["status"]["mode"]);
  EXPECT_EQ("idle", askControl("io.hapticd.Status.GetStatus")["parameters"]["status"]["mode"]);
  EXPECT_TRUE(changer.silent());
  box.acknowledge();
  EXPECT_EQ(kFirstChange, changer.json()["parameters"]["generation"]);
  EXPECT_EQ("org.varlink.service.MethodNotFound", changer.json()["error"]);
}

TEST_F(ControlServiceTest, AnswersNoOnewayChangeInThePlaceOfALaterCall) {
  start();
  box.holdAcknowledgements();
  RawClient client = controlClient();
  client.call(
      R"({"method":"io.hapticd.Control.SetParameters","oneway":true,
          "parameters":{"parameters":{"force.radius_m":0.03}}})");
  client.call(R"({"method":"io.hapticd.Control.Engage"})");
  EXPECT_TRUE(box.waitForChanges(2));
  box.acknowledge();
  EXPECT_EQ(json({{"parameters", {{"mode", "engaged"}, {"cause", "requested"}, {"already", false}}}}),
            client.json());
}

TEST_F(ControlServiceTest, SaysSoWhenTheLoopDoesNotTakeAChangeInTime) {
  service_options.apply_timeout = std::chrono::milliseconds(20);
  start();
  box.holdAcknowledgements();
  EXPECT_EQ(errorReply("io.hapticd.Control.NotApplied", {{"generation", kFirstChange}}),
            set(R"({"force.radius_m":0.03})"));
  EXPECT_EQ(errorReply("io.hapticd.Control.NotApplied", {{"generation", kFirstChange + 1}}),
            askControl("io.hapticd.Control.Engage"));
}

TEST_F(ControlServiceTest, EngagesAndDisengages) {
  start();
  json engaged = {{"parameters", {{"mode", "engaged"}, {"cause", "requested"}, {"already", false}}}};
  const json idle = {{"parameters", {{"mode", "idle"}, {"cause", "requested"}}}};
  EXPECT_EQ(engaged, askControl("io.hapticd.Control.Engage"));
  engaged["parameters"]["already"] = true;
  EXPECT_EQ(engaged, askControl("io.hapticd.Control.Engage"));
  EXPECT_EQ(idle, askControl("io.hapticd.Control.Disengage"));
}

TEST_F(ControlServiceTest, ReportsWhyEngagingWasRefusedAndAcceptsRequestsToEngageAnyway) {
  config::Settings inside = box.settings();
  inside.handle.of<drivers::SimulatedHandleSettings>().start_m_in_world.z = -0.99;  // of a wall at -1
  box.setSettings(inside);
  start();
  const json refused = {{"error", "io.hapticd.Control.Refused"},
                        {"parameters", {{"cause", "inside_surface"}}}};
  EXPECT_EQ(refused, askControl("io.hapticd.Control.Engage"));
  EXPECT_EQ(refused, askControl("io.hapticd.Control.Engage", R"({"insideSurface":false})"));
  EXPECT_EQ("engaged",
            askControl("io.hapticd.Control.Engage", R"({"insideSurface":true})")["parameters"]["mode"]);
  EXPECT_EQ("insideSurface",
            askControl("io.hapticd.Control.Engage", R"({"insideSurface":1})")["parameters"]["parameter"]);
}

TEST_F(ControlServiceTest, ShowsEveryParameterAsTheTableHasIt) {
  start();
  const json rows = askStatus("io.hapticd.Status.GetParameters")["parameters"]["parameters"];
  ASSERT_EQ(config::parameterTable().size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i)
    EXPECT_EQ(json(config::parameterTable()[i].name), rows[i]["name"]);

  const json names = R"({"names":["force.max_points","force.radius_m"]})"_json;
  const json two = askStatus("io.hapticd.Status.GetParameters", names.dump())["parameters"]["parameters"];
  ASSERT_EQ(2U, two.size());
  EXPECT_EQ("force.max_points", two[0]["name"]);
  EXPECT_EQ(100, two[0]["value"]);
  EXPECT_EQ("integer", two[0]["kind"]);
  EXPECT_EQ(0.04, two[1]["value"]);
  EXPECT_EQ(0.04, two[1]["default"]);
  EXPECT_EQ("m", two[1]["unit"]);
  EXPECT_EQ("live", two[1]["effect"]);
  EXPECT_EQ(config::findParameter("force.radius_m")->minimum, two[1]["minimum"]);
  EXPECT_EQ(config::findParameter("force.radius_m")->maximum, two[1]["maximum"]);
  EXPECT_TRUE(two[1]["choices"].is_null());
}

TEST_F(ControlServiceTest, NamesTheNearestParametersForAnUnknownOne) {
  start();
  const json reply =
      askStatus("io.hapticd.Status.GetParameters", R"({"names":["force.radius_m","force.radios_m"]})");
  EXPECT_EQ("io.hapticd.Status.UnknownParameter", reply["error"]);
  ASSERT_EQ(1U, reply["parameters"]["problems"].size());
  const json& problem = reply["parameters"]["problems"][0];
  EXPECT_EQ("force.radios_m", problem["parameter"]);
  EXPECT_NE(std::string::npos, problem["reason"].get<std::string>().find("force.radius_m"));
}

// --- a status as JSON

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

TEST(StatusJson, ShowsEveryCounter) {
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
  const json all = shown(status);
  EXPECT_EQ(79, all["handle"]["wantedThreadPriority"]);
  EXPECT_EQ(136, all["handle"]["threadPriority"]);
  EXPECT_EQ(R"({"p50Ns":137,"p99Ns":138,"p999Ns":139,"maxNs":140})"_json, all["handle"]["lastHop"]);
  EXPECT_EQ(141, all["tick"]["handleCommandLatencyNs"]);
  EXPECT_EQ(R"({"ticks":101,"overruns":102,"skippedPeriods":103,"contactTicks":104,"outsideModelTicks":105,
                "slewLimitedTicks":106,"magnitudeClampedTicks":107,"notFiniteTicks":108,"depthStaleTicks":109,
                "handleStaleTicks":110,"handleInvalidTicks":111,"passivityTicks":132,
                "thermallyLimitedTicks":133,"stiffnessLimitedTicks":134,"releases":135})"_json,
            all["loop"]["counters"]);
  EXPECT_EQ(112, all["loop"]["directiveGeneration"]);
  EXPECT_EQ(113, all["loop"]["traceTicksDropped"]);
  EXPECT_EQ(131, all["loop"]["pageFaults"]);
  EXPECT_EQ(
      R"({"state":"lost","detail":"unplugged","identity":"v4l2 A00","frames":114,
          "damagedFrames":115,"lostFrames":141,"advice":"two found",
          "details":{"node":"/dev/video2","serial":"A00","firmware":"5.15.1.0","format":"Z16",
                     "widthPx":848,"heightPx":480,"rateHz":30.0,"temperatureC":41.5}})"_json,
      all["camera"]);
  EXPECT_EQ(R"({"frames":116,"models":117,"remodels":118,"points":119,"pointsOverCapacity":120,
                "skippedFrames":121,"lastModelNs":122,"frameRateHz":29.5,
                "ballCentreMInWorld":{"x":0.1,"y":0.2,"z":-0.3},"ballRadiusM":0.08})"_json,
            all["scene"]);
  EXPECT_EQ(R"({"p50Ns":123,"p99Ns":124,"p999Ns":125,"maxNs":126})"_json, all["loop"]["wakeupLatency"]);
  EXPECT_EQ(R"({"p50Ns":127,"p99Ns":128,"p999Ns":129,"maxNs":130})"_json, all["loop"]["computeTime"]);
  EXPECT_TRUE(all["loop"]["cpu"].is_null());
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

TEST(StatusJson, ShowsNumbersThatAreNotFiniteAsNull) {
  BoxStatus status;
  status.loop.rate_hz = std::numeric_limits<double>::infinity();
  status.scene.frame_rate_hz = std::numeric_limits<double>::quiet_NaN();
  status.loop.state.tick.hip_m_in_world = {std::numeric_limits<double>::quiet_NaN(), 1, 2};
  const json all = shown(status);
  EXPECT_TRUE(all["loop"]["rateHz"].is_null());
  EXPECT_TRUE(all["scene"]["frameRateHz"].is_null());
  EXPECT_EQ(R"({"x":null,"y":1.0,"z":2.0})"_json, all["tick"]["hipMInWorld"]);
}

TEST(StatusJson, ShowsTextThatIsNotUtf8WithReplacements) {
  BoxStatus status;
  status.camera.identity = "recording \xff";
  EXPECT_EQ("recording \xEF\xBF\xBD", shown(status)["camera"]["identity"]);
}

}  // namespace
}  // namespace hapticd::daemon::test

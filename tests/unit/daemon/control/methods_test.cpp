// SPDX-License-Identifier: Apache-2.0
// What the methods do beside their answers, which sessions/ hold: when they answer, what they write, what
// they wait for.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "control_fixture.h"
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
};

TEST_F(ControlServiceTest, ReadsOnTheControlSocketToo) {
  start();
  EXPECT_TRUE(askControl("io.hapticd.Status.GetStatus")["parameters"]["status"].is_object());
  EXPECT_TRUE(askControl("io.hapticd.Status.GetParameters")["parameters"]["parameters"].is_array());
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
}

// --- the camera's pose

const json kPose = {{"xM", 0.5},      {"yM", -1.25},     {"zM", 2},
                    {"rollRad", 0.1}, {"pitchRad", 0.2}, {"yawRad", -0.3}};

class CalibrationTest : public ControlFixture {
 protected:
  json set(const json& parameters) {
    return askControl("io.hapticd.Control.SetCalibration", parameters.dump());
  }
  json calibration() { return askStatus("io.hapticd.Status.GetCalibration")["parameters"]["calibration"]; }
  /// Sets kPose, which is expected to succeed.
  void registerPose() {
    EXPECT_EQ(R"({"parameters":{"restartRequired":true}})"_json,
              set({{"cameraPose", kPose}, {"residualM", 0.0012}}));
  }
  /// Whether the service's next period warns.
  bool warnsSoon(bool expected) {
    for (int period = 0; period < 10'000 && warnings().empty() == expected; ++period) calibration();
    return !warnings().empty();
  }
};

TEST_F(CalibrationTest, KeepsARegisteredPoseForTheNextStartAndWarnsOfIt) {
  start();
  registerPose();
  const json shown = calibration();
  EXPECT_EQ("configuration", shown["source"]);
  EXPECT_EQ(0, shown["cameraPose"]["xM"]);
  EXPECT_EQ(kPose, shown["waiting"]);
  EXPECT_EQ(0.0012, shown["residualM"]);
  EXPECT_TRUE(shown["time"].get<std::string>().ends_with("Z"));
  EXPECT_TRUE(warnsSoon(true));
  EXPECT_NE(std::string::npos, warnings().at(0).find("systemctl restart hapticd"));
  const auto stored = readRegistration(folder.path("state"));
  ASSERT_TRUE(stored && *stored);
  EXPECT_EQ(-1.25, (*stored)->T_world_camera.position_m.y);
  EXPECT_EQ(0.2, (*stored)->T_world_camera.pitch_rad);
  EXPECT_EQ(0.0012, (*stored)->residual_m);
  EXPECT_EQ(shown["time"], json((*stored)->time));
}

TEST_F(CalibrationTest, GoesBackToTheConfigurationsPose) {
  start();
  registerPose();
  EXPECT_EQ(R"({"parameters":{"restartRequired":false}})"_json, set(json::object()));
  EXPECT_TRUE(calibration()["waiting"].is_null());
  EXPECT_TRUE(calibration()["time"].is_null());
  EXPECT_FALSE(warnsSoon(false));
  EXPECT_FALSE(std::filesystem::exists(folder.path("state/registration.yaml")));
}

TEST_F(CalibrationTest, ShowsTheRegistrationThatItStartedWithAndWhatComesInItsPlace) {
  Registration registration;
  registration.T_world_camera.position_m = {1, 2, 3};
  registration.time = "2026-03-04T05:06:07Z";
  config::Settings settings = box.settings();
  settings.camera.setPose(registration.T_world_camera);
  box.setSettings(settings);
  service_options.calibration = {{{4, 5, 6}, 0, 0, 0}, registration};
  start();
  EXPECT_EQ("registration", calibration()["source"]);
  EXPECT_EQ(3, calibration()["cameraPose"]["zM"]);
  EXPECT_EQ("2026-03-04T05:06:07Z", calibration()["time"]);
  EXPECT_TRUE(calibration()["waiting"].is_null());
  EXPECT_EQ(R"({"parameters":{"restartRequired":true}})"_json, set({{"cameraPose", nullptr}}));
  EXPECT_EQ(6, calibration()["waiting"]["zM"]);
}

TEST_F(CalibrationTest, SaysWhyItCannotWriteAndKeepsWhatWas) {
  start();
  std::filesystem::remove_all(folder.path("state"));
  std::ofstream(folder.path("state")) << "no folder";
  EXPECT_EQ("io.hapticd.Control.CalibrationFailed", set({{"cameraPose", kPose}})["error"]);
  EXPECT_TRUE(calibration()["waiting"].is_null());
}

// --- profiles

class ProfileMethodsTest : public ControlFixture {
 protected:
  void write(const std::string& name, const std::string& yaml) {
    std::filesystem::create_directories(folder.path("state/profiles"));
    std::ofstream(folder.path("state/profiles/" + name + ".yaml")) << yaml;
  }
  std::string reasonOf(const json& reply) {
    EXPECT_EQ("io.hapticd.Control.ProfileFailed", reply["error"]) << reply;
    return reply["parameters"]["reason"];
  }
};

TEST_F(ProfileMethodsTest, SavesAllLiveParametersAndNoOthers) {
  start();
  ask("SaveProfile", {{"name", "all"}});
  std::ifstream stream(folder.path("state/profiles/all.yaml"));
  const std::string yaml{std::istreambuf_iterator<char>(stream), {}};
  for (const config::Parameter& parameter : config::parameterTable()) {
    const std::string group(parameter.name.substr(0, parameter.name.find('.')));
    const std::string line = "\n  " + std::string(parameter.name.substr(group.size() + 1)) + ": ";
    const std::size_t begin = ("\n" + yaml).find("\n" + group + ":\n");
    const bool has = begin != std::string::npos && yaml.find(line, begin) != std::string::npos;
    if (parameter.effect == config::Effect::live) {
      EXPECT_TRUE(has) << parameter.name;
    }
  }
  EXPECT_EQ(std::string::npos, yaml.find("camera:"));
  EXPECT_EQ(std::string::npos, yaml.find("driver"));
}

TEST_F(ProfileMethodsTest, WaitsForTheLoopToTakeTheParameters) {
  service_options.apply_timeout = std::chrono::milliseconds(20);
  start();
  write("soft", "force: {stiffness_n_per_m: 250}\n");
  box.holdAcknowledgements();
  EXPECT_EQ(errorReply("io.hapticd.Control.NotApplied", {{"generation", 2}}),
            ask("LoadProfile", {{"name", "soft"}}));
}

TEST_F(ProfileMethodsTest, LoadsForAClientThatDoesNotWait) {
  start();
  write("soft", "force: {stiffness_n_per_m: 250}\n");
  RawClient client = controlClient();
  client.call(R"({"method":"io.hapticd.Control.LoadProfile","parameters":{"name":"soft"},"oneway":true})");
  client.close();
  EXPECT_TRUE(box.waitForChanges(1));
  EXPECT_EQ(250, box.appliedSettings().live.force.stiffness_n_per_m);
}

TEST_F(ProfileMethodsTest, RefusesNamesThatLeaveTheFolder) {
  start();
  const std::string outside = folder.path("state/x.yaml");
  std::ofstream(outside) << "force: {stiffness_n_per_m: 250}\n";
  const std::vector<std::string> names = {"../x", "",         ".",   "a/b",
                                          "a.b",  "\xc3\xa9", "a b", std::string(65, 'a')};
  for (const std::string& name : names) {
    for (const char* method : {"SaveProfile", "LoadProfile", "DeleteProfile", "SetBootProfile"}) {
      EXPECT_NE(std::string::npos,
                reasonOf(ask(method, {{"name", name}})).find("is not a valid profile name"))
          << method << " " << name;
    }
  }
  EXPECT_TRUE(std::filesystem::exists(outside));
  for (const char* method : {"SaveProfile", "LoadProfile", "DeleteProfile"}) {
    EXPECT_EQ(invalidParameter("name"), ask(method)) << method;
    EXPECT_EQ(invalidParameter("name"), ask(method, {{"name", 1}})) << method;
  }
}

TEST_F(ProfileMethodsTest, SaysWhereItCannotWriteAndWhatToDo) {
  start();
  std::filesystem::remove_all(folder.path("state"));
  std::ofstream(folder.path("state")) << "no folder";
  const std::string reason = reasonOf(ask("SaveProfile", {{"name", "a"}}));
  EXPECT_NE(std::string::npos, reason.find("state.folder")) << reason;
  EXPECT_TRUE(log().empty());
}

// --- traces

class TraceMethodsTest : public ControlFixture {
 protected:
  json names() {
    json names = json::array();
    const json reply = askStatus("io.hapticd.Status.ListTraces");
    for (const json& trace : reply["parameters"]["traces"]) names.push_back(trace["name"]);
    return names;
  }
  json firstTrace() { return askStatus("io.hapticd.Status.ListTraces")["parameters"]["traces"][0]; }
  /// Puts finished traces, without content, beside those of the box: trace-0000, trace-0001, ...
  void addTraceFiles(int count, const std::string& note = "") const {
    std::filesystem::create_directories(folder.path("state/traces"));
    for (int i = 0; i < count; ++i) {
      const std::string file = folder.path(fmt::format("state/traces/trace-{:04}", i));
      std::ofstream(file + ".mcap");
      if (!note.empty()) std::ofstream(file + ".note") << note;
    }
  }
};

TEST_F(TraceMethodsTest, ManyLongNotesLeaveOutTheOldestTracesNotTheReply) {
  addTraceFiles(1000, std::string(200, '"'));
  start();
  const json reply = askStatus("io.hapticd.Status.ListTraces")["parameters"];
  const std::size_t listed = reply["traces"].size();
  EXPECT_LT(listed, 1000U);
  EXPECT_EQ(1000U, listed + reply["omitted"].get<std::size_t>());
  EXPECT_EQ("trace-0999", reply["traces"].back()["name"]);
}

TEST_F(TraceMethodsTest, TakesDepthFromTheConfigurationWhereNothingIsSaid) {
  config::Settings settings = box.settings();
  settings.trace.depth = true;
  box.setSettings(settings);
  start();
  ask("StartTrace");
  EXPECT_EQ(true, firstTrace()["depth"]);
}

TEST_F(TraceMethodsTest, ServesOthersWhileTheDiskTakesItsTime) {
  start();
  box.holdJobs();
  RawClient starter = controlClient();
  starter.call(R"({"method":"io.hapticd.Control.StartTrace"})");
  EXPECT_TRUE(box.waitForJobs(1));
  EXPECT_EQ("idle", askStatus("io.hapticd.Status.GetStatus")["parameters"]["status"]["mode"]);
  EXPECT_TRUE(starter.silent());
  box.finishJobs();
  EXPECT_TRUE(starter.json()["parameters"]["name"].is_string());
}

TEST_F(TraceMethodsTest, FinishesAndLogsWhatAClientThatLeftHasBegun) {
  start();
  box.holdJobs();
  RawClient starter = controlClient();
  starter.call(R"({"method":"io.hapticd.Control.StartTrace"})");
  EXPECT_TRUE(box.waitForJobs(1));
  starter.close();
  box.finishJobs();
  EXPECT_EQ(1U, names().size());
  while (logged(config::EventKind::trace).empty()) askStatus("io.hapticd.Status.GetStatus");
  EXPECT_EQ(1U, logged(config::EventKind::trace).size());
}

TEST_F(TraceMethodsTest, RefusesWhatWouldWaitBehindTooManyOthersAndKeepsPlacesForChanges) {
  start();
  box.holdJobs();
  std::vector<RawClient> readers;
  for (int i = 0; i < 32; ++i) {
    readers.push_back(statusClient());
    readers.back().call(R"({"method":"io.hapticd.Status.ListTraces"})");
  }
  ASSERT_TRUE(box.waitForJobs(32));
  EXPECT_EQ("io.hapticd.Status.ListFailed", askStatus("io.hapticd.Status.ListTraces")["error"]);
  RawClient changer = controlClient();
  for (int i = 0; i < 100; ++i) {
    changer.call(R"({"method":"io.hapticd.Control.DumpTrace","oneway":true})");
  }
  ASSERT_TRUE(box.waitForJobs(64));
  const json refused = ask("DumpTrace");
  EXPECT_EQ("io.hapticd.Control.TraceFailed", refused["error"]);
  EXPECT_EQ(64, box.jobs());
  box.finishJobs();
  while (logged(config::EventKind::trace).size() < 32) askStatus("io.hapticd.Status.GetStatus");
  EXPECT_TRUE(ask("DumpTrace").contains("parameters"));
}

TEST_F(TraceMethodsTest, ListsTheNewestThousand) {
  addTraceFiles(1234);
  start();
  const json listed = askStatus("io.hapticd.Status.ListTraces")["parameters"];
  EXPECT_EQ(1000U, listed["traces"].size());
  EXPECT_EQ("trace-0234", listed["traces"].front()["name"]);
  EXPECT_EQ("trace-1233", listed["traces"].back()["name"]);
  EXPECT_EQ(234, listed["omitted"]);
}

}  // namespace
}  // namespace hapticd::daemon::test

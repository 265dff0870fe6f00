// SPDX-License-Identifier: Apache-2.0
// The camera's pose as clients see it, over the real sockets.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "control_fixture.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;

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

TEST_F(CalibrationTest, ShowsTheConfigurationsPoseWhereNothingIsRegistered) {
  start();
  const json shown = calibration();
  EXPECT_EQ("configuration", shown["source"]);
  EXPECT_EQ(0, shown["cameraPose"]["xM"]);
  for (const char* name : {"waiting", "residualM", "time"}) EXPECT_TRUE(shown[name].is_null()) << name;
  EXPECT_TRUE(warnings().empty());
}

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

TEST_F(CalibrationTest, RefusesPosesOutOfTheRangesOfTheParametersAndNamesThemAll) {
  start();
  json pose = kPose;
  pose["xM"] = 11;
  pose["yawRad"] = 4;
  const json reply = set({{"cameraPose", pose}});
  EXPECT_EQ("io.hapticd.Control.CalibrationFailed", reply["error"]);
  const std::string reason = reply["parameters"]["reason"];
  EXPECT_NE(std::string::npos, reason.find("camera.position_x_m")) << reason;
  EXPECT_NE(std::string::npos, reason.find("-10..10 m")) << reason;
  EXPECT_NE(std::string::npos, reason.find("camera.yaw_rad")) << reason;
  EXPECT_TRUE(calibration()["waiting"].is_null());
  EXPECT_TRUE(log().empty());
}

TEST_F(CalibrationTest, RefusesWhatIsNoPose) {
  start();
  json without = kPose;
  without.erase("zM");
  json more = kPose;
  more["rollDeg"] = 1;
  json text = kPose;
  text["xM"] = "1";
  for (const json& pose : {without, more, text, json(1), json::array()}) {
    EXPECT_EQ(invalidParameter("cameraPose"), set({{"cameraPose", pose}})) << pose;
  }
  for (const json& residual : {json(-1), json("x"), json(true)}) {
    EXPECT_EQ(invalidParameter("residualM"), set({{"cameraPose", kPose}, {"residualM", residual}}));
  }
  EXPECT_EQ(invalidParameter("residualM"), set({{"residualM", 1}}));
}

TEST_F(CalibrationTest, SaysWhyItCannotWriteAndKeepsWhatWas) {
  start();
  std::filesystem::remove_all(folder.path("state"));
  std::ofstream(folder.path("state")) << "no folder";
  EXPECT_EQ("io.hapticd.Control.CalibrationFailed", set({{"cameraPose", kPose}})["error"]);
  EXPECT_TRUE(calibration()["waiting"].is_null());
}

TEST_F(CalibrationTest, LogsWhoRegisteredWhat) {
  start();
  registerPose();
  const auto entries = logged(config::EventKind::calibration);
  ASSERT_EQ(1U, entries.size());
  EXPECT_EQ("(0, 0, 0) m, (0, 0, 0) rad", entries[0].at("OLD"));
  EXPECT_EQ("(0.5, -1.25, 2) m, (0.1, 0.2, -0.3) rad", entries[0].at("NEW"));
  EXPECT_EQ(std::to_string(::getuid()), entries[0].at("UID"));
}

}  // namespace
}  // namespace hapticd::daemon::test

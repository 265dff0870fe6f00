// SPDX-License-Identifier: Apache-2.0
// Profiles as clients see them, over the real sockets.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "control_fixture.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;

class ProfileMethodsTest : public ControlFixture {
 protected:
  json ask(const std::string& method, const json& parameters = json::object()) {
    return askControl("io.hapticd.Control." + method, parameters.dump());
  }
  json set(const json& values) { return ask("SetParameters", {{"parameters", values}}); }
  json profiles() { return askStatus("io.hapticd.Status.ListProfiles")["parameters"]["profiles"]; }
  void write(const std::string& name, const std::string& yaml) {
    std::filesystem::create_directories(folder.path("state/profiles"));
    std::ofstream(folder.path("state/profiles/" + name + ".yaml")) << yaml;
  }
  std::string reasonOf(const json& reply) {
    EXPECT_EQ("io.hapticd.Control.ProfileFailed", reply["error"]) << reply;
    return reply["parameters"]["reason"];
  }
};

TEST_F(ProfileMethodsTest, BringsBackWhatWasSaved) {
  start();
  set({{"force.stiffness_n_per_m", 800}, {"force.law", "proxy"}});
  EXPECT_EQ(R"({"parameters":{"name":"stiff"}})"_json, ask("SaveProfile", {{"name", "stiff"}}));
  set({{"force.stiffness_n_per_m", 300}, {"force.law", "auto"}});
  const json loaded = ask("LoadProfile", {{"name", "stiff"}})["parameters"];
  EXPECT_EQ(json({"force.law", "force.stiffness_n_per_m"}), loaded["changed"]);
  EXPECT_GT(loaded["generation"], 3);
  EXPECT_EQ(800, box.appliedSettings().live.force.stiffness_n_per_m);
  EXPECT_EQ(rt::ForceLaw::proxy, box.appliedSettings().live.force.law);
}

TEST_F(ProfileMethodsTest, ReplacesAProfileUnlessItIsToldNotTo) {
  start();
  set({{"force.stiffness_n_per_m", 800}});
  ask("SaveProfile", {{"name", "mine"}, {"replace", false}});
  set({{"force.stiffness_n_per_m", 300}});
  const std::string reason = reasonOf(ask("SaveProfile", {{"name", "mine"}, {"replace", false}}));
  EXPECT_NE(reason.find("profile mine: exists already"), std::string::npos) << reason;
  EXPECT_NE(reason.find("hapticctl save --force mine"), std::string::npos) << reason;
  set({{"force.stiffness_n_per_m", 400}});
  ask("LoadProfile", {{"name", "mine"}});
  EXPECT_EQ(800, box.appliedSettings().live.force.stiffness_n_per_m) << "a refused call keeps the profile";
  set({{"force.stiffness_n_per_m", 300}});
  ask("SaveProfile", {{"name", "mine"}});
  set({{"force.stiffness_n_per_m", 400}});
  ask("LoadProfile", {{"name", "mine"}});
  EXPECT_EQ(300, box.appliedSettings().live.force.stiffness_n_per_m);
}

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

TEST_F(ProfileMethodsTest, KeepsWhatAHandWrittenProfileDoesNotName) {
  start();
  write("hand", "force: {stiffness_n_per_m: 250}\n");
  set({{"force.radius_m", 0.03}});
  EXPECT_EQ(json({"force.stiffness_n_per_m"}),
            ask("LoadProfile", {{"name", "hand"}})["parameters"]["changed"]);
  EXPECT_EQ(0.03, box.appliedSettings().live.force.radius_m);
}

TEST_F(ProfileMethodsTest, ChangesNothingAndNamesEveryProblemOfABrokenProfile) {
  start();
  write("broken",
        "force: {stiffness_n_per_m: 250, radius_m: 7, from_the_future: 1}\ncamera: {near_m: 0.5}\nnew: {x: "
        "1}\n");
  const std::string reason = reasonOf(ask("LoadProfile", {{"name", "broken"}}));
  for (const char* part : {"force.radius_m", "there is no parameter of this name", "from_the_future",
                           "camera.near_m", "there is no group of this name", "broken.yaml:1"}) {
    EXPECT_NE(std::string::npos, reason.find(part)) << part << " in: " << reason;
  }
  EXPECT_EQ(0U, box.changes());
  EXPECT_TRUE(log().empty());
}

TEST_F(ProfileMethodsTest, ChangesNothingWhenTheProfileDoesNotFitTheOthers) {
  start();
  write("few", "force: {max_points: 8}\n");
  set({{"force.min_points", 9}});
  EXPECT_NE(std::string::npos, reasonOf(ask("LoadProfile", {{"name", "few"}})).find("force.min_points"));
  EXPECT_EQ(1U, box.changes());
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

TEST_F(ProfileMethodsTest, ListsProfilesAndWhichOneIsForTheStart) {
  start();
  EXPECT_EQ(json::array(), profiles());
  ask("SaveProfile", {{"name", "b"}});
  ask("SaveProfile", {{"name", "a"}});
  EXPECT_EQ(R"({"parameters":{}})"_json, ask("SetBootProfile", {{"name", "b"}}));
  const json listed = profiles();
  ASSERT_EQ(2U, listed.size());
  EXPECT_EQ("a", listed[0]["name"]);
  EXPECT_EQ(false, listed[0]["boot"]);
  EXPECT_EQ(true, listed[1]["boot"]);
  EXPECT_LT(1'600'000'000'000'000'000, listed[1]["timeNs"]);
  EXPECT_EQ(R"({"parameters":{}})"_json, ask("SetBootProfile"));
  EXPECT_EQ(false, profiles()[1]["boot"]);
}

TEST_F(ProfileMethodsTest, DeletesAllButTheProfileOfTheStart) {
  start();
  ask("SaveProfile", {{"name", "a"}});
  ask("SetBootProfile", {{"name", "a"}});
  EXPECT_NE(std::string::npos, reasonOf(ask("DeleteProfile", {{"name", "a"}})).find("is the boot profile"));
  ask("SetBootProfile", {{"name", nullptr}});
  EXPECT_EQ(R"({"parameters":{}})"_json, ask("DeleteProfile", {{"name", "a"}}));
  EXPECT_EQ(json::array(), profiles());
  EXPECT_NE(std::string::npos, reasonOf(ask("DeleteProfile", {{"name", "a"}})).find("no such profile"));
  EXPECT_NE(std::string::npos, reasonOf(ask("LoadProfile", {{"name", "a"}})).find("no such profile"));
  EXPECT_NE(std::string::npos, reasonOf(ask("SetBootProfile", {{"name", "a"}})).find("no such profile"));
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

TEST_F(ProfileMethodsTest, LogsWhatWasDoneAndByWhom) {
  start();
  ask("SaveProfile", {{"name", "a"}});
  set({{"force.stiffness_n_per_m", 800}});
  ask("LoadProfile", {{"name", "a"}});
  ask("SetBootProfile", {{"name", "a"}});
  ask("SetBootProfile");
  ask("DeleteProfile", {{"name", "a"}});
  std::vector<std::string> actions;
  for (const auto& entry : logged(config::EventKind::profile)) {
    actions.push_back(entry.at("ACTION") + " " + entry.at("PROFILE"));
    EXPECT_EQ(std::to_string(::getuid()), entry.at("UID"));
  }
  EXPECT_EQ((std::vector<std::string>{"save a", "load a", "boot a", "boot ", "delete a"}), actions);
  const auto parameters = logged(config::EventKind::parameter);
  ASSERT_EQ(2U, parameters.size());
  EXPECT_EQ("800", parameters[1].at("OLD"));
  EXPECT_EQ("500", parameters[1].at("NEW"));
}

TEST_F(ProfileMethodsTest, LogsWhatAProfileHeldBeforeAndHoldsNow) {
  start();
  write("a", "force: {stiffness_n_per_m: 250}\n");
  ask("SaveProfile", {{"name", "a"}});
  set({{"force.stiffness_n_per_m", 800}, {"force.radius_m", 0.03}});
  ask("SaveProfile", {{"name", "a"}});
  ask("SetBootProfile", {{"name", "a"}});
  ask("SetBootProfile");
  write("b", "force: {radius_m: 0.02}\n");
  ask("DeleteProfile", {{"name", "b"}});
  const auto entries = logged(config::EventKind::profile);
  ASSERT_EQ(5U, entries.size());
  EXPECT_EQ("force.stiffness_n_per_m=250", entries[0].at("OLD"));
  EXPECT_NE(std::string::npos, entries[0].at("NEW").find("force.law=")) << "not named before";
  EXPECT_EQ("force.stiffness_n_per_m=500, force.radius_m=0.04", entries[1].at("OLD"));
  EXPECT_EQ("force.stiffness_n_per_m=800, force.radius_m=0.03", entries[1].at("NEW"));
  EXPECT_EQ(" to a, a to ", entries[2].at("OLD") + " to " + entries[2].at("NEW") + ", " +
                                entries[3].at("OLD") + " to " + entries[3].at("NEW"));
  EXPECT_EQ("force.radius_m=0.02", entries[4].at("OLD"));
  EXPECT_EQ("", entries[4].at("NEW"));
}

}  // namespace
}  // namespace hapticd::daemon::test

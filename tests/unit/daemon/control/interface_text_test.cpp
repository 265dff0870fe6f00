// SPDX-License-Identifier: Apache-2.0
// The interface texts against the grammar of the language and against what the daemon really answers.
#include <gtest/gtest.h>

#include <mutex>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "control_fixture.h"
#include "daemon/base/box.h"
#include "daemon/base/reloads.h"
#include "daemon/control/base/status_json.h"
#include "interface_definition.h"
#include "rt/base/words.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;

/// Reloads that end at once, as a test sets them up. Thread: any.
class FakeReloads final : public Reloads {
 public:
  explicit FakeReloads(Box& box) : box_(box) {}

  /// From now on this waits for confirmation, as number 7.
  void holdBack(std::vector<config::Loosening> loosenings) {
    const std::lock_guard lock(mutex_);
    pending_ = PendingReload{7, std::move(loosenings)};
  }
  void fail() {
    const std::lock_guard lock(mutex_);
    fails_ = true;
  }

  std::uint64_t request() override { return 1; }
  std::optional<Outcome> outcome(std::uint64_t) const override {
    const std::lock_guard lock(mutex_);
    if (fails_) return std::unexpected(std::vector{base::Error{"hapticd.yaml", "is empty", "restore it"}});
    return done();
  }
  const std::optional<PendingReload>& pending() const override { return pending_; }
  Outcome confirm() override {
    const std::lock_guard lock(mutex_);
    pending_.reset();
    return done();
  }

 private:
  ReloadReport done() const {
    return {box_.acknowledgedGeneration(),
            {"sets force.radius_m from 0.04 to 0.03"},
            {"loop.priority"},
            {"fixture a"}};
  }

  Box& box_;
  mutable std::mutex mutex_;
  std::optional<PendingReload> pending_;
  bool fails_ = false;
};

class InterfaceTextTest : public ControlFixture {
 protected:
  std::string textOf(const std::string& interface) {
    RawClient client = statusClient();
    client.call(R"({"method":"org.varlink.service.GetInterfaceDescription","parameters":{"interface":")" +
                interface + "\"}}");
    return client.json()["parameters"]["description"];
  }

  /// The parameters of the reply to a call of `interface`, checked against the interface's own text.
  json checkedReply(const std::string& interface, const std::string& method,
                    const json& parameters = json::object()) {
    const InterfaceDefinition definition(textOf(interface));
    EXPECT_TRUE(definition.outputs.contains(method)) << method;
    RawClient client = controlClient();
    client.call(
        json{{"method", interface + "." + method}, {"parameters", parameters}, {"more", true}}.dump());
    const json reply = client.json();
    if (!reply.contains("error")) {
      EXPECT_EQ("", definition.mismatch(reply["parameters"], definition.outputs.at(method)));
      return reply["parameters"];
    }
    const std::string error = reply["error"];
    EXPECT_EQ(0U, error.find(interface + ".")) << error;
    const std::string name = error.substr(interface.size() + 1);
    EXPECT_TRUE(definition.errors.contains(name)) << name;
    EXPECT_EQ("", definition.mismatch(reply["parameters"], definition.errors.at(name)));
    return reply;
  }
};

TEST_F(InterfaceTextTest, FollowsTheGrammarAndCarriesItsOwnName) {
  start();
  for (const std::string name : {"org.varlink.service", "io.hapticd.Status", "io.hapticd.Control"}) {
    EXPECT_EQ(name, InterfaceDefinition(textOf(name)).name);
  }
}

TEST_F(InterfaceTextTest, ExplainsEveryFieldThatStandsOnALineOfItsOwn) {
  start();
  for (const std::string name : {"org.varlink.service", "io.hapticd.Status", "io.hapticd.Control"}) {
    std::istringstream lines(textOf(name));
    std::string previous;
    for (std::string line; std::getline(lines, line); previous = line) {
      const bool field = line.starts_with("  ") && line.find('#') == std::string::npos;
      const bool member = line.starts_with("method") || line.starts_with("type") || line.starts_with("error");
      if (field || member) {
        EXPECT_NE(std::string::npos, previous.find('#')) << name << ": " << line;
      }
    }
  }
}

TEST_F(InterfaceTextTest, DescribesWhatTheStandardMethodsAnswer) {
  start();
  checkedReply("org.varlink.service", "GetInfo");
  checkedReply("org.varlink.service", "GetInterfaceDescription", {{"interface", "io.hapticd.Status"}});
  EXPECT_TRUE(checkedReply("org.varlink.service", "GetInterfaceDescription", {{"interface", "io.nobody"}})
                  .contains("error"));
}

TEST_F(InterfaceTextTest, DescribesWhatTheStatusMethodsAnswer) {
  start();
  checkedReply("io.hapticd.Status", "GetStatus");
  EXPECT_LT(10U, checkedReply("io.hapticd.Status", "GetParameters")["parameters"].size());
  checkedReply("io.hapticd.Status", "Monitor");
  checkedReply("io.hapticd.Status", "Ticks", {{"fields", {"no_such_field"}}});
  checkedReply("io.hapticd.Status", "Ticks", {{"fields", {"number"}}, {"intervalMs", 1}});
  const json unknown = checkedReply("io.hapticd.Status", "GetParameters", {{"names", {"a.b"}}});
  EXPECT_EQ("io.hapticd.Status.UnknownParameter", unknown["error"]);
}

TEST_F(InterfaceTextTest, DescribesTheStatusThatMonitorShowsAsAnObject) {
  start();
  addTicks(std::vector<rt::Tick>(3));
  const InterfaceDefinition definition(textOf("io.hapticd.Status"));
  RawClient client = statusClient();
  client.call(R"({"method":"io.hapticd.Status.Monitor","parameters":{"intervalMs":20},"more":true})");
  for (int i = 0; i < 2; ++i) {
    const json reply = client.json()["parameters"];
    EXPECT_EQ("", definition.mismatch(reply["status"], definition.types.at("Status")));
    EXPECT_EQ("", definition.mismatch(reply["window"], definition.types.at("Window")));
  }
}

TEST_F(InterfaceTextTest, DescribesWhatIsAnsweredOfTracesProfilesAndCalibration) {
  start();
  const std::string control = "io.hapticd.Control";
  const std::string status = "io.hapticd.Status";
  checkedReply(control, "StartTrace", {{"label", "a"}});
  EXPECT_EQ(1U, checkedReply(status, "ListTraces")["traces"].size());
  checkedReply(control, "StopTrace");
  EXPECT_TRUE(checkedReply(control, "StopTrace").contains("error"));
  checkedReply(control, "DumpTrace");
  checkedReply(control, "DeleteTrace", {{"name", "trace-0-a"}});
  checkedReply(control, "SaveProfile", {{"name", "a"}});
  checkedReply(control, "SetBootProfile", {{"name", "a"}});
  checkedReply(control, "LoadProfile", {{"name", "a"}});
  EXPECT_EQ(1U, checkedReply(status, "ListProfiles")["profiles"].size());
  EXPECT_TRUE(checkedReply(control, "DeleteProfile", {{"name", "a"}}).contains("error"));
  const json pose = R"({"xM":1,"yM":0,"zM":0,"rollRad":0,"pitchRad":0,"yawRad":0})"_json;
  EXPECT_TRUE(checkedReply(status, "GetCalibration")["calibration"]["waiting"].is_null());
  checkedReply(control, "SetCalibration", {{"cameraPose", pose}});
  EXPECT_EQ(1, checkedReply(status, "GetCalibration")["calibration"]["waiting"]["xM"]);
  EXPECT_EQ("io.hapticd.Control.CalibrationFailed",
            checkedReply(control, "SetCalibration", {{"cameraPose", [&] {
                                                        json far = pose;
                                                        far["xM"] = 99;
                                                        return far;
                                                      }()}})["error"]);
  checkedReply(status, "GetSnapshot");
  EXPECT_EQ("calibration", checkedReply(status, "Events", {{"kinds", {"calibration"}}})["event"]["kind"]);
  EXPECT_EQ("io.hapticd.Status.UnknownField", checkedReply(status, "Monitor", {{"fields", {"x"}}})["error"]);
}

TEST_F(InterfaceTextTest, DescribesThatThereIsNoFrame) {
  config::Settings settings = box.settings();
  settings.camera.driver = "freenect";  // of which there is none
  box.setSettings(settings);
  start();
  EXPECT_EQ("io.hapticd.Status.NoFrame", checkedReply("io.hapticd.Status", "GetSnapshot")["error"]);
}

TEST_F(InterfaceTextTest, DescribesWhatIsAnsweredOfAReload) {
  FakeReloads reloads(box);
  service_options.reloads = &reloads;
  start();
  const std::string control = "io.hapticd.Control";
  EXPECT_EQ("io.hapticd.Control.NoPendingReload", checkedReply(control, "Reload", {{"confirm", 1}})["error"]);
  EXPECT_TRUE(checkedReply(control, "Reload")["pending"].is_null());
  reloads.holdBack({{"safety.max_force_n", "safety.max_force_n from 1 to 4 N"}});
  EXPECT_EQ(1U, checkedReply(control, "Reload")["pending"]["held"].size());
  EXPECT_EQ("io.hapticd.Control.ChangedMeanwhile",
            checkedReply(control, "Reload", {{"confirm", 99}})["error"]);
  EXPECT_TRUE(checkedReply(control, "Reload", {{"confirm", 7}})["pending"].is_null());
  box.amendStatus([](BoxStatus& status) {
    status.pending_reload = PendingReload{3, {{"fixture nerve", "fixture nerve is removed"}}};
  });
  EXPECT_EQ(3, checkedReply("io.hapticd.Status", "GetStatus")["status"]["pendingReload"]["number"]);
  reloads.fail();
  EXPECT_EQ("io.hapticd.Control.ReloadRefused", checkedReply(control, "Reload")["error"]);
}

TEST_F(InterfaceTextTest, DescribesWhatIsAnsweredOfFixturesAndRegions) {
  start();
  const std::string control = "io.hapticd.Control";
  const json sphere = R"({"name":"a","kind":"sphere","position_m":[0,0,0],"radius_m":0.05})"_json;
  const json region =
      R"({"name":"a","place":"shape","shape":"sphere","position_m":[0,0,0],"radius_m":0.05})"_json;
  EXPECT_EQ(1, checkedReply(control, "ChangeFixtures", {{"add", json::array({sphere})}})["generation"]);
  EXPECT_EQ("io.hapticd.Control.FixtureRefused",
            checkedReply(control, "ChangeFixtures", {{"add", json::array({sphere})}})["error"]);
  EXPECT_EQ("io.hapticd.Control.ChangedMeanwhile",
            checkedReply(control, "ChangeFixtures", {{"generation", 7}})["error"]);
  EXPECT_EQ(1U, checkedReply("io.hapticd.Status", "ListFixtures")["fixtures"].size());
  EXPECT_EQ("io.hapticd.Status.NoSolid",
            checkedReply("io.hapticd.Status", "GetSolid", {{"solid", std::string(64, 'a')}})["error"]);
  EXPECT_EQ(1, checkedReply(control, "ChangeRegions", {{"add", json::array({region})}})["generation"]);
  EXPECT_EQ("io.hapticd.Control.RegionRefused",
            checkedReply(control, "ChangeRegions", {{"remove", {"b"}}})["error"]);
  EXPECT_EQ(1U, checkedReply("io.hapticd.Status", "ListRegions")["regions"].size());
  EXPECT_EQ(2,
            checkedReply(control, "SetStiffness", {{"region", "a"}, {"stiffnessNPerM", 400}})["generation"]);
  json sample{{"xM", 0}, {"yM", 0}, {"zM", 0}, {"stiffnessNPerM", 400}};
  EXPECT_EQ("a", checkedReply(control, "FeedStiffness", sample)["region"]);
  sample["xM"] = 9;
  EXPECT_EQ("io.hapticd.Control.OutsideRegions", checkedReply(control, "FeedStiffness", sample)["error"]);
}

TEST_F(InterfaceTextTest, DescribesWhatClearingAFaultAnswers) {
  start();
  EXPECT_EQ("io.hapticd.Control.NotFaulted", checkedReply("io.hapticd.Control", "ClearFault")["error"]);
  EXPECT_EQ(0U, box.changes());
  box.amendStatus([](BoxStatus& status) {
    if (status.loop.state.directive_generation > 1) return;  // that of the start
    status.loop.state.tick.mode = rt::Mode::faulted;
    status.loop.state.tick.cause = rt::Cause::force_not_finite;
  });
  EXPECT_EQ("idle", checkedReply("io.hapticd.Control", "ClearFault")["mode"]);
  EXPECT_EQ("force_not_finite", logged(config::EventKind::clear_fault).at(0).at("CAUSE"));
}

TEST_F(InterfaceTextTest, DescribesEveryPatternOfTheLeds) {
  BoxStatus status;
  status.leds.panel = {drivers::LedState::present, "", "gpiod box", drivers::LedSet("1111")};
  start();
  const InterfaceDefinition definition(textOf("io.hapticd.Status"));
  for (const LedPattern pattern : {LedPattern::off, LedPattern::on, LedPattern::slow_blink,
                                   LedPattern::fast_blink, LedPattern::double_blink}) {
    status.leds.patterns.fill(pattern);
    const json reply{{"status", json(statusJson(status))}};
    EXPECT_EQ("", definition.mismatch(reply, definition.outputs.at("GetStatus")));
  }
}

TEST_F(InterfaceTextTest, DescribesWhatTheControlMethodsAnswer) {
  start();
  const auto set = [&](const json& values) {
    return checkedReply("io.hapticd.Control", "SetParameters", {{"parameters", values}});
  };
  checkedReply("io.hapticd.Control", "Engage");
  checkedReply("io.hapticd.Control", "Disengage");
  EXPECT_EQ(4, set({{"force.radius_m", 0.03}})["generation"]);
  EXPECT_EQ("io.hapticd.Control.InvalidValue", set({{"force.radius_m", 3}, {"a.b", nullptr}})["error"]);
  EXPECT_EQ("io.hapticd.Control.InvalidValue",
            set({{"force.min_points", 90}, {"force.max_points", 80}})["error"]);
  EXPECT_EQ("io.hapticd.Control.RestartRequired", set({{"camera.near_m", 0.5}})["error"]);
}

}  // namespace
}  // namespace hapticd::daemon::test

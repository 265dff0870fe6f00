// SPDX-License-Identifier: Apache-2.0
// The rules of Varlink that hold for every method alike, found from the interface texts that the daemon
// serves, and these texts against the grammar of the language and against replies; control_sessions_test
// compares those of its sessions.

#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "control_fixture.h"
#include "daemon/base/box.h"
#include "daemon/control/base/status_json.h"
#include "interface_definition.h"
#include "rt/base/words.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;

const char* const kInterfaces[] = {"org.varlink.service", "io.hapticd.Status", "io.hapticd.Control"};
constexpr const char* kUnknown = R"({"method":"io.hapticd.Status.Nope"})";
constexpr const char* kUnknownReply =
    R"({"error":"org.varlink.service.MethodNotFound","parameters":{"method":"io.hapticd.Status.Nope"}})";

class ConformanceTest : public ControlFixture {
 protected:
  void SetUp() override { start(); }

  InterfaceDefinition definitionOf(const std::string& interface) const {
    const json reply =
        askStatus("org.varlink.service.GetInterfaceDescription", json{{"interface", interface}}.dump());
    return InterfaceDefinition(reply["parameters"]["description"].get<std::string>());
  }

  /// The full names of all methods with their inputs.
  std::map<std::string, IdlType> methodsOfTexts() const {
    std::map<std::string, IdlType> methods;
    for (const std::string interface : kInterfaces) {
      for (const auto& [name, input] : definitionOf(interface).inputs)
        methods[interface + "." + name] = input;
    }
    return methods;
  }

  static json ask(RawClient client, const json& call) {
    client.call(call.dump());
    return client.json();
  }
};

bool isStream(const std::string& method) {
  static const std::set<std::string> streams{"io.hapticd.Status.Monitor", "io.hapticd.Status.Events",
                                             "io.hapticd.Status.GetSnapshot", "io.hapticd.Status.ShareDepth",
                                             "io.hapticd.Status.Ticks"};
  return streams.contains(method);
}

TEST_F(ConformanceTest, DescribesEveryMethodThatItHasWithItsParametersAndNoOthers) {
  const std::map<std::string, IdlType> described = methodsOfTexts();
  const ControlService service(box, {});
  EXPECT_EQ(described.size(), service.methods().size());
  for (const Method& method : service.methods()) {
    const auto text = described.find(std::string(method.name));
    ASSERT_NE(text, described.end()) << method.name;
    std::vector<std::string_view> fields, known;
    for (const auto& [name, type] : text->second.fields) fields.push_back(name);
    for (const MethodParameter& parameter : method.parameters) known.push_back(parameter.name);
    EXPECT_EQ(fields, known) << method.name;
    EXPECT_EQ(isStream(text->first), method.streams) << method.name;
    EXPECT_EQ(text->first.starts_with("io.hapticd.Control."), method.access == Access::control)
        << method.name;
  }
}

TEST_F(ConformanceTest, ListsTheInterfacesThatItDescribes) {
  EXPECT_EQ(json(kInterfaces), askStatus("org.varlink.service.GetInfo")["parameters"]["interfaces"]);
}

TEST_F(ConformanceTest, KnowsEveryMethodOfItsTextsAndNamesAParameterThatItDoesNot) {
  for (const auto& [method, input] : methodsOfTexts()) {
    const json call = {{"method", method}, {"parameters", {{"nobodyKnowsThis", 1}}}, {"more", true}};
    EXPECT_EQ(invalidParameter("nobodyKnowsThis"), ask(controlClient(), call)) << method;
  }
  EXPECT_EQ(0U, box.changes());
}

/// A value that is not of the type, whatever the type.
json wrongValueFor(const IdlType& type) {
  const IdlType& inner = type.kind == IdlType::Kind::nullable ? *type.element : type;
  const bool text = inner.kind == IdlType::Kind::basic && inner.name == "string";
  return text ? json(7) : json("text");
}

TEST_F(ConformanceTest, NamesAParameterOfTheWrongTypeInEveryMethod) {
  int checked = 0;
  for (const auto& [method, input] : methodsOfTexts()) {
    for (const auto& [name, type] : input.fields) {
      const json call = {{"method", method}, {"parameters", {{name, wrongValueFor(type)}}}, {"more", true}};
      EXPECT_EQ(invalidParameter(name), ask(controlClient(), call)) << method;
      ++checked;
    }
  }
  EXPECT_LE(16, checked);
  EXPECT_EQ(0U, box.changes());
}

TEST_F(ConformanceTest, NamesAParameterThatIsMissingOrNullInEveryMethodThatNeedsOne) {
  int checked = 0;
  for (const auto& [method, input] : methodsOfTexts()) {
    for (const auto& [name, type] : input.fields) {
      if (type.kind == IdlType::Kind::nullable) continue;
      // the first of several that are missing is named
      if (name != std::ranges::find_if(input.fields, [](const auto& field) {
                    return field.second.kind != IdlType::Kind::nullable;
                  })->first) {
        continue;
      }
      const bool more = isStream(method);
      EXPECT_EQ(invalidParameter(name), ask(controlClient(), {{"method", method}, {"more", more}})) << method;
      EXPECT_EQ(invalidParameter(name),
                ask(controlClient(), {{"method", method}, {"parameters", {{name, nullptr}}}, {"more", more}}))
          << method;
      ++checked;
    }
  }
  EXPECT_LE(6, checked);
}

TEST_F(ConformanceTest, ExpectsMoreForStreamsAndAnswersOtherMethodsOnceWithIt) {
  for (const auto& [method, input] : methodsOfTexts()) {
    if (isStream(method)) {
      EXPECT_EQ(errorReply("org.varlink.service.ExpectedMore"), ask(statusClient(), {{"method", method}}));
      continue;
    }
    RawClient client = controlClient();
    client.call(json{{"method", method}, {"more", true}}.dump());
    client.call(kUnknown);
    EXPECT_FALSE(client.json().contains("continues")) << method;
    EXPECT_EQ(kUnknownReply, client.reply()) << method;
  }
}

TEST_F(ConformanceTest, DeniesEveryChangeOnTheStatusSocket) {
  const std::size_t before = log().size();
  for (const auto& [name, input] : definitionOf("io.hapticd.Control").inputs) {
    RawClient client = statusClient();
    client.call(json{{"method", "io.hapticd.Control." + name}, {"oneway", true}}.dump());
    client.call(json{{"method", "io.hapticd.Control." + name}}.dump());
    EXPECT_EQ(errorReply("org.varlink.service.PermissionDenied"), client.json()) << name;
  }
  EXPECT_EQ(before, log().size());
  EXPECT_EQ(0U, box.changes());
}

TEST_F(ConformanceTest, AnswersNothingToAnyOnewayCall) {
  RawClient client = controlClient();
  for (const auto& [method, input] : methodsOfTexts()) {
    client.call(json{{"method", method}, {"oneway", true}}.dump());
    client.call(json{{"method", method}, {"parameters", {{"nobodyKnowsThis", 1}}}, {"oneway", true}}.dump());
    client.call(kUnknown);
    EXPECT_EQ(kUnknownReply, client.reply()) << method;
  }
}

TEST_F(ConformanceTest, UpgradesNoMethod) {
  for (const auto& [method, input] : methodsOfTexts()) {
    EXPECT_EQ(errorReply("org.varlink.service.MethodNotImplemented", {{"method", method}}),
              ask(controlClient(), {{"method", method}, {"upgrade", true}}));
  }
}

TEST_F(ConformanceTest, PutsCallsTogetherWhereverTheyAreCut) {
  const std::string first = R"({"method":"io.hapticd.Status.A"})";
  const std::string calls = message(first) + message(kUnknown);
  for (std::size_t cut = 0; cut <= calls.size(); ++cut) {
    RawClient client = statusClient();
    client.send(calls.substr(0, cut));
    if (cut > first.size()) {  // by then the first one is whole
      EXPECT_EQ("io.hapticd.Status.A", client.json()["parameters"]["method"]) << cut;
    }
    client.send(calls.substr(cut));
    if (cut <= first.size()) {
      EXPECT_EQ("io.hapticd.Status.A", client.json()["parameters"]["method"]) << cut;
    }
    EXPECT_EQ(kUnknownReply, client.reply()) << cut;
  }
}

TEST_F(ConformanceTest, KeepsTheOrderWhereAnEarlierCallTakesLonger) {
  box.holdJobs();
  RawClient client = controlClient();
  client.call(R"({"method":"io.hapticd.Control.DumpTrace"})");
  client.call(R"({"method":"io.hapticd.Control.SaveProfile","parameters":{"name":"a"}})");
  client.call(R"({"method":"io.hapticd.Status.ListProfiles"})");
  client.call(R"({"method":"io.hapticd.Control.LoadProfile","parameters":{"name":"a"}})");
  client.call(kUnknown);
  EXPECT_TRUE(box.waitForJobs(1));
  box.finishJobs();
  EXPECT_TRUE(client.json()["parameters"]["name"].get<std::string>().ends_with("-dump"));
  EXPECT_EQ("a", client.json()["parameters"]["name"]);
  EXPECT_EQ("a", client.json()["parameters"]["profiles"][0]["name"]);
  EXPECT_EQ(json::array(), client.json()["parameters"]["changed"]);
  EXPECT_EQ(kUnknownReply, client.reply());
}

TEST_F(ConformanceTest, TakesSixteenLevelsOfNestingAndNotOneMore) {
  // The call and its parameters are two.
  const auto nested = [](int levels) {
    return R"({"method":"io.hapticd.Status.Nope","parameters":{"x":)" +
           std::string(static_cast<std::size_t>(levels - 2), '[') +
           std::string(static_cast<std::size_t>(levels - 2), ']') + "}}";
  };
  RawClient client = statusClient();
  client.call(nested(16));
  EXPECT_EQ(kUnknownReply, client.reply());
  client.call(nested(17));
  EXPECT_EQ("io.hapticd.Status.MalformedCall", client.json()["error"]);
  EXPECT_EQ(RawClient::kClosed, client.reply());
}

TEST_F(ConformanceTest, GivesBackTextOfAnyLanguage) {
  const std::string name = "io.hapticd.Status.\u00c4\u6f22\U0001F600\\u0000";
  RawClient client = statusClient();
  client.call(R"({"method":")" + name + "\"}");
  EXPECT_EQ(R"({"error":"org.varlink.service.MethodNotFound","parameters":{"method":")" + name + "\"}}",
            client.reply());
}

TEST_F(ConformanceTest, EndsEveryStreamWhenItsClientCloses) {
  addEvent({JournalEntry::Priority::notice, "something", config::EventKind::mode});
  for (const std::string stream : {"Monitor", "Events", "GetSnapshot"}) {
    const json call = {{"method", "io.hapticd.Status." + stream}, {"more", true}};
    for (int client = 0; client < 20; ++client) {  // more than there are places for a user
      json reply;
      while (!reply["continues"].is_boolean()) reply = ask(statusClient(), call);
    }
  }
}

// The interface texts against the grammar of the language and against what the daemon really answers, which
// control_sessions_test does for what its sessions ask.

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

}  // namespace
}  // namespace hapticd::daemon::test

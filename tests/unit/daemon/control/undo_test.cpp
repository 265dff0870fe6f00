// SPDX-License-Identifier: Apache-2.0
// Undo as clients see it: what random changes did is taken back step by step, and nothing else ever is.
#include <gtest/gtest.h>

#include <random>

#include "control_fixture.h"
#include "daemon/control/base/change_history.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;

class UndoTest : public ControlFixture {
 protected:
  void SetUp() override { start(); }

  /// The reply's parameters; fails on an error.
  json done(const std::string& method, const json& parameters = json::object()) {
    const json reply = ask(method, parameters);
    EXPECT_FALSE(reply.contains("error")) << reply;
    return reply.value("parameters", json::object());
  }
  /// Values of all live parameters and the definitions of all fixtures and regions.
  json state() {
    json all = json::object();
    const json parameters = askStatus("io.hapticd.Status.GetParameters")["parameters"]["parameters"];
    for (const json& row : parameters) {
      if (row["effect"] == "live") all[row["name"].get<std::string>()] = row["value"];
    }
    for (const auto& [method, list] :
         {std::pair("ListFixtures", "fixtures"), std::pair("ListRegions", "regions")}) {
      json definitions = json::array();
      const json entries = askStatus(std::string("io.hapticd.Status.") + method)["parameters"][list];
      for (const json& entry : entries) definitions.push_back(entry["definition"]);
      all[list] = definitions;
    }
    return all;
  }
};

json sphere(const std::string& name, double radius_m) {
  return {{"name", name}, {"kind", "sphere"}, {"position_m", {0, 0, -0.8}}, {"radius_m", radius_m}};
}

json tissue(const std::string& name, double stiffness_n_per_m) {
  return {{"name", name},      {"place", "shape"},
          {"shape", "sphere"}, {"position_m", {0, 0, 0}},
          {"radius_m", 0.1},   {"stiffness_n_per_m", stiffness_n_per_m}};
}

/// Changes at random whatever can be undone; each call changes something.
class RandomChanges {
 public:
  explicit RandomChanges(unsigned seed) : random_(seed) {}

  std::pair<std::string, json> next() {
    const double value = std::uniform_real_distribution(0.01, 0.05)(random_);
    switch (std::uniform_int_distribution(0, 4)(random_)) {
      case 0:
        return {"SetParameters", {{"parameters", {{"force.radius_m", value}}}}};
      case 1:
        return {"SetParameters",
                {{"parameters", {{"safety.max_force_n", 1 + 10 * value}, {"force.law", law()}}}}};
      case 2:
        fixtures_.push_back("f" + std::to_string(count_++));
        if (fixtures_.size() > 4) {
          const std::string oldest = fixtures_.front();
          fixtures_.erase(fixtures_.begin());
          return {"ChangeFixtures", {{"remove", {oldest}}, {"add", {sphere(fixtures_.back(), value)}}}};
        }
        return {"ChangeFixtures", {{"add", {sphere(fixtures_.back(), value)}}}};
      case 3:
        return {"ChangeRegions", {{"add", {tissue("r" + std::to_string(count_++), 10000 * value)}}}};
      default:
        return {"SetParameters", {{"parameters", {{"contact.friction", value}}}}};
    }
  }

 private:
  std::string law() { return std::uniform_int_distribution(0, 1)(random_) == 0 ? "proxy" : "surface"; }

  std::mt19937 random_;
  int count_ = 0;
  std::vector<std::string> fixtures_;
};

TEST_F(UndoTest, TakesBackRandomChangesStepByStep) {
  RandomChanges changes(7);
  std::vector<json> states{state()};
  for (std::size_t i = 0; i < ChangeHistory::kMaxChanges; ++i) {
    const auto [method, parameters] = changes.next();
    done(method, parameters);
    states.push_back(state());
  }
  while (states.size() > 1) {
    states.pop_back();
    const json preview = done("Undo", {{"preview", true}});
    EXPECT_EQ(states.size(), preview["remaining"]);
    const json reply = done("Undo");
    EXPECT_EQ(states.back(), state()) << reply;
    EXPECT_EQ(preview["changes"], reply["changes"]);
    EXPECT_FALSE(reply["changes"].empty());
    EXPECT_EQ(states.size() - 1, reply["remaining"]);
  }
  const json reply = ask("Undo");
  EXPECT_EQ("io.hapticd.Control.NothingToUndo", reply["error"]);
  EXPECT_EQ(states.front(), state());
}

TEST_F(UndoTest, RemembersABoundedNumberOfChanges) {
  for (int i = 0; i < 20; ++i)
    done("SetParameters", {{"parameters", {{"force.radius_m", 0.01 + 0.001 * i}}}});
  for (std::size_t i = 0; i < ChangeHistory::kMaxChanges; ++i) done("Undo");
  EXPECT_EQ("io.hapticd.Control.NothingToUndo", ask("Undo")["error"]);
  EXPECT_NEAR(0.013, state()["force.radius_m"].get<double>(), 1e-12);
}

TEST_F(UndoTest, KeepsWhatEstimatorsMeasuredWhereTheChangeWasElsewhere) {
  const auto liver = [this] { return state()["regions"][0]["stiffness_n_per_m"].get<double>(); };
  const auto measure = [this](double stiffness_n_per_m) {
    done("FeedStiffness", {{"xM", 0}, {"yM", 0}, {"zM", 0}, {"stiffnessNPerM", stiffness_n_per_m}});
  };
  json lung = tissue("lung", 400);
  lung["position_m"] = {1, 0, 0};
  done("ChangeRegions", {{"add", {tissue("liver", 500)}}});
  done("SetParameters", {{"parameters", {{"force.radius_m", 0.021}}}});
  measure(300);
  done("ChangeRegions", {{"add", {lung}}});  // which hands over what was measured before
  const double first = liver();
  EXPECT_NE(500, first);
  measure(200);
  done("ChangeRegions", {{"change", {{{"name", "lung"}, {"friction", 0.1}}}}});
  const double second = liver();
  EXPECT_NE(first, second);
  for (const std::size_t regions : {2U, 1U, 1U}) {
    done("Undo");
    EXPECT_EQ(regions, state()["regions"].size());
    EXPECT_EQ(second, liver());
  }
  done("Undo");
  EXPECT_EQ(json::array(), state()["regions"]);
}

TEST(ChangeHistory, ForgetsWhatSomethingElseHasChangedSince) {
  config::Settings first;
  config::Settings second = first;
  second.live.force.radius_m = 0.021;
  config::Settings reloaded = second;
  reloaded.live.safety.max_force_n = 1;
  ChangeHistory history;
  history.record(first, second);
  EXPECT_TRUE(history.undone(second));
  EXPECT_FALSE(history.undone(reloaded));
  EXPECT_TRUE(history.isOutdated(reloaded));
  config::Settings third = reloaded;
  third.live.force.radius_m = 0.03;
  history.record(reloaded, third);
  EXPECT_EQ(1U, history.size());
  ASSERT_TRUE(history.undone(third));
  EXPECT_TRUE(parameterDifferences(reloaded, *history.undone(third)).empty());
}

}  // namespace
}  // namespace hapticd::daemon::test

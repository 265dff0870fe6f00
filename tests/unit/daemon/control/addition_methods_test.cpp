// SPDX-License-Identifier: Apache-2.0
// Virtual fixtures and tissue regions as clients see them, over the real sockets.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "control_fixture.h"
#include "tests/support/program.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;

json sphere(const std::string& name, double radius_m = 0.05) {
  return {{"name", name}, {"kind", "sphere"}, {"position_m", {0, 0, -0.8}}, {"radius_m", radius_m}};
}

json tissue(const std::string& name, double x_m, double stiffness_n_per_m) {
  return {{"name", name},      {"place", "shape"},
          {"shape", "sphere"}, {"position_m", {x_m, 0, 0}},
          {"radius_m", 0.1},   {"stiffness_n_per_m", stiffness_n_per_m}};
}

class AdditionMethodsTest : public ControlFixture {
 protected:
  void SetUp() override { start(); }

  json ask(const std::string& method, const json& parameters = json::object()) {
    return askControl("io.hapticd.Control." + method, parameters.dump());
  }
  json fixtures() { return askStatus("io.hapticd.Status.ListFixtures")["parameters"]; }
  json regions() { return askStatus("io.hapticd.Status.ListRegions")["parameters"]; }
  std::vector<std::string> names() {
    std::vector<std::string> all;
    const json list = fixtures()["fixtures"];
    for (const json& entry : list) all.push_back(entry["name"]);
    return all;
  }
  /// Without what the hand makes of them.
  json definitions() {
    json all = json::array();
    const json list = fixtures()["fixtures"];
    for (const json& entry : list) all.push_back(entry["definition"]);
    return all;
  }
  double stiffness(const std::string& name) {
    const json list = regions()["regions"];
    for (const json& entry : list) {
      if (entry["name"] == name) return entry["definition"]["stiffness_n_per_m"];
    }
    return 0;
  }
  void add(const json& definitions) {
    const json list = definitions.is_array() ? definitions : json::array({definitions});
    const json reply = ask("ChangeFixtures", {{"add", list}});
    ASSERT_FALSE(reply.contains("error")) << reply;
  }
  /// Fields of the error FixtureRefused; fails on any other reply.
  json refusal(const json& parameters) {
    const json reply = ask("ChangeFixtures", parameters);
    EXPECT_EQ("io.hapticd.Control.FixtureRefused", reply["error"]) << reply;
    return reply["parameters"];
  }
  json feed(double x_m, double stiffness_n_per_m, const json& more = json::object()) {
    json parameters{{"xM", x_m}, {"yM", 0}, {"zM", 0}, {"stiffnessNPerM", stiffness_n_per_m}};
    parameters.update(more);
    return ask("FeedStiffness", parameters);
  }
};

TEST_F(AdditionMethodsTest, AddsListsChangesAndRemoves) {
  add({sphere("nerve"), sphere("vein", 0.02)});
  EXPECT_EQ((std::vector<std::string>{"nerve", "vein"}), names());
  const json entry = fixtures()["fixtures"][1];
  EXPECT_EQ(0.02, entry["definition"]["radius_m"]);
  EXPECT_EQ(json({0, 0, -0.8}), entry["definition"]["position_m"]);
  EXPECT_FALSE(entry["definition"].contains("size_m")) << "only members that the kind uses";
  EXPECT_EQ(true, entry["enabled"]);
  ask("ChangeFixtures", {{"remove", {"vein"}}, {"change", {{{"name", "nerve"}, {"radius_m", 0.06}}}}});
  EXPECT_EQ((std::vector<std::string>{"nerve"}), names());
  EXPECT_EQ(0.06, box.appliedSettings().additions.fixtures.at(0).radius_m);
}

TEST_F(AdditionMethodsTest, CountsChangesAndRefusesACallThatKnowsAnOlderSet) {
  add(sphere("nerve"));
  const json generation = fixtures()["generation"];
  EXPECT_EQ(generation.get<int>() + 1,
            ask("ChangeFixtures", {{"add", json::array({sphere("vein")})},
                                   {"generation", generation}})["parameters"]["generation"]);
  EXPECT_EQ(errorReply("io.hapticd.Control.ChangedMeanwhile", {{"generation", generation.get<int>() + 1}}),
            ask("ChangeFixtures", {{"remove", {"vein"}}, {"generation", generation}}));
  EXPECT_EQ(2U, names().size());
}

TEST_F(AdditionMethodsTest, SaysInWhichSetEachFixtureBecameWhatItIs) {
  const auto changed = [&](const json& parameters) {
    return ask("ChangeFixtures", parameters)["parameters"]["generation"];
  };
  const auto definedIn = [&] {
    json all = json::object();
    const json list = fixtures()["fixtures"];
    for (const json& entry : list) all[entry["name"].get<std::string>()] = entry["definedIn"];
    return all;
  };
  const json a = changed({{"add", {sphere("a")}}}), b = changed({{"add", {sphere("b")}}});
  EXPECT_EQ(definedIn(), json({{"a", a}, {"b", b}}));
  changed({{"change", {{{"name", "a"}, {"enabled", false}}}}});
  EXPECT_EQ(definedIn(), json({{"a", a}, {"b", b}}));
  const json later = changed({{"change", {{{"name", "b"}, {"radius_m", 0.06}}}}});
  const json again = changed({{"remove", {"a"}}, {"add", {sphere("a", 0.02)}}});
  EXPECT_EQ(definedIn(), json({{"a", again}, {"b", later}}));
}

TEST_F(AdditionMethodsTest, ChangesNothingWhereOneOfSeveralIsBad) {
  add(sphere("nerve"));
  const json before = definitions();
  const json refused = refusal({{"remove", {"nerve"}}, {"add", {sphere("good"), sphere("flat", 0)}}});
  EXPECT_EQ("flat", refused["fixture"]);
  EXPECT_EQ("radius_m", refused["field"]);
  EXPECT_NE("", refused["reason"]);
  EXPECT_NE("", refused["remedy"]);
  EXPECT_EQ(before, definitions());
  EXPECT_EQ(1U, logged(config::EventKind::fixture).size());
}

TEST_F(AdditionMethodsTest, RefusesWhatIsBadWithItsNameAndField) {
  add(sphere("nerve"));
  const json before = definitions();
  EXPECT_EQ("nerve", refusal({{"add", json::array({sphere("nerve")})}})["fixture"]) << "a name twice";
  EXPECT_EQ("ghost", refusal({{"remove", {"ghost"}}})["fixture"]);
  EXPECT_EQ("ghost", refusal({{"change", {{{"name", "ghost"}, {"enabled", false}}}}})["fixture"]);
  EXPECT_EQ("name", refusal({{"change", {{{"enabled", false}}}}})["field"]);
  json framed = sphere("a");
  framed["frame"] = "no name";
  EXPECT_EQ("frame", refusal({{"add", json::array({framed})}})["field"]);
  framed["frame"] = "moon";
  EXPECT_NE(refusal({{"add", json::array({framed})}})["reason"].get<std::string>().find("there is no frame"),
            std::string::npos);
  json unknown = sphere("a");
  unknown["radius"] = 1;
  EXPECT_EQ("a", refusal({{"add", json::array({unknown})}})["fixture"]);
  EXPECT_EQ("radius_m", refusal({{"change", {{{"name", "nerve"}, {"radius_m", "wide"}}}}})["field"]);
  json many = json::array();
  for (int i = 0; i < 16; ++i) many.push_back(sphere("s" + std::to_string(i)));
  refusal({{"add", many}});
  EXPECT_EQ(before, definitions());
}

TEST_F(AdditionMethodsTest, RefusesAStandoffWithoutTheSurfaceThatItActsOn) {
  ask("SetParameters", {{"parameters", {{"force.law", "proxy"}}}});
  const json refused = refusal({{"add", {{{"name", "skin"}, {"kind", "standoff"}, {"clearance_m", 0.005}}}}});
  EXPECT_NE(std::string::npos, refused["reason"].get<std::string>().find("skin")) << refused;
  EXPECT_TRUE(names().empty());
}

TEST_F(AdditionMethodsTest, LogsEachChangeWithWhoMadeItAndWhatWasBefore) {
  add(sphere("nerve"));
  ask("ChangeFixtures", {{"change", {{{"name", "nerve"}, {"enabled", false}}}}});
  ask("ChangeFixtures", {{"change", {{{"name", "nerve"}, {"enabled", true}}}}});
  ask("ChangeFixtures", {{"change", {{{"name", "nerve"}, {"radius_m", 0.07}}}}});
  ask("ChangeFixtures", {{"remove", {"nerve"}}});
  const auto entries = logged(config::EventKind::fixture);
  std::vector<std::string> actions;
  for (const auto& fields : entries) {
    EXPECT_EQ("nerve", fields.at("FIXTURE"));
    EXPECT_EQ(std::to_string(::getuid()), fields.at("UID"));
    actions.push_back(fields.at("ACTION"));
  }
  EXPECT_EQ((std::vector<std::string>{"add", "disable", "enable", "change", "remove"}), actions);
  EXPECT_EQ(json({{"radius_m", 0.05}}), json::parse(entries.at(3).at("OLD")));
  EXPECT_EQ(json({{"radius_m", 0.07}}), json::parse(entries.at(3).at("NEW")));
  EXPECT_EQ("", entries.at(0).at("OLD"));
  EXPECT_EQ("sphere", json::parse(entries.at(4).at("OLD"))["kind"]);
}

TEST_F(AdditionMethodsTest, ShowsWhichFixtureIsNearestAndWhichAreInContact) {
  add({sphere("nerve"), sphere("vein")});
  box.amendStatus([](BoxStatus& status) {
    status.fixtures.nearest = "vein";
    status.fixtures.distance_m = -0.001;
    status.fixtures.in_contact = {"vein"};
    status.fixtures.each = {{.name = "nerve", .distance_m = 0.02}, {.name = "vein", .distance_m = -0.001}};
  });
  const json entries = fixtures()["fixtures"];
  EXPECT_EQ(false, entries[0]["nearest"]);
  EXPECT_EQ(0.02, entries[0]["distanceM"]) << "of every fixture";
  EXPECT_EQ(true, entries[1]["nearest"]);
  EXPECT_EQ(-0.001, entries[1]["distanceM"]);
  EXPECT_EQ(true, entries[1]["inContact"]);
}

TEST_F(AdditionMethodsTest, ShowsWhatEachFixtureDoes) {
  ask("SetParameters", {{"parameters", {{"force.law", "surface"}}}});  // a stand-off takes its surface
  add({sphere("nerve"), sphere("vein")});
  ask("ChangeFixtures", {{"add", {{{"name", "skin"}, {"kind", "standoff"}, {"clearance_m", 0.01}}}}});
  box.amendStatus([](BoxStatus& status) { status.fixtures.each.clear(); });
  const json unknown = fixtures()["fixtures"][0];
  for (const char* member : {"distanceM", "forceN", "stiffnessNPerM", "stage", "warnings", "breaches",
                             "breachedS", "deepestBreachM"})
    EXPECT_TRUE(unknown[member].is_null()) << member;
  box.amendStatus([](BoxStatus& status) {
    FixtureConduct nerve{
        .name = "nerve", .configured_n_per_m = 300, .stiffness_n_per_m = 80, .force_n = 1.25};
    nerve.stage = rt::FixtureStage::soft;
    nerve.warnings = 7;
    nerve.breach.number = 3;
    nerve.breaches = {.duration_s = 1.5, .depth_m = 0.004};
    status.fixtures.each = {nerve, {.name = "vein"}};
    status.fixtures.each[1].distance_m = std::numeric_limits<double>::infinity();
  });
  const json entries = fixtures()["fixtures"];
  EXPECT_EQ(80, entries[0]["stiffnessNPerM"]);
  EXPECT_EQ(300, entries[0]["definition"]["stiffness_n_per_m"]);
  EXPECT_EQ(1.25, entries[0]["forceN"]);
  EXPECT_EQ("soft", entries[0]["stage"]);
  EXPECT_TRUE(entries[1]["stage"].is_null());
  EXPECT_EQ(7, entries[0]["warnings"]);
  EXPECT_EQ(3, entries[0]["breaches"]);
  EXPECT_EQ(1.5, entries[0]["breachedS"]);
  EXPECT_EQ(0.004, entries[0]["deepestBreachM"]);
  EXPECT_EQ("keep", entries[0]["onCameraLoss"]);
  EXPECT_EQ("fade", entries[2]["onCameraLoss"]);
  EXPECT_TRUE(entries[1]["distanceM"].is_null()) << "infinite: not known";
  const json each = askStatus("io.hapticd.Status.GetStatus")["parameters"]["status"]["fixtures"]["each"];
  EXPECT_EQ(json({{"name", "nerve"},
                  {"distanceM", nullptr},
                  {"forceN", 1.25},
                  {"stiffnessNPerM", 80.0},
                  {"configuredStiffnessNPerM", 300.0},
                  {"stage", "soft"},
                  {"warnings", 7},
                  {"breaches", 3},
                  {"breachedS", 1.5},
                  {"deepestBreachM", 0.004},
                  {"lagM", 0.0}}),
            each[0]);
}

TEST_F(AdditionMethodsTest, TakesAndShowsTheOrientationOfABoxAsAQuaternion) {
  json box_fixture{{"name", "cage"},
                   {"kind", "box"},
                   {"position_m", {0, 0, 0}},
                   {"size_m", {1, 1, 1}},
                   {"orientation_xyzw", {0, 0, 0.6, 0.8}}};
  add(box_fixture);
  const json cage = fixtures()["fixtures"][0];
  EXPECT_NEAR(cage["orientationXyzw"][2].get<double>(), 0.6, 1e-12);
  EXPECT_NEAR(cage["orientationXyzw"][3].get<double>(), 0.8, 1e-12);
  EXPECT_NEAR(cage["definition"]["rotation_deg"][2].get<double>(), 2 * 36.8698976458, 1e-9);
  EXPECT_FALSE(cage["definition"].contains("orientation_xyzw")) << "it would be given twice";
  box_fixture["rotation_deg"] = {0, 0, 0};
  box_fixture["name"] = "other";
  EXPECT_EQ("orientation_xyzw", refusal({{"add", json::array({box_fixture})}})["field"]);
  add(sphere("nerve"));
  EXPECT_TRUE(fixtures()["fixtures"][1]["orientationXyzw"].is_null());
}

/// The reasons of all problems, one on each line.
std::string reasonsIn(const json& refused) {
  std::string all;
  for (const json& problem : refused["problems"])
    all += problem["name"].get<std::string>() + ": " + problem["reason"].get<std::string>() + "\n";
  return all;
}

TEST_F(AdditionMethodsTest, NamesTheLimitOfSixteenFixtures) {
  json many = json::array();
  for (int i = 0; i < 17; ++i) many.push_back(sphere("s" + std::to_string(i)));
  EXPECT_EQ("s16: there would be 17 fixtures, and at most 16 are possible\n",
            reasonsIn(refusal({{"add", many}})));
  add(json(many.begin(), many.begin() + 10));
  EXPECT_EQ(
      "s6: there would be 17 fixtures, and at most 16 are possible\n",
      reasonsIn(refusal({{"add", json(many.begin(), many.begin() + 7)}}))
          .substr(0, std::string("s6: there would be 17 fixtures, and at most 16 are possible\n").size()));
  EXPECT_EQ(": the call names 17 fixtures to change, and there are at most 16\n",
            reasonsIn(refusal({{"change", many}})));
  json regions = json::array();
  for (int i = 0; i < 33; ++i) regions.push_back(tissue("t" + std::to_string(i), 0, 300));
  const json refused = ask("ChangeRegions", {{"add", regions}});
  EXPECT_EQ("io.hapticd.Control.RegionRefused", refused["error"]);
  EXPECT_EQ("t32: there would be 33 regions, and at most 32 are possible\n",
            reasonsIn(refused["parameters"]));
}

TEST_F(AdditionMethodsTest, SaysWhatIsNull) {
  add(sphere("nerve"));
  EXPECT_EQ(": fixture 2 of the list 'add' is null, not a definition\n",
            reasonsIn(refusal({{"add", {sphere("a"), nullptr}}})));
  EXPECT_EQ(": fixture 1 of the list 'change' is null, not an object\n",
            reasonsIn(refusal({{"change", {nullptr}}})));
  EXPECT_EQ(": fixture 1 of the list 'remove' is a number, not a name\n",
            reasonsIn(refusal({{"remove", json::array({7})}})));
  json without = sphere("a");
  without["radius_m"] = nullptr;
  const json refused = refusal({{"add", json::array({without})}});
  EXPECT_EQ("radius_m", refused["field"]);
  EXPECT_EQ("a: has no value (null)\n", reasonsIn(refused));
  without = sphere("a");
  without["name"] = nullptr;
  EXPECT_NE(
      std::string::npos,
      reasonsIn(refusal({{"add", json::array({without})}})).find("fixture 1 of the list: name has no value"));
}

TEST_F(AdditionMethodsTest, ListsAllProblemsOfAllFixturesAtOnce) {
  add(sphere("nerve"));
  json wide = sphere("wide", 11);
  wide["stiffness_n_per_m"] = 0;
  const json refused = refusal(
      {{"remove", {"ghost"}},
       {"change", {{{"name", "nerve"}, {"radius_m", 0}, {"side", "left"}}}},
       {"add", {sphere("flat", 0), wide, sphere("nerve"), nullptr, {{"name", "odd"}, {"kind", "egg"}}}}});
  std::vector<std::string> places;
  for (const json& problem : refused["problems"]) {
    places.push_back(problem["name"].get<std::string>() + "." +
                     (problem["field"].is_null() ? "" : problem["field"].get<std::string>()));
    EXPECT_NE("", problem["remedy"]);
  }
  std::ranges::sort(places);
  EXPECT_EQ((std::vector<std::string>{".", "flat.radius_m", "ghost.", "nerve.name", "nerve.radius_m",
                                      "nerve.side", "odd.kind", "wide.radius_m", "wide.stiffness_n_per_m"}),
            places)
      << refused;
  EXPECT_EQ("ghost", refused["fixture"]) << "the first one";
  EXPECT_EQ(1U, names().size());
}

TEST_F(AdditionMethodsTest, KeepsFixturesAndRegionsInProfiles) {
  add(sphere("nerve"));
  ask("ChangeRegions", {{"add", json::array({tissue("liver", 0, 300)})}});
  ask("SaveProfile", {{"name", "case"}});
  ask("ChangeFixtures", {{"remove", {"nerve"}}});
  ask("SetStiffness", {{"region", "liver"}, {"stiffnessNPerM", 400}});
  EXPECT_EQ(json({"fixtures", "regions"}), ask("LoadProfile", {{"name", "case"}})["parameters"]["changed"]);
  EXPECT_EQ((std::vector<std::string>{"nerve"}), names());
  EXPECT_EQ(300, stiffness("liver"));
  EXPECT_EQ("add", logged(config::EventKind::fixture).back().at("ACTION"));
}

TEST_F(AdditionMethodsTest, SetsTheStiffnessOfARegionByItsName) {
  ask("ChangeRegions", {{"add", json::array({tissue("liver", 0, 300)})}});
  EXPECT_EQ(2, ask("SetStiffness", {{"region", "liver"},
                                    {"stiffnessNPerM", 450},
                                    {"dampingNSPerM", 2}})["parameters"]["generation"]);
  EXPECT_EQ(450, stiffness("liver"));
  EXPECT_EQ(2, box.appliedSettings().additions.regions.at(0).damping_n_s_per_m);
  const json unknown = ask("SetStiffness", {{"region", "kidney"}, {"stiffnessNPerM", 450}});
  EXPECT_EQ("io.hapticd.Control.RegionRefused", unknown["error"]);
  EXPECT_EQ("kidney", unknown["parameters"]["region"]);
  EXPECT_EQ("stiffness_n_per_m",
            ask("SetStiffness", {{"region", "liver"}, {"stiffnessNPerM", -1}})["parameters"]["field"]);
  EXPECT_EQ(450, stiffness("liver"));
}

TEST_F(AdditionMethodsTest, RefusesLabelsOfDifferentTransitionsUnlessAllChangeTogether) {
  const auto label = [](const char* name, int value) {
    return config::RegionSettings{.name = name, .place = rt::TissuePlace::label, .label = value};
  };
  config::Settings settings = box.appliedSettings();
  settings.additions.label_image = "labels.pgm";
  settings.additions.regions = {label("liver", 1), label("bone", 2)};
  stop();
  box.setSettings(settings);
  start();
  const json before = regions();
  const auto wider = [](const char* name) { return json{{"name", name}, {"transition_m", 0.02}}; };
  const json refused = ask("ChangeRegions", {{"change", json::array({wider("bone")})}});
  EXPECT_EQ("io.hapticd.Control.RegionRefused", refused["error"]);
  EXPECT_EQ("bone", refused["parameters"]["region"]);
  EXPECT_EQ("transition_m", refused["parameters"]["field"]);
  EXPECT_NE(std::string::npos, refused["parameters"]["reason"].get<std::string>().find("region liver"));
  EXPECT_NE("", refused["parameters"]["remedy"]);
  EXPECT_EQ(before, regions());
  const json changed = ask("ChangeRegions", {{"change", {wider("liver"), wider("bone")}}});
  EXPECT_FALSE(changed.contains("error")) << changed;
}

TEST_F(AdditionMethodsTest, FeedsMeasurementsIntoTheRegionThatContainsThem) {
  ask("ChangeRegions", {{"add", {tissue("left", -0.2, 300), tissue("right", 0.2, 300)}}});
  EXPECT_EQ(json({{"region", "right"}, {"stiffnessNPerM", 500}}), feed(0.21, 500)["parameters"]);
  EXPECT_EQ(600, feed(0.19, 800, {{"weight", 0.5}})["parameters"]["stiffnessNPerM"])
      << "(500 + 800 / 2) / 1.5";
  EXPECT_EQ(errorReply("io.hapticd.Control.OutsideRegions"), feed(0.5, 500));
  EXPECT_EQ("io.hapticd.Control.RegionRefused", feed(0.2, -5)["error"]);
  EXPECT_EQ(invalidParameter("weight"), feed(0.2, 500, {{"weight", 0}}));
  EXPECT_EQ(2, ask("SetStiffness", {{"region", "left"}, {"stiffnessNPerM", 310}})["parameters"]["generation"])
      << "measurements are no change of the list";
  EXPECT_EQ(600, stiffness("right")) << "a change waits for the measurements before it";
  const auto entries = logged(config::EventKind::region);
  EXPECT_EQ(1, std::ranges::count(entries, "feed", [](const auto& fields) { return fields.at("ACTION"); }));
}

TEST_F(AdditionMethodsTest, TakesMeasurementsFromCallsThatExpectNoAnswer) {
  ask("ChangeRegions", {{"add", json::array({tissue("liver", 0, 300)})}});
  RawClient client = controlClient();
  client.call(R"({"method":"io.hapticd.Control.FeedStiffness","oneway":true,)"
              R"("parameters":{"xM":0,"yM":0,"zM":0,"stiffnessNPerM":520}})");
  client.call(R"({"method":"io.hapticd.Status.ListRegions"})");
  EXPECT_TRUE(client.json().contains("parameters"));
  EXPECT_TRUE(hapticd::test::becomesTrue([this] { return stiffness("liver") == 520; }));
}

TEST_F(AdditionMethodsTest, TakesSixteenLongPathsInOneCallAndListsThem) {
  json paths = json::array();
  for (int i = 0; i < 16; ++i) {
    json points = json::array();
    for (int k = 0; k < 256; ++k) points.push_back({0.001 * k, 0.01 * i, -0.8 + 0.0001 * (k % 7)});
    paths.push_back({{"name", "path" + std::to_string(i)}, {"kind", "path"}, {"points_m", points}});
  }
  add(paths);
  EXPECT_EQ(256U, fixtures()["fixtures"][15]["definition"]["points_m"].size());
}

}  // namespace
}  // namespace hapticd::daemon::test

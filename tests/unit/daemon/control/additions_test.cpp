// SPDX-License-Identifier: Apache-2.0
// Virtual fixtures, tissue regions and the solids that clients send, over the real sockets.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <string>

#include "config/base/descriptor.h"
#include "control_fixture.h"
#include "tests/support/made_solid.h"
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

  json fixtures() { return askStatus("io.hapticd.Status.ListFixtures")["parameters"]; }
  json regions() { return askStatus("io.hapticd.Status.ListRegions")["parameters"]; }
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
};

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

// --- solids

/// A client that passes files along with its calls.
class SolidMethodsTest : public ControlFixture {
 protected:
  void SetUp() override { start(); }

  json change(const json& changes) { return ask("ChangeFixtures", changes); }
  void add(const json& definition) {
    const json reply = change({{"add", {definition}}});
    ASSERT_FALSE(reply.contains("error")) << reply;
  }
  json firstFixture() { return askStatus("io.hapticd.Status.ListFixtures")["parameters"]["fixtures"][0]; }
  json store(const base::Descriptor& memory, const std::string& method = "io.hapticd.Control.StoreSolid") {
    return storeAt(controlPath(), memory, method);
  }
  static json storeAt(const std::string& socket, const base::Descriptor& memory, const std::string& method) {
    RawClient client(socket);
    client.pass(json{{"method", method}}.dump(), {memory.get()});
    return client.json();
  }
  json shapeOf(const json& sha256) {
    return askStatus("io.hapticd.Status.GetSolid", json{{"solid", sha256}}.dump());
  }
  static json solid(const std::string& name, const json& sha256) {
    return {{"name", name}, {"kind", "solid"}, {"solid", sha256}, {"position_m", {0, 0, -0.8}}};
  }
};

TEST_F(SolidMethodsTest, StoresASolidThatFixturesReferTo) {
  const std::string bytes = hapticd::test::ballBytes(0.02);
  const json stored = store(hapticd::test::memoryFile(bytes));
  ASSERT_FALSE(stored.contains("error")) << stored;
  const json sha256 = stored["parameters"]["solid"];
  add(solid("organ", sha256));
  const json entry = firstFixture();
  EXPECT_EQ(entry["definition"]["solid"], sha256);
  EXPECT_EQ(entry["orientationXyzw"], json({0, 0, 0, 1}));
  // The force loop has it: the resting hand is half a metre in front of the wall.
  EXPECT_TRUE(entry["stiffnessNPerM"].is_number()) << entry;

  const json missing = change({{"add", {solid("other", std::string(64, 'a'))}}});
  EXPECT_EQ(missing["error"], "io.hapticd.Control.FixtureRefused");
  EXPECT_EQ(missing["parameters"]["field"], "solid");
  EXPECT_NE(missing["parameters"]["reason"].get<std::string>().find("the box does not have"),
            std::string::npos);
}

TEST_F(SolidMethodsTest, ShowsTheShapeOfASolidToEverybodyOrSaysWhyNot) {
  const json sha256 = store(hapticd::test::memoryFile(hapticd::test::ballBytes(0.02)))["parameters"]["solid"];
  add(solid("organ", sha256));
  const json shown = shapeOf(sha256)["parameters"];
  EXPECT_EQ(json({"made", 1e-5, 0.002}), json({shown["source"], shown["errorM"], shown["spacingM"]}));
  EXPECT_LT(20U, shown["outline"].size());
  for (const json& line : shown["outline"]) {
    ASSERT_EQ(0U, line.size() % 3);
    for (std::size_t i = 0; i < line.size(); i += 3)  // rounded by up to 0.05 mm along each axis
      EXPECT_NEAR(0.02,
                  std::hypot(line[i].get<double>(), line[i + 1].get<double>(), line[i + 2].get<double>()),
                  1e-4);
  }
  change({{"remove", {"organ"}}});
  EXPECT_NE(std::string::npos, shapeOf(sha256).dump().find("is not in memory"));
  EXPECT_EQ("io.hapticd.Status.NoSolid", shapeOf("../organ")["error"]);
}

TEST_F(SolidMethodsTest, RefusesWhatIsNoSolid) {
  const auto reasonOf = [](const json& reply) {
    EXPECT_EQ(reply["error"], "io.hapticd.Control.SolidRefused") << reply;
    return reply["parameters"]["reason"].get<std::string>();
  };
  EXPECT_NE(reasonOf(ask("StoreSolid")).find("no memory file came with the call"), std::string::npos);
  EXPECT_NE(reasonOf(store(hapticd::test::memoryFile("x"))).find("is not the file of a solid"),
            std::string::npos);
  EXPECT_NE(reasonOf(store(hapticd::test::memoryFile(hapticd::test::ballBytes(0.02), 0))).find("sealed"),
            std::string::npos);
}

/// The descriptor belongs to the message that it came with, and who may only read can pass none.
TEST_F(SolidMethodsTest, ADescriptorGoesWithItsOwnCall) {
  const base::Descriptor memory = hapticd::test::memoryFile(hapticd::test::ballBytes(0.02));
  RawClient client = controlClient();
  client.pass(json{{"method", "io.hapticd.Status.GetStatus"}}.dump(), {memory.get()});
  EXPECT_TRUE(client.json()["parameters"].contains("status"));
  client.call(json{{"method", "io.hapticd.Control.StoreSolid"}}.dump());
  EXPECT_EQ(client.json()["error"], "io.hapticd.Control.SolidRefused");
  client.pass(json{{"method", "io.hapticd.Control.StoreSolid"}}.dump(), {memory.get()});
  EXPECT_TRUE(client.json()["parameters"].contains("solid"));
  // Pipelined behind a call without one.
  client.call(json{{"method", "io.hapticd.Status.ListFixtures"}}.dump());
  client.pass(json{{"method", "io.hapticd.Control.StoreSolid"}}.dump(), {memory.get()});
  EXPECT_TRUE(client.json()["parameters"].contains("fixtures"));
  EXPECT_TRUE(client.json()["parameters"].contains("solid"));

  EXPECT_EQ(storeAt(statusPath(), memory, "io.hapticd.Control.StoreSolid")["error"],
            "org.varlink.service.PermissionDenied");
  EXPECT_TRUE(storeAt(statusPath(), memory, "io.hapticd.Status.GetStatus")["parameters"].contains("status"));
}

TEST_F(SolidMethodsTest, KeepsNoDescriptorsBesideTheFirst) {
  const auto open = [] { return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {}); };
  const base::Descriptor memory = hapticd::test::memoryFile(hapticd::test::ballBytes(0.02));
  const std::string get_status = json{{"method", "io.hapticd.Status.GetStatus"}}.dump();
  RawClient client = controlClient();
  client.call(get_status);
  client.json();
  const auto before = open();
  constexpr int kCalls = 20;
  for (int i = 0; i < kCalls; ++i) {
    client.pass(get_status, {memory.get(), memory.get()});
    client.json();
  }
  EXPECT_LT(open(), before + kCalls);
  client.pass(json{{"method", "io.hapticd.Control.StoreSolid"}}.dump(), {memory.get(), client.descriptor()});
  EXPECT_TRUE(client.json()["parameters"].contains("solid"));
}

TEST_F(SolidMethodsTest, NeitherAcknowledgesAFixtureWithoutItsShapeNorEngagesWithIt) {
  const json stored = store(hapticd::test::memoryFile(hapticd::test::ballBytes(0.02)));
  const std::string sha256 = stored["parameters"]["solid"];
  add(solid("organ", sha256));
  ASSERT_FALSE(change({{"remove", {"organ"}}}).contains("error"));
  std::filesystem::resize_file(folder.path("state/solids/" + sha256 + ".solid"), 200);
  // It is read from the disk, where it is damaged.
  for (const json& reply : {change({{"add", {solid("organ", sha256)}}}), ask("Engage")}) {
    EXPECT_EQ(reply["error"], "io.hapticd.Control.FixtureMissing") << reply;
    EXPECT_NE(reply["parameters"]["reason"].get<std::string>().find("fixture organ does not act"),
              std::string::npos);
  }
  // Other changes do not wait for it.
  add({{"name", "wall"}, {"kind", "plane"}, {"position_m", {0, 0, -0.9}}, {"normal", {0, 0, 1}}});
  EXPECT_TRUE(firstFixture()["distanceM"].is_null()) << firstFixture();

  // Its file is sent again.
  ASSERT_EQ(store(hapticd::test::memoryFile(hapticd::test::ballBytes(0.02)))["parameters"]["solid"], sha256);
  EXPECT_FALSE(ask("Engage").contains("error"));
  EXPECT_TRUE(hapticd::test::becomesTrue([this] { return firstFixture()["distanceM"].is_number(); }))
      << firstFixture();
}

}  // namespace
}  // namespace hapticd::daemon::test

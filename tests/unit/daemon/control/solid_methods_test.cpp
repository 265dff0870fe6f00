// SPDX-License-Identifier: Apache-2.0
// The solids that clients send, over the real sockets.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <iterator>
#include <string>

#include "config/base/descriptor.h"
#include "control_fixture.h"
#include "tests/support/made_solid.h"
#include "tests/support/program.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;

/// A client that passes files along with its calls.
class SolidMethodsTest : public ControlFixture {
 protected:
  void SetUp() override { start(); }

  json ask(const std::string& method, const json& parameters = json::object()) {
    return askControl("io.hapticd.Control." + method, parameters.dump());
  }
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

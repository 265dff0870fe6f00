// SPDX-License-Identifier: Apache-2.0
// Fixtures and regions read back from their texts as they were, and changes keep what they do not name.

#include <gtest/gtest.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "config/additions/addition_json.h"
#include "config/additions/addition_reader.h"
#include "config/base/sha256.h"
#include "config/settings/fixture_settings.h"

namespace hapticd::config {
namespace {

using Json = nlohmann::json;

class RandomAdditions {
 public:
  explicit RandomAdditions(unsigned seed) : random_(seed) {}

  SceneAdditions next() {
    SceneAdditions additions;
    additions.label_image = "a folder/\"labels\"\\.pgm";
    for (int count = below(rt::kMaxFixtures + 1); count > 0; --count) {
      FixtureSettings fixture;
      fixture.name = "f" + std::to_string(count);
      fixture.kind = static_cast<rt::FixtureKind>(below(rt::kWords<rt::FixtureKind>.size()));
      fill(fixture);
      fixture.clearance_m = fixture.kind == rt::FixtureKind::standoff ? 0.01 : 0;
      keepRules(fixture);
      additions.fixtures.push_back(fixture);
    }
    for (int count = below(rt::kMaxTissueRegions + 1); count > 0; --count) {
      RegionSettings region;
      region.name = "r-" + std::to_string(count);
      region.place = static_cast<rt::TissuePlace>(below(2));
      if (region.place == rt::TissuePlace::shape) region.shape = static_cast<rt::ShapeKind>(1 + below(3));
      region.model = static_cast<rt::ContactModel>(below(3));
      fill(region);
      if (region.place == rt::TissuePlace::label) region.transition_m = kLabelTransition_m;
      additions.regions.push_back(region);
    }
    return additions;
  }

 private:
  static constexpr double kLabelTransition_m = 0.03;  // must be the same for all regions with a label

  int below(std::size_t count) { return static_cast<int>(random_() % count); }
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  /// Those between several members.
  void keepRules(FixtureSettings& fixture) {
    if (rt::isGuidance(fixture.kind)) return;
    if (fixture.effect == rt::FixtureEffect::slow) {
      if (fixture.side == rt::FixtureSide::both) fixture.side = rt::FixtureSide::in;
      return;
    }
    fixture.soft_stiffness_n_per_m = between(1, fixture.stiffness_n_per_m);
    const double most_m = std::min(0.9 * fixture.max_force_n / fixture.soft_stiffness_n_per_m, 0.039);
    fixture.soft_m = fixture.side == rt::FixtureSide::out && below(2) == 0 ? between(0, most_m) : 0;
    fixture.warning_m = below(2) == 0 ? 0 : fixture.soft_m + between(0.001, 0.05);
  }
  void fill(ChangeableAddition item) {
    for (const AdditionField& field : item.fields()) {
      if (!item.has(field)) continue;
      if (const auto value = valueFor(field)) item.set(field, *value);
    }
  }
  std::optional<Value> valueFor(const AdditionField& field) {
    switch (field.kind) {
      case Kind::boolean:
        return below(2) == 0;
      case Kind::integer:
        return std::int64_t{1} + below(255);
      case Kind::number:
        return between(field.minimum, field.maximum);
      case Kind::hash:
        return base::sha256(std::to_string(below(1000)));
      case Kind::vector:
      case Kind::direction: {
        rt::Vec3 vector;
        for (double* const component : {&vector.x, &vector.y, &vector.z})
          *component = between(field.minimum, field.maximum);
        return vector;
      }
      case Kind::points: {
        std::vector<rt::Vec3> points;
        double x_m = between(-1, 1);
        for (int count = 2 + below(255); count > 0; --count) {
          x_m += between(0.001, 0.01);
          points.push_back({x_m, between(-0.001, 0.001), between(-0.001, 0.001)});
        }
        return points;
      }
      case Kind::choice:
        if (field.name == "kind" || field.name == "place" || field.name == "shape" || field.name == "model")
          return std::nullopt;  // chosen before
        return std::string(field.choices[static_cast<std::size_t>(below(field.choices.size()))]);
      default:
        return std::nullopt;
    }
  }

  std::mt19937_64 random_;
};

std::string allTexts(const std::vector<AdditionError>& errors) {
  std::string texts;
  for (const AdditionError& error : errors) texts += error.error.text() + "\n";
  return texts;
}

TEST(Additions, ReadBackFromTheirText) {
  RandomAdditions random(18);
  for (int i = 0; i < 50; ++i) {
    const SceneAdditions additions = random.next();
    ASSERT_TRUE(checkTogether(additions).empty()) << allTexts(checkTogether(additions));
    const auto read = additionsFromText(textOf(additions), "text");
    ASSERT_TRUE(read) << allTexts(read.error());
    EXPECT_EQ(*read, additions);
  }
}

TEST(Additions, ReadBackFromJson) {
  RandomAdditions random(23);
  Json list = Json::array();
  const auto readBack = [&list]<typename Owner>(const std::vector<Owner>& owners) {
    list.clear();
    for (const Owner& owner : owners) list.push_back(definitionOf<Json>(owner));
    return definitionsFrom<Owner>(nodeOf(list), "json");
  };
  for (int i = 0; i < 20; ++i) {
    const SceneAdditions additions = random.next();
    const auto fixtures = readBack(additions.fixtures);
    ASSERT_TRUE(fixtures) << allTexts(fixtures.error());
    EXPECT_EQ(*fixtures, additions.fixtures);
    const auto regions = readBack(additions.regions);
    ASSERT_TRUE(regions) << allTexts(regions.error());
    EXPECT_EQ(*regions, additions.regions);
  }
}

TEST(Additions, JsonHoldsWholeNumbersWithoutAPoint) {
  const FixtureSettings plate{
      .name = "a", .kind = rt::FixtureKind::box, .position_m = {0, -1, 0.5}, .size_m = {1, 2, 3}};
  EXPECT_EQ(definitionOf<Json>(plate).at("position_m").dump(), "[0,-1,0.5]");
  EXPECT_EQ(definitionOf<Json>(plate).at("enabled").dump(), "true");
  EXPECT_EQ(definitionOf<Json>(plate).at("kind").dump(), "\"box\"");
  EXPECT_FALSE(definitionOf<Json>(plate).contains("orientation_xyzw")) << "it has rotation_deg";
  EXPECT_FALSE(definitionOf<Json>(plate).contains("radius_m")) << "a box has none";
}

TEST(Additions, ReadBackFromLines) {
  RandomAdditions random(19);
  for (int i = 0; i < 20; ++i) {
    const SceneAdditions additions = random.next();
    std::string fixtures;
    for (const FixtureSettings& fixture : additions.fixtures) {
      fixtures += (fixtures.empty() ? "" : ",") + lineOf(fixture);
    }
    std::string regions;
    for (const RegionSettings& region : additions.regions)
      regions += (regions.empty() ? "" : ",") + lineOf(region);
    const auto read = additionsFromText(
        R"({"fixtures":[)" + fixtures + R"(],"regions":[)" + regions + R"(],"label_image":"l.pgm"})", "json");
    ASSERT_TRUE(read) << allTexts(read.error());
    EXPECT_EQ(read->fixtures, additions.fixtures);
    EXPECT_EQ(read->regions, additions.regions);
  }
}

TEST(Additions, AreReadInEveryFormOfLists) {
  const auto flow = additionsFromText(
      "fixtures: [{name: a, kind: path, points_m: [[0, 0, 0], [0.1, 0, 0]]}, {name: b, kind: standoff, "
      "clearance_m: 0.004}]",
      "flow");
  const auto block = additionsFromText(
      "fixtures:\n"
      "- name: a  # a comment\n"
      "  kind: path\n"
      "  points_m:\n"
      "    - [0, 0, 0]\n"
      "    - - 0.1\n"
      "      - 0\n"
      "      - 0\n"
      "\n"
      "-\n"
      "  name: 'b'\n"
      "  kind: \"standoff\"\n"
      "  clearance_m: 4e-3\n",
      "block");
  const auto mixed = additionsFromText(
      "fixtures:\n"
      "  - {name: a, kind: path,\n"
      "     points_m: [[0, 0, 0],\n"
      "                [0.1, 0, 0]]}\n"
      "  - {name: b, kind: standoff, clearance_m: 0.004}\n",
      "mixed");
  ASSERT_TRUE(flow) << allTexts(flow.error());
  ASSERT_TRUE(block) << allTexts(block.error());
  ASSERT_TRUE(mixed) << allTexts(mixed.error());
  EXPECT_EQ(*block, *flow);
  EXPECT_EQ(*mixed, *flow);
  EXPECT_EQ(flow->fixtures[0].points_m, (std::vector<rt::Vec3>{{0, 0, 0}, {0.1, 0, 0}}));
}

TEST(Additions, ANullIsNoValueHoweverItIsWritten) {
  for (const char* const null : {"null", "Null", "NULL", "~", ""}) {
    for (const char* const form :
         {"fixtures: [{{name: a, kind: sphere, position_m: [0, 0, 0], radius_m: {}}}]",
          "{{\"fixtures\": [{{\"name\": \"a\", \"kind\": \"sphere\", \"radius_m\": {}, \"position_m\":[0, 0, "
          "0]}}]}}",
          "fixtures:\n  - name: a\n    kind: sphere\n    radius_m: {}\n    position_m: [0, 0, 0]\n"}) {
      const std::string text = fmt::format(fmt::runtime(form), null);
      const auto read = additionsFromText(text, "text");
      ASSERT_FALSE(read) << text;
      EXPECT_EQ(read.error().size(), 1U) << text << "\n" << allTexts(read.error());
      EXPECT_EQ(read.error().front().field, "radius_m");
      EXPECT_EQ(read.error().front().error.what, "has no value (null)");
    }
  }
  const auto nulls = additionsFromText(R"({"fixtures":[null,null]})", "text");
  ASSERT_FALSE(nulls);
  EXPECT_EQ(
      allTexts(nulls.error()),
      "text:1: fixture 1 of the list: is empty (null), not a mapping of members (write it as `{name: value, "
      "...}`)\ntext:1: fixture 2 of the list: is empty (null), not a mapping of members (write it as `{name: "
      "value, ...}`)\n");
}

TEST(Additions, MayBeEmpty) {
  for (const char* const text : {"", "{}", "fixtures:\nregions: []\nlabel_image:\n", "fixtures: ~\n"}) {
    const auto read = additionsFromText(text, "text");
    ASSERT_TRUE(read) << text << allTexts(read.error());
    EXPECT_EQ(*read, SceneAdditions{}) << text;
  }
}

TEST(Additions, APathMayCrossItselfIfThatIsAllowed) {
  const std::string cross =
      "fixtures: [{name: a, kind: path, points_m: [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0.05, -0.1, 0]]";
  EXPECT_FALSE(additionsFromText(cross + "}]", "text"));
  EXPECT_TRUE(additionsFromText(cross + ", allow_crossing: true}]", "text"));
}

TEST(Additions, AClosedPathIsNoCrossing) {
  const std::string square =
      "fixtures: [{name: a, kind: path, points_m: [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], ";
  for (const char* const end : {"[0, 0.1, 0], [0, 0, 0]", "[0, 0.1, 0], [0, 0.0004, 0]", "[0, 0, 0]"}) {
    const auto read = additionsFromText(square + end + "]}]", "text");
    EXPECT_TRUE(read) << end << allTexts(read.error());
  }
  FixtureSettings ring{.name = "ring", .kind = rt::FixtureKind::path};
  for (int i = 0; i <= 24; ++i) {
    const double angle = 2 * std::numbers::pi * i / 24;
    ring.points_m.push_back({0.003 * std::cos(angle), 0.003 * std::sin(angle), 0});
  }
  EXPECT_EQ(allTexts(checkTogether({{ring}, {}, {}})), "") << "dense points at the joint";
}

TEST(Additions, DensePointsOfABendAreNoCrossing) {
  FixtureSettings bend{.name = "bend", .kind = rt::FixtureKind::path};
  for (int i = 0; i <= 8; ++i) {
    const double angle = 3.0 * i / 8;
    bend.points_m.push_back({0.0015 * std::cos(angle), 0.0015 * std::sin(angle), 0});
  }
  EXPECT_EQ(allTexts(checkTogether({{bend}, {}, {}})), "");
}

FixtureSettings nerve() {
  return {.name = "nerve", .kind = rt::FixtureKind::sphere, .position_m = {0.1, 0.2, 0.3}, .radius_m = 0.05};
}

TEST(ChangedFixture, KeepsWhatIsNotNamed) {
  const auto change = changed(nerve(), nodeOf(Json{{"radius_m", 0.06}, {"enabled", false}}));
  ASSERT_TRUE(change) << allTexts(change.error());
  FixtureSettings expected = nerve();
  expected.radius_m = 0.06;
  expected.enabled = false;
  EXPECT_EQ(*change, expected);
  EXPECT_EQ(changed(nerve(), nodeOf(Json::object())), nerve());
}

// The rotation of a box by a quaternion q, v' = q v q*, against the rotation by the angles that are kept.
TEST(Additions, TheOrientationOfABoxMayBeAQuaternion) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  constexpr double kQuarter = std::numbers::sqrt2 / 2;
  std::vector<std::array<double, 4>> all{{0, 0, 0, 1},
                                         {0, kQuarter, 0, kQuarter},
                                         {0.5, -0.5, 0.5, 0.5},
                                         {0, -kQuarter, 0, kQuarter},
                                         {1, 0, 0, 0}};
  for (int i = 0; i < 200; ++i)
    all.push_back({normal(random), normal(random), normal(random), normal(random)});
  for (auto& q : all) {
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (double& component : q) component /= length;
    const double given = 1 + 0.0009 * std::sin(normal(random));  // need not be exactly of length 1
    const std::string text = fmt::format(
        "fixtures: [{{name: a, kind: box, position_m: [0, 0, 0], size_m: [1, 1, 1], orientation_xyzw: [{}, "
        "{}, "
        "{}, {}]}}]",
        given * q[0], given * q[1], given * q[2], given * q[3]);
    const auto read = additionsFromText(text, "text");
    ASSERT_TRUE(read) << allTexts(read.error());
    EXPECT_EQ(additionsFromText(textOf(*read), "text"), *read);
    const auto set = std::make_unique<rt::FixtureSet>();
    toFixtureSet(read->fixtures, {}, {{}, {}, {}}, *set);
    const auto& r = set->fixtures[0].shape.rotation;
    const rt::Vec3 axis{q[0], q[1], q[2]};
    for (std::size_t i = 0; i < 3; ++i) {
      const rt::Vec3 v{i == 0 ? 1.0 : 0, i == 1 ? 1.0 : 0, i == 2 ? 1.0 : 0};
      const rt::Vec3 turned = v + 2 * q[3] * cross(axis, v) + 2.0 * cross(axis, cross(axis, v));
      EXPECT_LT(norm(rt::Vec3{r[i], r[i + 3], r[i + 6]} - turned), 1e-9) << text;
    }
    const Quaternion back = orientationOf(read->fixtures[0].rotation_deg);
    const double same = back.x * q[0] + back.y * q[1] + back.z * q[2] + back.w * q[3];
    EXPECT_NEAR(std::abs(same), 1, 1e-12) << text;
  }
}

TEST(ChangedFixture, TakesAQuaternionInsteadOfItsAngles) {
  FixtureSettings box{
      .name = "box", .kind = rt::FixtureKind::box, .size_m = {1, 1, 1}, .rotation_deg = {1, 2, 3}};
  const auto change = changed(box, nodeOf(Json{{"orientation_xyzw", {0, 0, 1, 0}}}));
  ASSERT_TRUE(change) << allTexts(change.error());
  box.rotation_deg = {0, 0, 180};
  EXPECT_LT(norm(change->rotation_deg - box.rotation_deg), 1e-9);
}

TEST(ChangedFixture, OfAnotherKindHasTheMembersOfThatKind) {
  const auto capsule = changed(nerve(), nodeOf(Json{{"kind", "capsule"}, {"end_m", {0, 0, 0}}}));
  ASSERT_TRUE(capsule) << allTexts(capsule.error());
  EXPECT_EQ(capsule->radius_m, 0.05);
  const auto point = changed(nerve(), nodeOf(Json{{"kind", "point"}, {"deadband_m", 0.01}}));
  ASSERT_TRUE(point) << allTexts(point.error());
  EXPECT_EQ(point->radius_m, 0);
  EXPECT_EQ(point->position_m, nerve().position_m);
  const auto incomplete = changed(nerve(), nodeOf(Json{{"kind", "box"}}));
  ASSERT_FALSE(incomplete);
  EXPECT_EQ(incomplete.error().front().field, "size_m");
}

TEST(ChangedFixture, IsRefusedWithNameFieldAndRemedy) {
  struct Case {
    const char* change;
    const char* field;
  };
  for (const auto& [change, field] :
       {Case{R"({"radius_m": 0})", "radius_m"}, Case{R"({"radius_m": "0.1"})", "radius_m"},
        Case{R"({"radius_m": null})", "radius_m"}, Case{R"({"radius_m": [0.1]})", "radius_m"},
        Case{R"({"enabled": "true"})", "enabled"}, Case{R"({"kind": 1})", "kind"},
        Case{R"({"normal": [0, 0, 1]})", "normal"}, Case{R"({"position_m": [0, "1", 2]})", "position_m"},
        Case{R"({"radius": 1})", "radius"}, Case{R"({"name": "a b"})", "name"}, Case{"[]", ""}, Case{"7", ""},
        Case{"null", ""}}) {
    const auto refused = changed(nerve(), nodeOf(Json::parse(change)));
    ASSERT_FALSE(refused) << change;
    EXPECT_EQ(refused.error().front().field, field) << change;
    EXPECT_FALSE(refused.error().front().error.remedy.empty()) << change;
  }
}

TEST(ChangedRegion, KeepsWhatIsNotNamed) {
  const RegionSettings liver{.name = "liver", .position_m = {0, 0, 1}, .radius_m = 0.1};
  const auto layered = changed(liver, nodeOf(Json{{"model", "layered"}, {"layer_m", 0.003}}));
  ASSERT_TRUE(layered) << allTexts(layered.error());
  EXPECT_EQ(layered->model, rt::ContactModel::layered);
  EXPECT_EQ(layered->layer_m, 0.003);
  EXPECT_EQ(layered->radius_m, 0.1);
  const auto refused = changed(liver, nodeOf(Json{{"layer_m", 0.003}}));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().front().field, "layer_m");
}

}  // namespace
}  // namespace hapticd::config

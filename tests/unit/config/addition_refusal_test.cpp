// SPDX-License-Identifier: Apache-2.0
// Bad fixtures and regions are refused with name, field and remedy.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "config/settings/fixture_settings.h"

namespace hapticd::config {
namespace {

struct Refusal {
  const char* label;
  std::string text;
  std::string name;   ///< of the fixture or region
  std::string field;  ///< at fault
  std::string part;   ///< of the message
};

void PrintTo(const Refusal& refusal, std::ostream* out) {
  *out << refusal.label;
}

class AdditionRefusal : public testing::TestWithParam<Refusal> {};

std::string allTexts(const std::vector<AdditionError>& errors) {
  std::string texts;
  for (const AdditionError& error : errors) texts += error.error.text() + "\n";
  return texts;
}

TEST_P(AdditionRefusal, NamesTheFieldAndARemedy) {
  const auto& [label, text, name, field, part] = GetParam();
  const auto additions = additionsFromText(text, "f.yaml");
  ASSERT_FALSE(additions);
  ASSERT_EQ(additions.error().size(), 1U) << allTexts(additions.error());
  const AdditionError& error = additions.error().front();
  EXPECT_EQ(error.name, name);
  EXPECT_EQ(error.field, field);
  EXPECT_FALSE(error.error.remedy.empty());
  EXPECT_TRUE(error.error.text().starts_with("f.yaml")) << error.error.text();
  EXPECT_NE(error.error.text().find(part), std::string::npos) << error.error.text();
}

std::string sphere(const std::string& members) {
  return "fixtures: [{name: a, kind: sphere, position_m: [0, 0, 0], " + members + "}]";
}
std::string box(const std::string& members) {
  return "fixtures: [{name: a, kind: box, position_m: [0, 0, 0], size_m: [1, 1, 1], " + members + "}]";
}
std::string path(const std::string& points, const std::string& members = "") {
  return "fixtures: [{name: a, kind: path, points_m: [" + points + "]" + members + "}]";
}
std::string region(const std::string& members) {
  return "regions: [{name: a, shape: sphere, position_m: [0, 0, 0], radius_m: 0.02, " + members + "}]";
}
std::string times(std::size_t count, const std::string& text) {
  std::string all;
  for (std::size_t i = 0; i < count; ++i) all += text;
  return all;
}
std::string points(int count) {
  std::string all;
  for (int i = 0; i < count; ++i) all += "[0, 0, " + std::to_string(0.001 * i) + "],";
  all.pop_back();
  return all;
}
std::string numbered(int count, const std::string& before, const std::string& after) {
  std::string all;
  for (int i = 0; i < count; ++i) all += before + std::to_string(i) + after;
  return all;
}

const Refusal kNames[] = {
    {"NoName", "fixtures: [{kind: standoff, clearance_m: 0.01}]", "", "name",
     "fixture 1 of the list: name: is missing"},
    {"BadName", "fixtures: [{name: a b, kind: standoff, clearance_m: 0.01}]", "a b", "name",
     "is not a valid name"},
    {"LongName", "fixtures: [{name: " + std::string(33, 'x') + ", kind: standoff, clearance_m: 0.01}]",
     std::string(33, 'x'), "name", "1 to 32 letters"},
    {"DuplicateName",
     "fixtures: [{name: a, kind: standoff, clearance_m: 0.01}, {name: a, kind: standoff, clearance_m: 0.02}]",
     "a", "name", "an earlier fixture has the same name"},
    {"UnknownKind", "fixtures: [{name: a, kind: spere, radius_m: 1}]", "a", "kind", "did you mean sphere?"},
    {"NoKind", "fixtures: [{name: a, radius_m: 1}]", "a", "kind", "is missing"},
    {"UnknownSide", sphere("radius_m: 0.1, side: left"), "a", "side", "one of: out, in, both"},
    {"NoNameOfAFrame", sphere("radius_m: 0.1, frame: a b"), "a", "frame", "world, camera or one of the list"},
    {"UnknownMember", sphere("radius_m: 0.1, radus_m: 3"), "a", "radus_m", "did you mean radius_m?"},
    {"MemberTwice", sphere("radius_m: 0.1, radius_m: 0.2"), "a", "radius_m",
     "is given twice, first in line 1"},
    {"MemberOfAnotherKind",
     "fixtures: [{name: a, kind: plane, position_m: [0, 0, 0], normal: [0, 0, 1], radius_m: 1}]", "a",
     "radius_m", "its members are: name, kind, side"},
    {"SideOfGuidance", "fixtures: [{name: a, kind: point, position_m: [0, 0, 0], side: in}]", "a", "side",
     "kind point"},
    {"SideOfStandoff", "fixtures: [{name: a, kind: standoff, clearance_m: 0.01, side: in}]", "a", "side",
     "kind standoff"},
    {"DeadbandOfForbiddenRegion", sphere("radius_m: 0.1, deadband_m: 0.01"), "a", "deadband_m",
     "kind sphere"},
    {"EscapeOfForbiddenRegion", sphere("radius_m: 0.1, escape_force_n: 1"), "a", "escape_force_n",
     "kind sphere"},
    {"MissingRadius", "fixtures: [{name: a, kind: sphere, position_m: [0, 0, 0]}]", "a", "radius_m",
     "set radius_m to 0.0001..10 m"},
    {"MissingPlace", "fixtures: [{name: a, kind: sphere, radius_m: 0.1}]", "a", "position_m", "is missing"},
    {"TooMany", "fixtures: [" + numbered(17, "{name: a", ", kind: standoff, clearance_m: 0.01},") + "]",
     "a16", "", "is one of 17 fixtures, and 16 are possible (remove 1)"},
    {"NotAList", "fixtures: {name: a}", "", "fixtures", "is not a list of fixtures"},
    {"AScalar", "fixtures: nerve", "", "fixtures", "\"nerve\" is not a list"},
    {"NotAMapping", "fixtures: [nerve]", "", "", "is not a mapping of members"},
    {"UnknownList", "fixtrues:", "", "", "did you mean fixtures?"},
};
INSTANTIATE_TEST_SUITE_P(Names, AdditionRefusal, testing::ValuesIn(kNames),
                         [](const auto& each) { return each.param.label; });

const Refusal kValues[] = {
    {"ZeroRadius", sphere("radius_m: 0"), "a", "radius_m",
     "0 m is out of range (set radius_m to 0.0001..10 m)"},
    {"NegativeRadius", sphere("radius_m: -0.1"), "a", "radius_m", "-0.1 m is out of range"},
    {"NotANumber", sphere("radius_m: .nan"), "a", "radius_m", "nan is not a finite number"},
    {"Infinite", sphere("radius_m: .inf"), "a", "radius_m", "inf is not a finite number"},
    {"Text", sphere("radius_m: big"), "a", "radius_m", "\"big\" is not a number"},
    {"Quoted", sphere("radius_m: '0.1'"), "a", "radius_m", "is text because of its quotes"},
    {"NoValue", sphere("radius_m: "), "a", "radius_m", "has no value"},
    {"ListForNumber", sphere("radius_m: [1]"), "a", "radius_m", "is a list"},
    {"TruthValue", sphere("radius_m: 0.1, enabled: 1"), "a", "enabled", "true or false"},
    {"ZeroBox", "fixtures: [{name: a, kind: box, position_m: [0, 0, 0], size_m: [1, 0, 1]}]", "a", "size_m",
     "[1, 0, 1] is out of range"},
    {"ZeroNormal", "fixtures: [{name: a, kind: plane, position_m: [0, 0, 0], normal: [0, 0, 0]}]", "a",
     "normal", "any length except zero"},
    {"ZeroAxis", "fixtures: [{name: a, kind: cone, position_m: [0, 0, 0], axis: [0, 0, 0]}]", "a", "axis",
     "is not a direction"},
    {"FarAway", "fixtures: [{name: a, kind: point, position_m: [0, 10.5, 0]}]", "a", "position_m",
     "each -10..10 m"},
    {"TwoComponents", "fixtures: [{name: a, kind: point, position_m: [0, 1]}]", "a", "position_m",
     "is not a list of three numbers"},
    {"NotFiniteComponent", "fixtures: [{name: a, kind: point, position_m: [0, .nan, 0]}]", "a", "position_m",
     "not finite"},
    {"CapsuleWithoutLength",
     "fixtures: [{name: a, kind: capsule, position_m: [1, 0, 0], end_m: [1, 0, 0], radius_m: 0.1}]", "a",
     "end_m", "use a sphere"},
    {"Stiffness", sphere("radius_m: 0.1, stiffness_n_per_m: 0.5"), "a", "stiffness_n_per_m", "1..5000 N/m"},
    {"Damping", sphere("radius_m: 0.1, damping_n_s_per_m: 51"), "a", "damping_n_s_per_m", "0..50 N s/m"},
    {"Clearance", sphere("radius_m: 0.1, clearance_m: 0.06"), "a", "clearance_m", "0..0.05 m"},
    {"StandoffWithoutClearance", "fixtures: [{name: a, kind: standoff, clearance_m: 0}]", "a", "clearance_m",
     "above 0"},
    {"Deadband", "fixtures: [{name: a, kind: point, position_m: [0, 0, 0], deadband_m: 0.2}]", "a",
     "deadband_m", "0..0.1 m"},
    {"Escape", "fixtures: [{name: a, kind: point, position_m: [0, 0, 0], escape_force_n: 41}]", "a",
     "escape_force_n", "0..40 N"},
    {"LargestForce", sphere("radius_m: 0.1, max_force_n: 0"), "a", "max_force_n", "0.05..40 N"},
    {"FadeIn", sphere("radius_m: 0.1, fade_in_s: 11"), "a", "fade_in_s", "0..10 s"},
    {"HalfAngle",
     "fixtures: [{name: a, kind: cone, position_m: [0, 0, 0], axis: [0, 0, 1], half_angle_deg: 86}]", "a",
     "half_angle_deg", "1..85 deg"},
    {"OnCameraLoss", sphere("radius_m: 0.1, on_camera_loss: kepe"), "a", "on_camera_loss",
     "set on_camera_loss to one of: auto, keep, fade"},
    {"OrientationOfThree", box("orientation_xyzw: [0, 0, 0]"), "a", "orientation_xyzw",
     "is not a list of four numbers"},
    {"OrientationOfZero", box("orientation_xyzw: [0, 0, 0, 0]"), "a", "orientation_xyzw",
     "has the length 0, and a rotation has the length 1 (set orientation_xyzw to [x, y, z, w] of length 1"},
    {"OrientationTooLong", box("orientation_xyzw: [0, 0, 0, 1.0011]"), "a", "orientation_xyzw",
     "has the length 1.0011"},
    {"OrientationNotFinite", box("orientation_xyzw: [0, 0, .nan, 1]"), "a", "orientation_xyzw",
     "has the length nan"},
    {"OrientationBesideAngles", box("orientation_xyzw: [0, 0, 0, 1], rotation_deg: [0, 0, 0]"), "a",
     "orientation_xyzw", "is given together with rotation_deg, which says the same (delete one of the two)"},
    {"OrientationOfASphere", sphere("radius_m: 0.1, orientation_xyzw: [0, 0, 0, 1]"), "a", "orientation_xyzw",
     "is not a member of a fixture of kind sphere"},
    {"NoRoomInside", sphere("radius_m: 0.02, side: in, clearance_m: 0.02"), "a", "clearance_m",
     "no room inside"},
    {"NoRoomInABox",
     "fixtures: [{name: a, kind: box, position_m: [0, 0, 0], size_m: [1, 1, 0.02], side: in, clearance_m: "
     "0.011}]",
     "a", "clearance_m", "below 0.01 m"},
    {"NoRoomInTheSoftLayer", sphere("radius_m: 0.02, side: in, clearance_m: 0.005, soft_m: 0.015"), "a",
     "soft_m", "set soft_m below 0.015 m"},
    {"StandoffWithAThickLayer", "fixtures: [{name: a, kind: standoff, clearance_m: 0.04, soft_m: 0.015}]",
     "a", "soft_m", "reach 0.055 m from the surface, and a standoff may reach 0.05 m"},
    {"WarningInTheSoftLayer", sphere("radius_m: 0.1, warning_m: 0.005, soft_m: 0.005"), "a", "warning_m",
     "set warning_m above 0.005 m, or to 0"},
    {"LayerStifferThanTheRegion", sphere("radius_m: 0.1, soft_m: 0.002, soft_stiffness_n_per_m: 301"), "a",
     "soft_stiffness_n_per_m", "at most 300 N/m"},
    {"LayerThatReachesTheLargestForce", sphere("radius_m: 0.1, soft_m: 0.02"), "a", "soft_m",
     "0.02 m at 100 N/m are 2 N, and the boundary behind it could not be felt (set soft_m below 0.02 m"},
    {"LayerOfGuidance", "fixtures: [{name: a, kind: point, position_m: [0, 0, 0], soft_m: 0.01}]", "a",
     "soft_m", "is not a member of a fixture of kind point"},
    {"Breach", sphere("radius_m: 0.1, breach_m: 0"), "a", "breach_m", "0.0001..0.05 m"},
    {"Effect", sphere("radius_m: 0.1, effect: stop"), "a", "effect", "one of: hold, slow"},
    {"EffectOfGuidance", "fixtures: [{name: a, kind: point, position_m: [0, 0, 0], effect: slow}]", "a",
     "effect", "is not a member of a fixture of kind point"},
    {"StiffnessOfAZone", sphere("radius_m: 0.1, effect: slow, stiffness_n_per_m: 200"), "a",
     "stiffness_n_per_m", "is not a member of a fixture of kind sphere and effect slow"},
    {"LayerOfAZone", sphere("radius_m: 0.1, effect: slow, soft_m: 0.002"), "a", "soft_m",
     "is not a member of a fixture of kind sphere and effect slow"},
    {"ViscosityOfARegion", sphere("radius_m: 0.1, viscosity_n_s_per_m: 2"), "a", "viscosity_n_s_per_m",
     "is not a member of a fixture of kind sphere"},
    {"SpeedLimit", sphere("radius_m: 0.1, effect: slow, speed_limit_m_per_s: 2"), "a", "speed_limit_m_per_s",
     "0..1 m/s"},
    {"BothSidesOfAZone", sphere("radius_m: 0.1, effect: slow, side: both"), "a", "side",
     "set side to out, to slow the HIP inside the shape"},
};
INSTANTIATE_TEST_SUITE_P(Values, AdditionRefusal, testing::ValuesIn(kValues),
                         [](const auto& each) { return each.param.label; });

const Refusal kPaths[] = {
    {"OnePoint", path("[0, 0, 0]"), "a", "points_m", "has 1 point (give 2 to 256 points)"},
    {"TooManyPoints", path(points(257)), "a", "points_m", "has 257 points"},
    {"PointsTooNear", path("[0, 0, 0], [0, 0, 0.0004]"), "a", "points_m",
     "points 1 and 2 are 0.0004 m apart"},
    {"TurnsBack", path("[0, 0, 0], [0, 0, 0.1], [0, 0.001, 0]"), "a", "points_m", "at point 2"},
    {"CrossesItself", path("[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0.05, -0.1, 0]"), "a", "points_m",
     "set allow_crossing to true"},
    {"AlmostClosed", path("[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0], [0, 0.0006, 0]"), "a",
     "points_m", "to make it a closed path, end it in its first point"},
    {"ClosedEight", path("[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0.1, 0.1, 0], [0, 0, 0]"), "a", "points_m",
     "crosses itself: the segments from point 2 to 3 and from 4 to 5"},
    {"ClosedBesideItsStart", path("[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.0002, 0], [0, 0.0004, 0]"),
     "a", "points_m", "points 4 and 5 are 0.0002 m apart"},
    {"ClosedByTurningBack", path("[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0.05, 0.001, 0], [0, 0, 0]"), "a",
     "points_m", "turns by 178.9 degrees at point 5"},
    {"SmallLoop", path("[0, 0, 0], [0.002, 0, 0], [0.002, 0.001, 0], [0.0015, 0.001, 0], [0.0015, -0.01, 0]"),
     "a", "points_m", "crosses itself"},
    {"BendRadius", path("[0, 0, 0], [0.1, 0, 0]", ", bend_radius_m: 0"), "a", "bend_radius_m",
     "0.0005..0.1 m"},
    {"NotAPoint", path("[0, 0, 0], 7"), "a", "points_m", "point 2: is not a list of three numbers"},
};
INSTANTIATE_TEST_SUITE_P(Paths, AdditionRefusal, testing::ValuesIn(kPaths),
                         [](const auto& each) { return each.param.label; });

const Refusal kRegions[] = {
    {"NoShape", "regions: [{name: a}]", "a", "shape", "is missing"},
    {"Cone", "regions: [{name: a, shape: cone}]", "a", "shape", "one of: sphere, box, capsule"},
    {"LabelOfAShape", region("label: 3"), "a", "label", "is not a member of a region of shape sphere"},
    {"ShapeOfALabel", "label_image: l.pgm\nregions: [{name: a, place: label, label: 3, radius_m: 0.1}]", "a",
     "radius_m", "place label"},
    {"NoLabel", "label_image: l.pgm\nregions: [{name: a, place: label}]", "a", "label",
     "whole number 1..255"},
    {"LabelZero", "label_image: l.pgm\nregions: [{name: a, place: label, label: 0}]", "a", "label", "1..255"},
    {"LabelFraction", "label_image: l.pgm\nregions: [{name: a, place: label, label: 1.5}]", "a", "label",
     "is not a whole number"},
    {"NoLabelImage", "regions: [{name: a, place: label, label: 1}]", "a", "label", "set label_image"},
    {"Transition", region("transition_m: 0.001"), "a", "transition_m", "0.002..0.1 m"},
    {"TransitionsOfLabels",
     "label_image: l.pgm\nregions: [{name: a, place: label, label: 1}, {name: b, place: label, label: 2, "
     "transition_m: 0.02}]",
     "b", "transition_m",
     "f.yaml:2: region b: transition_m: 0.02 m differs from the 0.01 m of region a, and all regions of place "
     "label share one width (set transition_m to 0.01 m, or to another width in all of these regions at "
     "once)"},
    {"Stiffness", region("stiffness_n_per_m: 5001"), "a", "stiffness_n_per_m", "1..5000 N/m"},
    {"Exponent", region("model: hunt_crossley, exponent: 2.1"), "a", "exponent", "1..2"},
    {"ExponentOfLinear", region("exponent: 2"), "a", "exponent", "model linear"},
    {"DampingPerSpeed", region("model: hunt_crossley, damping_per_speed_s_per_m: 6"), "a",
     "damping_per_speed_s_per_m", "0..5 s/m"},
    {"Layer", region("model: layered, layer_m: 0"), "a", "layer_m", "0.0005..0.05 m"},
    {"Orientation",
     "regions: [{name: a, shape: box, position_m: [0, 0, 0], size_m: [1, 1, 1], orientation_xyzw: [1, 1, 0, "
     "0]}]",
     "a", "orientation_xyzw", "has the length 1.41421"},
    {"Friction", region("friction: 3"), "a", "friction", "0..2"},
    {"CueForce", region("cue_force_n: 0.4"), "a", "cue_force_n", "0..0.3 N"},
    {"CueFrequency", region("cue_hz: 251"), "a", "cue_hz", "1..250 Hz"},
    {"TooMany",
     "regions: [" + numbered(33, "{name: a", ", shape: sphere, position_m: [0, 0, 0], radius_m: 1},") + "]",
     "a32", "", "33 regions, and 32 are possible"},
};
INSTANTIATE_TEST_SUITE_P(Regions, AdditionRefusal, testing::ValuesIn(kRegions),
                         [](const auto& each) { return each.param.label; });

TEST(AdditionsText, MayHaveOtherTransitionsForShapesThanForLabels) {
  const std::string label = "place: label, transition_m: 0.02, label: ";
  const auto additions = additionsFromText(
      "label_image: l.pgm\nregions: [{name: a, shape: sphere, position_m: [0, 0, 0], "
      "radius_m: 0.1, transition_m: 0.01}, {name: b, " +
          label + "1}, {name: c, " + label + "2}]",
      "f.yaml");
  EXPECT_TRUE(additions) << allTexts(additions.error());
}

TEST(AdditionsText, DoesNotCompareTransitionsOfLabelsWhereOneIsUnknown) {
  const std::string label = "place: label, transition_m: ";
  const auto additions = additionsFromText("label_image: l.pgm\nregions: [{name: a, " + label +
                                               "wide, label: 1}, {name: b, " + label + "0.02, label: 2}]",
                                           "f.yaml");
  ASSERT_FALSE(additions);
  ASSERT_EQ(additions.error().size(), 1U) << allTexts(additions.error());
  EXPECT_EQ(additions.error()[0].name, "a");
}

TEST(AdditionsText, AreAllRefusedTogetherInTheOrderOfTheirLines) {
  const auto additions = additionsFromText(
      "fixtures:\n"
      "  - name: a\n"
      "    kind: sphere\n"
      "    position_m: [0, 0, 0]\n"
      "    radius_m: -1\n"
      "    side: left\n"
      "  - name: b\n"
      "    kind: nothing\n"
      "regions:\n"
      "  - name: c\n"
      "    shape: sphere\n"
      "    position_m: [0, 0, 0]\n"
      "    radius_m: 0.1\n"
      "    friction: 9\n",
      "f.yaml");
  ASSERT_FALSE(additions);
  EXPECT_EQ(
      allTexts(additions.error()),
      "f.yaml:5: fixture a: radius_m: -1 m is out of range (set radius_m to 0.0001..10 m)\n"
      "f.yaml:6: fixture a: side: \"left\" is not an allowed choice (set side to one of: out, in, both)\n"
      "f.yaml:8: fixture b: kind: \"nothing\" is not an allowed choice (set kind to one of: standoff, plane, "
      "box, sphere, capsule, cone, solid, path, point)\n"
      "f.yaml:14: region c: friction: 9 is out of range (set friction to 0..2)\n");
}

TEST(AdditionsText, WithAMillionPointsIsRefusedByItsLength) {
  const auto additions = additionsFromText(path(times(1'000'000, "[0,0,0],")), "f.yaml");
  ASSERT_FALSE(additions);
  ASSERT_EQ(additions.error().size(), 1U);
  EXPECT_EQ(additions.error()[0].error.text(),
            "f.yaml: is longer than 1 MiB (a path has at most 256 points; leave out the others)");
}

TEST(AdditionsText, WithAHundredThousandPointsNamesTheFixtureAndIsNotReadToItsEnd) {
  const auto additions = additionsFromText(path(times(100'000, "[0,0,0],")), "f.yaml");
  ASSERT_FALSE(additions);
  ASSERT_EQ(additions.error().size(), 2U) << allTexts(additions.error());
  EXPECT_EQ(additions.error()[0].name, "a");
  EXPECT_EQ(additions.error()[0].field, "points_m");
  EXPECT_NE(additions.error()[0].error.what.find("has at least "), std::string::npos);
  EXPECT_NE(additions.error()[1].error.what.find("not read any further"), std::string::npos);
}

TEST(AdditionsText, DamagedYamlIsRefusedWithItsLine) {
  for (const char* const text :
       {"fixtures: [{name: a", "fixtures:\n  - name: a\n    kind: *b\n", "fixtures: [{name: !x a}]",
        "fixtures:\n  - name: a\n    kind:\n      sphere\n", "fixtures: []\nfixtures: []\n"}) {
    const auto additions = additionsFromText(text, "f.yaml");
    ASSERT_FALSE(additions) << text;
    EXPECT_TRUE(additions.error()[0].error.text().starts_with("f.yaml:"))
        << additions.error()[0].error.text();
  }
}

}  // namespace
}  // namespace hapticd::config

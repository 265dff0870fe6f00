// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/field/mesh_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "tests/unit/tools/solids/made_up_solids.h"
#include "tools/lib/solids/files/mesh_reader.h"

// Sampled meshes of bodies whose signed distance is known in closed form.
namespace hapticd::solids {
namespace {

using rt::Vec3;
using test::MadeUpBody;

constexpr double kFloat_m = 2e-8;  // half a unit in the last place of a float of 0.2 m

FieldOptions within(double tolerance_m) {
  FieldOptions options;
  options.tolerance_m = tolerance_m;
  return options;
}

/// Calls check(value, true distance, place) for each sample.
void forEachSample(const SampledField& field, const MadeUpBody& body,
                   const std::function<void(double, double, const Vec3&)>& check) {
  for (int z = 0; z < field.samples[2]; ++z)
    for (int y = 0; y < field.samples[1]; ++y)
      for (int x = 0; x < field.samples[0]; ++x) {
        const Vec3 place = field.placeOf(x, y, z);
        check(static_cast<double>(field.distance_m[field.indexOf(x, y, z)]), body.distance_m(place), place);
      }
}

/// Share of samples with the wrong sign, farther from the surface than the mesh is.
double wrongSigns(const SampledField& field, const MadeUpBody& body) {
  std::size_t wrong = 0;
  forEachSample(field, body, [&](double value, double truth, const Vec3&) {
    if (std::abs(truth) > body.sagitta_m && (value < 0) != (truth < 0)) ++wrong;
  });
  return static_cast<double>(wrong) / static_cast<double>(field.count());
}

MadeUpBody randomBody(int trial, std::mt19937_64& random) {
  const auto among = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const Vec3 centre{among(-0.1, 0.1), among(-0.1, 0.1), among(-0.1, 0.1)};
  switch (trial % 4) {
    case 0:
      return test::sphereBody(centre, among(0.008, 0.03));
    case 1:
      return test::torusBody(centre, among(0.02, 0.03), among(0.006, 0.012));
    case 2:
      return test::boxBody(centre, {among(0.01, 0.04), among(0.01, 0.04), among(0.01, 0.04)});
    default:
      return test::turned(test::capsuleBody(centre, among(0.005, 0.02), among(0.006, 0.015)));
  }
}

TEST(MeshField, IsTheDistanceOfRandomBodiesInTheBandAndHasItsSignEverywhere) {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 8; ++trial) {
    const MadeUpBody body = randomBody(trial, random);
    const auto result = fieldOfMesh(body.mesh, "body", within(0.0004));
    ASSERT_TRUE(result) << trial << ": " << result.error().text();
    const double h = result->field.spacing_m;
    EXPECT_LE(result->report.surface.max_m, 0.0004);
    EXPECT_LE(result->report.surface.rms_m, result->report.surface.max_m);
    EXPECT_EQ(wrongSigns(result->field, body), 0) << trial;
    forEachSample(result->field, body, [&](double value, double truth, const Vec3&) {
      // exact in the band; beyond it the triangle is at least the nearest of a neighbour
      const double tolerance_m =
          std::abs(truth) < result->report.band_m - h ? body.sagitta_m + kFloat_m : body.sagitta_m + 0.5 * h;
      EXPECT_NEAR(value, truth, tolerance_m) << trial;
    });
  }
}

TEST(MeshField, NeverChangesFasterThanADistance) {
  const MadeUpBody body = test::torusBody({}, 0.03, 0.008);
  const auto result = fieldOfMesh(body.mesh, "body", within(0.0005));
  ASSERT_TRUE(result) << result.error().text();
  const SampledField& field = result->field;
  for (int z = 0; z + 1 < field.samples[2]; ++z)
    for (int y = 0; y + 1 < field.samples[1]; ++y)
      for (int x = 0; x + 1 < field.samples[0]; ++x)
        for (const std::size_t next :
             {field.indexOf(x + 1, y, z), field.indexOf(x, y + 1, z), field.indexOf(x, y, z + 1)}) {
          const double change =
              static_cast<double>(field.distance_m[next] - field.distance_m[field.indexOf(x, y, z)]);
          EXPECT_LE(std::abs(change), 1.001 * field.spacing_m);
        }
}

TEST(MeshField, ReachesBeyondTheBodyByTheBand) {
  const Vec3 size{0.020, 0.030, 0.040};
  FieldOptions options = within(0.001);
  options.clearance_m = 0.004;
  options.tool_radius_m = 0.006;
  const auto result = fieldOfMesh(test::boxBody({0.1, 0, 0}, size).mesh, "box", options);
  ASSERT_TRUE(result) << result.error().text();
  const SampledField& field = result->field;
  EXPECT_DOUBLE_EQ(result->report.band_m, std::max(2 * field.spacing_m + 0.015, 0.010));
  const Vec3 last = field.placeOf(field.samples[0] - 1, field.samples[1] - 1, field.samples[2] - 1);
  for (const auto& [low, high, centre, extent] :
       {std::tuple{field.origin_m.x, last.x, 0.1, size.x}, std::tuple{field.origin_m.y, last.y, 0.0, size.y},
        std::tuple{field.origin_m.z, last.z, 0.0, size.z}}) {
    EXPECT_LE(low, centre - extent / 2 - result->report.band_m + 1e-12);
    EXPECT_GE(high, centre + extent / 2 + result->report.band_m - 1e-12);
    EXPECT_LT(high - low, extent + 2 * result->report.band_m + field.spacing_m + 1e-12);
  }
}

TEST(MeshField, OfABoxIsExactAwayFromEdgesAndTooLargeNextToThem) {
  const MadeUpBody box = test::boxBody({}, {0.020, 0.030, 0.040});
  FieldOptions options = within(0.0004);
  options.clearance_m = 0.010;  // the farthest place is 12 mm away
  const auto result = fieldOfMesh(box.mesh, "box", options);
  ASSERT_TRUE(result) << result.error().text();
  const SampledField& field = result->field;
  const double h = field.spacing_m;
  ASSERT_LT(h, 0.002);
  // cells that hold neither an edge nor a plane where two faces are equally near
  for (const auto& [place_mm, phi_mm] : {std::pair{Vec3{12, 0, 0}, 2.0}, std::pair{Vec3{4, 0, -25}, 5.0},
                                         std::pair{Vec3{0, 14, -1}, -1.0}, std::pair{Vec3{-10, 0, 0}, 0.0}})
    EXPECT_NEAR(trilinearValue(field, 1e-3 * place_mm), 1e-3 * phi_mm, kFloat_m);
  // curved there: the distance to an edge and to a corner; h^2/8 times the curvature 1/phi bounds each axis
  EXPECT_NEAR(trilinearValue(field, {0.013, 0.019, 0}), 0.005, h * h / (4 * 0.005));
  EXPECT_NEAR(trilinearValue(field, {0.013, 0.019, 0.032}), 0.013, 2 * h * h / (8 * 0.013) * 2);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> along(-0.015, 0.015);
  double worst = 0;
  for (int i = 0; i < 200; ++i) {
    const double error_m = trilinearValue(field, {0.010, 0.015, along(random)});
    EXPECT_GE(error_m, -kFloat_m);
    EXPECT_LE(error_m, 0.32 * h + kFloat_m);
    worst = std::max(worst, error_m);
  }
  EXPECT_GE(result->report.surface.max_m, worst - kFloat_m);
}

/// The winding number is above 1/2 by at least the error of its dipoles, unless a hole is near.
TEST(MeshField, HasTheRightSignWhereFacesAreMissingOrTurned) {
  const MadeUpBody whole = test::sphereBody({}, 0.050, 71);  // 19,880 faces
  std::mt19937_64 random(1);
  const auto share = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
  FieldOptions options = within(0.003);
  {
    MadeUpBody missing = whole;
    std::erase_if(missing.mesh.triangles, [&](const Triangle&) { return share() < 0.05; });
    const auto result = fieldOfMesh(missing.mesh, "missing", options);
    ASSERT_TRUE(result) << result.error().text();
    EXPECT_EQ(wrongSigns(result->field, whole), 0);
    EXPECT_FALSE(result->report.warnings.empty());
  }
  {
    MadeUpBody flipped = whole;
    for (Triangle& t : flipped.mesh.triangles)
      if (share() < 0.05) std::swap(t[0], t[1]);
    const auto result = fieldOfMesh(flipped.mesh, "flipped", options);
    ASSERT_TRUE(result) << result.error().text();
    EXPECT_EQ(wrongSigns(result->field, whole), 0);
    EXPECT_GT(result->turned_faces, 500U);
  }
  {
    MadeUpBody hole = whole;
    std::erase_if(hole.mesh.triangles, [&](const Triangle& t) {
      const Vec3 p = hole.mesh.points_m[t[0]];
      return p.x > 0.050 * std::cos(10 * std::numbers::pi / 180);
    });
    const auto result = fieldOfMesh(hole.mesh, "hole", options);
    ASSERT_TRUE(result) << result.error().text();
    EXPECT_LE(wrongSigns(result->field, whole), 2e-4);
    EXPECT_GT(result->winding.unclear, 0U);
    ASSERT_FALSE(result->report.warnings.empty());
    EXPECT_NE(result->report.warnings[0].find("1 holes"), std::string::npos) << result->report.warnings[0];
  }
}

TEST(MeshField, TurnsEachPartThatIsInsideOut) {
  MadeUpBody pair =
      test::unionOf(test::sphereBody({-0.03, 0, 0}, 0.012, 24), test::sphereBody({0.03, 0, 0}, 0.015, 24));
  const std::size_t half = pair.mesh.triangles.size() / 2;
  for (std::size_t i = 0; i < half; ++i) std::swap(pair.mesh.triangles[i][0], pair.mesh.triangles[i][1]);
  const auto result = fieldOfMesh(pair.mesh, "pair", within(0.0005));
  ASSERT_TRUE(result) << result.error().text();
  EXPECT_EQ(result->turned_faces, half);
  EXPECT_EQ(wrongSigns(result->field, pair), 0);
  EXPECT_EQ(result->report.warnings.size(), 1U);
}

TEST(MeshField, LeavesACavityOpenAndFillsAShellInsideAnother) {
  const MadeUpBody outer = test::sphereBody({}, 0.03, 32), inner = test::sphereBody({}, 0.015, 32);
  MadeUpBody filled = test::unionOf(outer, inner);
  const auto solid = fieldOfMesh(filled.mesh, "shells", within(0.0005));
  ASSERT_TRUE(solid) << solid.error().text();
  EXPECT_EQ(solid->hidden_faces, inner.mesh.triangles.size());
  forEachSample(solid->field, filled, [&](double value, double truth, const Vec3&) {
    EXPECT_NEAR(value, truth, outer.sagitta_m + solid->field.spacing_m / 2);
  });
  MadeUpBody hollow = filled;
  for (std::size_t i = outer.mesh.triangles.size(); i < hollow.mesh.triangles.size(); ++i)
    std::swap(hollow.mesh.triangles[i][0], hollow.mesh.triangles[i][1]);
  hollow.distance_m = [&](const Vec3& p) { return std::max(outer.distance_m(p), -inner.distance_m(p)); };
  const auto cavity = fieldOfMesh(hollow.mesh, "cavity", within(0.0005));
  ASSERT_TRUE(cavity) << cavity.error().text();
  EXPECT_EQ(cavity->hidden_faces + cavity->turned_faces, 0U);
  EXPECT_EQ(wrongSigns(cavity->field, hollow), 0);
}

TEST(MeshField, OfCapsulesThatCrossIsTheirUnionOutside) {
  const MadeUpBody a = test::capsuleBody({}, 0.02, 0.008, 32),
                   b = test::turned(test::capsuleBody({0, 0, 0.003}, 0.02, 0.007, 32));
  const MadeUpBody both = test::unionOf(a, b);
  const auto result = fieldOfMesh(both.mesh, "cross", within(0.0003));
  ASSERT_TRUE(result) << result.error().text();
  EXPECT_GT(result->hidden_faces, 0U);
  EXPECT_EQ(wrongSigns(result->field, both), 0);
  forEachSample(result->field, both, [&](double value, double truth, const Vec3&) {
    if (truth <= 0) return;
    EXPECT_NEAR(value, truth, both.sagitta_m + result->field.spacing_m / 2);
  });
}

TEST(MeshField, OfCoarseBoxesThatCrossIsTheirUnionAlsoInside) {
  // a beam through the middle of a plate: no face is covered as a whole
  const Vec3 plate_m{0.06, 0.05, 0.012}, beam_m{0.010, 0.012, 0.05};
  const MadeUpBody both = test::unionOf(test::boxBody({}, plate_m), test::boxBody({}, beam_m));
  const auto result = fieldOfMesh(both.mesh, "cross", within(0.0006));
  ASSERT_TRUE(result) << result.error().text();
  EXPECT_GT(result->cut_faces, 0U);
  EXPECT_EQ(wrongSigns(result->field, both), 0);
  // within the plate and the beam the surface is that of the plate, with a hole where the beam is, or of the
  // beam
  const double piece_m = norm(plate_m) / 256 + result->field.spacing_m;
  double worst_m = 0;
  forEachSample(result->field, both, [&](double value, double truth, const Vec3& p) {
    const bool is_in_both =
        std::abs(p.x) < beam_m.x / 2 && std::abs(p.y) < beam_m.y / 2 && std::abs(p.z) < plate_m.z / 2;
    if (truth > 0) worst_m = std::max(worst_m, std::abs(value - truth));
    if (!is_in_both) return;
    // the nearest edges of what is left are the four where plate and beam meet
    const double to_x = beam_m.x / 2 - std::abs(p.x), to_y = beam_m.y / 2 - std::abs(p.y),
                 to_z = plate_m.z / 2 - std::abs(p.z);
    worst_m = std::max(worst_m, std::abs(-value - std::hypot(std::min(to_x, to_y), to_z)));
  });
  EXPECT_LE(worst_m, piece_m);
}

TEST(MeshField, WithDuplicatesOfOppositeOrientationIsThatOfTheFirst) {
  MadeUpBody body = test::sphereBody({}, 0.02, 24);
  const std::vector<Triangle> original = body.mesh.triangles;
  for (const Triangle& t : original) body.mesh.triangles.push_back({t[1], t[0], t[2]});
  const auto result = fieldOfMesh(body.mesh, "double", within(0.0005));
  ASSERT_TRUE(result) << result.error().text();
  EXPECT_EQ(wrongSigns(result->field, body), 0);
}

TEST(MeshField, DoesNotCallSamplesOnTheSurfaceUnclear) {
  constexpr double kHalf_m = 0.015, kSpacing_m = 0.0015, kBand_m = 0.0105;
  const MeshBody box(test::boxBody({}, {2 * kHalf_m, 2 * kHalf_m, 2 * kHalf_m}).mesh);
  SampledField field =
      gridAbout({-kHalf_m, -kHalf_m, -kHalf_m}, {kHalf_m, kHalf_m, kHalf_m}, kBand_m, kSpacing_m);
  const WindingRange winding = sampleMesh(box, kBand_m, field);
  ASSERT_GT(std::ranges::count_if(field.distance_m, [](float d) { return std::abs(d) < 1e-7F; }), 100);
  EXPECT_EQ(winding.unclear, 0U);
}

TEST(MeshField, RefusesAWideHoleAndSaysWhere) {
  MadeUpBody bowl = test::sphereBody({}, 0.03, 32);
  std::erase_if(bowl.mesh.triangles, [&](const Triangle& t) { return bowl.mesh.points_m[t[0]].z > 0.005; });
  const auto result = fieldOfMesh(bowl.mesh, "bowl", within(0.0005));
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().what.find("unclear"), std::string::npos) << result.error().text();
  EXPECT_NE(result.error().what.find("mm"), std::string::npos);
  EXPECT_NE(result.error().remedy.find("hole"), std::string::npos);
}

/// A C whose gap of 45 x 30 mm a fan about any corner would close.
TEST(MeshField, OfHollowPolygonsIsFreeBetweenThem) {
  std::string file = "# SPACE=LPS\n";
  for (const int z : {0, 15})
    for (const auto& [x, y] :
         {std::pair{0, 0}, {60, 0}, {60, 15}, {15, 15}, {15, 45}, {60, 45}, {60, 60}, {0, 60}})
      file += "v " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + "\n";
  file += "f 2 1 8 7 6 5 4 3\nf 10 11 12 13 14 15 16 9\n";
  for (int i = 1; i <= 8; ++i)
    file += "f " + std::to_string(i) + " " + std::to_string(i % 8 + 1) + " " + std::to_string(i % 8 + 9) +
            " " + std::to_string(i + 8) + "\n";
  const auto read = meshFrom(file, "c.obj");
  ASSERT_TRUE(read) << read.error().text();
  const auto result = fieldOfMesh(read->mesh, "c", within(0.0005));
  ASSERT_TRUE(result) << result.error().text();
  // 15 mm from three faces; the trilinear value errs by at most half a spacing where all are as near
  EXPECT_NEAR(trilinearValue(result->field, {0.045, 0.030, 0.0075}), 0.015, result->field.spacing_m / 2);
  EXPECT_NEAR(trilinearValue(result->field, {0.008, 0.030, 0.0075}), -0.007, result->field.spacing_m / 2);
}

TEST(MeshField, StatesWhatTheShapeOfFacesLeavesOpen) {
  const auto withLift = [](double lift_mm) {
    return meshFrom("# SPACE=LPS\nv 0 0 0\nv 30 0 0\nv 30 30 0\nv 0 30 0\nv 0 0 20\nv 30 0 20\nv 30 30 " +
                        std::to_string(20 + lift_mm) +
                        "\nv 0 30 20\nf 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n",
                    "a.obj");
  };
  const auto bent = withLift(0.8);
  ASSERT_TRUE(bent);
  EXPECT_LT(withLift(0)->mesh.error_m, 1e-9);
  // half of the lift lies between the two diagonals of the face
  EXPECT_NEAR(bent->mesh.error_m, 0.0004, 1e-6);
  TriangleMesh only_triangles = bent->mesh;
  only_triangles.error_m = 0;
  const auto stated = fieldOfMesh(bent->mesh, "bent", within(0.005)),
             measured = fieldOfMesh(only_triangles, "triangles", within(0.005));
  ASSERT_TRUE(stated && measured);
  ASSERT_EQ(stated->field.spacing_m, measured->field.spacing_m);
  EXPECT_NEAR(stated->report.surface.max_m, measured->report.surface.max_m + 0.0004, 1e-6);
  const auto refused = fieldOfMesh(bent->mesh, "bent", within(0.0003));
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("bend"), std::string::npos);
}

/// Hundreds of large triangles that are nothing: refused by some tens of thousands of samples.
TEST(MeshField, RefusesRandomTriangles) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> place_m(0, 0.1);
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < 300; ++i) {
    for (int corner = 0; corner < 3; ++corner)
      mesh.points_m.push_back({place_m(random), place_m(random), place_m(random)});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const auto result = fieldOfMesh(mesh, "nothing", within(0.0005));
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().what.find("unclear"), std::string::npos) << result.error().text();
}

/// What an effort permits, a body takes; one that is used up answers at once.
TEST(MeshField, TakesNoMoreThanItsEffort) {
  const TriangleMesh mesh =
      test::unionOf(test::sphereBody({}, 0.02, 16), test::boxBody({}, {0.03, 0.03, 0.03})).mesh;
  Effort enough, little{100'000};
  MeshBody body(mesh, &enough), hurried(mesh, &little);
  body.uncover();
  hurried.uncover();
  EXPECT_GT(body.hiddenFaces(), 0U);
  EXPECT_LT(enough.left, Effort{}.left - 100'000);
  EXPECT_EQ(little.left, 0U);
  EXPECT_TRUE(hurried.surface().isSpent());
}

TEST(MeshField, RefusesASheetThatEnclosesNothing) {
  TriangleMesh sheet{{{0, 0, 0}, {0.05, 0, 0}, {0.05, 0.05, 0}, {0, 0.05, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  EXPECT_FALSE(fieldOfMesh(sheet, "sheet", within(0.0005)));
  EXPECT_FALSE(fieldOfMesh({}, "nothing", within(0.0005)));
}

TEST(MeshField, ResolvesAThinPlateWithTwoSpacings) {
  const auto result =
      fieldOfMesh(test::boxBody({0, 0, 0.1}, {0.03, 0.03, 0.0008}).mesh, "plate", within(0.0005));
  ASSERT_TRUE(result) << result.error().text();
  ASSERT_TRUE(result->thinnest);
  EXPECT_NEAR(result->thinnest->thickness_m, 0.0008, 1e-9);
  EXPECT_NEAR(result->thinnest->place_m.z, 0.1, 1e-9);
  EXPECT_LE(result->field.spacing_m, 0.0004 + 1e-9);
  EXPECT_TRUE(result->report.warnings.empty());
  // the whole plate is there: no place in its middle plane is outside
  for (double x = -0.014; x <= 0.014; x += 0.0007)
    EXPECT_LT(trilinearValue(result->field, {x, x / 3, 0.1}), 0);
}

TEST(MeshField, SaysWhereABodyIsTooThinForItsSpacing) {
  FieldOptions options = within(0.004);
  options.limits.samples_per_axis = 48;
  const MadeUpBody body = test::unionOf(test::boxBody({0, 0, 0}, {0.04, 0.04, 0.03}),
                                        test::boxBody({0, 0, 0.03}, {0.04, 0.04, 0.001}));
  const auto result = fieldOfMesh(body.mesh, "plate", options);
  ASSERT_TRUE(result) << result.error().text();
  ASSERT_LT(0.001, 2 * result->field.spacing_m);
  ASSERT_EQ(result->report.warnings.size(), 1U);
  EXPECT_NE(result->report.warnings[0].find("1.00 mm thick"), std::string::npos)
      << result->report.warnings[0];
  EXPECT_NE(result->report.warnings[0].find("30.0) mm"), std::string::npos) << result->report.warnings[0];
}

TEST(MeshField, RefusesATolerancePastTheLimitsWithOneThatFits) {
  FieldOptions options = within(0.00005);
  options.limits.samples_per_axis = 80;
  const TriangleMesh mesh = test::boxBody({}, {0.03, 0.03, 0.03}).mesh;
  const auto refused = fieldOfMesh(mesh, "box", options);
  ASSERT_FALSE(refused);
  const std::string& remedy = refused.error().remedy;
  const std::string words = "tolerance of ";
  const double would_fit_mm = std::stod(remedy.substr(remedy.find(words) + words.size()));
  options.tolerance_m = 1e-3 * would_fit_mm;
  const auto result = fieldOfMesh(mesh, "box", options);
  ASSERT_TRUE(result) << result.error().text();
  for (const int samples : result->field.samples) EXPECT_LE(samples, 80);
}

TEST(MeshField, KeepsWithinTheNumberOfSamples) {
  FieldOptions options = within(0.001);
  options.limits.samples = 60'000;
  const auto result = fieldOfMesh(test::sphereBody({}, 0.03, 32).mesh, "sphere", options);
  ASSERT_TRUE(result) << result.error().text();
  EXPECT_LE(result->field.count(), 60'000U);
}

TEST(MeshField, MeasuresTheErrorWithTheConsumersValue) {
  FieldOptions options = within(0.0008);
  const TriangleMesh mesh = test::sphereBody({}, 0.02, 32).mesh;
  const auto plain = fieldOfMesh(mesh, "sphere", options);
  options.reader = [](const SampledField& field) {
    return [&field](const Vec3& place_m) { return trilinearValue(field, place_m) - 0.0005; };
  };
  const auto shifted = fieldOfMesh(mesh, "sphere", options);
  ASSERT_TRUE(plain && shifted);
  EXPECT_GT(shifted->report.surface.max_m, 0.00045);
  EXPECT_LT(plain->report.surface.max_m, 0.00035);
  EXPECT_EQ(shifted->report.surface.places, plain->report.surface.places);
}

TEST(MeshField, OfASphereErrsAsTheTheoryOfTrilinearSamplesSays) {
  // h^2 / (4 R), to which the edges of the mesh add 0.32 h times their angle
  const double radius_m = 0.010;
  const MadeUpBody body = test::sphereBody({}, radius_m, 64);
  for (const double h : {0.001, 0.0007}) {
    SampledField field =
        gridAbout({-radius_m, -radius_m, -radius_m}, {radius_m, radius_m, radius_m}, 0.004, h);
    for (int z = 0; z < field.samples[2]; ++z)
      for (int y = 0; y < field.samples[1]; ++y)
        for (int x = 0; x < field.samples[0]; ++x)
          field.distance_m[field.indexOf(x, y, z)] =
              static_cast<float>(body.distance_m(field.placeOf(x, y, z)));
    SampledField of_mesh = field;
    sampleMesh(MeshBody(body.mesh), 0.01, of_mesh);
    const SurfaceError exact = surfaceError(field, body.mesh.points_m, {}, trilinearReader);
    EXPECT_LE(exact.max_m, 1.01 * h * h / (4 * radius_m));
    EXPECT_GE(exact.max_m, 0.9 * h * h / (4 * radius_m));
    EXPECT_GT(exact.worst_value_m, 0);  // bodies that bulge shrink
    EXPECT_NEAR(surfaceError(of_mesh, body.mesh.points_m, {}, trilinearReader).max_m, exact.max_m,
                body.sagitta_m);
  }
}

TEST(MeshField, RefusesOptionsOutOfTheirRange) {
  const TriangleMesh mesh = test::boxBody({}, {0.03, 0.03, 0.03}).mesh;
  for (const double bad : {0.0, -1.0, 0.5, std::nan("")}) EXPECT_FALSE(fieldOfMesh(mesh, "box", within(bad)));
  FieldOptions options;
  options.clearance_m = -0.001;
  EXPECT_FALSE(fieldOfMesh(mesh, "box", options));
  options.clearance_m = 0;
  options.tool_radius_m = 1;
  EXPECT_FALSE(fieldOfMesh(mesh, "box", options));
}

}  // namespace
}  // namespace hapticd::solids

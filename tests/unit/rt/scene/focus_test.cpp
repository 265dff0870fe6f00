// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "rt/depth/depth_model.h"
#include "rt/modelling/focus/body_fit.h"
#include "rt/modelling/focus/body_kernel.h"
#include "rt/modelling/focus/corner_kernel.h"
#include "rt/modelling/surface/column_shifts.h"
#include "rt/scene/focus_body.h"
#include "rt/scene/focus_corner.h"
#include "tests/unit/rt/simd_targets.h"
#include "tools/lib/truth/body_scene.h"

namespace hapticd {
namespace {

using rt::FaceChoice;
using rt::FocusBody;
using rt::FocusCorner;
using rt::Vec3;

constexpr double kDepth_m = 1;

Vec3 unit(const Vec3& v) {
  return (1 / norm(v)) * v;
}

/// A body 1 m away on the ray (0.1, -0.05, 1) whose normal leans by about 30 degrees. Image axes.
FocusBody leaning(const rt::TangentCurvature& per_m) {
  FocusBody body;
  body.exists = true;
  body.inverse_depth_per_m = 1 / kDepth_m;
  body.ray_x = 0.1;
  body.ray_y = -0.05;
  body.normal = unit({0.4, 0.3, -1});
  body.tangent = unit(cross(body.normal, {0, 1, 0}));
  body.curvature = {per_m.along_1 * kDepth_m, per_m.twist * kDepth_m, per_m.along_2 * kDepth_m};
  body.updateMatrix();
  return body;
}

/// The place of a crossing, metres from the camera.
Vec3 placeOf(const FocusBody& body, const FocusBody::Crossing& crossing, double dx, double dy) {
  return (crossing.stretch / body.inverse_depth_per_m) * Vec3{body.ray_x + dx, body.ray_y + dy, 1};
}

constexpr double kExact_m = 1e-9;

TEST(FocusBody, IsExactlyASphereWhereBothCurvaturesAreEqual) {
  constexpr double kRadius_m = 0.03;
  const FocusBody body = leaning({1 / kRadius_m, 0, 1 / kRadius_m});
  const Vec3 centre = kDepth_m * body.ray() - kRadius_m * body.normal;
  int crossings = 0;
  for (double dx = -0.02; dx <= 0.02; dx += 0.002) {
    for (double dy = -0.02; dy <= 0.02; dy += 0.002) {
      const FocusBody::Crossing there = body.crossing(dx, dy);
      if (!there.exists) continue;
      ++crossings;
      const Vec3 off = placeOf(body, there, dx, dy) - centre;
      EXPECT_NEAR(norm(off), kRadius_m, kExact_m);
      EXPECT_NEAR(norm(unit(there.normal) - unit(off)), 0, 1e-7);
    }
  }
  EXPECT_GT(crossings, 100);
}

TEST(FocusBody, IsExactlyACylinderWhereOneCurvatureIsZero) {
  constexpr double kRadius_m = 0.01;
  const FocusBody body = leaning({0, 0, 1 / kRadius_m});
  const Vec3 axis = body.tangent;
  const Vec3 centre = kDepth_m * body.ray() - kRadius_m * body.normal;
  int crossings = 0;
  for (double dx = -0.05; dx <= 0.05; dx += 0.002) {
    for (double dy = -0.05; dy <= 0.05; dy += 0.002) {
      const FocusBody::Crossing there = body.crossing(dx, dy);
      if (!there.exists) continue;
      ++crossings;
      const Vec3 off = placeOf(body, there, dx, dy) - centre;
      EXPECT_NEAR(norm(off - dot(off, axis) * axis), kRadius_m, kExact_m);
    }
  }
  EXPECT_GT(crossings, 100);
}

TEST(FocusBody, IsTheSameBodySeenFromAnotherFocus) {
  for (const rt::TangentCurvature& curvature :
       {rt::TangentCurvature{}, rt::TangentCurvature{20, 0, 20}, rt::TangentCurvature{0, 0, 40},
        rt::TangentCurvature{10, 20, 40}, rt::TangentCurvature{-15, 0, -15}}) {
    const FocusBody body = leaning(curvature);
    const FocusBody moved = body.movedTo(0.004, -0.006);
    ASSERT_TRUE(moved.exists);
    EXPECT_NEAR(norm(moved.normal), 1, 1e-12);
    for (double dx = -0.01; dx <= 0.01; dx += 0.005) {
      for (double dy = -0.01; dy <= 0.01; dy += 0.005) {
        const FocusBody::Crossing a = body.crossing(dx + 0.004, dy - 0.006);
        const FocusBody::Crossing b = moved.crossing(dx, dy);
        if (!a.exists || !b.exists) continue;
        const Vec3 place = placeOf(body, a, dx + 0.004, dy - 0.006);
        EXPECT_NEAR(norm(placeOf(moved, b, dx, dy) - place), 0, 1e-8);
      }
    }
  }
}

/// Samples of the camera's image of a body, `count` to each side of the focus.
void sample(const FocusBody& body, const rt::BodyMeasure& measure, rt::FocusSamples& samples) {
  constexpr int kReach = 12;
  std::size_t count = 0;
  for (int cell = 0; cell < rt::FocusSamples::kCells; ++cell) {
    samples.cell_begin[cell] = count;
    for (int j = -kReach + cell / 3 * 8; j < -kReach + cell / 3 * 8 + 8; ++j) {
      for (int i = -kReach + cell % 3 * 8; i < -kReach + cell % 3 * 8 + 8; ++i) {
        const FocusBody::Crossing there = body.crossing(i / measure.focal_x_px, j / measure.focal_y_px);
        const double w = body.inverse_depth_per_m / there.stretch;
        samples.column_px[count] = static_cast<float>(i);
        samples.row_px[count] = static_cast<float>(j);
        samples.disparity_raw[count] = static_cast<float>((w - measure.b_per_m) / measure.a_per_m);
        samples.weight[count] = there.exists ? 1.0F : 0.0F;
        ++count;
      }
    }
  }
  samples.cell_begin[rt::FocusSamples::kCells] = count;
}

/// The i-th diagonal element of the normal matrix.
double diagonal(const rt::BodyEquations& equations, int i) {
  constexpr int kN = rt::BodyEquations::kParameters;
  return equations.products[i * kN - i * (i - 1) / 2];
}

class BodyEquations : public test::EachSimdTarget {};

/// Returns the body with one of its parameters changed, see BodyEquations.
FocusBody changed(const FocusBody& body, int parameter, double step, double a_per_m) {
  FocusBody result = body;
  if (parameter == 0) result.inverse_depth_per_m += a_per_m * step;
  if (parameter == 1 || parameter == 2) {
    const Vec3 along = parameter == 2 ? body.otherTangent() : body.tangent;
    result.normal = unit(body.normal + step * along);
    result.tangent = unit(body.tangent - dot(body.tangent, result.normal) * result.normal);
  }
  if (parameter == 3) result.curvature.along_1 += step;
  if (parameter == 4) result.curvature.twist += step;
  if (parameter == 5) result.curvature.along_2 += step;
  result.updateMatrix();
  return result;
}

/// The equations against central differences of the disparities, which the closed form gives in double
/// precision.
TEST_P(BodyEquations, AreTheDerivativesOfTheDisparities) {
  const rt::DepthModelParameters camera{};
  const rt::BodyMeasure measure{camera.fx_px, camera.fy_px, camera.a_per_m, camera.b_per_m, 50, 60};
  const FocusBody body = leaning({5, 3, 20});
  const auto samples = std::make_unique<rt::FocusSamples>();
  // Each parameter's derivative times a small step, as residuals: the equations must give it back.
  for (int parameter = 0; parameter < rt::BodyEquations::kParameters; ++parameter) {
    constexpr double kStep[] = {0.05, 2e-4, 2e-4, 0.05, 0.05, 0.05};
    const double step = kStep[parameter];
    sample(changed(body, parameter, -step, camera.a_per_m), measure, *samples);
    const rt::BodyEquations less = rt::equationsOf(*samples, body, measure);
    sample(changed(body, parameter, step, camera.a_per_m), measure, *samples);
    const rt::BodyEquations more = rt::equationsOf(*samples, body, measure);
    EXPECT_GT(more.sums.explained, 500);
    EXPECT_EQ(more.sums.unexplained, 0);
    int product = 0;
    for (int row = 0; row < rt::BodyEquations::kParameters; ++row) {
      for (int column = row; column < rt::BodyEquations::kParameters; ++column, ++product) {
        if (row != parameter && column != parameter) continue;
        const int other = row == parameter ? column : row;
        // The derivatives leave out how the normal's own curvature depends on the others, a few per cent of
        // what Cauchy and Schwarz allow.
        const double scale = step * std::sqrt(diagonal(more, row) * diagonal(more, column));
        EXPECT_NEAR(0.5 * (more.residuals[other] - less.residuals[other]), step * more.products[product],
                    0.05 * scale)
            << "parameter " << parameter << ", equation " << other;
      }
    }
  }
}
HAPTICD_FOR_EACH_SIMD_TARGET(BodyEquations);

/// Fits over frames of a scene without noise, with the focus on the body, and compares depths along rays with
/// the true ones.
double worstError_m(const std::vector<tools::TrueBody>& bodies, double distance_m) {
  tools::RigidFrame frame;
  frame.origin_m = {0, 0, -distance_m};
  tools::BodyScene scene(bodies, frame, {}, rt::DepthModelParameters{}, 1);
  const rt::DepthModel model(scene.depthModel(), {});
  const rt::ColumnShifts shifts(model);
  const auto fit = std::make_unique<rt::BodyFit>(model, shifts.offsets());
  const auto image = std::make_unique<rt::DepthFrame>();
  const rt::DepthModelParameters& camera = model.parameters();
  const rt::ImagePosition focus{camera.cx_px + 2.3, camera.cy_px - 3.4};
  double worst = 0;
  for (int i = 1; i <= 4; ++i) {
    scene.render(0, static_cast<std::uint64_t>(i), tools::SceneNoise::quantised, *image);
    const auto raw = [&](double du, double dv) {
      return model.disparity().rawOf(scene.trueDepth(focus.u + du, focus.v + dv, 0));
    };
    const rt::Facet facet{static_cast<float>(raw(0, 0)), static_cast<float>(raw(0.5, 0) - raw(-0.5, 0)),
                          static_cast<float>(raw(0, 0.5) - raw(0, -0.5)), 0};
    const FocusBody body = fit->fit({.image = image->raw,
                                     .pixels = model.wholeDisparity(),
                                     .focus = focus,
                                     .facet = facet,
                                     .noise = 1,
                                     .moved = {},
                                     .max_frames = 8});
    if (!body.exists) return std::numeric_limits<double>::infinity();
    worst = 0;
    for (int du = -4; du <= 4; du += 4) {
      const FocusBody::Crossing there = body.crossing(du / camera.fx_px, 0);
      const double depth_m = there.stretch / body.inverse_depth_per_m;
      worst = std::max(worst, std::abs(depth_m - scene.trueDepth(focus.u + du, focus.v, 0)));
    }
  }
  return worst;
}

/// Standard deviation of rounding to whole raw units; on a smooth surface pixels round alike, so that their
/// mean is not much better.
double rounding_m(double distance_m) {
  return std::sqrt(1.0 / 12) * std::abs(rt::DepthModelParameters{}.a_per_m) * distance_m * distance_m;
}

TEST(BodyFit, FindsPlanesBallsAndRods) {
  const tools::ConvexBody wall{{tools::Face{{0, 0, 1}, -0.12}}};
  for (const double distance_m : {0.6, 1.0}) {
    EXPECT_LT(worstError_m({tools::ConvexBody{{tools::Face{{0, 0, 1}, 0}}}}, distance_m),
              rounding_m(distance_m));
    EXPECT_LT(worstError_m({tools::BallBody{0.05}, wall}, distance_m), rounding_m(distance_m));
    EXPECT_LT(worstError_m({tools::RodBody{0.02, 1}, wall}, distance_m), rounding_m(distance_m));
  }
}

/// Mean over the noise's seeds of how much too far the fit sees the front of a rod across the image, after a
/// few frames.
double meanRodError_m(double radius_m, double distance_m) {
  constexpr std::uint32_t kSeeds = 16;
  constexpr std::uint64_t kFrames = 3;
  tools::RigidFrame frame;
  frame.origin_m = {0, 0, -distance_m - radius_m};
  const tools::ConvexBody wall{{tools::Face{{0, 0, 1}, -0.12}}};
  double sum_m = 0;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    tools::BodyScene scene({tools::RodBody{radius_m, 4}, wall}, frame, {}, rt::DepthModelParameters{}, seed);
    const rt::DepthModel model(scene.depthModel(), {});
    const rt::ColumnShifts shifts(model);
    const auto fit = std::make_unique<rt::BodyFit>(model, shifts.offsets());
    const auto image = std::make_unique<rt::DepthFrame>();
    const rt::ImagePosition focus{model.parameters().cx_px + 2.3, model.parameters().cy_px + 0.4};
    const double true_m = scene.trueDepth(focus.u, focus.v, 0);
    const rt::Facet facet{static_cast<float>(model.disparity().rawOf(true_m)), 0, 0, 0};
    FocusBody body;
    for (std::uint64_t i = 1; i <= kFrames; ++i) {
      scene.render(0, i, tools::SceneNoise::sensor, *image);
      body = fit->fit({.image = image->raw,
                       .pixels = model.wholeDisparity(),
                       .focus = focus,
                       .facet = facet,
                       .noise = 1,
                       .moved = {},
                       .max_frames = 8});
    }
    if (!body.exists) return std::numeric_limits<double>::infinity();
    sum_m += (1 / body.inverse_depth_per_m - true_m) / kSeeds;
  }
  return sum_m;
}

/// A plane through all that the camera sees of a rod lies (1 - pi / 4) of its radius behind the front: 4.3 mm
/// here, of a HIP that is 8 mm deep. One estimate errs by some 2.5 mm with this noise, so that the mean of 16
/// lies within half of the 4.3 mm by three of its standard errors.
TEST(BodyFit, TellsANarrowRodFromAPlaneByItsOutline) {
  constexpr double kRadius_m = 0.02;
  constexpr double kOfPlane_m = (1 - std::numbers::pi / 4) * kRadius_m;
  EXPECT_LT(std::abs(meanRodError_m(kRadius_m, 2)), kOfPlane_m / 2);
}

FocusCorner randomCorner(std::mt19937& random, int faces) {
  std::uniform_real_distribution<double> slope(-0.8, 0.8);
  FocusCorner corner;
  corner.faces = faces;
  for (int i = 0; i < faces; ++i) corner.face[i] = {600 + slope(random), slope(random), slope(random)};
  return corner;
}

TEST(FocusCorner, IsTheFarthestOrTheNearestOfItsPlanes) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> offset_px(-40, 40);
  for (int i = 0; i < 1000; ++i) {
    FocusCorner corner = randomCorner(random, 2 + i % 2);
    corner.greatest = i % 4 < 2;
    const double du = offset_px(random);
    const double dv = offset_px(random);
    std::vector<double> disparities;
    for (int k = 0; k < corner.faces; ++k) disparities.push_back(corner.face[k].at(du, dv));
    const double expected = corner.greatest ? *std::max_element(disparities.begin(), disparities.end())
                                            : *std::min_element(disparities.begin(), disparities.end());
    EXPECT_EQ(corner.faceAt(du, dv).at(du, dv), expected);
  }
}

TEST(FocusCorner, IsTheSameSeenFromAnotherFocus) {
  std::mt19937 random(2);
  FocusCorner corner = randomCorner(random, 3);
  corner.column_px = 100;
  corner.row_px = 200;
  const FocusCorner moved = corner.movedTo(103.5, 196.25);
  for (double du = -20; du <= 20; du += 5)
    EXPECT_NEAR(moved.faceAt(du - 3.5, du + 3.75).at(du - 3.5, du + 3.75), corner.faceAt(du, du).at(du, du),
                1e-9);
}

class CornerSums : public test::EachSimdTarget {};

/// Against sums in double precision, sample by sample.
TEST_P(CornerSums, AreThoseOfEachFace) {
  constexpr double kTolerance_raw = 2.8;
  constexpr double kBeside_raw = 9;
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, 2);
  const auto samples = std::make_unique<rt::FocusSamples>();
  for (const FaceChoice choice : {FaceChoice::greatest, FaceChoice::least, FaceChoice::nearest}) {
    for (int faces = 1; faces <= FocusCorner::kMaxFaces; ++faces) {
      FocusCorner corner = randomCorner(random, faces);
      corner.greatest = choice == FaceChoice::greatest;
      std::size_t count = 0;
      rt::CornerSums expected{};
      for (int cell = 0; cell < rt::FocusSamples::kCells; ++cell) {
        samples->cell_begin[cell] = count;
        for (int i = 0; i < 4 * static_cast<int>(rt::FocusSamples::kAlignment); ++i, ++count) {
          const double x = i % 8 + 8 * (cell % 3) - 12;
          const double y = i / 8 + 8 * (cell / 3) - 12;
          int met = 0;
          const double d = corner.faceAt(x, y).at(x, y) + static_cast<double>(noise(random));
          const auto isBefore = [&](int a, int b) {
            const double of_a = corner.face[a].at(x, y);
            const double of_b = corner.face[b].at(x, y);
            return choice == FaceChoice::greatest ? of_a > of_b
                   : choice == FaceChoice::least  ? of_a < of_b
                                                  : std::abs(d - of_a) < std::abs(d - of_b);
          };
          for (int k = 1; k < faces; ++k) {
            if (isBefore(k, met)) met = k;
          }
          samples->column_px[count] = static_cast<float>(x);
          samples->row_px[count] = static_cast<float>(y);
          samples->disparity_raw[count] = static_cast<float>(d);
          samples->weight[count] = i % 5 == 0 ? 0.0F : 1.0F;
          if (i % 5 == 0) continue;
          const double r = static_cast<double>(samples->disparity_raw[count]) - corner.face[met].at(x, y);
          const double near = std::max(0.0, 1 - r * r / (kTolerance_raw * kTolerance_raw));
          const double w = near * near;
          rt::FaceSums& s = expected.face[met];
          s.w += w, s.wx += w * x, s.wy += w * y, s.wxx += w * x * x, s.wxy += w * x * y, s.wyy += w * y * y;
          s.wr += w * r, s.wrx += w * r * x, s.wry += w * r * y;
          expected.fit.weight += w;
          expected.fit.square += w * r * r;
          expected.fit.explained += std::abs(r) < kTolerance_raw ? 1 : 0;
          expected.fit.unexplained += std::abs(r) >= kTolerance_raw && std::abs(r) < kBeside_raw ? 1 : 0;
          expected.fit.cell_weight[cell] += w;
          expected.fit.cell_residual[cell] += w * r;
        }
      }
      samples->cell_begin[rt::FocusSamples::kCells] = count;
      const rt::CornerSums sums = rt::cornerSumsOf(*samples, corner, choice, kTolerance_raw, kBeside_raw);
      // Single precision at a disparity of 600: 6e-5 raw per sample.
      constexpr double kRounding_raw = 1e-4;
      const double all = expected.fit.weight * kRounding_raw;
      for (int k = 0; k < FocusCorner::kMaxFaces; ++k) {
        EXPECT_NEAR(sums.face[k].w, expected.face[k].w, all);
        EXPECT_NEAR(sums.face[k].wxy, expected.face[k].wxy, 144 * all);
        EXPECT_NEAR(sums.face[k].wyy, expected.face[k].wyy, 144 * all);
        EXPECT_NEAR(sums.face[k].wr, expected.face[k].wr, 3 * all);
        EXPECT_NEAR(sums.face[k].wrx, expected.face[k].wrx, 36 * all);
        EXPECT_NEAR(sums.face[k].wry, expected.face[k].wry, 36 * all);
      }
      EXPECT_NEAR(sums.fit.square, expected.fit.square, 10 * all);
      EXPECT_NEAR(sums.fit.explained, expected.fit.explained, 1);
      EXPECT_NEAR(sums.fit.unexplained, expected.fit.unexplained, 1);
      EXPECT_NEAR(sums.fit.cell_residual[4], expected.fit.cell_residual[4], 3 * all);
    }
  }
}
HAPTICD_FOR_EACH_SIMD_TARGET(CornerSums);

/// A scene that a box would see, and what BodyFit makes of it around a focus.
class SeenScene {
 public:
  SeenScene(const std::vector<tools::TrueBody>& bodies, const tools::RigidFrame& T_camera_bodies,
            std::uint32_t seed)
      : scene_(bodies, T_camera_bodies, {}, rt::DepthModelParameters{}, seed),
        model_(scene_.depthModel(), {}),
        shifts_(model_),
        fit_(std::make_unique<rt::BodyFit>(model_, shifts_.offsets())) {
    const auto image = std::make_unique<rt::DepthFrame>();
    for (std::uint64_t frame = 1; frame <= 6; ++frame) {
      scene_.render(0, frame, tools::SceneNoise::sensor, *image);
      const rt::Facet facet{static_cast<float>(trueRaw(0, 0)), 0, 0, 0};
      body_ = fit_->fit({.image = image->raw,
                         .pixels = model_.wholeDisparity(),
                         .focus = focus_,
                         .facet = facet,
                         .noise = 1,
                         .moved = {},
                         .max_frames = 8});
    }
  }

  const FocusCorner& corner() const { return fit_->corner(); }
  double trueRaw(double du, double dv) const {
    return model_.disparity().rawOf(scene_.trueDepth(focus_.u + du, focus_.v + dv, 0));
  }
  /// RMS difference from the truth, raw units, within `reach_px` of the focus.
  double error_raw(int reach_px) const {
    double square = 0;
    int count = 0;
    for (int du = -reach_px; du <= reach_px; du += 2) {
      for (int dv = -reach_px; dv <= reach_px; dv += 2) {
        const double off = corner().faceAt(du, dv).at(du, dv) - trueRaw(du, dv);
        square += off * off;
        ++count;
      }
    }
    return std::sqrt(square / count);
  }

 private:
  tools::BodyScene scene_;
  rt::DepthModel model_;
  rt::ColumnShifts shifts_;
  std::unique_ptr<rt::BodyFit> fit_;
  rt::ImagePosition focus_{rt::DepthModelParameters{}.cx_px + 2.3, rt::DepthModelParameters{}.cy_px - 3.4};
  rt::FocusBody body_;
};

/// Faces through the middle of the image whose normals lean by `lean_rad` from the view, evenly around it.
std::vector<tools::Face> facesAround(int faces, double lean_rad, double turn_rad, bool hollow) {
  std::vector<tools::Face> result;
  for (int i = 0; i < faces; ++i) {
    const double angle = turn_rad + 2 * std::numbers::pi * i / faces;
    const double sideways = (hollow ? -1 : 1) * std::sin(lean_rad);
    result.push_back({{sideways * std::cos(angle), sideways * std::sin(angle), std::cos(lean_rad)}, 0});
  }
  return result;
}

tools::TrueBody bodyOf(const std::vector<tools::Face>& faces, bool hollow) {
  if (hollow) return tools::HollowBody{faces};
  return tools::ConvexBody{faces};
}

/// The error of a plane at the border of the part of a disc that shows it, by least squares with one sample
/// of the noise per patch: the standard deviation times sqrt(6 / patches) for halves and thirds of a disc.
TEST(CornerFit, FindsRandomCornersAsExactlyAsTheNoiseAllows) {
  constexpr double kNoise_raw = 0.56;
  constexpr int kReach_px = 8;
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(0, 1);
  constexpr int kCorners = 60;
  int found = 0;
  double ratios = 0;
  for (int i = 0; i < kCorners; ++i) {
    const int faces = 2 + i % 2;
    const bool hollow = i % 4 >= 2;
    const double lean_rad = (25 + 35 * uniform(random)) * std::numbers::pi / 180;
    tools::RigidFrame frame;
    frame.origin_m = {0, 0, -(0.6 + 0.6 * uniform(random))};
    const SeenScene seen({bodyOf(facesAround(faces, lean_rad, 6.28 * uniform(random), hollow), hollow)},
                         frame, static_cast<std::uint32_t>(100 + i));
    const FocusCorner& corner = seen.corner();
    if (corner.faces != faces) continue;
    ++found;
    EXPECT_EQ(corner.greatest, !hollow);
    const double patches = std::numbers::pi * corner.radius_px * corner.radius_px / (81.0 * faces);
    const double bound_raw = kNoise_raw * std::sqrt(6 / patches);
    ratios += std::pow(seen.error_raw(kReach_px) / bound_raw, 2);
  }
  EXPECT_GE(found, kCorners * 95 / 100);
  EXPECT_LE(std::sqrt(ratios / found), 1.5);
}

TEST(CornerFit, FindsNoneOnPlanesBallsAndRods) {
  const tools::ConvexBody wall{{tools::Face{{0, 0, 1}, -0.12}}};
  std::uint32_t seed = 500;
  int corners = 0;
  int scenes = 0;
  for (const double distance_m : {0.6, 0.8, 1.0}) {
    tools::RigidFrame frame;
    frame.origin_m = {0, 0, -distance_m};
    std::vector<std::vector<tools::TrueBody>> all{{tools::ConvexBody{{tools::Face{{0, 0, 1}, 0}}}}};
    for (const double radius_m : {0.02, 0.05, 0.1}) all.push_back({tools::BallBody{radius_m}, wall});
    for (const double radius_m : {0.01, 0.02, 0.04}) all.push_back({tools::RodBody{radius_m, 1}, wall});
    for (const auto& bodies : all) {
      for (int i = 0; i < 2; ++i) {
        const SeenScene seen(bodies, frame, seed++);
        ++scenes;
        if (seen.corner().faces > 0) ++corners;
      }
    }
  }
  EXPECT_EQ(corners, 0) << "of " << scenes;
}

/// In any direction, and touched beside the middle, where the limb is in the window.
TEST(CornerFit, FindsNoneOnRandomRodsBeforeAWall) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(0, 1);
  constexpr int kRods = 60;
  int corners = 0;
  for (int i = 0; i < kRods; ++i) {
    const double radius_m = 0.01 + 0.03 * uniform(random);
    const double turn_rad = 6.28 * uniform(random);
    const double tilt_rad = 0.6 * (uniform(random) - 0.5);
    const double beside_m = 1.4 * (uniform(random) - 0.5) * radius_m;
    tools::RigidFrame frame;
    frame.x = {std::cos(turn_rad) * std::cos(tilt_rad), std::sin(turn_rad) * std::cos(tilt_rad),
               std::sin(tilt_rad)};
    frame.y = {-std::sin(turn_rad), std::cos(turn_rad), 0};
    frame.z = cross(frame.x, frame.y);
    frame.origin_m = Vec3{0, 0, -(0.6 + 0.4 * uniform(random))} + beside_m * frame.y;
    const tools::ConvexBody wall{{tools::Face{frame.directionIn({0, 0, 1}), -0.12}}};
    const SeenScene seen({tools::RodBody{radius_m, 2}, wall}, frame, static_cast<std::uint32_t>(700 + i));
    if (seen.corner().faces > 0) ++corners;
  }
  EXPECT_EQ(corners, 0);
}

}  // namespace
}  // namespace hapticd

// SPDX-License-Identifier: Apache-2.0
#include "rt/scene/focus_body.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "rt/depth/depth_model.h"
#include "rt/modelling/focus/body_fit.h"
#include "rt/modelling/focus/body_kernel.h"
#include "rt/modelling/surface/column_shifts.h"
#include "tests/unit/rt/simd_targets.h"
#include "tools/lib/truth/body_scene.h"

namespace hapticd {
namespace {

using rt::FocusBody;
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
                                     .moved_raw = 0,
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

}  // namespace
}  // namespace hapticd

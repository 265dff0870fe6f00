// SPDX-License-Identifier: Apache-2.0
#include "rt/fixtures/surface_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "rt/depth/depth_model.h"
#include "rt/depth/disparity_frame.h"
#include "tests/unit/rt/fixture_rig.h"

// The distance from the visible surface, and stand-offs above it, with exact facets: no pixels, no rounding.
namespace hapticd::test {
namespace {

using rt::BlockLattice;
using rt::Vec3;

/// A scene whose facets are tangent planes of a known surface.
class FacetScene {
 public:
  /// `depth_m`: Z of the surface on a ray (x right, y up, -1 forward), or 0.
  explicit FacetScene(const std::function<double(const Vec3& ray)>& depth_m)
      : image_(drivers::kKinectPixels, rt::kNoRawDisparity),
        facets_(lattice_.blocks()),
        cells_(lattice_.blocks(), rt::Cell::smooth) {
    const rt::DepthModelParameters& camera = model_.parameters();
    const auto disparityAt = [&](double u, double v) {
      const double depth =
          depth_m({(u - camera.cx_px) / camera.fx_px, (camera.cy_px - v) / camera.fy_px, -1});
      return depth > 0 ? (1 / depth - camera.b_per_m) / camera.a_per_m : -1;
    };
    for (int row = 0; row < lattice_.rows; ++row) {
      for (int column = 0; column < lattice_.columns; ++column) {
        const double u = column * BlockLattice::kBlock_px + BlockLattice::kMiddle_px;
        const double v = row * BlockLattice::kBlock_px + BlockLattice::kMiddle_px;
        const double d = disparityAt(u, v);
        const double step = 0.01;
        facets_[lattice_.at(row, column)] = {
            static_cast<float>(d),
            static_cast<float>((disparityAt(u + step, v) - disparityAt(u - step, v)) / (2 * step)),
            static_cast<float>((disparityAt(u, v + step) - disparityAt(u, v - step)) / (2 * step)), 0};
      }
    }
    rt::VisibleSurface& surface = scene.surface;
    surface.radius_m = 10;
    surface.lattice = lattice_;
    surface.blocks = {0, lattice_.columns - 1, 0, lattice_.rows - 1};
    surface.visible = {image_.data(), facets_.data(), cells_.data()};
    surface.hidden = surface.visible;
    scene.frame = 1;
    scene.has_surface = true;
    scene.depth_model = &model_;
  }

  rt::Scene scene;

 private:
  rt::DepthModel model_{{}, {}};
  rt::BlockLattice lattice_{model_};
  std::vector<std::uint16_t> image_;
  std::vector<rt::Facet> facets_;
  std::vector<rt::Cell> cells_;
};

struct KnownSurface {
  const char* name;
  /// Z on a ray.
  double (*depth_m)(const Vec3& ray);
  /// Signed distance and gradient.
  rt::SignedDistance (*distance)(const Vec3& p);
};

const Vec3 kNormal{0.3 / std::hypot(0.3, 0.2, 1), 0.2 / std::hypot(0.3, 0.2, 1), 1 / std::hypot(0.3, 0.2, 1)};
constexpr double kBallDistance_m = 0.9;
constexpr double kBallRadius_m = 0.2;

double planeDepth(const Vec3& ray) {
  return dot(kNormal, Vec3{0, 0, -1}) / dot(kNormal, ray);
}
rt::SignedDistance planeDistance(const Vec3& p) {
  return {dot(kNormal, p - Vec3{0, 0, -1}), kNormal};
}
double ballDepth(const Vec3& ray) {
  const Vec3 centre{0, 0, -kBallDistance_m};
  const double a = dot(ray, ray);
  const double b = dot(ray, centre);
  const double inside = b * b - a * (dot(centre, centre) - kBallRadius_m * kBallRadius_m);
  return inside > 0 ? (b - std::sqrt(inside)) / a : 0;
}
rt::SignedDistance ballDistance(const Vec3& p) {
  const Vec3 offset = p - Vec3{0, 0, -kBallDistance_m};
  return {norm(offset) - kBallRadius_m, (1 / norm(offset)) * offset};
}

class EachSurface : public testing::TestWithParam<KnownSurface> {};
INSTANTIATE_TEST_SUITE_P(Surfaces, EachSurface,
                         testing::Values(KnownSurface{"plane", planeDepth, planeDistance},
                                         KnownSurface{"ball", ballDepth, ballDistance}),
                         [](const auto& param) { return param.param.name; });

/// A random place on the surface, seen at up to 35 degrees: the interpolation between the facets of blocks of
/// 4 pixels tilts a ball's normal by 0.13 degrees where it is seen at 50 degrees.
Vec3 placeOnSurface(const KnownSurface& known, RandomShapes& random) {
  const Vec3 ray{random.between(-0.09, 0.09), random.between(-0.09, 0.09), -1};
  return known.depth_m(ray) * ray;
}

TEST_P(EachSurface, TheDistanceAndItsGradientAreThoseOfTheClosedForm) {
  const FacetScene facets(GetParam().depth_m);
  const rt::SurfaceDistance field(facets.scene, 0.035, 0);
  RandomShapes random(1);
  for (int i = 0; i < 10'000; ++i) {
    const Vec3 on_surface = placeOnSurface(GetParam(), random);
    const Vec3 p = on_surface + random.between(0.001, 0.02) * GetParam().distance(on_surface).normal_in_world;
    const rt::SignedDistance expected = GetParam().distance(p);
    const auto found = field.at(p, 0.03);
    ASSERT_TRUE(found.found() && found.modelled) << i;
    ASSERT_NEAR(found.signed_distance.distance_m, expected.distance_m, 5e-6) << i;
    ASSERT_GT(dot(found.signed_distance.normal_in_world, expected.normal_in_world),
              std::cos(0.1 * std::numbers::pi / 180))
        << i;
  }
}

TEST_P(EachSurface, TheDistanceIsContinuousAndNeverChangesFasterThanThePlace) {
  const FacetScene facets(GetParam().depth_m);
  const rt::SurfaceDistance field(facets.scene, 0.035, 0);
  RandomShapes random(2);
  for (int i = 0; i < 50; ++i) {
    const Vec3 on_surface = placeOnSurface(GetParam(), random);
    Vec3 p = on_surface + 0.005 * GetParam().distance(on_surface).normal_in_world;
    const Vec3 step = 5e-5 * random.direction();
    double before = field.at(p, 0.03).signed_distance.distance_m;
    for (int k = 0; k < 200 && before > 0.0005; ++k) {
      p += step;
      const double now = field.at(p, 0.03).signed_distance.distance_m;
      ASSERT_LE(std::abs(now - before), norm(step) + 2e-6) << i << " " << k;
      before = now;
    }
  }
}

TEST_P(EachSurface, AStandoffHasTheForceOfTheClosedForm) {
  const FacetScene facets(GetParam().depth_m);
  FixtureRig rig;
  rig.scene = facets.scene;
  rig.surface_law = true;
  constexpr double kClearance_m = 0.01;
  rig[rig.add(rt::FixtureKind::standoff, {}, 500)].clearance_m = kClearance_m;
  RandomShapes random(3);
  for (int i = 0; i < 10'000; ++i) {
    const Vec3 on_surface = placeOnSurface(GetParam(), random);
    const Vec3 out = GetParam().distance(on_surface).normal_in_world;
    const double depth = random.between(0.003, 0.009);
    rig.jumpTo(on_surface + (kClearance_m + 0.001) * out);
    auto output = rig.moveTo(on_surface + (kClearance_m - depth) * out, 0.002);
    for (int settle = 0; settle < 3; ++settle) output = rig.tick(on_surface + (kClearance_m - depth) * out);
    const double expected_n = 500 * depth;
    // facets are single precision: 2 um of distance
    ASSERT_NEAR(norm(output.force_n), expected_n, 1e-3 * expected_n) << i;
    const double cosine = std::min(1.0, dot(output.force_n, out) / norm(output.force_n));
    ASSERT_LT(std::acos(cosine) * 180 / std::numbers::pi, 0.1) << i;
  }
}

TEST(SurfaceDistance, BesideAnOutlineItIsTheDistanceFromTheLastPatch) {
  const FacetScene half([](const Vec3& ray) { return ray.x > 0 ? 1.0 : 0.0; });
  const rt::SurfaceDistance field(half.scene, 0.035, 0);
  const double pixel_m = 1 / 594.2;
  double before = 0;
  for (double x = -0.004; x > -0.03; x -= 0.0005) {
    const auto found = field.at({x, 0.01, -0.999}, 0.05);
    ASSERT_TRUE(found.found());
    EXPECT_NEAR(found.signed_distance.distance_m, -x, 4 * pixel_m) << "within a block";
    if (before > 0) {
      EXPECT_NEAR(found.signed_distance.distance_m - before, 0.0005, 1e-4);
    }
    before = found.signed_distance.distance_m;
    EXPECT_LT(found.signed_distance.normal_in_world.x, -0.9);
  }
}

TEST_P(EachSurface, ALookOverAWiderRangeFindsTheSamePlace) {
  const FacetScene facets(GetParam().depth_m);
  const rt::SurfaceDistance field(facets.scene, 0.035, 0);
  RandomShapes random(4);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 on_surface = placeOnSurface(GetParam(), random);
    const Vec3 p = on_surface + random.between(0.001, 0.009) * random.direction();
    const auto narrow = field.at(p, 0.01);
    const auto wide = field.at(p, 0.02);
    ASSERT_EQ(narrow.found(), wide.found()) << i;
    ASSERT_EQ(narrow.signed_distance.distance_m, wide.signed_distance.distance_m) << i;
  }
}

TEST(SurfaceDistance, OutsideTheModelNothingIsKnown) {
  FacetScene facets(planeDepth);
  facets.scene.surface.radius_m = 0.05;
  facets.scene.surface.centre_m_in_world = {0, 0, -1};
  const rt::SurfaceDistance field(facets.scene, 0.035, 0);
  EXPECT_FALSE(field.at({0, 0, -0.9}, 0.2).modelled);
  EXPECT_FALSE(field.at({0, 0, -0.96}, 0.01).found());
  EXPECT_TRUE(field.at({0, 0, -0.96}, 0.01).modelled);
}

}  // namespace
}  // namespace hapticd::test

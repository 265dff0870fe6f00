// SPDX-License-Identifier: Apache-2.0
#include "rt/tissue/tissue_shares.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "drivers/camera/kinect_image.h"
#include "tests/unit/rt/flat_tissue.h"

namespace hapticd::rt {
namespace {

using test::FlatTissue;

double smoothstep(double x) {
  return x <= 0 ? 0 : x >= 1 ? 1 : x * x * (3 - 2 * x);
}

const TissueShares::Entry* entryOf(const TissueShares& shares, std::size_t region) {
  for (std::size_t i = 0; i < shares.count; ++i) {
    if (shares.entries[i].region == region) return &shares.entries[i];
  }
  return nullptr;
}

double shareOf(const TissueShares& shares, std::size_t region) {
  const TissueShares::Entry* entry = entryOf(shares, region);
  return entry == nullptr ? 0 : entry->share;
}

TEST(TissueShares, PassFromInsideToOutsideOverTheTransition) {
  FlatTissue tissue;
  tissue.addSphere({}, 0.02, 0.01);
  for (double r = 0; r < 0.04; r += 0.0005) {
    EXPECT_NEAR(shareOf(sharesAt(*tissue.map, nullptr, {0, r, 0}), 0), smoothstep((0.025 - r) / 0.01), 1e-12);
  }
}

TEST(TissueShares, LaterRegionsCoverEarlierOnes) {
  FlatTissue tissue;
  tissue.addSphere({}, 0.02, 0.01);
  tissue.addSphere({}, 0.01, 0.004);
  const TissueShares inside = sharesAt(*tissue.map, nullptr, {});
  EXPECT_EQ(shareOf(inside, 1), 1);
  EXPECT_EQ(shareOf(inside, 0), 0);
  const TissueShares border = sharesAt(*tissue.map, nullptr, {0.01, 0, 0});
  EXPECT_NEAR(shareOf(border, 1), 0.5, 1e-12);
  EXPECT_NEAR(shareOf(border, 0), 0.5, 1e-12);
  EXPECT_NEAR(border.rest.share, 0, 1e-12);
}

/// Shapes of all kinds that overlap, some thinner than their transition.
void addOverlappingShapes(FlatTissue& tissue) {
  tissue.addSphere({0.01, 0, 0}, 0.02, 0.01);
  tissue.addBox({-0.01, 0.005, 0}, {0.015, 0.004, 0.03}, 0.012).shape.rotation = {0.8, -0.6, 0, 0.6, 0.8,
                                                                                  0,   0,    0, 1};
  TissueRegion capsule;
  capsule.shape.kind = ShapeKind::capsule;
  capsule.shape.position_m_in_world = {-0.02, -0.01, 0};
  capsule.shape.axis_in_world = {1, 0, 0};
  capsule.shape.length_m = 0.04;
  capsule.shape.radius_m = 0.003;
  capsule.transition_m = 0.01;
  tissue.add(capsule);
}

TEST(TissueShares, AddUpToOneAndTheirGradientsToZero) {
  FlatTissue tissue;
  addOverlappingShapes(tissue);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> anywhere(-0.04, 0.04);
  for (int i = 0; i < 10'000; ++i) {
    const TissueShares shares =
        sharesAt(*tissue.map, nullptr, {anywhere(random), anywhere(random), anywhere(random)});
    double sum = shares.rest.share;
    Vec3 gradient = shares.rest.gradient_per_m_in_world;
    for (std::size_t k = 0; k < shares.count; ++k) {
      sum += shares.entries[k].share;
      gradient += shares.entries[k].gradient_per_m_in_world;
    }
    ASSERT_NEAR(sum, 1, 1e-12);
    ASSERT_NEAR(norm(gradient), 0, 1e-9);
  }
}

/// Checks the gradient against central differences along a random line, and that it has no step: its change
/// is at most the stated bound of the second derivative times the displacement.
void checkGradients(const FlatTissue& tissue, const DepthModel* model, const Vec3& middle,
                    double bend_factor) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> anywhere(-0.04, 0.04);
  constexpr double kStep_m = 1e-6;
  for (int i = 0; i < 2'000; ++i) {
    const Vec3 p = middle + Vec3{anywhere(random), anywhere(random), 0};
    const Vec3 direction = std::cos(i) * Vec3{1, 0, 0} + std::sin(i) * Vec3{0, 1, 0};
    const TissueShares before = sharesAt(*tissue.map, model, p - kStep_m * direction);
    const TissueShares here = sharesAt(*tissue.map, model, p);
    const TissueShares after = sharesAt(*tissue.map, model, p + kStep_m * direction);
    const double slope = (after.rest.share - before.rest.share) / (2 * kStep_m);
    ASSERT_NEAR(dot(here.rest.gradient_per_m_in_world, direction), slope, 0.05) << i;
    const Vec3 turned = after.rest.gradient_per_m_in_world - before.rest.gradient_per_m_in_world;
    const double bend = std::max({before.rest.bend_per_m2, here.rest.bend_per_m2, after.rest.bend_per_m2});
    ASSERT_LE(norm(turned), bend_factor * bend * 2 * kStep_m + 1e-6) << i;
  }
}

TEST(TissueShares, HaveAContinuousGradientInShapes) {
  FlatTissue tissue;
  addOverlappingShapes(tissue);
  checkGradients(tissue, nullptr, {}, 1);
}

/// A camera at the origin over a plane 0.5 m away, with labels in its image.
class LabelledPlane : public testing::Test {
 protected:
  LabelledPlane() {
    tissue_.map->has_labels = true;
    tissue_.map->label_width_px = drivers::kKinectWidth;
    tissue_.map->label_height_px = drivers::kKinectHeight;
    for (const int label : {1, 2}) {
      TissueRegion region;
      region.place = TissuePlace::label;
      region.label = static_cast<std::uint8_t>(label);
      region.transition_m = 0.01;
      tissue_.add(region);
    }
  }

  /// Labels all pixels whose place on the plane is in the half plane x cos + y sin < offset_m.
  void labelHalfPlane(double angle_rad, double offset_m, std::uint8_t label) {
    for (int row = 0; row < drivers::kKinectHeight; ++row) {
      for (int column = 0; column < drivers::kKinectWidth; ++column) {
        const double x = (column - camera_.cx_px) / camera_.fx_px * kDepth_m;
        const double y = -(row - camera_.cy_px) / camera_.fy_px * kDepth_m;
        if (x * std::cos(angle_rad) + y * std::sin(angle_rad) >= offset_m) continue;
        tissue_.map->labels[static_cast<std::size_t>(row * drivers::kKinectWidth + column)] = label;
      }
    }
  }
  static Vec3 onPlane(double x, double y) { return {x, y, -kDepth_m}; }

  static constexpr double kDepth_m = 0.5;
  DepthModelParameters camera_;
  DepthModel model_{camera_, PoseParameters{}};
  FlatTissue tissue_;
};

// A sample is on one side of the border or the other, within a pixel of 0.85 mm; 89 samples in 10 mm.
TEST_F(LabelledPlane, PassesOverBordersAsShapesDo) {
  for (const double angle : {0.0, 0.5, std::numbers::pi / 2, 2.0}) {
    tissue_.map->labels.fill(0);
    labelHalfPlane(angle, 0.01, 1);
    for (double s = -0.01; s < 0.03; s += 0.0005) {
      const Vec3 p = onPlane(s * std::cos(angle), s * std::sin(angle));
      EXPECT_NEAR(shareOf(sharesAt(*tissue_.map, &model_, p), 0), smoothstep((0.015 - s) / 0.01), 0.09)
          << angle << ' ' << s;
    }
  }
}

TEST_F(LabelledPlane, HasNoLabelsForACameraOfAnotherSize) {
  labelHalfPlane(0, 0, 2);
  DepthModelParameters other = camera_;
  other.width_px = 848;
  const DepthModel wider(other, PoseParameters{});
  EXPECT_EQ(sharesAt(*tissue_.map, &wider, onPlane(-0.02, 0)).count, 0U);
}

TEST_F(LabelledPlane, IsWholeInsideAndNothingOutsideALabel) {
  labelHalfPlane(0, 0, 2);
  EXPECT_NEAR(shareOf(sharesAt(*tissue_.map, &model_, onPlane(-0.02, 0)), 1), 1, 1e-12);
  EXPECT_EQ(sharesAt(*tissue_.map, &model_, onPlane(0.02, 0)).count, 0U);
  EXPECT_EQ(sharesAt(*tissue_.map, nullptr, onPlane(-0.02, 0)).count, 0U);
  EXPECT_EQ(sharesAt(*tissue_.map, &model_, {0, 0, 0.5}).count, 0U);
}

// Between pixels the labels are interpolated, so the gradient changes faster than over the transition: by the
// ratio of transition and pixel.
TEST_F(LabelledPlane, HasAContinuousGradient) {
  labelHalfPlane(0.3, 0.02, 1);
  labelHalfPlane(2.0, 0.0, 2);
  const double pixels = 0.01 * camera_.fx_px / kDepth_m;
  checkGradients(tissue_, &model_, onPlane(0, 0), pixels);
}

}  // namespace
}  // namespace hapticd::rt

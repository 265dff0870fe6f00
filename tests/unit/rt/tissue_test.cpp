// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <numbers>
#include <random>

#include "drivers/camera/kinect_image.h"
#include "rt/depth/depth_model.h"
#include "rt/tissue/tissue_contact.h"
#include "rt/tissue/tissue_shares.h"

namespace hapticd::test {

/// A stiffness map under a flat surface, z = 0 with the free side above, touched without friction by a HIP
/// whose proxy is straight above it.
class FlatTissue {
 public:
  static constexpr double kPeriod_s = 0.001;

  rt::TissueRegion& add(const rt::TissueRegion& region) {
    map->generation += 1;
    rt::TissueRegion& added = map->regions[map->count++];
    added = region;
    added.identity = ++last_identity_;
    return added;
  }
  rt::TissueRegion& addSphere(const rt::Vec3& centre, double radius_m, double transition_m) {
    rt::TissueRegion region;
    region.shape.kind = rt::ShapeKind::sphere;
    region.shape.position_m_in_world = centre;
    region.shape.radius_m = radius_m;
    region.transition_m = transition_m;
    return add(region);
  }
  rt::TissueRegion& addBox(const rt::Vec3& centre, const rt::Vec3& half_size_m, double transition_m) {
    rt::TissueRegion region;
    region.shape.kind = rt::ShapeKind::box;
    region.shape.position_m_in_world = centre;
    region.shape.half_size_m = half_size_m;
    region.transition_m = transition_m;
    return add(region);
  }

  /// Returns the sample of the law with a HIP there, its force replaced.
  rt::ForceSample at(const rt::Vec3& hip_m, const rt::Vec3& velocity_m_per_s = {}) {
    rt::ForceSample sample;
    sample.proxy_m_in_world = hip_m;
    if (hip_m.z < 0) {
      sample.state = rt::ContactState::contact;
      sample.proxy_m_in_world.z = 0;
      sample.normal_in_world = {0, 0, 1};
      sample.depth_m = -hip_m.z;
      sample.force_n_in_world = {0, 0, -parameters.force.stiffness_n_per_m * hip_m.z};
    }
    contact = tissue.apply({.map = map.get(),
                            .model = model,
                            .parameters = parameters.contact,
                            .stiffness_n_per_m = parameters.force.stiffness_n_per_m,
                            .hip_m_in_world = hip_m,
                            .velocity_m_per_s_in_world = velocity_m_per_s,
                            .period_s = kPeriod_s},
                           sample);
    return sample;
  }
  /// Returns the force without the memory of an earlier contact.
  rt::Vec3 freshForce(const rt::Vec3& hip_m, const rt::Vec3& velocity_m_per_s = {}) {
    tissue.release();
    return at(hip_m, velocity_m_per_s).force_n_in_world;
  }

  std::unique_ptr<rt::TissueMap> map = std::make_unique<rt::TissueMap>();
  const rt::DepthModel* model = nullptr;
  rt::LiveParameters parameters;
  rt::TissueContact tissue;
  rt::LocalContact contact;  ///< of the last sample

 private:
  std::uint32_t last_identity_ = 0;
};

}  // namespace hapticd::test

namespace hapticd::rt {
namespace {

using test::FlatTissue;

constexpr double kRounding = 1e-9;

TEST(TissueContact, LeavesTheForceWithoutRegions) {
  FlatTissue tissue;
  EXPECT_EQ(tissue.at({0, 0, -0.003}).force_n_in_world, (Vec3{0, 0, 500 * 0.003}));
  EXPECT_FALSE(tissue.contact.in_tissue);
  EXPECT_EQ(tissue.contact.tangent_n_per_m, 500);
  EXPECT_EQ(tissue.contact.largest_n_per_m, 500);
}

TEST(TissueContact, IsTheModelInsideARegionAndTheLawBesideIt) {
  FlatTissue tissue;
  tissue.parameters.contact.damping_n_s_per_m = 3;
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.stiffness_n_per_m = 800;
  region.damping_n_s_per_m = 2;
  for (const double rate : {0.1, -0.1}) {  // of the depth
    EXPECT_NEAR(tissue.freshForce({0, 0, -0.004}, {0, 0, -rate}).z, 800 * 0.004 + 2 * rate, kRounding);
    EXPECT_EQ(tissue.contact.region, 0);
    EXPECT_NEAR(tissue.freshForce({0.1, 0, -0.004}, {0, 0, -rate}).z, 500 * 0.004 + 3 * rate, kRounding);
    EXPECT_EQ(tissue.contact.region, -1);
  }
  region.model = ContactModel::hunt_crossley;
  region.damping_per_speed_s_per_m = 0.5;
  EXPECT_NEAR(tissue.freshForce({0, 0, -0.004}, {0, 0, -0.2}).z,
              800 * std::pow(0.005, -0.5) * std::pow(0.004, 1.5) * (1 + 0.5 * 0.2), kRounding);
}

TEST(TissueContact, NeverPulls) {
  FlatTissue tissue;
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.damping_n_s_per_m = 50;
  EXPECT_EQ(tissue.freshForce({0, 0, -0.001}, {0, 0, 1}).z, 0);
  region.model = ContactModel::hunt_crossley;
  region.damping_per_speed_s_per_m = 2;
  EXPECT_EQ(tissue.freshForce({0, 0, -0.001}, {0, 0, 1}).z, 0);
}

TEST(TissueContact, StatesTheTangentStiffnessAndTheLargestOne) {
  FlatTissue tissue;
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.model = ContactModel::layered;
  region.stiffness_n_per_m = 300;
  region.lower_stiffness_n_per_m = 900;
  tissue.freshForce({0, 0, -0.002});
  EXPECT_NEAR(tissue.contact.tangent_n_per_m, 300, kRounding);
  EXPECT_NEAR(tissue.contact.largest_n_per_m, 900, kRounding);
  tissue.freshForce({0, 0, -0.008});
  EXPECT_NEAR(tissue.contact.tangent_n_per_m, 900, kRounding);
  region.model = ContactModel::hunt_crossley;
  tissue.freshForce({0, 0, -0.002});
  EXPECT_NEAR(tissue.contact.largest_n_per_m, 1.5 * 300 * std::sqrt(2), 1e-6);
  region.stiffness_n_per_m = 100;
  tissue.freshForce({0, 0, -0.002});
  EXPECT_NEAR(tissue.contact.largest_n_per_m, 500, kRounding);
}

/// Two regions of all models that overlap each other and the rest.
void addOverlappingRegions(FlatTissue& tissue, ContactModel first, ContactModel second) {
  TissueRegion& sphere = tissue.addSphere({0.01, 0, 0}, 0.015, 0.01);
  sphere.model = first;
  sphere.stiffness_n_per_m = 900;
  sphere.lower_stiffness_n_per_m = 1500;
  TissueRegion& box = tissue.addBox({-0.005, 0.01, 0}, {0.012, 0.01, 0.01}, 0.008);
  box.model = second;
  box.stiffness_n_per_m = 250;
  box.lower_stiffness_n_per_m = 1200;
  box.layer_m = 0.003;
}

/// Returns the work of the force along a closed path of the HIP, by the trapezoidal rule.
double workAround(FlatTissue& tissue, const Vec3& middle, double turn) {
  constexpr int kSteps = 200'000;
  const auto place = [&middle, turn](int i) {
    const double angle = 2 * std::numbers::pi * i / kSteps;
    return middle + Vec3{0.02 * std::cos(angle), 0.02 * std::sin(angle + turn),
                         -0.005 + 0.004 * std::sin(2 * angle + turn)};
  };
  double work_j = 0;
  Vec3 before = tissue.freshForce(place(0));
  for (int i = 1; i <= kSteps; ++i) {
    const Vec3 force = tissue.freshForce(place(i));
    work_j += dot(before + force, place(i) - place(i - 1)) / 2;
    before = force;
  }
  return work_j;
}

TEST(TissueContact, GivesNoEnergyOnClosedPathsOverBorders) {
  for (const ContactModel first : {ContactModel::linear, ContactModel::layered}) {
    for (const ContactModel second : {ContactModel::hunt_crossley, ContactModel::layered}) {
      FlatTissue tissue;
      addOverlappingRegions(tissue, first, second);
      for (const double turn : {0.0, 0.7, 1.9}) EXPECT_NEAR(workAround(tissue, {}, turn), 0, 1e-9);
    }
  }
}

TEST(TissueContact, StoresTheEnergyThatTheForceTakes) {
  FlatTissue tissue;
  addOverlappingRegions(tissue, ContactModel::linear, ContactModel::hunt_crossley);
  constexpr int kSteps = 20'000;
  double work_j = 0;
  Vec3 before;
  Vec3 last;
  for (int i = 1; i <= kSteps; ++i) {
    const double share = static_cast<double>(i) / kSteps;
    const Vec3 hip{0.03 * share, 0.01 * share, -0.007 * share};
    const Vec3 force = tissue.freshForce(hip);
    work_j -= dot(before + force, hip - last) / 2;
    before = force;
    last = hip;
    if (i % 1000 == 0) {
      EXPECT_NEAR(tissue.contact.energy_j, work_j, 1e-8);
    }
  }
}

// The bound is what the core takes as explained by the displacement alone.
TEST(TissueContact, ChangesNoFasterThanStated) {
  FlatTissue tissue;
  addOverlappingRegions(tissue, ContactModel::linear, ContactModel::hunt_crossley);
  Vec3 before;
  double steepest = 0;
  constexpr double kStep_m = 2e-5;
  for (int i = 0; i < 4000; ++i) {
    const double angle = 0.01 * i;
    const Vec3 hip{-0.04 + kStep_m * i, 0.01 * std::sin(angle), -0.004};
    const Vec3 force = tissue.freshForce(hip);
    if (i > 0) {
      const double displacement = std::hypot(kStep_m, 0.01 * (std::sin(angle) - std::sin(angle - 0.01)));
      ASSERT_LE(norm(force - before),
                1.001 * std::max(steepest, tissue.contact.steepest_n_per_m) * displacement + kRounding);
    }
    steepest = tissue.contact.steepest_n_per_m;
    before = force;
  }
}

TEST(TissueContact, DoesNotStiffenBeforeTheContactEnds) {
  FlatTissue tissue;
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.stiffness_n_per_m = 400;
  const Vec3 pressed{0, 0, -0.005};
  tissue.at(pressed);
  region.stiffness_n_per_m = 1000;
  tissue.map->generation += 1;
  for (int i = 0; i < 5000; ++i) ASSERT_NEAR(tissue.at(pressed).force_n_in_world.z, 2, kRounding);
  tissue.at({0, 0, 0.001});
  EXPECT_NEAR(tissue.at(pressed).force_n_in_world.z, 5, kRounding);
}

TEST(TissueContact, SoftensByAtMostOneKilonewtonPerMetreAndSecond) {
  FlatTissue tissue;
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.stiffness_n_per_m = 1000;
  const Vec3 pressed{0, 0, -0.005};
  tissue.at(pressed);
  region.stiffness_n_per_m = 400;
  tissue.map->generation += 1;
  for (int i = 1; i <= 700; ++i) {
    const double expected = std::max(400.0, 1000 - 1000 * i * FlatTissue::kPeriod_s);
    ASSERT_NEAR(tissue.at(pressed).force_n_in_world.z, 0.005 * expected, kRounding);
  }
}

TEST(TissueContact, KeepsARegionThatAppearsInContactAsSoftAsWhatWasThere) {
  FlatTissue tissue;
  tissue.addSphere({0.5, 0, 0}, 0.02, 0.01);
  const Vec3 pressed{0, 0, -0.005};
  tissue.at(pressed);
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.model = ContactModel::layered;
  region.stiffness_n_per_m = 1500;
  region.lower_stiffness_n_per_m = 2000;
  for (int i = 0; i < 100; ++i) ASSERT_NEAR(tissue.at(pressed).force_n_in_world.z, 2.5, kRounding);
  tissue.at({0, 0, 0.001});
  EXPECT_GT(tissue.at(pressed).force_n_in_world.z, 7);
}

TEST(TissueContact, FollowsARegionToItsNewPlaceInTheMap) {
  FlatTissue tissue;
  tissue.addSphere({0.5, 0, 0}, 0.02, 0.01);
  tissue.addSphere({}, 0.02, 0.01).stiffness_n_per_m = 400;
  const Vec3 pressed{0, 0, -0.005};
  tissue.at(pressed);
  tissue.map->regions[0] = tissue.map->regions[1];
  tissue.map->regions[0].stiffness_n_per_m = 1000;
  tissue.map->count = 1;
  tissue.map->generation += 1;
  EXPECT_NEAR(tissue.at(pressed).force_n_in_world.z, 2, kRounding);
}

TEST(TissueContact, BlendsTheFrictionOfTheRegions) {
  FlatTissue tissue;
  tissue.parameters.contact.friction = 0.1;
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.friction = 0.5;
  region.stiffness_n_per_m = 1000;
  tissue.at({0, 0, -0.004});
  EXPECT_NEAR(tissue.contact.friction, 0.5, kRounding);
  // The law holds friction times the depth by springs of k_s, half as stiff as the region.
  EXPECT_NEAR(tissue.tissue.frictionOfLaw(tissue.parameters.contact), 1, kRounding);
  tissue.at({0.02, 0, -0.004});
  EXPECT_NEAR(tissue.contact.friction, 0.3, kRounding);
  tissue.at({0.1, 0, -0.004});
  EXPECT_NEAR(tissue.tissue.frictionOfLaw(tissue.parameters.contact), 0.1, kRounding);
}

TEST(TissueContact, PassesTheCueByTheShareOfTheRegion) {
  FlatTissue tissue;
  TissueRegion& region = tissue.addSphere({}, 0.02, 0.01);
  region.cue_force_n = 0.2;
  region.cue_hz = 80;
  tissue.at({0, 0, -0.004});
  EXPECT_NEAR(tissue.contact.cue_force_n, 0.2, kRounding);
  EXPECT_EQ(tissue.contact.cue_hz, 80);
  tissue.at({0.02, 0, -0.004});
  EXPECT_NEAR(tissue.contact.cue_force_n, 0.1, kRounding);
  tissue.at({0, 0, 0.004});
  EXPECT_EQ(tissue.contact.cue_force_n, 0);
}

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

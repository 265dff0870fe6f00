// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <vector>

#include "daemon/trace/reader/trace_reader.h"
#include "daemon/trace/writer/trace_writer.h"
#include "drivers/camera/kinect_image.h"
#include "rt/depth/depth_model.h"
#include "rt/loop/haptic_core.h"
#include "rt/modelling/scene_builder.h"
#include "rt/tissue/tissue.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tools/haptic-palpate/palpation_map.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kTick_s = 0.001;

PressSample pressAt(double time_s, double stiffness, double damping) {
  const double angle = 2 * std::numbers::pi * time_s;
  PressSample sample{0.006 + 0.004 * std::sin(angle), 0.004 * 2 * std::numbers::pi * std::cos(angle)};
  sample.force_n = stiffness * sample.depth_m + damping * sample.rate_m_per_s;
  return sample;
}

TEST(StiffnessEstimator, FindsSpringAndDamper) {
  StiffnessEstimator estimator;
  for (int i = 0; i < 2000; ++i) estimator.add(pressAt(i * kTick_s, 420, 3));
  const StiffnessEstimate estimate = estimator.estimate();
  ASSERT_TRUE(estimate.known);
  EXPECT_NEAR(estimate.stiffness_n_per_m, 420, 1e-6);
  EXPECT_NEAR(estimate.damping_n_s_per_m, 3, 1e-6);
}

TEST(StiffnessEstimator, ForgetsWhatWasThereBefore) {
  StiffnessEstimator estimator;
  for (int i = 0; i < 2000; ++i) estimator.add(pressAt(i * kTick_s, 420, 3));
  for (int i = 0; i < 4000; ++i) estimator.add(pressAt(i * kTick_s, 700, 1));
  EXPECT_NEAR(estimator.estimate().stiffness_n_per_m, 700, 1e-3);
}

TEST(StiffnessEstimator, IgnoresShallowAndSlowSamples) {
  StiffnessEstimator estimator;
  for (int i = 0; i < 1000; ++i) {
    estimator.add({0.0009, 0.01, 5});
    estimator.add({0.005, 0.0019, 5});
    estimator.add({0.005, std::nan(""), 5});
  }
  EXPECT_FALSE(estimator.estimate().known);
}

// The stated errors are those of white noise without forgetting: over many runs the spread of the estimates.
TEST(StiffnessEstimator, StatesItsStandardErrors) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise_n(0, 0.05);
  double squares = 0;
  double stated = 0;
  constexpr int kRuns = 400;
  for (int run = 0; run < kRuns; ++run) {
    StiffnessEstimator estimator(1);
    for (int i = 0; i < 500; ++i) {
      PressSample sample = pressAt(i * 0.002, 420, 3);
      sample.force_n += noise_n(random);
      estimator.add(sample);
    }
    squares += std::pow(estimator.estimate().stiffness_n_per_m - 420, 2);
    stated += estimator.estimate().stiffness_error_n_per_m;
  }
  EXPECT_NEAR(std::sqrt(squares / kRuns) / (stated / kRuns), 1, 0.15);
}

TEST(FitLayers, FindsBothStiffnessesAndTheBoundary) {
  std::vector<PressSample> samples;
  for (int i = 0; i < 1000; ++i) {
    PressSample sample = pressAt(i * kTick_s, 0, 2);
    sample.force_n += 300 * std::min(sample.depth_m, 0.005) + 700 * std::max(sample.depth_m - 0.005, 0.0);
    samples.push_back(sample);
  }
  const LayerFit fit = fitLayers(samples);
  ASSERT_TRUE(fit.layered);
  EXPECT_NEAR(fit.upper_n_per_m, 300, 1);
  EXPECT_NEAR(fit.lower_n_per_m, 700, 1);
  EXPECT_NEAR(fit.layer_m, 0.005, 0.0002);
}

TEST(FitLayers, FindsNoneInOneLayer) {
  std::vector<PressSample> samples;
  for (int i = 0; i < 1000; ++i) samples.push_back(pressAt(i * kTick_s, 300, 2));
  const LayerFit fit = fitLayers(samples);
  EXPECT_TRUE(fit.known);
  EXPECT_FALSE(fit.layered);
  EXPECT_NEAR(fit.lower_n_per_m, 300, 1e-6);
}

/// A flat wall of tissue 0.85 m in front of the camera, and a hand (a mass held by a spring and a damper at a
/// place that moves as planned) that presses it at the places of a grid.
class PalpatingHand {
 public:
  static constexpr double kTissue_n_per_m = 300;

  PalpatingHand() : map_(std::make_unique<rt::TissueMap>()) {
    constexpr std::uint16_t kRaw = 700;
    wall_z_m_ = -model_.depth_m(kRaw);
    const auto frame = std::make_unique<rt::DepthFrame>();
    std::fill_n(frame->raw, drivers::kKinectPixels, kRaw);
    frame->sequence = 1;
    frame->arrival_ns = 0;
    storage_.attachTo(scene_);
    builder_.build(*frame, {0, 0, wall_z_m_}, builder_.largestBall_m(), scene_,
                   {.points = false,
                    .image = false,
                    .hidden = false,
                    .visible_surface = true,
                    .surface = {},
                    .filter = {}});
    directive_.parameters.law = rt::ForceLaw::surface;
    directive_.parameters.force.stiffness_n_per_m = kTissue_n_per_m;
    directive_.parameters.safety.max_force_n = 8;
    directive_.engage = true;
    handle_.sequence = 1;
    handle_.position_m_in_world = planned_ = {0, 0, wall_z_m_ + 0.005};
  }

  /// A nodule of 10 mm, twice as stiff as the tissue and 5 mm below its surface.
  void addNodule(const Vec3& on_wall_m) {
    rt::TissueRegion& region = map_->regions[map_->count++];
    region.identity = 1;
    region.shape.position_m_in_world = on_wall_m + Vec3{0, 0, wall_z_m_};
    region.shape.radius_m = 0.005;
    region.transition_m = 0.004;
    region.model = rt::ContactModel::layered;
    region.stiffness_n_per_m = kTissue_n_per_m;
    region.lower_stiffness_n_per_m = 2 * kTissue_n_per_m;
    region.layer_m = 0.005;
    map_->generation = 1;
  }

  /// Presses at places 3 mm apart and passes each tick to `visit`.
  template <typename Visit>
  void palpate(const Visit& visit) {
    rest(600, visit);
    for (int row = -4; row <= 4; ++row) {
      for (int column = -4; column <= 4; ++column) {
        const double x = 0.003 * column;
        const double y = 0.003 * row;
        moveTo({x, y, wall_z_m_ + 0.004}, 60, visit);
        moveTo({x, y, wall_z_m_ - 0.02}, 150, visit);
        moveTo({x, y, wall_z_m_ + 0.004}, 150, visit);
      }
    }
  }

 private:
  template <typename Visit>
  void moveTo(const Vec3& to, int ticks, const Visit& visit) {
    const Vec3 from = planned_;
    for (int i = 1; i <= ticks; ++i) {
      const double x = static_cast<double>(i) / ticks;
      planned_ = from + x * x * (3 - 2 * x) * (to - from);
      visit(step());
    }
  }
  template <typename Visit>
  void rest(int ticks, const Visit& visit) {
    for (int i = 0; i < ticks; ++i) visit(step());
  }

  rt::Tick step() {
    constexpr double kMass_kg = 0.2;
    constexpr double kHand_n_per_m = 500;
    constexpr double kHand_n_s_per_m = 15;
    const Vec3 force = kHand_n_per_m * (planned_ - handle_.position_m_in_world) -
                       kHand_n_s_per_m * handle_.velocity_m_per_s_in_world + command_n_;
    handle_.velocity_m_per_s_in_world += (kTick_s / kMass_kg) * force;
    handle_.position_m_in_world += kTick_s * handle_.velocity_m_per_s_in_world;
    now_ns_ += 1'000'000;
    handle_.time_ns = scene_.frame_time_ns = now_ns_;
    rt::Tick tick = core_.step({.now_ns = now_ns_,
                                .period_s = kTick_s,
                                .scene = scene_,
                                .handle = handle_,
                                .directive = directive_,
                                .start = start_,
                                .fixtures = nullptr,
                                .tissue = map_.get()});
    tick.number = ++number_;
    tick.planned_ns = now_ns_;
    command_n_ = tick.command_force_n_in_world;
    return tick;
  }

  rt::DepthModel model_{rt::DepthModelParameters{}, rt::PoseParameters{}};
  rt::SceneBuilder builder_{model_, rt::GridParameters{}};
  rt::SceneStorage storage_{builder_.shape(), builder_.pointCapacity(), builder_.model()};
  rt::Scene scene_;
  rt::HapticCore core_{builder_.pointCapacity()};
  rt::HandleState handle_;
  rt::Directive directive_;
  rt::StartParameters start_;
  std::unique_ptr<rt::TissueMap> map_;
  Vec3 planned_;
  Vec3 command_n_;
  double wall_z_m_ = 0;
  std::int64_t now_ns_ = 5'000'000'000;
  std::uint64_t number_ = 0;
};

TEST(Palpation, FindsANoduleUnderTheSkin) {
  for (const Vec3& place : {Vec3{0, 0, 0}, Vec3{0.0043, -0.0031, 0}}) {
    PalpatingHand hand;
    hand.addNodule(place);
    Palpation palpation;
    hand.palpate([&palpation](const rt::Tick& tick) { palpation.add(tick); });
    const PalpationMap map = palpation.map(0.003);
    ASSERT_TRUE(map.nodule.has_value());
    EXPECT_NEAR(map.nodule->position_m_in_world.x, place.x, 0.002);
    EXPECT_NEAR(map.nodule->position_m_in_world.y, place.y, 0.002);
    EXPECT_NEAR(map.nodule->stiffness_n_per_m, 600, 60);
    EXPECT_NEAR(map.nodule->surroundings_n_per_m, 300, 30);
    EXPECT_NEAR(map.nodule->layer_m, 0.005, 0.002);
  }
}

TEST(Palpation, FindsNoneInEvenTissue) {
  PalpatingHand hand;
  Palpation palpation;
  hand.palpate([&palpation](const rt::Tick& tick) { palpation.add(tick); });
  const PalpationMap map = palpation.map(0.003);
  EXPECT_GE(map.cells.size(), 81U);
  for (const PalpatedCell& cell : map.cells) {
    EXPECT_NEAR(cell.estimate.stiffness_n_per_m, 300, 3);
  }
  EXPECT_FALSE(map.nodule.has_value());
}

TEST(HapticPalpate, PrintsWhatItFindsInATrace) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "palpation.mcap";
  const Vec3 place{-0.003, 0.002, 0};
  {
    PalpatingHand hand;
    hand.addNodule(place);
    auto writer = trace::TraceWriter::create(file, {});
    ASSERT_TRUE(writer.has_value()) << writer.error().text();
    hand.palpate([&writer](const rt::Tick& tick) { ASSERT_TRUE((*writer)->write(tick).has_value()); });
    ASSERT_TRUE((*writer)->close().has_value());
  }
  const test::Finished finished =
      test::runToEnd({HAPTIC_PALPATE_PROGRAM, "--json", "--cell-mm", "3", file.string()});
  ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
  const nlohmann::json nodule = nlohmann::json::parse(finished.output).at("nodule");
  EXPECT_NEAR(nodule.at("position_m_in_world").at(0).get<double>(), place.x, 0.002);
  EXPECT_NEAR(nodule.at("position_m_in_world").at(1).get<double>(), place.y, 0.002);
  EXPECT_NEAR(nodule.at("stiffness_n_per_m").get<double>(), 600, 60);
  const test::Finished table = test::runToEnd({HAPTIC_PALPATE_PROGRAM, file.string()});
  EXPECT_EQ(table.ending, test::exitedWith(0));
  EXPECT_NE(table.output.find("Stiffer place: "), std::string::npos);
}

TEST(HapticPalpate, RefusesWhatIsNoTrace) {
  const test::TemporaryFolder folder;
  const test::Finished finished =
      test::runToEnd({HAPTIC_PALPATE_PROGRAM, (folder.path() / "none.mcap").string()});
  EXPECT_EQ(finished.ending, test::exitedWith(66));
  EXPECT_NE(finished.errors.find("none.mcap"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::tools

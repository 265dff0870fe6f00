// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/speed.h"

#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <random>

#include "rt/depth_model.h"
#include "rt/nearest_springs.h"
#include "rt/periodic_clock.h"
#include "rt/scene_builder.h"
#include "tools/hapticbench/contenders.h"
#include "tools/hapticbench/reference_force.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

/// Where the N_max-th and the next point are nearer to each other than this, either choice is right.
constexpr double kAmbiguous_m = 1e-6;

/// Times one call and keeps its result alive.
template <typename Task>
auto timed(std::vector<std::int64_t>& durations_ns, Task task) {
  const std::int64_t begin_ns = rt::monotonicNow_ns();
  auto result = task();
  benchmark::DoNotOptimize(result);
  durations_ns.push_back(rt::monotonicNow_ns() - begin_ns);
  return result;
}

/// Our model and its memory.
struct Model {
  Model(const rt::DepthModel& depth_model, rt::ModelExtent extent)
      : grid{.extent = extent},
        builder(depth_model, grid),
        storage(builder.shape(), builder.pointCapacity()),
        search(builder.pointCapacity()) {
    storage.attachTo(scene);
  }
  std::uint32_t build(const rt::DepthFrame& frame, const Vec3& hip, double radius_m) {
    builder.build(frame, hip, radius_m, scene);
    ++scene.model;
    return scene.points;
  }

  rt::GridParameters grid;
  rt::SceneBuilder builder;
  rt::SceneStorage storage;
  rt::Scene scene;
  rt::SearchMemory search;
};

class SpeedRun {
 public:
  SpeedRun(const BenchScene& scene, const SpeedOptions& options)
      : frame_(*scene.frame),
        options_(options),
        depth_model_({}, {}),
        reference_(frame_, {}),
        reach_(depth_model_, rt::ModelExtent::reach),
        whole_(depth_model_, rt::ModelExtent::frame),
        brute_(reference_.points_m()),
        random_(options.seed) {
    result_.scene = scene.name;
    result_.points = reference_.points_m().size();
  }

  SceneSpeed run() {
    const auto cloud = KdTree::cloudOf(reference_.points_m());
    model(cloud);
    tree_ = std::make_unique<KdTree>(cloud);
    result_.scattered = evaluate(scatteredPositions(), true);
    result_.path = evaluate(pathPositions(), false);
    return result_;
  }

 private:
  void model(const std::shared_ptr<const KdTree::Cloud>& cloud) {
    std::vector<std::int64_t> reach, whole, tree;
    std::size_t reach_points = 0;
    for (const Vec3& hip : scatteredPositions()) {
      reach_points += timed(reach, [&] { return reach_.build(frame_, hip, reach_m()); });
    }
    for (std::size_t i = 0; i < options_.frames; ++i)
      timed(whole, [&] { return whole_.build(frame_, {}, 0); });
    for (std::size_t i = 0; i < options_.tree_builds; ++i) {
      timed(tree, [&] { return std::make_unique<KdTree>(cloud); });
    }
    result_.reach_points = static_cast<double>(reach_points) / static_cast<double>(options_.positions);
    result_.modelling = {{"reach only", Durations::of(reach)},
                         {"whole frame", Durations::of(whole)},
                         {"nanoflann tree", Durations::of(tree)}};
    compare(result_.modelling);
  }

  double reach_m() const {
    return rt::reachOfModel_m({.radius_m = springs_.radius_m, .surface = {}, .filter = {}}, reach_.grid);
  }

  /// Each way runs over all positions by itself, so that none finds its data driven out of the caches by
  /// another.
  std::vector<Measurement> evaluate(const std::vector<Vec3>& positions, bool count_ambiguous) {
    std::vector<ReferenceForce::Sample> truth;
    for (const Vec3& hip : positions) {
      truth.push_back(reference_.at(hip, springs_));
      if (count_ambiguous && truth.back().gap_m < kAmbiguous_m) ++result_.ambiguous;
    }
    const auto none = [](const Vec3&) {};
    // modelled again only when the HIP leaves the ball, as the daemon does
    const auto modelReach = [this](const Vec3& hip) {
      if (!reach_.scene.covers(hip, springs_.radius_m)) reach_.build(frame_, hip, reach_m());
    };
    std::vector<Measurement> measurements{
        measure("reach only", positions, truth, modelReach,
                [this](const Vec3& hip) {
                  return rt::nearestSprings(reach_.scene, hip, springs_, reach_.search).force_n_in_world;
                }),
        measure("whole frame", positions, truth, none,
                [this](const Vec3& hip) {
                  return rt::nearestSprings(whole_.scene, hip, springs_, whole_.search).force_n_in_world;
                }),
        measure("nanoflann 100 nearest", positions, truth, none,
                [this](const Vec3& hip) { return tree_->force_n(hip, springs_); }),
        measure("brute force", positions, truth, none,
                [this](const Vec3& hip) { return brute_.force_n(hip, springs_); })};
    compare(measurements);
    return measurements;
  }

  template <typename Prepare, typename Force>
  static Measurement measure(const char* what, const std::vector<Vec3>& positions,
                             const std::vector<ReferenceForce::Sample>& truth, Prepare prepare, Force force) {
    std::vector<std::int64_t> times;
    double error_n = 0;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      prepare(positions[i]);
      const Vec3 computed = timed(times, [&] { return force(positions[i]); });
      if (truth[i].gap_m >= kAmbiguous_m) error_n = std::max(error_n, norm(computed - truth[i].force_n));
    }
    return {what, Durations::of(times), 0, error_n};
  }

  /// nanoflann's is always the third.
  static void compare(std::vector<Measurement>& measurements) {
    for (Measurement& measurement : measurements) {
      measurement.slower_than_nanoflann = measurement.time.median_us / measurements[2].time.median_us;
    }
  }

  /// A measured point, moved by up to a few centimetres.
  Vec3 nearSurface() {
    std::uniform_int_distribution<std::size_t> point(0, reference_.points_m().size() - 1);
    std::normal_distribution<double> offset_m(0, 0.01);
    return reference_.points_m()[point(random_)] +
           Vec3{offset_m(random_), offset_m(random_), offset_m(random_)};
  }

  std::vector<Vec3> scatteredPositions() {
    std::vector<Vec3> positions;
    while (positions.size() < options_.positions) positions.push_back(nearSurface());
    return positions;
  }

  /// Strokes of 100 steps each, in a random direction from a place near the surface.
  std::vector<Vec3> pathPositions() {
    constexpr std::size_t kSteps = 100;
    constexpr double kStep_m = 0.0003;
    std::normal_distribution<double> direction;
    std::vector<Vec3> positions;
    while (positions.size() < options_.positions) {
      const Vec3 towards{direction(random_), direction(random_), direction(random_)};
      const Vec3 step = (kStep_m / norm(towards)) * towards;
      Vec3 hip = nearSurface();
      for (std::size_t i = 0; i < kSteps && positions.size() < options_.positions; ++i) {
        positions.push_back(hip += step);
      }
    }
    return positions;
  }

  const rt::DepthFrame& frame_;
  const SpeedOptions options_;
  const rt::SpringParameters springs_;
  rt::DepthModel depth_model_;
  ReferenceForce reference_;
  Model reach_;
  Model whole_;
  BruteForce brute_;
  std::unique_ptr<KdTree> tree_;
  std::mt19937 random_;
  SceneSpeed result_;
};

}  // namespace

SceneSpeed measureSpeed(const BenchScene& scene, const SpeedOptions& options) {
  return SpeedRun(scene, options).run();
}

}  // namespace hapticd::tools

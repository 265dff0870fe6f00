// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/cost_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "rt/depth_model.h"
#include "rt/periodic_clock.h"
#include "tools/hapticbench/accuracy/accuracy_scene.h"
#include "tools/hapticbench/bench_scene.h"
#include "tools/hapticbench/pareto/touching_path.h"
#include "tools/lib/oracle/reference_camera.h"
#include "tools/lib/oracle/spring_oracle.h"
#include "tools/lib/truth/true_scene.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kEasyReach_m = 2;

/// Places the HIP's path about the point seen by the pixel that is nearest to the middle of the image and has
/// a depth in easy reach. Returns false if there is none.
bool placeInMiddle(TimedScene& scene) {
  const rt::DepthModel model(scene.camera, {});
  const auto width = static_cast<std::uint32_t>(model.width_px());
  const auto height = static_cast<std::uint32_t>(model.height_px());
  const auto stride = static_cast<std::uint32_t>(model.stride_px());
  double best = std::numeric_limits<double>::infinity();
  for (std::uint32_t row = 0; row < height; ++row) {
    for (std::uint32_t column = 0; column < width; ++column) {
      const std::uint16_t raw = scene.frames.front()->raw[row * stride + column];
      const double depth_m = model.depth_m(raw);
      const double off_middle = std::hypot(column - width / 2.0, row - height / 2.0);
      if (depth_m <= 0 || depth_m > kEasyReach_m || off_middle >= best) continue;
      best = off_middle;
      scene.surface_m = model.pointInWorld(rt::PackedPixel::pack(column, row, raw), raw);
    }
  }
  if (!std::isfinite(best)) return false;
  scene.inward = (1 / norm(scene.surface_m)) * scene.surface_m;
  return true;
}

/// Calls `task` and returns how long it took.
template <typename Task>
std::int64_t timed_ns(std::int64_t clock_cost_ns, Task task) {
  const std::int64_t begin_ns = rt::monotonicNow_ns();
  task();
  return std::max<std::int64_t>(0, rt::monotonicNow_ns() - begin_ns - clock_cost_ns);
}

class CostRun {
 public:
  CostRun(const TimedScene& scene, const std::vector<ContenderKind>& kinds, const CostOptions& options)
      : scene_(scene), options_(options), clock_cost_ns_(clockCost_ns()) {
    const auto ticks = static_cast<int>(options.seconds * kTicksPerSecond);
    path_ = scene.path.empty() ? touchingPath(scene.surface_m, scene.inward, ticks) : scene.path;
    for (const ContenderKind& kind : kinds) {
      costs_.push_back({kind, {}, 0, 0, -1});
      contenders_.push_back(kind.make(scene.camera));
    }
  }

  std::vector<ContenderCost> run() {
    std::size_t tick = 0;
    while (tick < path_.size()) {
      const auto shown =
          static_cast<std::size_t>(static_cast<double>(tick) * kFramesPerSecond / kTicksPerSecond);
      const auto next = static_cast<std::size_t>(
          std::ceil(static_cast<double>(shown + 1) * kTicksPerSecond / kFramesPerSecond));
      const std::size_t end = std::min(next, path_.size());
      *frame_ = *scene_.frames[shown % scene_.frames.size()];
      frame_->sequence = shown + 1;  // filters take a frame that they know for no news
      for (std::size_t i = 0; i < contenders_.size(); ++i) timeFrame(i, tick, end);
      check(path_[tick]);
      tick = end;
    }
    return std::move(costs_);
  }

 private:
  void timeFrame(std::size_t index, std::size_t tick, std::size_t end) {
    Contender& contender = *contenders_[index];
    ContenderCost& cost = costs_[index];
    const auto model = [&](const Vec3& hip_m) {
      ++cost.models;
      return timed_ns(clock_cost_ns_, [&] { contender.model(*frame_, hip_m); });
    };
    if (scene_.unrelated) contender.release();
    std::int64_t model_ns = model(path_[tick]);
    for (; tick < end; ++tick) {
      const Vec3& hip_m = path_[tick];
      if (scene_.unrelated) contender.release();
      if (contender.needsModel(hip_m)) model_ns += model(hip_m);
      Vec3 force_n;
      cost.samples.force_ns.push_back(timed_ns(clock_cost_ns_, [&] { force_n = contender.force_n(hip_m); }));
      if (!(force_n == Vec3{})) ++cost.contacts;
    }
    cost.samples.model_ns.push_back(model_ns);
  }

  /// Compares the paper's law of all that compute it with the reference, outside the times.
  void check(const Vec3& hip_m) {
    if (checked_ >= options_.checks) return;
    ++checked_;
    const SpringOracle truth(pointsInCamera(frame_->image(), scene_.camera), hip_m, {});
    if (truth.rankMargin_m() < SpringOracle::kTie_m) return;
    for (std::size_t i = 0; i < contenders_.size(); ++i) {
      if (!costs_[i].kind.is_paper_law) continue;
      if (contenders_[i]->needsModel(hip_m)) contenders_[i]->model(*frame_, hip_m);
      const double difference_n = norm(contenders_[i]->force_n(hip_m) - truth.force_n());
      costs_[i].largest_difference_n = std::max(costs_[i].largest_difference_n, difference_n);
    }
  }

  const TimedScene& scene_;
  const CostOptions& options_;
  std::int64_t clock_cost_ns_;
  std::unique_ptr<rt::DepthFrame> frame_ = std::make_unique<rt::DepthFrame>();
  std::vector<Vec3> path_;
  std::vector<ContenderCost> costs_;
  std::vector<std::unique_ptr<Contender>> contenders_;
  int checked_ = 0;
};

}  // namespace

config::Result<std::vector<TimedScene>> timedScenes(const std::string& recordings) {
  constexpr std::size_t kMostFrames = 60;
  std::vector<TimedScene> scenes;
  auto sequences = recordedSequences(recordings, kMostFrames);
  if (!sequences) return std::unexpected(sequences.error());
  sequences->insert(sequences->begin(), syntheticScene());
  for (BenchSequence& sequence : *sequences) {
    TimedScene scene{.name = sequence.name, .camera = sequence.camera()};
    for (auto& frame : sequence.frames) scene.frames.push_back(std::move(frame));
    if (!placeInMiddle(scene)) {
      return std::unexpected(
          config::Error{fmt::format("{}/{}", recordings, scene.name),
                        fmt::format("the first frame shows nothing within {} m", kEasyReach_m),
                        "take a recording of something that a hand can reach"});
    }
    scenes.push_back(std::move(scene));
  }
  return scenes;
}

TimedScene slopeAt(double distance_m) {
  constexpr int kFrames = 30;
  const auto& all = accuracyScenes();
  const auto slope = std::find_if(all.begin(), all.end(),
                                  [](const AccuracyScene& scene) { return scene.name == "plane30"; });
  TrueScene truth = slope->at(distance_m, SceneNoise::harsh, 1);
  TimedScene scene{.name = slope->name, .camera = truth.depthModel()};
  for (int i = 1; i <= kFrames; ++i) {
    const auto frame = std::make_shared<rt::DepthFrame>();
    truth.render(0, static_cast<std::uint64_t>(i), SceneNoise::harsh, *frame);
    scene.frames.push_back(frame);
  }
  const TrueScene::Approach approach = truth.approach(0);
  scene.surface_m = approach.surface_m_in_world;
  scene.inward = approach.inward_in_world;
  return scene;
}

std::vector<ContenderCost> measureCosts(const TimedScene& scene, const std::vector<ContenderKind>& kinds,
                                        const CostOptions& options) {
  std::vector<ContenderCost> costs = CostRun(scene, kinds, options).run();
  CostOptions again = options;
  again.checks = 0;
  for (int repeat = 1; repeat < options.repeats; ++repeat) {
    const std::vector<ContenderCost> more = CostRun(scene, kinds, again).run();
    for (std::size_t i = 0; i < costs.size(); ++i) costs[i].samples.keepLeast(more[i].samples);
  }
  return costs;
}

void addCosts(std::vector<ContenderCost>& sum, const std::vector<ContenderCost>& more) {
  if (sum.empty()) {
    sum = more;
    return;
  }
  for (std::size_t i = 0; i < std::min(sum.size(), more.size()); ++i) {
    sum[i].samples.append(more[i].samples);
    sum[i].models += more[i].models;
    sum[i].contacts += more[i].contacts;
    sum[i].largest_difference_n = std::max(sum[i].largest_difference_n, more[i].largest_difference_n);
  }
}

}  // namespace hapticd::tools

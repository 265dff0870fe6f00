// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>
#include <random>

#include "drivers/camera/kinect_image.h"
#include "rt/base/clock.h"
#include "rt/depth/depth_model.h"
#include "tools/hapticbench/accuracy.h"
#include "tools/hapticbench/engine/measures.h"
#include "tools/hapticbench/engine/sequences.h"
#include "tools/lib/oracle/reference_camera.h"
#include "tools/lib/oracle/spring_oracle.h"
#include "tools/lib/truth/body_scene.h"
#include "tools/lib/truth/true_scene.h"

namespace hapticd::tools {
namespace {

void keepLeast(std::vector<std::int64_t>& kept, const std::vector<std::int64_t>& again) {
  if (kept.empty()) kept = again;
  for (std::size_t i = 0; i < std::min(kept.size(), again.size()); ++i) kept[i] = std::min(kept[i], again[i]);
}

std::vector<double> inMicroseconds(const std::vector<std::int64_t>& ns) {
  std::vector<double> us;
  for (const std::int64_t value : ns) us.push_back(static_cast<double>(value) / 1000);
  return us;
}

double mean(const std::vector<double>& values) {
  if (values.empty()) return 0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

void CostSamples::keepLeast(const CostSamples& again) {
  tools::keepLeast(model_ns, again.model_ns);
  tools::keepLeast(force_ns, again.force_ns);
}

void CostSamples::append(const CostSamples& more) {
  model_ns.insert(model_ns.end(), more.model_ns.begin(), more.model_ns.end());
  force_ns.insert(force_ns.end(), more.force_ns.begin(), more.force_ns.end());
}

CpuCost CpuCost::of(const CostSamples& samples) {
  const std::vector<double> model_us = inMicroseconds(samples.model_ns);
  const std::vector<double> force_us = inMicroseconds(samples.force_ns);
  return {.model_median_us = quantile(model_us, 0.5),
          .model_mean_us = mean(model_us),
          .model_max_us = quantile(model_us, 1),
          .force_median_us = quantile(force_us, 0.5),
          .force_mean_us = mean(force_us),
          .force_p999_us = quantile(force_us, 0.999),
          .force_max_us = quantile(force_us, 1)};
}

std::int64_t clockCost_ns() {
  std::vector<std::int64_t> empty;
  for (int i = 0; i < 10001; ++i) {
    const std::int64_t begin_ns = rt::monotonicNow_ns();
    empty.push_back(rt::monotonicNow_ns() - begin_ns);
  }
  const auto middle = empty.begin() + 5000;
  std::nth_element(empty.begin(), middle, empty.end());
  return *middle;
}

namespace {

/// Any unit vector at a right angle to `direction`.
rt::Vec3 perpendicularTo(const rt::Vec3& direction) {
  const rt::Vec3 other = std::abs(direction.x) < 0.5 ? rt::Vec3{1, 0, 0} : rt::Vec3{0, 1, 0};
  const rt::Vec3 across = other - dot(other, direction) * direction;
  return unitOf(across);
}

}  // namespace

std::vector<rt::Vec3> touchingPath(const rt::Vec3& surface_m, const rt::Vec3& inward, int ticks,
                                   double radius_m, double speed_up) {
  // the largest speeds of the two motions, 0.38 and 0.31 m/s, are at right angles
  constexpr double kCircle_hz = 1;
  constexpr double kStroke_m = 0.025;
  constexpr double kStroke_hz = 2;
  constexpr double kMiddle_m = -0.01;
  const rt::Vec3 across = perpendicularTo(inward);
  const rt::Vec3 along = cross(inward, across);
  std::vector<rt::Vec3> path;
  for (int tick = 0; tick < ticks; ++tick) {
    const double turns = speed_up * 2 * std::numbers::pi * tick / 1000.0;
    const double angle = kCircle_hz * turns;
    const double depth_m = kMiddle_m + kStroke_m * std::sin(kStroke_hz * turns);
    path.push_back(surface_m + (radius_m * std::cos(angle)) * across + (radius_m * std::sin(angle)) * along +
                   depth_m * inward);
  }
  return path;
}

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

base::Result<std::vector<TimedScene>> timedScenes(const std::string& recordings) {
  constexpr std::size_t kMaxFrames = 60;
  std::vector<TimedScene> scenes;
  auto sequences = recordedSequences(recordings, kMaxFrames);
  if (!sequences) return std::unexpected(sequences.error());
  sequences->insert(sequences->begin(), syntheticScene());
  for (BenchSequence& sequence : *sequences) {
    TimedScene scene{.name = sequence.name, .camera = sequence.camera()};
    for (auto& frame : sequence.frames) scene.frames.push_back(std::move(frame));
    if (!placeInMiddle(scene)) {
      return std::unexpected(
          base::Error{fmt::format("{}/{}", recordings, scene.name),
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

namespace {

/// Returns the raw value whose depth is nearest to `depth_m`.
std::uint16_t rawAt(const rt::DepthModel& model, double depth_m) {
  std::uint16_t best = 0;
  for (std::uint16_t raw = 0; raw < drivers::kKinectRawValues; ++raw) {
    if (std::abs(model.depth_m(raw) - depth_m) < std::abs(model.depth_m(best) - depth_m)) best = raw;
  }
  return best;
}

constexpr double kFar_m = 0.63;

/// `camera` is a Kinect v1 but for its lens. `depthOf(column, row)`: `middle_m`, kFar_m, or negative for a
/// random raw value.
template <typename DepthOf>
TimedScene hard(const char* name, const rt::DepthModelParameters& camera, double middle_m, double radius_m,
                DepthOf depthOf) {
  constexpr int kTicks = 500;
  constexpr double kJump_m = 0.025;
  const rt::DepthModel model(camera, {});
  const std::uint16_t middle_raw = rawAt(model, middle_m);
  const std::uint16_t far_raw = rawAt(model, kFar_m);
  std::mt19937 random(1);
  const auto frame = std::make_shared<rt::DepthFrame>();
  for (int row = 0; row < drivers::kKinectHeight; ++row) {
    for (int column = 0; column < drivers::kKinectWidth; ++column) {
      const double depth_m = depthOf(column, row);
      const auto pixel = static_cast<std::size_t>(row * drivers::kKinectWidth + column);
      frame->raw[pixel] = depth_m < 0 ? static_cast<std::uint16_t>(random() % drivers::kKinectRawValues)
                          : depth_m == middle_m ? middle_raw
                                                : far_raw;
    }
  }
  TimedScene scene{name, camera, {frame}, {0, 0, -middle_m}, {0, 0, -1}};
  scene.path = touchingPath(scene.surface_m, scene.inward, kTicks, radius_m);
  std::uniform_real_distribution<double> jump_m(-kJump_m, kJump_m);
  for (int i = 0; i < kTicks; ++i) {
    scene.path.push_back(scene.surface_m + Vec3{jump_m(random), jump_m(random), jump_m(random)});
  }
  return scene;
}

}  // namespace

std::vector<TimedScene> hardFrames() {
  constexpr double kNear_m = 0.6;
  constexpr double kWall_m = 0.42;
  constexpr double kCircle_m = 0.02;
  rt::DepthModelParameters lens;
  lens.fx_px = lens.fy_px = 20000;
  const rt::DepthModelParameters kinect;
  std::vector<TimedScene> scenes;
  scenes.push_back(hard("all in one ball", lens, kNear_m, 0.005, [](int, int) { return kNear_m; }));
  scenes.push_back(hard("wall at 0.42 m", kinect, kWall_m, kCircle_m, [](int, int) { return kWall_m; }));
  scenes.push_back(hard("checkerboard", kinect, kNear_m, kCircle_m,
                        [](int column, int row) { return (column + row) % 2 == 0 ? kNear_m : kFar_m; }));
  scenes.push_back(hard("columns", kinect, kNear_m, kCircle_m,
                        [](int column, int) { return column % 2 == 0 ? kNear_m : kFar_m; }));
  scenes.push_back(hard("random", kinect, kNear_m, kCircle_m, [](int, int) { return -1.0; }));
  return scenes;
}

TimedScene scattered(TimedScene scene, int ticks) {
  constexpr double kOffset_m = 0.01;
  const rt::DepthModel model(scene.camera, {});
  std::mt19937 random(1);
  std::uniform_int_distribution<std::uint32_t> any_column(0,
                                                          static_cast<std::uint32_t>(model.width_px()) - 1);
  std::uniform_int_distribution<std::uint32_t> any_row(0, static_cast<std::uint32_t>(model.height_px()) - 1);
  const auto stride = static_cast<std::uint32_t>(model.stride_px());
  std::normal_distribution<double> offset_m(0, kOffset_m);
  scene.frames.resize(1);
  scene.unrelated = true;
  scene.path.clear();
  while (scene.path.size() < static_cast<std::size_t>(ticks)) {
    const std::uint32_t column = any_column(random);
    const std::uint32_t row = any_row(random);
    const std::uint16_t raw = scene.frames.front()->raw[row * stride + column];
    if (model.depth_m(raw) <= 0) continue;
    const Vec3 point = model.pointInWorld(rt::PackedPixel::pack(column, row, raw), raw);
    scene.path.push_back(point + Vec3{offset_m(random), offset_m(random), offset_m(random)});
  }
  return scene;
}

TimedScene fast(TimedScene scene, int ticks) {
  scene.path = touchingPath(scene.surface_m, scene.inward, ticks, kPathRadius_m, 1 / kPathSpeed_m_per_s);
  return scene;
}

}  // namespace hapticd::tools

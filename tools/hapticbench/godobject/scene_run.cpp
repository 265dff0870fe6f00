// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <memory>

#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/godobject/godobject.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kTick_s = 0.001;
constexpr std::int64_t kTick_ns = 1'000'000;
constexpr double kFramePeriod_s = 1.0 / 30;
constexpr int kSettlingFrames = 20;  // more than any filter or fusion looks back
constexpr double kPressed_n = 0.5;   // of the true force, from which on a force must be noticed
constexpr double kNoticed_n = 0.1;
constexpr double kNothing_n = 0.001;

/// The HIP over time along the corners of a path.
class Way {
 public:
  explicit Way(const SceneCase& scene) : scene_(scene) {
    ends_s_.push_back(0);
    for (std::size_t i = 1; i < scene.path_m.size(); ++i)
      ends_s_.push_back(ends_s_.back() + norm(scene.path_m[i] - scene.path_m[i - 1]) / scene.speed_m_per_s);
  }
  double ends_s() const { return ends_s_.back() + scene_.stays_s; }

  Vec3 hip_m(double t_s) const {
    const auto next = static_cast<std::size_t>(std::ranges::upper_bound(ends_s_, t_s) - ends_s_.begin());
    if (next == 0) return scene_.path_m.front();
    if (next == ends_s_.size()) return scene_.path_m.back();
    const double share = (t_s - ends_s_[next - 1]) / (ends_s_[next] - ends_s_[next - 1]);
    return scene_.path_m[next - 1] + share * (scene_.path_m[next] - scene_.path_m[next - 1]);
  }
  int loop(double t_s) const {
    const std::vector<std::size_t>& corners = scene_.loop_corners;
    for (std::size_t i = 1; i < corners.size(); ++i) {
      if (t_s >= ends_s_[corners[i - 1]] && t_s < ends_s_[corners[i]]) return static_cast<int>(i) - 1;
    }
    return -1;
  }

 private:
  const SceneCase& scene_;
  std::vector<double> ends_s_;
};

/// The frames of a scene. Those of one at rest are rendered once, as many as a law may fuse and more, and
/// then played backwards and forwards, so that what drifts in their noise never jumps: noise costs most of a
/// stroke.
class FramesOfScene {
 public:
  FramesOfScene(DistanceScene& scene, SceneNoise noise)
      : scene_(scene), noise_(noise), kept_(scene.rests() && isSensorNoise(noise) ? kKept : 1) {}

  /// Valid until the next call.
  const rt::DepthFrame& next(double t_s, std::int64_t now_ns) {
    const std::size_t period = std::max(2 * kept_ - 2, std::size_t{1});
    const std::size_t place = number_ % period;
    const std::size_t index = place < kept_ ? place : period - place;
    ++number_;
    const bool is_new = index == frames_.size();
    if (is_new) frames_.push_back(std::make_unique<rt::DepthFrame>());
    rt::DepthFrame& frame = *frames_[index];
    if (is_new || !scene_.rests()) scene_.render(t_s, number_, noise_, frame);
    frame.sequence = number_;
    frame.arrival_ns = now_ns;
    return frame;
  }
  std::uint64_t count() const { return number_; }

 private:
  static constexpr std::size_t kKept = 24;

  DistanceScene& scene_;
  SceneNoise noise_;
  std::size_t kept_;
  std::vector<std::unique_ptr<rt::DepthFrame>> frames_;
  std::uint64_t number_ = 0;
};

/// A box whose safety chain limits nothing.
std::unique_ptr<OfflineBox> boxWithoutLimits(const rt::LiveParameters& setting,
                                             const rt::DepthModelParameters& camera) {
  auto box = boxWith(setting, camera);
  rt::SafetyParameters& safety = box->parameters().safety;
  safety.max_force_n = 1e6;  // the blend cuts to it
  safety.passivity_control = false;
  safety.stiffness_limit = rt::StiffnessLimit::off;
  return box;
}

}  // namespace

bool isKnown(const DistanceScene& scene, const Vec3& hip_m, const Vec3& proxy_m, double t_s) {
  constexpr double kThickness_m = 0.03;  // somewhat less than SurfaceParameters::shell_m
  constexpr double kTurnedAway = -0.2;
  const Vec3 pull = proxy_m - hip_m;
  if (!(norm(pull) > 0)) return true;
  return dot(pull, proxy_m) < -kTurnedAway * norm(pull) * norm(proxy_m) &&
         scene.behindSight_m(hip_m, t_s) < kThickness_m && scene.behindSight_m(proxy_m, t_s) < kThickness_m;
}

SceneRun runScene(const SceneCase& one, const SceneView& view,
                  const std::vector<rt::LiveParameters>& settings) {
  const Way way(one);
  DistanceScene scene(one.bodies, one.gaps, view.camera, view.seed);
  GodObject ideal(scene);
  std::vector<std::unique_ptr<OfflineBox>> boxes;
  for (const rt::LiveParameters& setting : settings) boxes.push_back(boxWithoutLimits(setting, view.camera));
  const double stiffness = settings.front().force.stiffness_n_per_m;

  SceneRun run;
  run.output.resize(settings.size());
  FramesOfScene frames(scene, view.noise);
  // The boxes' clock begins at 0, well before the hand moves.
  const long first_tick = -std::lround(kSettlingFrames * kFramePeriod_s / kTick_s);
  const long last_tick = std::lround(way.ends_s() / kTick_s);
  long ticked = first_tick;
  for (long i = first_tick + 1; i <= last_tick; ++i) {
    const double t_s = static_cast<double>(i) * kTick_s;
    const std::int64_t now_ns = (i - first_tick) * kTick_ns;
    const bool is_new = now_ns > std::llround(static_cast<double>(frames.count()) * kFramePeriod_s * 1e9);
    if (is_new) {
      const rt::DepthFrame& frame = frames.next(t_s, now_ns);
      for (const auto& box : boxes) box->show(frame, now_ns);
    }
    const bool settling = i < 0;
    if (settling && !is_new) continue;
    const Vec3 hip = way.hip_m(t_s);
    const Vec3 velocity = (1 / kTick_s) * (hip - way.hip_m(t_s - kTick_s));
    for (std::size_t box = 0; box < boxes.size(); ++box) {
      const rt::Tick tick = boxes[box]->tick(hip, static_cast<double>(i - ticked) * kTick_s, velocity);
      if (!settling) run.output[box].push_back({tick.law_force_n_in_world, tick.blended_force_n_in_world});
    }
    ticked = i;
    if (settling) continue;
    const Vec3 proxy = ideal.follow(hip, t_s);
    run.truth.push_back({.t_s = t_s,
                         .hip_m = hip,
                         .proxy_m = proxy,
                         .force_n = stiffness * (proxy - hip),
                         .distance_m = scene.signedDistance(hip, t_s),
                         .is_known = isKnown(scene, hip, proxy, t_s),
                         .loop = way.loop(t_s)});
  }
  return run;
}

void GodObjectFigures::add(const GodObjectFigures& other) {
  strokes += other.strokes;
  contact_ticks += other.contact_ticks;
  lost_ticks += other.lost_ticks;
  aside_ticks += other.aside_ticks;
  unknown_ticks += other.unknown_ticks;
  error_n.add(other.error_n);
  blended_n.add(other.blended_n);
  errors_n.insert(errors_n.end(), other.errors_n.begin(), other.errors_n.end());
  ghost_n = std::max(ghost_n, other.ghost_n);
  step_n = std::max(step_n, other.step_n);
  true_step_n = std::max(true_step_n, other.true_step_n);
  loop_j = loops == 0 ? other.loop_j : other.loops == 0 ? loop_j : std::max(loop_j, other.loop_j);
  loops += other.loops;
}

GodObjectFigures judgeScene(const std::vector<GodObjectTick>& truth,
                            const std::vector<GodObjectForce>& output, double clear_m,
                            double stiffness_n_per_m) {
  GodObjectFigures figures;
  figures.strokes = 1;
  std::vector<double> given_j;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const GodObjectTick& tick = truth[i];
    const Vec3& force = output[i].law_n;
    if (i > 0 && tick.is_known && truth[i - 1].is_known) {
      const GodObjectTick& before = truth[i - 1];
      const Vec3 moved = tick.hip_m - before.hip_m;
      const double spring_n = stiffness_n_per_m * norm(moved);
      figures.step_n = std::max(figures.step_n, norm(force - output[i - 1].law_n) - spring_n);
      figures.true_step_n = std::max(figures.true_step_n, norm(tick.force_n - before.force_n) - spring_n);
      if (tick.loop >= 0 && tick.loop == before.loop) {
        given_j.resize(static_cast<std::size_t>(tick.loop) + 1);
        given_j.back() += 0.5 * dot(force + output[i - 1].law_n, moved);
      }
    }
    if (tick.distance_m > clear_m) figures.ghost_n = std::max(figures.ghost_n, norm(force));
    if (!tick.is_known) {
      ++figures.unknown_ticks;
      continue;
    }
    const double error = norm(force - tick.force_n);
    if (norm(tick.force_n) > kNothing_n || error > kNothing_n) {
      figures.error_n.add(error);
      figures.blended_n.add(norm(output[i].blended_n - tick.force_n));
      figures.errors_n.push_back(static_cast<float>(error));
    }
    if (norm(tick.force_n) <= kPressed_n) continue;
    ++figures.contact_ticks;
    if (norm(force) < kNoticed_n) ++figures.lost_ticks;
    if (norm(force) > kPressed_n && angleBetween_deg(force, tick.force_n) > kRightDirection_deg)
      ++figures.aside_ticks;
  }
  figures.loops = static_cast<int>(given_j.size());
  if (!given_j.empty()) figures.loop_j = std::ranges::max(given_j);
  return figures;
}

std::vector<GodObjectFigures> measureScene(const GodObjectScene& scene, const SceneSight& sight,
                                           const std::vector<rt::LiveParameters>& settings) {
  std::mt19937 random(sight.seed);
  const ScenePlacement placement{.distance_m = sight.distance_m, .has_wall = sight.seed % 2 == 1};
  constexpr double kTouch_m = 0.002;
  const double clear_m = kTouch_m + sight.distance_m / rt::DepthModelParameters{}.fx_px;
  std::vector<GodObjectFigures> figures(settings.size());
  for (const SceneCase& one : scene.make(placement, random)) {
    const rt::DepthModelParameters camera = sight.noise == SceneNoise::none
                                                ? fineDepthModelAround(sight.distance_m, one.beyond_m)
                                                : rt::DepthModelParameters{};
    const SceneRun run = runScene(one, {sight.noise, camera, sight.seed}, settings);
    for (std::size_t i = 0; i < settings.size(); ++i)
      figures[i].add(judgeScene(run.truth, run.output[i], clear_m, settings[i].force.stiffness_n_per_m));
  }
  return figures;
}

}  // namespace hapticd::tools

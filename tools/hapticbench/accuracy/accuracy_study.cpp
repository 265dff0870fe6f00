// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy/accuracy_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "tools/hapticbench/accuracy/accuracy_scene.h"
#include "tools/hapticbench/accuracy/course.h"
#include "tools/hapticbench/accuracy/law_truth.h"
#include "tools/hapticbench/accuracy/pop_through.h"
#include "tools/offline/offline_box.h"

namespace hapticd::tools {
namespace {

using rt::ForceLaw;
using rt::Vec3;

struct Setting {
  ForceLaw law;
  double voxel_edge_m;  // of the grid of points
  bool filtered;
};

/// A box whose safety chain limits nothing.
std::unique_ptr<OfflineBox> boxFor(const Setting& setting, const rt::DepthModelParameters& camera) {
  rt::GridParameters grid;
  grid.voxel_edge_m = setting.voxel_edge_m;
  auto box = std::make_unique<OfflineBox>(camera, rt::PoseParameters{}, grid);
  rt::LiveParameters& live = box->parameters();
  live.law = setting.law;
  if (setting.filtered) live.filter = kFilterOn;
  live.safety.max_force_n = 1e6;
  live.safety.max_slew_n_per_s = 1e9;
  return box;
}

/// First of the settling frames that are shown: where no mean is taken over frames there is nothing to
/// settle.
int firstFrame(const Setting& setting) {
  return setting.filtered || setting.law == ForceLaw::surface ? 0 : kSettlingFrames - 1;
}

/// Shows the settling frames to a HIP that waits.
void settle(OfflineBox& box, FrameReel& reel, const Setting& setting, const Vec3& hip_m) {
  for (int frame = firstFrame(setting); frame < kSettlingFrames; ++frame) {
    box.show(reel.frame(frame));
    box.lawForce(hip_m);
  }
}

/// What a law gives along a course. Where the model lacks a part the force of the tick before stays, as in
/// the core.
std::vector<rt::ForceSample> follow(const Course& course, FrameReel& reel, const Setting& setting,
                                    const rt::DepthModelParameters& camera) {
  const auto box = boxFor(setting, camera);
  settle(*box, reel, setting, course.ticks.front().hip_m);
  std::vector<rt::ForceSample> felt;
  felt.reserve(course.ticks.size());
  int shown = -1;
  for (const CourseTick& tick : course.ticks) {
    if (tick.frame != shown) box->show(reel.frame(tick.frame));
    shown = tick.frame;
    rt::ForceSample sample = box->lawForce(tick.hip_m);
    if (sample.outside_model && !felt.empty()) {
      sample = felt.back();
      sample.outside_model = true;
    }
    felt.push_back(sample);
  }
  return felt;
}

/// True where the proxy, between the largest force and the loss of it, was in free space beside the surface,
/// deeper than where the HIP was pushed in: it slid around and not through.
bool slidAround(const TrueScene& scene, const Course& course, const std::vector<rt::ForceSample>& felt,
                const PopThrough& push) {
  constexpr double kBeside_m = 0.001;
  const TrueScene::Approach approach = scene.approach(0);
  for (std::size_t i = push.largest_tick; i < felt.size(); ++i) {
    const Vec3& proxy = felt[i].proxy_m_in_world;
    const double deep_m = dot(proxy - approach.surface_m_in_world, approach.inward_in_world);
    const double t_s = FrameReel::time_s(course.ticks[i].frame, course.first_moving_frame);
    if (felt[i].state == rt::ContactState::free) return false;
    if (deep_m > kBeside_m && scene.signedDistance(proxy, t_s) > kBeside_m) return true;
  }
  return false;
}

void judge(const TrueScene& scene, const Course& course, const std::vector<rt::ForceSample>& felt,
           PopThroughs& pops) {
  std::vector<double> outward;
  std::vector<double> ideal;
  for (std::size_t i = 0; i < felt.size(); ++i) {
    outward.push_back(dot(felt[i].force_n_in_world, course.outward));
    ideal.push_back(dot(course.ticks[i].ideal_force_n, course.outward));
  }
  const PopThrough push = judgePush(outward, ideal);
  PopThroughs one;
  one.pushes = 1;
  one.popped = push.popped ? 1 : 0;
  one.around = push.under(kPopLimits_n.back()) && slidAround(scene, course, felt, push) ? 1 : 0;
  one.dipped = push.dipped ? 1 : 0;
  one.least_force_n = push.largest_n;
  one.depth_at_least_force_mm = 1000 * course.ticks[push.largest_tick].depth_m;
  for (std::size_t i = 0; i < kPopLimits_n.size(); ++i)
    one.popped_under[i] = push.under(kPopLimits_n[i]) ? 1 : 0;
  pops.add(one);
}

/// How far the force fell behind an earlier one while the scene came nearer, at the ends of frames.
double largestDrop_n(const Course& course, const std::vector<rt::ForceSample>& felt) {
  double highest = 0;
  double drop = 0;
  for (std::size_t i = 0; i < felt.size(); ++i) {
    if (!course.ticks[i].ends_frame || course.ticks[i].frame < course.first_moving_frame) continue;
    const double outward = dot(felt[i].force_n_in_world, course.outward);
    highest = std::max(highest, outward);
    drop = std::max(drop, highest - outward);
  }
  return drop;
}

/// One scene at one distance as one camera sees it: its courses and their truths, shared by all laws.
class Stage {
 public:
  Stage(const AccuracyScene& scene, double distance_m, SceneNoise noise, const AccuracyOptions& options)
      : options_(options), scene_(scene.at(distance_m, noise, options.seed)), moves_(scene.moves()) {
    prototype_.scene = scene.name;
    prototype_.distance_m = distance_m;
    prototype_.noise = noise;
    const double stiffness = rt::SpringParameters{}.stiffness_n_per_m;
    if (moves_) {
      courses_.push_back(waitForPlane(scene_, stiffness, options.seed));
      courses_.push_back(pressThenPlane(scene_, stiffness, options.seed));
    } else {
      courses_ = pushes(scene_, stiffness, options.pushes, options.seed);
    }
    for (const Course& course : courses_) {
      const bool shares = !moves_ && !reels_.empty();
      reels_.push_back(shares ? reels_.front()
                              : std::make_shared<FrameReel>(scene_, noise, course.first_moving_frame));
    }
  }

  AccuracyRow measure(const Setting& setting) {
    AccuracyRow row = prototype_;
    row.law = setting.law;
    row.filtered = setting.filtered;
    for (std::size_t i = 0; i < courses_.size(); ++i) {
      const std::vector<rt::ForceSample> felt = follow(courses_[i], *reels_[i], setting, scene_.depthModel());
      judge(scene_, courses_[i], felt, row.pops);
      compareWithSurface(courses_[i], felt, row);
      if (setting.law != ForceLaw::surface) compareWithLaw(courses_[i], felt, lawTruth(setting)[i], row);
      if (moves_) row.largest_drop_n = std::max(row.largest_drop_n, largestDrop_n(courses_[i], felt));
    }
    if (!moves_ && options_.hold_frames > 0) hold(setting, row);
    return row;
  }

  /// One push with another grid than usual, compared with the usual one.
  AccuracyRow compareGrids(const Setting& setting) {
    AccuracyRow row = prototype_;
    row.law = setting.law;
    row.voxel_edge_m = setting.voxel_edge_m;
    Setting usual = setting;
    usual.voxel_edge_m = kUsualVoxelEdge_m;
    const auto felt = follow(courses_.front(), *reels_.front(), setting, scene_.depthModel());
    const auto expected = follow(courses_.front(), *reels_.front(), usual, scene_.depthModel());
    row.grid_difference_n = 0;
    for (std::size_t i = 0; i < felt.size(); ++i) {
      const double difference_n = norm(felt[i].force_n_in_world - expected[i].force_n_in_world);
      row.grid_difference_n = std::max(row.grid_difference_n, difference_n);
    }
    return row;
  }

 private:
  /// The law's own truth at the samples of each course, computed when it is first asked for. Not of
  /// `surface`.
  const std::vector<std::vector<Vec3>>& lawTruth(const Setting& setting) {
    const bool constraint = hasProxy(setting.law);
    const std::size_t place = constraint                                 ? (setting.filtered ? 3 : 2)
                              : setting.law == ForceLaw::nearest_springs ? 0
                                                                         : 1;
    std::optional<std::vector<std::vector<Vec3>>>& truth = law_truth_[place];
    if (truth) return *truth;
    truth.emplace();
    rt::LiveParameters parameters;
    parameters.law = setting.law;
    if (setting.filtered) parameters.filter = kFilterOn;
    for (std::size_t i = 0; i < courses_.size(); ++i) {
      truth->push_back(
          constraint ? constraintTruth_n(scene_, courses_[i], *reels_[i], firstFrame(setting), parameters)
                     : springTruth_n(scene_, courses_[i], parameters));
    }
    return *truth;
  }

  void compareWithSurface(const Course& course, const std::vector<rt::ForceSample>& felt,
                          AccuracyRow& row) const {
    for (std::size_t i = 0; i < felt.size(); ++i) {
      const CourseTick& tick = course.ticks[i];
      if (felt[i].outside_model) ++row.outside_model;
      if (tick.sample != SamplePlace::behind) continue;
      row.against_surface.add(felt[i].force_n_in_world, tick.ideal_force_n);
      if (!hasProxy(row.law)) continue;
      const double t_s = FrameReel::time_s(tick.frame, course.first_moving_frame);
      const double gap_m = scene_.signedDistance(felt[i].proxy_m_in_world, t_s);
      row.proxy_to_surface_mm.add(1000 * std::abs(gap_m));
    }
  }

  /// `law_truth`: at the samples in turn. In front of the surface only the spring laws push.
  static void compareWithLaw(const Course& course, const std::vector<rt::ForceSample>& felt,
                             const std::vector<Vec3>& law_truth, AccuracyRow& row) {
    std::size_t sample = 0;
    for (std::size_t i = 0; i < felt.size(); ++i) {
      const SamplePlace place = course.ticks[i].sample;
      if (place == SamplePlace::none) continue;
      const Vec3& truth = law_truth[sample++];
      if (place == SamplePlace::behind || !hasProxy(row.law)) {
        row.against_law.add(felt[i].force_n_in_world, truth);
      }
    }
  }

  /// Holds the HIP 10 mm behind the surface, or as far in front of it for the laws that push there, while
  /// frames come.
  void hold(const Setting& setting, AccuracyRow& row) {
    constexpr double kHold_m = 0.01;
    constexpr double kTick_s = 0.001;
    const Course& course = courses_.front();
    const double until_m = hasProxy(setting.law) ? kHold_m : -kHold_m;
    const auto box = boxFor(setting, scene_.depthModel());
    settle(*box, *reels_.front(), setting, course.ticks.front().hip_m);
    int shown = kSettlingFrames - 1;
    Vec3 hip = course.ticks.front().hip_m;
    for (const CourseTick& tick : course.ticks) {
      if (tick.depth_m > until_m) break;
      if (tick.frame != shown) box->show(reels_.front()->frame(tick.frame));
      shown = tick.frame;
      hip = tick.hip_m;
      box->tick(hip, kTick_s);
    }
    hold(*box, hip, shown, row);
  }

  void hold(OfflineBox& box, const Vec3& hip, int shown, AccuracyRow& row) {
    constexpr double kTick_s = 0.001;
    constexpr int kCalmTicks = 70;  // for the blend of the last frame to end
    rt::Tick before;
    for (int i = 0; i < kCalmTicks; ++i) before = box.tick(hip, kTick_s);
    const int ticks = static_cast<int>(options_.hold_frames / kFrameRate_hz / kTick_s);
    const int first = shown + 1;
    for (int i = 0; i < ticks; ++i) {
      const int frame = first + static_cast<int>(i * kTick_s * kFrameRate_hz);
      const bool is_new = frame != shown;
      if (is_new) box.show(reels_.front()->frame(frame));
      shown = frame;
      const rt::Tick tick = box.tick(hip, kTick_s);
      const double commanded_n = norm(tick.command_force_n_in_world - before.command_force_n_in_world);
      row.slew_n_per_s = std::max(row.slew_n_per_s, commanded_n / kTick_s);
      if (is_new) {
        row.blended_step_n = std::max(row.blended_step_n, commanded_n);
        row.law_step_n =
            std::max(row.law_step_n, norm(tick.law_force_n_in_world - before.law_force_n_in_world));
      }
      before = tick;
    }
    row.held = true;
  }

  const AccuracyOptions& options_;
  TrueScene scene_;
  bool moves_;
  AccuracyRow prototype_;
  std::vector<Course> courses_;
  std::vector<std::shared_ptr<FrameReel>> reels_;
  std::array<std::optional<std::vector<std::vector<Vec3>>>, 4> law_truth_;
};

void measureStage(Stage& stage, const AccuracyOptions& options, bool moves, std::vector<AccuracyRow>& rows) {
  for (const ForceLaw law : options.laws) {
    if (law == ForceLaw::surface) {
      rows.push_back(stage.measure({law, kUsualVoxelEdge_m, false}));
      continue;
    }
    for (const bool filtered : options.filters)
      rows.push_back(stage.measure({law, kUsualVoxelEdge_m, filtered}));
    if (moves) continue;
    for (const double voxel_edge_m : options.voxel_edges_m) {
      if (voxel_edge_m != kUsualVoxelEdge_m) rows.push_back(stage.compareGrids({law, voxel_edge_m, false}));
    }
  }
}

}  // namespace

std::string_view nameOf(SceneNoise noise) {
  constexpr std::array<std::string_view, 4> kNames{"none", "quantised", "sensor", "harsh"};
  return kNames.at(static_cast<std::size_t>(noise));
}

void PopThroughs::add(const PopThroughs& other) {
  if (other.pushes > 0 && (pushes == 0 || other.least_force_n < least_force_n)) {
    least_force_n = other.least_force_n;
    depth_at_least_force_mm = other.depth_at_least_force_mm;
  }
  pushes += other.pushes;
  popped += other.popped;
  around += other.around;
  dipped += other.dipped;
  for (std::size_t i = 0; i < popped_under.size(); ++i) popped_under[i] += other.popped_under[i];
}

std::vector<AccuracyRow> measureAccuracy(const AccuracyOptions& options,
                                         const std::function<void(const std::string&)>& progress) {
  std::vector<AccuracyRow> rows;
  for (const AccuracyScene& scene : accuracyScenes()) {
    const bool chosen = options.scenes.empty() || std::find(options.scenes.begin(), options.scenes.end(),
                                                            scene.name) != options.scenes.end();
    if (!chosen) continue;
    for (const double distance_m : options.distances_m) {
      if (progress) progress(fmt::format("{} at {} m", scene.name, distance_m));
      for (const SceneNoise noise : options.noises) {
        Stage stage(scene, distance_m, noise, options);
        measureStage(stage, options, scene.moves(), rows);
      }
    }
  }
  return rows;
}

}  // namespace hapticd::tools

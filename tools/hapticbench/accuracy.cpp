// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "tools/hapticbench/engine/study.h"
#include "tools/lib/offline/offline_box.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/body_scene.h"

namespace hapticd::tools {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A camera of fine depth steps that covers everything in front of and behind the scene that a law can reach.
rt::DepthModelParameters fineCameraFor(const TrueSceneParameters& shape, double distance_m) {
  constexpr double kBehind_m = 0.1;
  constexpr double kMargin_m = 0.02;
  const bool has_wall = shape.kind == SceneKind::thin_plate;
  return fineDepthModelAround(distance_m, has_wall ? shape.wall_behind_m + kMargin_m : kBehind_m);
}

}  // namespace

const std::vector<AccuracyScene>& accuracyScenes() {
  static const std::vector<AccuracyScene> scenes{
      {"plane", {.kind = SceneKind::plane}},
      {"plane30", {.kind = SceneKind::plane, .tilt_rad = 30 * kDegree}},
      {"plane60", {.kind = SceneKind::plane, .tilt_rad = 60 * kDegree}},
      {"sphere", {.kind = SceneKind::sphere, .radius_m = 0.05}},
      {"bowl", {.kind = SceneKind::bowl, .radius_m = 0.05}},
      {"cylinder", {.kind = SceneKind::cylinder, .radius_m = 0.02}},
      {"edge", {.kind = SceneKind::convex_edge}},
      {"half_plane", {.kind = SceneKind::half_plane}},
      {"corner", {.kind = SceneKind::inner_corner}},
      {"plate", {.kind = SceneKind::thin_plate}},
      {"step", {.kind = SceneKind::step}},
  };
  return scenes;
}

TrueScene AccuracyScene::at(double distance_m, SceneNoise noise, std::uint32_t seed) const {
  TrueSceneParameters placed = shape;
  placed.distance_m = distance_m;
  const rt::DepthModelParameters kinect;
  return TrueScene(placed, noise == SceneNoise::none ? fineCameraFor(shape, distance_m) : kinect, seed);
}

const rt::DepthFrame& FrameReel::frame(int index) {
  // The noise repeats after 1.3 s, long after any law has forgotten it.
  constexpr int kFrames = 40;
  const int place = isSensorNoise(noise_) ? index % kFrames : 0;
  if (place >= static_cast<int>(rendered_.size())) rendered_.resize(static_cast<std::size_t>(place) + 1);
  auto& frame = rendered_[static_cast<std::size_t>(place)];
  const auto number = static_cast<std::uint64_t>(index) + 1;
  if (!frame) {
    frame = std::make_unique<rt::DepthFrame>();
    scene_.render(0, number, noise_, *frame);
  }
  frame->sequence = number;
  return *frame;
}

namespace {

using rt::Vec3;

constexpr double kTick_s = 0.001;
constexpr double kRounding_m = 1e-9;

/// A displacement across `direction` of at most 4 mm, so that HIPs do not lie on the lattice of pixels.
Vec3 aside(const Vec3& direction, std::mt19937& random) {
  constexpr double kAside_m = 0.004;
  std::uniform_real_distribution<double> share(0, 1);
  const Vec3 first = std::abs(direction.x) < 0.9 ? cross(direction, {1, 0, 0}) : cross(direction, {0, 1, 0});
  const Vec3 across = unitOf(first);
  const double radius = kAside_m * std::sqrt(share(random));
  const double angle = 2 * std::numbers::pi * share(random);
  return radius * (std::cos(angle) * across + std::sin(angle) * cross(direction, across));
}

/// Builds a course tick by tick.
class CourseMaker {
 public:
  CourseMaker(const TrueScene& scene, double stiffness_n_per_m)
      : scene_(scene), stiffness_(stiffness_n_per_m) {
    course_.outward = -scene.approach(0).inward_in_world;
  }

  /// Adds a tick; returns false at the end of the course.
  bool add(const Vec3& hip_m) {
    CourseTick tick{.hip_m = hip_m};
    const auto count = static_cast<double>(course_.ticks.size());
    tick.frame = kSettlingFrames + static_cast<int>(count * kTick_s * kFrameRate_hz + kRounding_m);
    const Vec3 to_surface = scene_.closestVisible(hip_m, 0) - hip_m;
    const bool is_behind = scene_.penetration(hip_m, 0) > 0;
    tick.depth_m = is_behind ? norm(to_surface) : -norm(to_surface);
    if (is_behind) tick.ideal_force_n = stiffness_ * to_surface;
    const double ideal_n = dot(tick.ideal_force_n, course_.outward);
    const bool lets_go = most_ideal_n_ > 0.5 && ideal_n < 0.98 * most_ideal_n_;
    if (tick.depth_m > kDeepest_m || lets_go) return false;
    most_ideal_n_ = std::max(most_ideal_n_, ideal_n);
    course_.ticks.push_back(tick);
    return true;
  }

  /// Marks the ticks at which forces are compared: every millimetre of depth between 5 and 20 mm.
  Course finish() {
    constexpr double kFirst_m = 0.005;
    constexpr double kLast_m = 0.02;
    constexpr double kStep_m = 0.001;
    double last_m = -1;
    for (CourseTick& tick : course_.ticks) {
      const double depth_m = std::abs(tick.depth_m);
      const bool in_range = depth_m >= kFirst_m - kRounding_m && depth_m <= kLast_m + kRounding_m;
      if (!in_range || std::abs(tick.depth_m - last_m) < kStep_m - kRounding_m) continue;
      tick.is_sample = tick.depth_m > 0;
      last_m = tick.depth_m;
    }
    return std::move(course_);
  }

 private:
  const TrueScene& scene_;
  double stiffness_;
  Course course_;
  double most_ideal_n_ = 0;
};

}  // namespace

std::vector<Course> pushes(const TrueScene& scene, double stiffness_n_per_m, int count, std::uint32_t seed) {
  constexpr double kStart_m = 0.03;  // in front of the surface
  constexpr double kSpeed_m_per_s = 0.1;
  constexpr double kStep_m = kSpeed_m_per_s * kTick_s;
  constexpr int kTicks = static_cast<int>((kStart_m + 2 * kDeepest_m) / kStep_m);
  std::mt19937 random(seed);
  const TrueScene::Approach approach = scene.approach(0);
  std::vector<Course> courses;
  for (int i = 0; i < count; ++i) {
    CourseMaker maker(scene, stiffness_n_per_m);
    const Vec3 foot = approach.surface_m_in_world + aside(approach.inward_in_world, random);
    for (int tick = 0; tick < kTicks; ++tick) {
      if (!maker.add(foot + (tick * kStep_m - kStart_m) * approach.inward_in_world)) break;
    }
    courses.push_back(maker.finish());
  }
  return courses;
}

namespace {

/// First of the settling frames that are shown: a law that uses the newest frame alone has nothing to settle.
int firstFrame(const LawSetting& setting) {
  return setting.usesEarlierFrames() ? 0 : kSettlingFrames - 1;
}

/// Shows the settling frames to a HIP that waits.
void settle(OfflineBox& box, FrameReel& reel, const LawSetting& setting, const Vec3& hip_m) {
  for (int frame = firstFrame(setting); frame < kSettlingFrames; ++frame) {
    box.show(reel.frame(frame));
    box.lawForce(hip_m);
  }
}

/// The forces of a law along a course. Where the model lacks a part, the force of the previous tick stays, as
/// in the core.
std::vector<rt::ForceSample> follow(const Course& course, FrameReel& reel, const LawSetting& setting,
                                    const rt::DepthModelParameters& camera) {
  const auto box = boxFor(setting, camera);
  settle(*box, reel, setting, course.ticks.front().hip_m);
  std::vector<rt::ForceSample> forces;
  forces.reserve(course.ticks.size());
  int shown = -1;
  for (const CourseTick& tick : course.ticks) {
    if (tick.frame != shown) box->show(reel.frame(tick.frame));
    shown = tick.frame;
    rt::ForceSample sample = box->lawForce(tick.hip_m);
    if (sample.outside_model && !forces.empty()) {
      sample = forces.back();
      sample.outside_model = true;
    }
    forces.push_back(sample);
  }
  return forces;
}

void judge(const Course& course, const std::vector<rt::ForceSample>& forces, PopThroughs& pops) {
  std::vector<double> outward;
  std::vector<double> ideal;
  for (std::size_t i = 0; i < forces.size(); ++i) {
    outward.push_back(dot(forces[i].force_n_in_world, course.outward));
    ideal.push_back(dot(course.ticks[i].ideal_force_n, course.outward));
  }
  const PopThrough push = judgePush(outward, ideal);
  PopThroughs one;
  one.pushes = 1;
  one.popped = push.popped ? 1 : 0;
  one.dipped = push.dipped ? 1 : 0;
  one.least_force_n = push.largest_n;
  one.depth_at_least_force_mm = 1000 * course.ticks[push.largest_tick].depth_m;
  for (std::size_t i = 0; i < kPopLimits_n.size(); ++i)
    one.popped_under[i] = push.under(kPopLimits_n[i]) ? 1 : 0;
  pops.add(one);
}

/// One scene at one distance as one camera sees it: its courses and their truths, shared by all laws.
class Stage {
 public:
  Stage(const AccuracyScene& scene, double distance_m, SceneNoise noise, const AccuracyOptions& options)
      : options_(options), scene_(scene.at(distance_m, noise, options.seed)), reel_(scene_, noise) {
    prototype_.scene = scene.name;
    prototype_.distance_m = distance_m;
    prototype_.noise = noise;
    courses_ = pushes(scene_, rt::SpringParameters{}.stiffness_n_per_m, options.pushes, options.seed);
  }

  AccuracyRow measure(const LawSetting& setting) {
    AccuracyRow row = prototype_;
    row.setting = setting;
    for (const Course& course : courses_) {
      const std::vector<rt::ForceSample> forces = follow(course, reel_, setting, scene_.depthModel());
      judge(course, forces, row.pops);
      compareWithSurface(course, forces, row);
    }
    if (options_.hold_frames > 0) hold(setting, row);
    return row;
  }

 private:
  void compareWithSurface(const Course& course, const std::vector<rt::ForceSample>& forces,
                          AccuracyRow& row) const {
    for (std::size_t i = 0; i < forces.size(); ++i) {
      const CourseTick& tick = course.ticks[i];
      if (forces[i].outside_model) ++row.outside_model;
      if (!tick.is_sample) continue;
      row.error.add(forces[i].force_n_in_world, tick.ideal_force_n);
      if (!hasProxy(row.setting.law)) continue;
      row.proxy_to_surface_mm.add(1000 * std::abs(scene_.signedDistance(forces[i].proxy_m_in_world, 0)));
    }
  }

  /// Holds the HIP 10 mm behind the surface, or as far in front of it for the laws that push there, while
  /// frames come.
  void hold(const LawSetting& setting, AccuracyRow& row) {
    constexpr double kHold_m = 0.01;
    constexpr int kCalmTicks = 70;  // for the blend of the last frame to end
    const Course& course = courses_.front();
    const double until_m = hasProxy(setting.law) ? kHold_m : -kHold_m;
    const auto box = boxFor(setting, scene_.depthModel());
    settle(*box, reel_, setting, course.ticks.front().hip_m);
    int shown = kSettlingFrames - 1;
    Vec3 hip = course.ticks.front().hip_m;
    for (const CourseTick& tick : course.ticks) {
      if (tick.depth_m > until_m) break;
      if (tick.frame != shown) box->show(reel_.frame(tick.frame));
      shown = tick.frame;
      hip = tick.hip_m;
      box->tick(hip, kTick_s);
    }
    rt::Tick before;
    for (int i = 0; i < kCalmTicks; ++i) before = box->tick(hip, kTick_s);
    measureSteps(*box, hip, shown, before, row);
  }

  void measureSteps(OfflineBox& box, const Vec3& hip, int shown, rt::Tick before, AccuracyRow& row) {
    const int ticks = static_cast<int>(options_.hold_frames / kFrameRate_hz / kTick_s);
    const int first = shown + 1;
    for (int i = 0; i < ticks; ++i) {
      const int frame = first + static_cast<int>(i * kTick_s * kFrameRate_hz);
      const bool is_new = frame != shown;
      if (is_new) box.show(reel_.frame(frame));
      shown = frame;
      const rt::Tick tick = box.tick(hip, kTick_s);
      const double commanded_n = norm(tick.command_force_n_in_world - before.command_force_n_in_world);
      const double law_n = norm(tick.law_force_n_in_world - before.law_force_n_in_world);
      row.slew_n_per_s = std::max(row.slew_n_per_s, commanded_n / kTick_s);
      if (is_new) {
        row.blended_step_n = std::max(row.blended_step_n, commanded_n);
        row.law_step_n = std::max(row.law_step_n, law_n);
      }
      before = tick;
    }
    row.held = true;
  }

  const AccuracyOptions& options_;
  TrueScene scene_;
  FrameReel reel_;
  AccuracyRow prototype_;
  std::vector<Course> courses_;
};

}  // namespace

void PopThroughs::add(const PopThroughs& other) {
  if (other.pushes > 0 && (pushes == 0 || other.least_force_n < least_force_n)) {
    least_force_n = other.least_force_n;
    depth_at_least_force_mm = other.depth_at_least_force_mm;
  }
  pushes += other.pushes;
  popped += other.popped;
  dipped += other.dipped;
  for (std::size_t i = 0; i < popped_under.size(); ++i) popped_under[i] += other.popped_under[i];
}

void AccuracyRow::add(const AccuracyRow& other) {
  error.add(other.error);
  proxy_to_surface_mm.add(other.proxy_to_surface_mm);
  pops.add(other.pops);
  law_step_n = std::max(law_step_n, other.law_step_n);
  blended_step_n = std::max(blended_step_n, other.blended_step_n);
  slew_n_per_s = std::max(slew_n_per_s, other.slew_n_per_s);
  outside_model += other.outside_model;
}

std::vector<AccuracyCase> casesOf(const AccuracyOptions& options) {
  std::vector<AccuracyCase> cases;
  for (const AccuracyScene& scene : accuracyScenes()) {
    if (!options.scenes.empty() && std::ranges::find(options.scenes, scene.name) == options.scenes.end())
      continue;
    for (const double distance_m : options.distances_m) {
      for (const SceneNoise noise : options.noises) cases.push_back({scene, distance_m, noise});
    }
  }
  return cases;
}

std::vector<AccuracyRow> measureCase(const AccuracyCase& one, const AccuracyOptions& options) {
  Stage stage(one.scene, one.distance_m, one.noise, options);
  std::vector<AccuracyRow> rows;
  for (const LawSetting& setting : options.settings) rows.push_back(stage.measure(setting));
  return rows;
}

std::vector<AccuracyRow> measureAccuracy(const AccuracyOptions& options) {
  std::vector<AccuracyRow> rows;
  for (const AccuracyCase& one : casesOf(options)) {
    const auto of_case = measureCase(one, options);
    rows.insert(rows.end(), of_case.begin(), of_case.end());
  }
  return rows;
}

namespace {

constexpr const char* kExplanation =
    "Errors of the law's force against a spring of 500 N/m from the HIP to an ideal constraint on the\n"
    "true surface, 5 to 20 mm behind it: N, % of the true force, multiples of the just noticeable\n"
    "difference max(7 % of F, 0.1 N), and degrees. proxy: its distance from the true surface. pop: the\n"
    "smallest force over the pushes at which the surface gave way, or the largest that was reached (a\n"
    "push ends 45 mm deep, or where a body lets an ideal constraint go), the penetration of the HIP\n"
    "there, and how many pushes popped through below 3, 10 and 20 N. step: the largest change at a new\n"
    "frame with the HIP held still 10 mm behind the surface (spring laws: in front of it), of the law and\n"
    "of the blended command; slew: of the command at any tick.\n\n";

Row accuracyCells(const AccuracyRow& r) {
  Row row{{"/scene", "scene", 0, r.scene},
          {"/distance_m", "m", 1, r.distance_m},
          {"/law", "law", 0, nameOf(r.setting.law)},
          {"/noise", "noise", 0, nameOf(r.noise)},
          {"/filtered", "filter", 0, r.setting.filtered},
          {"/against_surface/samples", "", 0, r.error.error_n.count()}};
  for (const Row& spread :
       {spreadCells("/against_surface/error_n", "rms N", "max N", r.error.error_n),
        spreadCells("/against_surface/error_percent", "rms %", "", r.error.error_percent),
        spreadCells("/against_surface/error_jnd", "JND", "max JND", r.error.error_jnd),
        spreadCells("/against_surface/direction_deg", "deg", "max deg", r.error.direction_deg),
        spreadCells("/proxy_to_surface_mm", "proxy mm", "max mm", r.proxy_to_surface_mm)})
    row = joined(std::move(row), spread);
  return joined(std::move(row), {{"/pushes", "pushes", 0, r.pops.pushes},
                                 {"/popped", "popped", 0, r.pops.popped},
                                 {"/popped_under_3_n", "<3 N", 0, r.pops.popped_under[0]},
                                 {"/popped_under_10_n", "<10 N", 0, r.pops.popped_under[1]},
                                 {"/popped_under_20_n", "<20 N", 0, r.pops.popped_under[2]},
                                 {"/dipped", "dipped", 0, r.pops.dipped},
                                 {"/pop_through_n", "pop N", 2, r.pops.least_force_n},
                                 {"/depth_at_pop_through_mm", "at mm", 1, r.pops.depth_at_least_force_mm},
                                 {"/law_step_n", "step N", 2, r.law_step_n},
                                 {"/blended_step_n", "blended N", 2, r.blended_step_n},
                                 {"/slew_n_per_s", "slew N/s", 1, r.slew_n_per_s},
                                 {"/ticks_outside_model", "not modelled", 0, r.outside_model}});
}

std::vector<Limit> accuracyLimits(const AccuracyRow& r) {
  std::vector<Limit> limits;
  const auto add = [&](rt::ForceLaw law, const char* text, bool applies, double value, double limit) {
    limits.push_back({text, applies && r.setting.law == law, value, limit, std::string(nameOf(law))});
  };
  for (const rt::ForceLawRow& law : rt::kForceLaws) {
    if (law.has_proxy)
      add(law.law, "pushes that pop through below 20 N", true, r.pops.popped_under.back(), 0);
  }
  const bool exact = r.noise == SceneNoise::none;
  const bool is_plane = r.scene.starts_with("plane");
  const bool faces_camera = r.scene == "plane" && exact;
  const double expected_n = faces_camera ? popThroughForceOnPlane_n({}, {}, r.distance_m) : 1;
  add(rt::ForceLaw::nearest_springs,
      "pop-through force on the plane without noise compared with the closed form, %", faces_camera,
      100 * std::abs(r.pops.least_force_n / expected_n - 1), 3);
  add(rt::ForceLaw::surface, "RMS error on planes to 1.2 m with a sensor's noise, JND",
      isSensorNoise(r.noise) && r.distance_m <= 1.2 && is_plane, r.error.error_jnd.rms(), 1);
  add(rt::ForceLaw::surface, "error on planes without noise, % or degrees", exact && is_plane,
      std::max(r.error.error_percent.max(), r.error.direction_deg.max()), 1);
  return limits;
}

}  // namespace

std::vector<AccuracyRow> summaryOf(const std::vector<AccuracyRow>& rows) {
  std::vector<AccuracyRow> summaries;
  for (const AccuracyRow& row : rows) {
    auto summary = std::ranges::find_if(summaries, [&row](const AccuracyRow& other) {
      return other.setting == row.setting && other.noise == row.noise;
    });
    if (summary == summaries.end()) {
      summary = summaries.insert(summaries.end(), AccuracyRow{.scene = "all"});
      summary->setting = row.setting;
      summary->noise = row.noise;
    }
    summary->add(row);
  }
  std::ranges::stable_sort(summaries, {}, [](const AccuracyRow& row) { return row.setting.law; });
  return summaries;
}

std::vector<Requirement> requirementsOf(const std::vector<AccuracyRow>& rows) {
  return checked(
      {""}, rows, [](const AccuracyRow&, const std::string&) { return true; }, accuracyLimits,
      [](const AccuracyRow& r) {
        return fmt::format("{} at {} m, noise {}, {}", r.scene, r.distance_m, nameOf(r.noise),
                           nameOf(r.setting));
      });
}

Report accuracyReport(const std::vector<AccuracyRow>& rows) {
  Report report;
  report.say(kExplanation);
  report.table("rows", "", rowsOf(rows, accuracyCells));
  report.table("summary", "\nall scenes and distances together\n", rowsOf(summaryOf(rows), accuracyCells));
  report.requirements(requirementsOf(rows));
  return report;
}

StudyCommand accuracyCommand(CLI::App& app) {
  struct Chosen {
    AccuracyOptions options;
    std::vector<rt::ForceLaw> laws = everyOne<rt::ForceLaw>();
  };
  const auto chosen = std::make_shared<Chosen>();
  AccuracyOptions& options = chosen->options;
  StudyCommand command(app, "accuracy",
                       "forces on known surfaces: error, direction, pop-through, steps at new frames");
  command.quick("plane and sphere at 1 m, one push each", [&options] {
    options.scenes = {"plane", "sphere"};
    options.distances_m = {1};
    options.pushes = 1;
    options.hold_frames = 10;
  });
  command.names("--scenes", options.scenes, namesOf(accuracyScenes()), "all");
  command.choices("--laws", chosen->laws, kAllOf<rt::ForceLaw>, "all");
  command.numbers("--distances", options.distances_m, 0.5, 3.9, "from the camera, metres (0.6,1,2)");
  command.choices("--noises", options.noises, kAllNoises, "none,harsh");
  command.seed(options.seed, "of the positions and of the noise (1)");
  command.parts();
  command.onRun([chosen](const StudyCommand& self) {
    std::erase_if(chosen->options.settings, [&chosen](const LawSetting& setting) {
      return std::ranges::find(chosen->laws, setting.law) == chosen->laws.end();
    });
    return self.forEachCase(
        casesOf(chosen->options), [&](const AccuracyCase& one) { return measureCase(one, chosen->options); },
        [](const std::vector<std::vector<AccuracyRow>>& cases) {
          std::vector<AccuracyRow> rows;
          for (const auto& of_case : cases) rows.insert(rows.end(), of_case.begin(), of_case.end());
          return accuracyReport(rows);
        });
  });
  return command;
}

}  // namespace hapticd::tools

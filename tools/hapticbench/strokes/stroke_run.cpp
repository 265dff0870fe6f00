// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <variant>

#include "tools/hapticbench/strokes/strokes.h"

namespace hapticd::tools {

using rt::Vec3;

Vec3 StrokePath::hip_m(double stroked_m) const {
  const Vec3 first = approach_m(0);
  if (bend_radius_m == 0) return first + stroked_m * along;
  const double radius = bend_radius_m - depth_m;
  const double angle = stroked_m / radius;
  const Vec3 centre = start_m - bend_radius_m * outward;
  return centre + radius * (std::cos(angle) * outward + std::sin(angle) * along);
}

Vec3 StrokePath::direction(double stroked_m) const {
  if (length_m == 0) return {};
  if (bend_radius_m == 0) return along;
  const double angle = stroked_m / (bend_radius_m - depth_m);
  return std::cos(angle) * along - std::sin(angle) * outward;
}

Vec3 StrokePath::approach_m(double before_m) const {
  const Vec3 from = entry == Vec3{} ? outward : entry;
  return start_m + (before_m - depth_m) * from;
}

namespace {

constexpr double kTick_s = 0.001;
constexpr double kFramePeriod_s = 1.0 / 30;
constexpr int kSettlingFrames = 20;   // more than any filter or fusion looks back
constexpr double kApproach_m = 0.02;  // in front of the surface
constexpr double kPressed_s = 0.1;    // before the stroke begins

/// The times of the hand's actions. Time 0 is the beginning of the approach; frames arrive before.
class Schedule {
 public:
  explicit Schedule(const StrokeCase& stroke) : stroke_(stroke) {
    const double travel_m = kApproach_m + stroke.path.depth_m;
    pressed_s_ = travel_m / kStrokeSpeed_m_per_s;
    begins_s_ = pressed_s_ + kPressed_s + stroke.phase_s + (stroke.motion.rests() ? 0 : kSteady_s);
    const bool moves_on = stroke.hip == HipMotion::strokes && stroke.path.length_m > 0;
    ends_s_ = begins_s_ + (moves_on ? stroke.path.length_m / kStrokeSpeed_m_per_s : stroke.stays_s);
  }

  /// Returns when the bodies begin to move.
  double motionStarts_s() const { return pressed_s_ + kPressed_s; }
  double ends_s() const { return ends_s_; }
  bool judged(double t_s) const { return t_s >= (stroke_.motion.rests() ? pressed_s_ : begins_s_); }
  bool strokes(double t_s) const { return t_s >= begins_s_ && stroke_.hip == HipMotion::strokes; }
  double stroked_m(double t_s) const {
    return std::clamp((t_s - begins_s_) * kStrokeSpeed_m_per_s, 0.0, stroke_.path.length_m);
  }

  Vec3 hip_m(const BodyScene& scene, double t_s) const {
    const bool stays = stroke_.hip == HipMotion::stays && t_s > begins_s_;
    const RigidFrame bodies = scene.frameAt(stays ? begins_s_ : t_s);
    if (t_s < pressed_s_) {
      const double before_m = kApproach_m + stroke_.path.depth_m - std::max(0.0, t_s) * kStrokeSpeed_m_per_s;
      return bodies.positionOut(stroke_.path.approach_m(before_m));
    }
    return bodies.positionOut(stroke_.path.hip_m(stays ? 0 : stroked_m(t_s)));
  }

 private:
  const StrokeCase& stroke_;
  double pressed_s_;
  double begins_s_;
  double ends_s_;
};

/// A box whose safety chain limits nothing.
std::unique_ptr<OfflineBox> unlimitedBox(const rt::LiveParameters& setting,
                                         const rt::DepthModelParameters& camera) {
  auto box = boxWith(setting, camera);
  rt::SafetyParameters& safety = box->parameters().safety;
  safety.max_force_n = 1e6;  // the blend cuts to it
  safety.passivity_control = false;
  safety.stiffness_limit = rt::StiffnessLimit::off;
  return box;
}

/// The frames of a scene one after the other, of which only the newest is kept.
class Camera {
 public:
  Camera(BodyScene& scene, const StrokeView& view) : scene_(scene), view_(view) {}

  /// Renders what has arrived by `t_s`; true if that is a new frame.
  bool refresh(double t_s, std::int64_t start_ns) {
    constexpr double kRounding_s = 1e-9;
    bool is_new = false;
    while (shows_s(number_ + 1) <= t_s + kRounding_s) {
      ++number_;
      is_new = true;
    }
    if (!is_new) return false;
    const bool same = scene_.rests() && number_ > 1 && view_.noise <= SceneNoise::quantised && rendered_;
    if (!same) scene_.render(shows_s(number_), static_cast<std::uint64_t>(number_), view_.noise, *frame_);
    rendered_ = true;
    frame_->sequence = static_cast<std::uint64_t>(number_);
    frame_->arrival_ns = start_ns + std::llround(shows_s(number_) * 1e9);
    return true;
  }
  const rt::DepthFrame& frame() const { return *frame_; }

 private:
  static double shows_s(long number) {
    return static_cast<double>(number - kSettlingFrames) * kFramePeriod_s;
  }

  BodyScene& scene_;
  const StrokeView& view_;
  std::unique_ptr<rt::DepthFrame> frame_ = std::make_unique<rt::DepthFrame>();
  long number_ = 0;
  bool rendered_ = false;
};

/// Metres along `direction` at `p` for one pixel of the image.
double pitchAlong_m(const rt::DepthModelParameters& camera, const Vec3& p, const Vec3& direction) {
  const double depth = -p.z;
  // How fast the point moves in the image: the derivative of (f x / Z, f y / Z).
  const double across = camera.fx_px * (direction.x / depth + direction.z * p.x / (depth * depth));
  const double up = camera.fy_px * (direction.y / depth + direction.z * p.y / (depth * depth));
  return 1 / std::hypot(across, up);
}

TrueTick trueTick(const StrokeCase& stroke, const Schedule& schedule, const BodyScene& scene,
                  IdealConstraint& ideal, double t_s, double stiffness_n_per_m) {
  TrueTick tick;
  tick.t_s = t_s;
  tick.hip_m = schedule.hip_m(scene, t_s);
  tick.hold = ideal.follow(tick.hip_m, t_s);
  tick.judged = schedule.judged(t_s);
  if (schedule.strokes(t_s)) {
    const double stroked_m = schedule.stroked_m(t_s);
    tick.along = scene.frameAt(t_s).directionOut(stroke.path.direction(stroked_m));
    if (stroke.ends_at_m) tick.past_end_m = stroked_m - *stroke.ends_at_m;
  }
  if (stroke.ends_unseen && tick.past_end_m.value_or(0) > 0) {
    tick.hold.reset();
    return tick;
  }
  if (tick.judged && stroke.held_in_front) {
    const RigidFrame bodies = scene.frameAt(t_s);
    const double into_m = stroke.path.depth_m;
    const Vec3 outward = bodies.directionOut(stroke.path.outward);
    tick.hold = Hold{tick.hip_m + into_m * outward, outward};
  }
  if (tick.hold) {
    tick.force_n = stiffness_n_per_m * (tick.hold->proxy_m - tick.hip_m);
  } else {
    tick.clearance_m = scene.signedDistance(tick.hip_m, t_s);
  }
  return tick;
}

LawTick lawTick(OfflineBox& box, const Vec3& hip_m, const Vec3& velocity_m_per_s, double period_s) {
  const rt::Tick tick = box.tick(hip_m, period_s, velocity_m_per_s);
  return {tick.law_force_n_in_world, tick.blended_force_n_in_world, tick.proxy_m_in_world, tick.contact,
          tick.outside_model};
}

}  // namespace

StrokeRun runStroke(const StrokeCase& stroke, const StrokeView& view,
                    const std::vector<rt::LiveParameters>& settings) {
  const Schedule schedule(stroke);
  BodyMotion motion = stroke.motion;
  motion.start_s = schedule.motionStarts_s();
  BodyScene scene(stroke.bodies, stroke.T_camera_bodies, motion, view.camera, view.seed);
  Camera camera(scene, view);
  IdealConstraint ideal(scene);
  std::vector<std::unique_ptr<OfflineBox>> boxes;
  for (const rt::LiveParameters& setting : settings) boxes.push_back(unlimitedBox(setting, view.camera));

  StrokeRun run;
  run.output.resize(settings.size());
  // The boxes' clock begins at 0, well before the first frame arrives.
  const long first_tick = -std::lround(kSettlingFrames * kFramePeriod_s / kTick_s);
  const std::int64_t start_ns = -first_tick * std::llround(kTick_s * 1e9);
  const long last_tick = std::lround(schedule.ends_s() / kTick_s);
  long ticked = first_tick;
  for (long i = first_tick + 1; i <= last_tick; ++i) {
    const double t_s = static_cast<double>(i) * kTick_s;
    const bool is_new = camera.refresh(t_s, start_ns);
    if (is_new) {
      for (const auto& box : boxes) box->show(camera.frame(), start_ns + i * std::llround(kTick_s * 1e9));
    }
    const bool settling = i < 0;
    if (settling && !is_new) continue;
    const double period_s = static_cast<double>(i - ticked) * kTick_s;
    ticked = i;
    const Vec3 hip = schedule.hip_m(scene, t_s);
    const Vec3 velocity = (1 / kTick_s) * (hip - schedule.hip_m(scene, t_s - kTick_s));
    for (std::size_t box = 0; box < boxes.size(); ++box) {
      const LawTick output = lawTick(*boxes[box], hip, velocity, period_s);
      if (!settling) run.output[box].push_back(output);
    }
    if (settling) continue;
    const double stiffness = settings.front().force.stiffness_n_per_m;
    run.truth.push_back(trueTick(stroke, schedule, scene, ideal, t_s, stiffness));
  }
  const Vec3 end_m = stroke.path.hip_m(stroke.ends_at_m.value_or(stroke.path.length_m));
  const RigidFrame bodies = scene.frameAt(schedule.ends_s());
  const Vec3 direction = bodies.directionOut(stroke.path.along);
  run.pitch_m = pitchAlong_m(view.camera, bodies.positionOut(end_m), direction);
  return run;
}

namespace {

constexpr double kNoticed_n = 0.1;  // less than that nobody notices
constexpr double kPressed_n = 0.5;  // of the true force, from which on a force must be noticed

bool isNearEnd(const TrueTick& tick, const JudgeLimits& limits) {
  return tick.past_end_m && std::abs(*tick.past_end_m) <= limits.end_m;
}

double lag_m(const TrueTick& truth, const LawTick& output) {
  if (output.state == rt::ContactState::free) return 0;
  return dot(truth.hold->proxy_m - output.proxy_m, truth.along);
}

void judgeContact(const TrueTick& truth, const LawTick& output, StrokeFigures& figures) {
  const Vec3 error = output.law_force_n - truth.force_n;
  const bool pressed = norm(truth.force_n) > kPressed_n;
  ++figures.contact_ticks;
  if (isRightForce(output.law_force_n, truth.force_n)) ++figures.right_ticks;
  figures.size_sum_n += norm(output.law_force_n);
  figures.true_size_sum_n += norm(truth.force_n);
  if (pressed && norm(output.law_force_n) < kNoticed_n) ++figures.lost_ticks;
  if (pressed && dot(output.law_force_n, truth.hold->outward) < -kNoticed_n) ++figures.wrong_side_ticks;
  figures.error.add(output.law_force_n, truth.force_n);
  figures.blended.add(output.blended_force_n, truth.force_n);
  figures.along_n.add(std::abs(dot(error, truth.along)));
}

/// Returns where the force finally fell below half of the true force before the end.
std::optional<double> endOfContact_m(const std::vector<TrueTick>& truth, const std::vector<LawTick>& output) {
  double before_n = 0;
  for (const TrueTick& tick : truth) {
    if (tick.past_end_m && *tick.past_end_m < 0) before_n = norm(tick.force_n);
  }
  std::optional<double> last;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!truth[i].past_end_m) continue;
    if (!last || norm(output[i].law_force_n) > before_n / 2) last = truth[i].past_end_m;
  }
  return last;
}

}  // namespace

void EndSpread::add(double past_end_m, double pitch_m) {
  EndSpread one;
  one.ends = 1;
  one.earliest_m = one.latest_m = past_end_m;
  one.worst_pitches = std::abs(past_end_m) / pitch_m;
  add(one);
}

void EndSpread::add(const EndSpread& other) {
  if (other.ends == 0) return;
  earliest_m = ends == 0 ? other.earliest_m : std::min(earliest_m, other.earliest_m);
  latest_m = ends == 0 ? other.latest_m : std::max(latest_m, other.latest_m);
  worst_pitches = std::max(worst_pitches, other.worst_pitches);
  ends += other.ends;
}

void DelaySearch::add(const std::vector<Vec3>& force_n, const std::vector<Vec3>& true_n) {
  const auto ticks = static_cast<int>(force_n.size());
  // the same ticks for all shifts
  for (int tick = kLatest_ms; tick < ticks + kEarliest_ms; ++tick) {
    for (int shift = kEarliest_ms; shift <= kLatest_ms; ++shift) {
      const Vec3 error =
          force_n[static_cast<std::size_t>(tick)] - true_n[static_cast<std::size_t>(tick - shift)];
      squares_[static_cast<std::size_t>(shift - kEarliest_ms)] += dot(error, error);
    }
  }
}

void DelaySearch::add(const DelaySearch& other) {
  for (std::size_t i = 0; i < squares_.size(); ++i) squares_[i] += other.squares_[i];
}

std::optional<int> DelaySearch::delay_ms() const {
  const auto least = std::ranges::min_element(squares_);
  if (*std::ranges::max_element(squares_) == 0) return std::nullopt;
  return static_cast<int>(least - squares_.begin()) + kEarliest_ms;
}

std::optional<double> StrokeFigures::sizeRatio() const {
  if (true_size_sum_n == 0) return std::nullopt;
  return size_sum_n / true_size_sum_n;
}

void StrokeFigures::add(const StrokeFigures& other) {
  strokes += other.strokes;
  stopped += other.stopped;
  lagged += other.lagged;
  contact_ticks += other.contact_ticks;
  lost_ticks += other.lost_ticks;
  right_ticks += other.right_ticks;
  size_sum_n += other.size_sum_n;
  true_size_sum_n += other.true_size_sum_n;
  delay.add(other.delay);
  wrong_side_ticks += other.wrong_side_ticks;
  free_ticks += other.free_ticks;
  ghost_ticks += other.ghost_ticks;
  outside_model_ticks += other.outside_model_ticks;
  error.add(other.error);
  blended.add(other.blended);
  along_n.add(other.along_n);
  lag_m = std::max(lag_m, other.lag_m);
  ghost_n = std::max(ghost_n, other.ghost_n);
  end.add(other.end);
}

StrokeFigures judgeStroke(const std::vector<TrueTick>& truth, const std::vector<LawTick>& output,
                          const JudgeLimits& limits) {
  StrokeFigures figures;
  figures.strokes = 1;
  bool behind = false;  // now
  std::vector<Vec3> forces_n;
  std::vector<Vec3> true_forces_n;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const TrueTick& tick = truth[i];
    if (output[i].outside_model) ++figures.outside_model_ticks;
    if (isNearEnd(tick, limits)) continue;
    if (tick.hold && tick.judged) {
      judgeContact(tick, output[i], figures);
      forces_n.push_back(output[i].law_force_n);
      true_forces_n.push_back(tick.force_n);
      const double lag = limits.has_proxy ? lag_m(tick, output[i]) : 0;
      behind = lag > limits.lag_m;
      if (behind) figures.lagged = 1;
      figures.lag_m = std::max(figures.lag_m, lag);
    } else if (!tick.hold && tick.clearance_m > limits.clear_m) {
      ++figures.free_ticks;
      const double force = norm(output[i].law_force_n);
      if (force > kNoticed_n) ++figures.ghost_ticks;
      figures.ghost_n = std::max(figures.ghost_n, force);
    }
  }
  figures.stopped = behind ? 1 : 0;
  if (limits.moving) figures.delay.add(forces_n, true_forces_n);
  if (const auto end = endOfContact_m(truth, output)) figures.end.add(*end, limits.pitch_m);
  return figures;
}

namespace {

constexpr double kPatch_m = 0.16;
constexpr FloorFrames kResting{.count = 8};
constexpr FloorFrames kMoving{.count = 3, .moving = true};

FloorFrames framesOf(const StrokeCase& stroke) {
  return stroke.motion.rests() ? kResting : kMoving;
}

/// The face as a patch that faces the camera and has as many pixels.
FloorError flatFloor(const StrokeCase& stroke, const drivers::SensorNoise::Parameters& noise,
                     double distance_m, double stiffness_n_per_m) {
  const Vec3 place = stroke.T_camera_bodies.positionOut(stroke.path.hip_m(stroke.path.length_m / 2));
  const Vec3 outward = stroke.T_camera_bodies.directionOut(stroke.path.outward);
  const double to_normal = std::abs(dot(outward, (1 / -place.z) * place));  // of an error in depth
  const FloorPatch patch{.side_m = kPatch_m * std::sqrt(to_normal),
                         .distance_m = distance_m,
                         .off_centre = std::max(0.0, 1 - 2 * stroke.beside_edge_m / kPatch_m),
                         .frames = framesOf(stroke)};
  FloorError floor = noiseFloor(noise, {}, patch, stiffness_n_per_m);
  floor.depth_m *= to_normal;
  floor.force_n *= to_normal;
  floor.force_jnd *= to_normal;
  return floor;
}

/// `body`: radius and axis, in the frame of the bodies.
FloorError curvedFloor(const StrokeCase& stroke, FloorBody body,
                       const drivers::SensorNoise::Parameters& noise, double stiffness_n_per_m) {
  constexpr int kPlaces = 3;  // spread evenly over the stroke
  const StrokePath& path = stroke.path;
  FloorError sum{.determined = true};
  const auto add = [](double& mean_square, double value) { mean_square += value * value / kPlaces; };
  for (int i = 0; i < kPlaces; ++i) {
    const double stroked_m = (i + 0.5) / kPlaces * path.length_m;
    const Vec3 along = path.direction(stroked_m);
    const Vec3 outward =
        path.bend_radius_m == 0 ? path.outward : unitOf(cross(along, cross(path.outward, along)));
    const RigidFrame& bodies = stroke.T_camera_bodies;
    body.outward = bodies.directionOut(outward);
    body.along = bodies.directionOut(along);
    body.contact_m = bodies.positionOut(path.hip_m(stroked_m)) + path.depth_m * body.outward;
    const FloorError floor = noiseFloor(noise, {}, body, stiffness_n_per_m);
    if (!floor.determined) return floor;
    add(sum.depth_m, floor.depth_m);
    add(sum.force_n, floor.force_n);
    add(sum.force_jnd, floor.force_jnd);
    add(sum.tilt_force_n, floor.tilt_force_n);
  }
  for (double* figure : {&sum.depth_m, &sum.force_n, &sum.force_jnd, &sum.tilt_force_n})
    *figure = std::sqrt(*figure);
  return sum;
}

}  // namespace

FloorError strokeFloor(const StrokeCase& stroke, SceneNoise noise, double distance_m,
                       double stiffness_n_per_m) {
  const drivers::SensorNoise::Parameters sensor = sensorParameters(noise);
  const bool has_crease = std::holds_alternative<HollowBody>(stroke.bodies.front());
  if (stroke.held_in_front || has_crease) return {};
  FloorBody body{.depth_m = stroke.path.depth_m, .frames = framesOf(stroke)};
  if (const auto* ball = std::get_if<BallBody>(&stroke.bodies.front())) {
    body.radius_m = ball->radius_m;
    return curvedFloor(stroke, body, sensor, stiffness_n_per_m);
  }
  if (const auto* rod = std::get_if<RodBody>(&stroke.bodies.front())) {
    body.radius_m = rod->radius_m;
    body.axis = stroke.T_camera_bodies.x;
    return curvedFloor(stroke, body, sensor, stiffness_n_per_m);
  }
  return flatFloor(stroke, sensor, distance_m, stiffness_n_per_m);
}

}  // namespace hapticd::tools

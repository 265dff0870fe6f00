// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/body_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kOnFace_m = 1e-12;  // a point that near to a face lies on it
constexpr double kParallel = 1e-12;  // sine below which faces or rays have no crossing

bool isInAll(const std::vector<Face>& faces, const Vec3& p) {
  return std::ranges::all_of(faces, [&p](const Face& face) { return face.above_m(p) <= kOnFace_m; });
}

/// `p` moved onto both planes by the shortest displacement, or nothing where they are parallel.
std::optional<Vec3> ontoTwo(const Face& a, const Face& b, const Vec3& p) {
  const double cosine = dot(a.outward, b.outward);
  const double determinant = 1 - cosine * cosine;
  if (determinant < kParallel) return std::nullopt;
  const double above_a = a.above_m(p);
  const double above_b = b.above_m(p);
  return p - ((above_a - cosine * above_b) / determinant) * a.outward -
         ((above_b - cosine * above_a) / determinant) * b.outward;
}

/// The common point of three planes, or nothing where two are parallel.
std::optional<Vec3> ontoThree(const Face& a, const Face& b, const Face& c) {
  const Vec3 bc = cross(b.outward, c.outward);
  const double determinant = dot(a.outward, bc);
  if (std::abs(determinant) < kParallel) return std::nullopt;
  return (1 / determinant) * (a.offset_m * bc + b.offset_m * cross(c.outward, a.outward) +
                              c.offset_m * cross(a.outward, b.outward));
}

/// The best of the candidates that lie in all half-spaces.
class Nearest {
 public:
  Nearest(const std::vector<Face>& faces, const Vec3& p) : faces_(faces), p_(p) {}

  void consider(const std::optional<Vec3>& candidate) {
    if (!candidate || !isInAll(faces_, *candidate)) return;
    const double distance = norm(*candidate - p_);
    if (distance >= distance_) return;
    distance_ = distance;
    point_ = *candidate;
  }
  const Vec3& point() const { return point_; }

 private:
  const std::vector<Face>& faces_;
  Vec3 p_;
  Vec3 point_ = p_;
  double distance_ = kNever;
};

/// The half-spaces whose borders the hollow's faces are, seen from the hollow.
std::vector<Face> turnedOver(const std::vector<Face>& faces) {
  std::vector<Face> over;
  for (const Face& face : faces) over.push_back({-face.outward, -face.offset_m});
  return over;
}

/// The stretch of a ray that lies in a half-space is cut off `first`..`last`.
void clip(const Face& face, const Vec3& origin, const Vec3& direction, double& first, double& last) {
  const double above = face.above_m(origin);
  const double rising = dot(face.outward, direction);
  if (rising == 0) {
    if (above > 0) last = -kNever;
  } else if (rising < 0) {
    first = std::max(first, -above / rising);
  } else {
    last = std::min(last, -above / rising);
  }
}

/// The first crossing of origin + s * direction into the ball or, when the x components are left out, the
/// endless cylinder; and the last one.
struct Passage {
  double in;
  double out;
};
std::optional<Passage> passage(const Vec3& origin, const Vec3& direction, double radius) {
  const double a = dot(direction, direction);
  const double b = dot(origin, direction);
  const double c = dot(origin, origin) - radius * radius;
  if (a == 0) return c <= 0 ? std::optional(Passage{-kNever, kNever}) : std::nullopt;
  const double square = b * b - a * c;
  if (square < 0) return std::nullopt;
  const double root = std::sqrt(square);
  return Passage{(-b - root) / a, (-b + root) / a};
}

Vec3 acrossX(const Vec3& v) {
  return {0, v.y, v.z};
}

}  // namespace

Vec3 closestInAll(const std::vector<Face>& faces, const Vec3& p) {
  Nearest nearest(faces, p);
  nearest.consider(p);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    nearest.consider(p - faces[i].above_m(p) * faces[i].outward);
    for (std::size_t j = 0; j < i; ++j) {
      nearest.consider(ontoTwo(faces[i], faces[j], p));
      for (std::size_t k = 0; k < j; ++k) nearest.consider(ontoThree(faces[i], faces[j], faces[k]));
    }
  }
  return nearest.point();
}

double ConvexBody::signedDistance(const Vec3& p) const {
  double highest = -kNever;
  for (const Face& face : faces) highest = std::max(highest, face.above_m(p));
  return highest <= 0 ? highest : norm(p - closestInAll(faces, p));
}

double ConvexBody::rayEntry(const Vec3& origin, const Vec3& direction) const {
  double first = 0;
  double last = kNever;
  for (const Face& face : faces) clip(face, origin, direction, first, last);
  return first < last ? first : kNever;
}

namespace {

/// The last face that a HIP that moved from `before` to `p` inside came through. A HIP that was inside all
/// along counts as come through the nearest face.
int faceEntered(const std::vector<Face>& faces, const Vec3& before, const Vec3& p) {
  int entered = -1;
  double latest = 0;
  int nearest = 0;
  for (int i = 0; i < static_cast<int>(faces.size()); ++i) {
    const Face& face = faces[static_cast<std::size_t>(i)];
    const double above_before = face.above_m(before);
    const double above = face.above_m(p);
    if (above > faces[static_cast<std::size_t>(nearest)].above_m(p)) nearest = i;
    if (above_before <= 0) continue;
    const double when = above_before / (above_before - above);
    if (when <= latest) continue;
    latest = when;
    entered = i;
  }
  return entered >= 0 ? entered : nearest;
}

/// The face beyond which `on_face` lies the farthest, or -1.
int faceSlidOver(const std::vector<Face>& faces, const Vec3& on_face) {
  int beyond = -1;
  double farthest = kOnFace_m;
  for (int i = 0; i < static_cast<int>(faces.size()); ++i) {
    const double above = faces[static_cast<std::size_t>(i)].above_m(on_face);
    if (above <= farthest) continue;
    farthest = above;
    beyond = i;
  }
  return beyond;
}

}  // namespace

std::optional<Hold> ConvexBody::hold(const Vec3& p, const Vec3& before, HoldingSide& side) const {
  const bool outside = std::ranges::any_of(faces, [&p](const Face& face) { return face.above_m(p) >= 0; });
  if (outside) {
    side.face = -1;
    return std::nullopt;
  }
  if (side.face < 0) side.face = faceEntered(faces, before, p);
  Hold held;
  // Over each edge the proxy gets nearer to the HIP, so no face comes twice.
  for (std::size_t i = 0; i <= faces.size(); ++i) {
    const Face& face = faces[static_cast<std::size_t>(side.face)];
    held = {p - face.above_m(p) * face.outward, face.outward};
    const int beyond = faceSlidOver(faces, held.proxy_m);
    if (beyond < 0) break;
    side.face = beyond;
  }
  return held;
}

double HollowBody::signedDistance(const Vec3& p) const {
  double lowest = kNever;
  for (const Face& face : faces) lowest = std::min(lowest, face.above_m(p));
  return lowest >= 0 ? lowest : -norm(p - closestInAll(turnedOver(faces), p));
}

double HollowBody::rayEntry(const Vec3& origin, const Vec3& direction) const {
  double first = kNever;
  for (const Face& face : faces) {
    const double rising = dot(face.outward, direction);
    if (rising < 0) first = std::min(first, -face.above_m(origin) / rising);
  }
  return first;
}

std::optional<Hold> HollowBody::hold(const Vec3& p, const Vec3&, HoldingSide&) const {
  const bool outside = std::ranges::all_of(faces, [&p](const Face& face) { return face.above_m(p) >= 0; });
  if (outside) return std::nullopt;
  const Vec3 proxy = closestInAll(turnedOver(faces), p);
  return Hold{proxy, unitOf(proxy - p)};
}

double RodBody::signedDistance(const Vec3& p) const {
  const double beside = norm(acrossX(p)) - radius_m;
  const double beyond = std::abs(p.x) - half_length_m;
  if (beside > 0 && beyond > 0) return std::hypot(beside, beyond);
  return std::max(beside, beyond);
}

double RodBody::rayEntry(const Vec3& origin, const Vec3& direction) const {
  const auto round = passage(acrossX(origin), acrossX(direction), radius_m);
  if (!round) return kNever;
  double first = std::max(0.0, round->in);
  double last = round->out;
  clip({{1, 0, 0}, half_length_m}, origin, direction, first, last);
  clip({{-1, 0, 0}, half_length_m}, origin, direction, first, last);
  return first < last ? first : kNever;
}

std::optional<Hold> RodBody::hold(const Vec3& p, const Vec3&, HoldingSide&) const {
  if (signedDistance(p) >= 0) return std::nullopt;
  const Vec3 outward = norm(acrossX(p)) > 0 ? unitOf(acrossX(p)) : Vec3{0, 0, 1};
  return Hold{{p.x, radius_m * outward.y, radius_m * outward.z}, outward};
}

double BallBody::signedDistance(const Vec3& p) const {
  return norm(p) - radius_m;
}

double BallBody::rayEntry(const Vec3& origin, const Vec3& direction) const {
  const auto through = passage(origin, direction, radius_m);
  return through && through->in >= 0 ? through->in : kNever;
}

std::optional<Hold> BallBody::hold(const Vec3& p, const Vec3&, HoldingSide&) const {
  if (signedDistance(p) >= 0) return std::nullopt;
  const Vec3 outward = norm(p) > 0 ? unitOf(p) : Vec3{0, 0, 1};
  return Hold{radius_m * outward, outward};
}

namespace {

constexpr double kNotMet = std::numeric_limits<double>::infinity();

/// A ray from the camera in the bodies' frame; its parameter is the depth Z.
struct BodyRays {
  Vec3 camera_m;
  Vec3 right;
  Vec3 up;
  Vec3 ahead;

  explicit BodyRays(const RigidFrame& bodies)
      : camera_m(bodies.positionIn({})),
        right(bodies.directionIn({1, 0, 0})),
        up(bodies.directionIn({0, 1, 0})),
        ahead(bodies.directionIn({0, 0, -1})) {}
  /// `ray`: in the camera's frame, at depth 1.
  Vec3 direction(const Vec3& ray) const { return ray.x * right + ray.y * up + ahead; }
};

double firstDepth(const std::vector<TrueBody>& bodies, const Vec3& origin, const Vec3& direction) {
  double depth = kNotMet;
  for (const TrueBody& body : bodies) {
    depth = std::min(depth,
                     std::visit([&](const auto& solid) { return solid.rayEntry(origin, direction); }, body));
  }
  return depth;
}

}  // namespace

double Beat::displacement_m(double elapsed_s) const {
  double displacement_m = 0;
  for (std::size_t i = 0; i < amplitudes_m.size(); ++i) {
    const double harmonic = static_cast<double>(i + 1);
    const double sign = i % 2 == 0 ? -1 : 1;
    displacement_m +=
        sign * amplitudes_m[i] * (std::cos(2 * std::numbers::pi * harmonic * hz * elapsed_s) - 1);
  }
  return displacement_m;
}

bool BodyMotion::rests() const {
  const Vec3 none{};
  return beat.rests() && velocity_m_per_s == none && turning_rad_per_s == none && spin_rad_per_s == none &&
         sway_m == none && sway_rad == none;
}

RigidFrame BodyMotion::at(const RigidFrame& rested, double t_s) const {
  const double elapsed = std::clamp(t_s - start_s, 0.0, lasts_s);
  const double phase = 2 * std::numbers::pi * sway_hz * elapsed;
  const Vec3 sway{std::sin(phase), std::sin(1.1 * phase), std::sin(1.2 * phase)};
  const auto swayed = [&sway](const Vec3& amplitude) {
    return Vec3{amplitude.x * sway.x, amplitude.y * sway.y, amplitude.z * sway.z};
  };
  return rested.spun(elapsed * spin_rad_per_s)
      .moved(elapsed * turning_rad_per_s + swayed(sway_rad),
             elapsed * velocity_m_per_s + swayed(sway_m) + beat.displacement_m(elapsed) * beat.direction);
}

BodyScene::BodyScene(std::vector<TrueBody> bodies, const RigidFrame& T_camera_bodies,
                     const BodyMotion& motion, const rt::DepthModelParameters& depth_model,
                     std::uint32_t seed)
    : bodies_(std::move(bodies)),
      T_camera_bodies_(T_camera_bodies),
      motion_(motion),
      camera_(depth_model),
      sensor_(seed) {}

double BodyScene::signedDistance(const Vec3& p, double t_s) const {
  const Vec3 inside = frameAt(t_s).positionIn(p);
  double distance = kNotMet;
  for (const TrueBody& body : bodies_) {
    distance = std::min(
        distance, std::visit([&inside](const auto& solid) { return solid.signedDistance(inside); }, body));
  }
  return distance;
}

double BodyScene::trueDepth(double column, double row, double t_s) const {
  const BodyRays rays(frameAt(t_s));
  return firstDepth(bodies_, rays.camera_m, rays.direction(camera_.rayThrough(column, row)));
}

void BodyScene::render(double t_s, std::uint64_t frame_number, SceneNoise noise, rt::DepthFrame& frame) {
  if (!measured_at_s_ || (!rests() && *measured_at_s_ != t_s)) {
    const BodyRays rays(frameAt(t_s));
    camera_.measure(
        [&](const Vec3& ray) { return 1 / firstDepth(bodies_, rays.camera_m, rays.direction(ray)); });
    measured_at_s_ = t_s;
  }
  sensor_.deliver(camera_, frame_number, noise, frame);
  camera_.removeOutsideLimits(frame);
  frame.arrival_ns = std::llround(t_s * 1e9);
}

std::optional<Hold> IdealConstraint::follow(const Vec3& hip, double t_s) {
  const RigidFrame frame = scene_.frameAt(t_s);
  const Vec3 inside = frame.positionIn(hip);
  const Vec3 before = before_m_.value_or(inside);
  before_m_ = inside;
  std::optional<Hold> held;
  for (std::size_t i = 0; i < sides_.size(); ++i) {
    const auto by_body = std::visit([&](const auto& solid) { return solid.hold(inside, before, sides_[i]); },
                                    scene_.bodies()[i]);
    if (by_body) held = Hold{frame.positionOut(by_body->proxy_m), frame.directionOut(by_body->outward)};
  }
  return held;
}

}  // namespace hapticd::tools

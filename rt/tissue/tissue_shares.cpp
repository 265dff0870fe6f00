// SPDX-License-Identifier: Apache-2.0
#include "rt/tissue/tissue_shares.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace hapticd::rt {
namespace {

/// Bound of the second derivative of a presence with a transition of width 1: 6 for the smoothstep, 3 for the
/// curvature of a sphere no thinner than the transition.
constexpr double kBend = 9;

struct Step {
  double value;
  double slope_per_m;
};

/// Returns the smoothstep of a signed distance: 1 inside, 0 outside.
Step stepAt(double distance_m, double width_m) noexcept {
  const double x = std::clamp(0.5 - distance_m / width_m, 0.0, 1.0);
  return {x * x * (3 - 2 * x), -6 * x * (1 - x) / width_m};
}

constexpr double bendOf(double width_m) noexcept {
  return kBend / (width_m * width_m);
}

Presence presenceOfBox(const Shape& box, double transition_m, const Vec3& offset_m) noexcept {
  const auto& r = box.rotation;
  const double half[3] = {box.half_size_m.x, box.half_size_m.y, box.half_size_m.z};
  Vec3 axes[3];
  Step steps[3];
  for (std::size_t i = 0; i < 3; ++i) {
    axes[i] = {r[i], r[3 + i], r[6 + i]};
    const double along = dot(offset_m, axes[i]);
    steps[i] = stepAt(std::abs(along) - half[i], std::min(transition_m, 2 * half[i]));
    if (!(steps[i].value > 0)) return {};
    steps[i].slope_per_m = std::copysign(1.0, along) * steps[i].slope_per_m;
  }
  return {steps[0].value * steps[1].value * steps[2].value,
          steps[0].slope_per_m * steps[1].value * steps[2].value * axes[0] +
              steps[0].value * steps[1].slope_per_m * steps[2].value * axes[1] +
              steps[0].value * steps[1].value * steps[2].slope_per_m * axes[2],
          bendOf(std::min({transition_m, 2 * half[0], 2 * half[1], 2 * half[2]}))};
}

/// Looks up the presence of labels around a place: a mean over a window as wide as the transition, with a
/// kernel whose integral is the smoothstep. The samples form a Fibonacci lattice, in which no line parallel
/// to an edge of a label holds many of them.
class LabelWindow {
 public:
  LabelWindow(const TissueMap& map, const DepthModel& model, const Vec3& p_m_in_world) noexcept
      : map_(map), model_(model), camera_(model.parameters()), p_(model.positionInCamera(p_m_in_world)) {}

  /// Looks up all label regions with the transition of region `first` and stores their presence.
  void look(std::size_t first, std::array<Presence, kMaxTissueRegions>& presence) noexcept {
    const double transition_m = map_.regions[first].transition_m;
    std::array<std::int8_t, 256> slot_of_label;
    slot_of_label.fill(-1);
    std::int8_t slots = 0;
    for (std::size_t i = first; i < map_.count; ++i) {
      const TissueRegion& region = map_.regions[i];
      if (region.place != TissuePlace::label || region.transition_m != transition_m) continue;
      std::int8_t& slot = slot_of_label[region.label];
      if (slot < 0) slot = slots++;
    }
    std::array<Presence, kMaxTissueRegions> found{};
    if (-p_.z > kNearest_m) {
      for (int k = 0; k < kSamples; ++k) addSample(k, transition_m, slot_of_label, found);
    }
    for (std::size_t i = first; i < map_.count; ++i) {
      const TissueRegion& region = map_.regions[i];
      if (region.place != TissuePlace::label || region.transition_m != transition_m) continue;
      const Presence& label = found[static_cast<std::size_t>(slot_of_label[region.label])];
      presence[i] = {std::min(label.value / weightOfAll(), 1.0),
                     (1 / weightOfAll()) * model_.directionInWorld(label.gradient_per_m_in_world),
                     bendOf(transition_m)};
    }
  }

 private:
  static constexpr double kNearest_m = 0.05;
  static constexpr int kSamples = 89;
  static constexpr int kGenerator = 55;

  struct Offset {
    double x, y;  // -0.5..0.5
    constexpr double weight() const noexcept { return (1 - 4 * x * x) * (1 - 4 * y * y); }
  };
  static constexpr Offset offset(int k) noexcept {
    return {(k + 0.5) / kSamples - 0.5, (k * kGenerator % kSamples + 0.5) / kSamples - 0.5};
  }
  static constexpr double weightOfAll() noexcept {
    constexpr double kWeight = [] {
      double sum = 0;
      for (int k = 0; k < kSamples; ++k) sum += offset(k).weight();
      return sum;
    }();
    return kWeight;
  }

  std::uint8_t labelAt(int column, int row) const noexcept {
    const bool in_image =
        column >= 0 && column < map_.label_width_px && row >= 0 && row < map_.label_height_px;
    return in_image ? map_.labels[static_cast<std::size_t>(row * map_.label_width_px + column)]
                    : std::uint8_t{0};
  }

  /// Adds the labels at one place, interpolated between four pixels by smoothsteps.
  void addSample(int k, double transition_m, const std::array<std::int8_t, 256>& slot_of_label,
                 std::array<Presence, kMaxTissueRegions>& found) const noexcept {
    const Offset off = offset(k);
    const double scale = -1 / p_.z;
    const double x = (p_.x + transition_m * off.x) * scale;
    const double y = (p_.y + transition_m * off.y) * scale;
    const double u = camera_.cx_px + camera_.fx_px * x;
    const double v = camera_.cy_px - camera_.fy_px * y;
    if (!(u > -1 && u < map_.label_width_px && v > -1 && v < map_.label_height_px)) return;
    const int column = static_cast<int>(std::floor(u));
    const int row = static_cast<int>(std::floor(v));
    const double weight = off.weight();
    const std::uint8_t labels[4] = {labelAt(column, row), labelAt(column + 1, row), labelAt(column, row + 1),
                                    labelAt(column + 1, row + 1)};
    if (labels[0] == labels[1] && labels[0] == labels[2] && labels[0] == labels[3]) {
      const std::int8_t slot = slot_of_label[labels[0]];
      if (slot >= 0) found[static_cast<std::size_t>(slot)].value += weight;
      return;
    }
    const double s = u - column;
    const double t = v - row;
    const double right = s * s * (3 - 2 * s);
    const double below = t * t * (3 - 2 * t);
    const double slope_u = 6 * s * (1 - s);
    const double slope_v = 6 * t * (1 - t);
    const Vec3 of_u = camera_.fx_px * scale * Vec3{1, 0, x};
    const Vec3 of_v = -camera_.fy_px * scale * Vec3{0, 1, y};
    for (int corner = 0; corner < 4; ++corner) {
      const std::int8_t slot = slot_of_label[labels[corner]];
      if (slot < 0) continue;
      const bool is_right = corner % 2 != 0;
      const bool is_below = corner / 2 != 0;
      const double of_column = is_right ? right : 1 - right;
      const double of_row = is_below ? below : 1 - below;
      Presence& presence = found[static_cast<std::size_t>(slot)];
      presence.value += weight * of_column * of_row;
      presence.gradient_per_m_in_world += weight * ((is_right ? slope_u : -slope_u) * of_row * of_u +
                                                    (is_below ? slope_v : -slope_v) * of_column * of_v);
    }
  }

  const TissueMap& map_;
  const DepthModel& model_;
  const DepthModelParameters& camera_;
  const Vec3 p_;  // in the camera's frame
};

/// Looks up the presence of all label regions, one width of transition after the other.
void lookUpLabels(const TissueMap& map, const DepthModel& model, const Vec3& p_m_in_world,
                  std::array<Presence, kMaxTissueRegions>& presence) noexcept {
  LabelWindow window(map, model, p_m_in_world);
  for (std::size_t i = 0; i < map.count; ++i) {
    if (map.regions[i].place != TissuePlace::label) continue;
    bool done = false;
    for (std::size_t before = 0; before < i && !done; ++before) {
      done = map.regions[before].place == TissuePlace::label &&
             map.regions[before].transition_m == map.regions[i].transition_m;
    }
    if (!done) window.look(i, presence);
  }
}

}  // namespace

Presence presenceOf(const Shape& shape, double transition_m, const Vec3& p_m_in_world) HAPTICD_RT {
  if (shape.kind == ShapeKind::box) {
    return presenceOfBox(shape, transition_m, p_m_in_world - shape.position_m_in_world);
  }
  const double width_m = std::min(transition_m, 2 * shape.radius_m);
  const SignedDistance from = distanceFrom(shape, p_m_in_world);
  const Step step = stepAt(from.distance_m, width_m);
  return {step.value, step.slope_per_m * from.normal_in_world, bendOf(width_m)};
}

TissueShares sharesAt(const TissueMap& map, const DepthModel* model, const Vec3& p_m_in_world) HAPTICD_RT {
  std::array<Presence, kMaxTissueRegions> of_labels{};
  if (model != nullptr && map.hasLabelsFor(model->parameters()))
    lookUpLabels(map, *model, p_m_in_world, of_labels);
  TissueShares shares;
  TissueShares::Entry& rest = shares.rest;
  // Later regions cover earlier ones, so the last one takes its share first.
  for (std::size_t i = map.count; i-- > 0 && rest.share > 0;) {
    const TissueRegion& region = map.regions[i];
    const Presence here = region.place == TissuePlace::label
                              ? of_labels[i]
                              : presenceOf(region.shape, region.transition_m, p_m_in_world);
    if (!(here.value > 0)) continue;
    const double slope = norm(here.gradient_per_m_in_world);
    const double bend = here.value < 1 ? here.bend_per_m2 : 0;
    const double cross_bend = 2 * norm(rest.gradient_per_m_in_world) * slope;
    shares.entries[shares.count++] = {
        i, rest.share * here.value,
        here.value * rest.gradient_per_m_in_world + rest.share * here.gradient_per_m_in_world,
        here.value * rest.bend_per_m2 + cross_bend + rest.share * bend};
    rest.gradient_per_m_in_world =
        (1 - here.value) * rest.gradient_per_m_in_world - rest.share * here.gradient_per_m_in_world;
    rest.bend_per_m2 = (1 - here.value) * rest.bend_per_m2 + cross_bend + rest.share * bend;
    rest.share *= 1 - here.value;
  }
  return shares;
}

}  // namespace hapticd::rt

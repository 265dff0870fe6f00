// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <utility>

#include "rt/fixtures/distance_grid.h"
#include "rt/fixtures/grid_region.h"
#include "tools/hapticbench/engine/measures.h"
#include "tools/hapticbench/solids/exact_surface.h"
#include "tools/hapticbench/solids/solids.h"
#include "tools/lib/solids/field/mesh_field.h"
#include "tools/lib/solids/field/spline_field.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kReach_m = 0.005;

/// Random places of a mesh, equally dense everywhere, with the normal of their face.
class MeshPlaces {
 public:
  explicit MeshPlaces(const solids::TriangleMesh& mesh) : mesh_(mesh) {
    double sum = 0;
    for (const solids::Triangle& t : mesh.triangles) sum_m2_.push_back(sum += norm(areaNormalOf(t)));
  }
  struct Place {
    Vec3 place_m, normal;
  };
  Place next(std::mt19937_64& random) const {
    std::uniform_real_distribution<double> share(0, 1);
    const auto found = std::ranges::upper_bound(sum_m2_, share(random) * sum_m2_.back());
    const auto index = std::min(static_cast<std::size_t>(found - sum_m2_.begin()), sum_m2_.size() - 1);
    const solids::Triangle& t = mesh_.triangles[index];
    double u = share(random), v = share(random);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const Vec3& a = mesh_.points_m[t[0]];
    const Vec3 normal = areaNormalOf(t);
    return {a + u * (mesh_.points_m[t[1]] - a) + v * (mesh_.points_m[t[2]] - a), (1 / norm(normal)) * normal};
  }

 private:
  Vec3 areaNormalOf(const solids::Triangle& t) const {
    return cross(mesh_.points_m[t[1]] - mesh_.points_m[t[0]], mesh_.points_m[t[2]] - mesh_.points_m[t[0]]);
  }

  const solids::TriangleMesh& mesh_;
  std::vector<double> sum_m2_;
};

/// The median angle between faces that share an edge and do not meet at an edge of the body.
double medianFold_deg(const solids::TriangleMesh& mesh) {
  constexpr double kEdge_deg = 30;
  std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3> normals;
  std::vector<double> folds_deg;
  for (const solids::Triangle& t : mesh.triangles) {
    const Vec3 normal =
        cross(mesh.points_m[t[1]] - mesh.points_m[t[0]], mesh.points_m[t[2]] - mesh.points_m[t[0]]);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [other, is_new] = normals.try_emplace(std::minmax(t[i], t[(i + 1) % 3]), normal);
      if (is_new) continue;
      const double fold_deg = angleBetween_deg(other->second, normal);
      if (fold_deg < kEdge_deg) folds_deg.push_back(fold_deg);
    }
  }
  return quantile(std::move(folds_deg), 0.5);
}

constexpr double kTail = 0.99;

void measurePlaces(const rt::DistanceGrid& grid, const Body& truth, const ExactSurface& exact,
                   const SolidOptions& options, SolidRow& row) {
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> off(-kReach_m, kReach_m);
  const MeshPlaces places(truth.mesh);
  Spread error_m, at_surface_m;
  std::size_t within = 0;
  std::vector<double> gradients_deg;
  for (int i = 0; i < options.places; ++i) {
    const auto [on_m, normal] = places.next(random);
    const Vec3 place_m = on_m + off(random) * normal;
    const ExactPlace there = exact.at(place_m);
    const rt::GridDistance found = rt::distanceAt(grid, place_m);
    const double difference_m = std::abs(found.distance_m - there.distance_m);
    error_m.add(difference_m);
    if (std::abs(there.distance_m) <= grid.spacing_m) at_surface_m.add(difference_m);
    within += difference_m <= row.of.tolerance_m ? 1 : 0;
    const bool is_wrong = (found.distance_m < 0) != (there.distance_m < 0);
    row.wrong_signs += is_wrong && std::abs(there.distance_m) > row.of.tolerance_m ? 1U : 0U;
    if (there.gradient == Vec3{} || exact.isNearEdge(there.foot_m, grid.spacing_m) ||
        !exact.isAloneFor(there, 2 * grid.spacing_m))
      continue;
    gradients_deg.push_back(angleBetween_deg(found.gradient, there.gradient));
  }
  row.max_m = error_m.max();
  row.rms_m = error_m.rms();
  row.surface_max_m = at_surface_m.max();
  row.within_percent = percentOf(within, error_m.count());
  row.smooth_percent = percentOf(gradients_deg.size(), error_m.count());
  row.gradient_median_deg = quantile(gradients_deg, 0.5);
  row.gradient_p99_deg = quantile(gradients_deg, kTail);
}

/// A hand that goes straight to a place at 0.1 m/s, and stays there until the proxy rests.
rt::RegionPlace pushTo(const rt::DistanceGrid& grid, bool keeps_inside, const Vec3& from_m,
                       const Vec3& to_m) {
  constexpr double kStep_m = 1e-4, kAtRest_m = 1e-9;
  constexpr int kMaxTicks = 200;
  rt::Shape pose;
  rt::GridMemory memory{};
  rt::RegionPlace place{.proxy_m_in_world = from_m};
  const int steps = std::max(1, static_cast<int>(std::ceil(norm(to_m - from_m) / kStep_m)));
  for (int tick = 1; tick <= steps + kMaxTicks; ++tick) {
    const Vec3 hip_m = from_m + std::min(1.0, static_cast<double>(tick) / steps) * (to_m - from_m);
    const Vec3 before_m = place.proxy_m_in_world;
    place = rt::followSolid(pose, grid, keeps_inside, 0, hip_m, before_m, memory);
    if (tick > steps && norm(place.proxy_m_in_world - before_m) < kAtRest_m) break;
  }
  return place;
}

class PushFigures {
 public:
  void add(double percent, double degrees) {
    percent_.push_back(percent);
    degrees_.push_back(degrees);
  }
  PushErrors errors() const {
    return {percent_.size(), quantile(percent_, kTail), quantile(percent_, 1), quantile(degrees_, kTail),
            quantile(degrees_, 1)};
  }

 private:
  std::vector<double> percent_, degrees_;
};

/// Thin bodies: the faces that look up, or down.
Body sheetOf(const Body& body, double side) {
  Body sheet = body;
  std::erase_if(sheet.mesh.triangles, [&](const solids::Triangle& t) {
    const auto& p = body.mesh.points_m;
    const Vec3 normal = cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]);
    return side * normal.z < 0.9 * norm(normal);
  });
  return sheet;
}

void measurePushes(const rt::DistanceGrid& grid, const Body& truth, const ExactSurface& exact,
                   const SolidOptions& options, SolidRow& row) {
  constexpr double kLeast_m = 0.001, kMost_m = 0.003;
  constexpr double kSamePart = 0.98, kFar = 3;
  const double start_m = truth.is_thin ? 0.0003 : 0.001;
  std::mt19937_64 random(options.seed + 1);
  std::uniform_real_distribution<double> depth(kLeast_m, kMost_m);
  const MeshPlaces places(truth.mesh);
  std::optional<ExactSurface> upper, lower;
  if (truth.is_thin) {
    upper.emplace(sheetOf(truth, 1));
    lower.emplace(sheetOf(truth, -1));
  }
  std::array<PushFigures, 2> smooth;
  PushFigures rest, far;
  for (int i = 0; i < options.pushes; ++i) {
    auto entry = places.next(random);
    while (truth.is_thin && std::abs(entry.normal.z) < 0.99) entry = places.next(random);
    const bool keeps_inside = i % 2 != 0;
    const Vec3 inward = keeps_inside ? entry.normal : -entry.normal;  // out of the region's free side
    const double depth_m = depth(random);
    const Vec3 hip_m = entry.place_m + depth_m * inward;
    const ExactSurface& nearest = !truth.is_thin ? exact : entry.normal.z > 0 ? *upper : *lower;
    const ExactPlace there = nearest.at(hip_m, !keeps_inside);
    const rt::RegionPlace found = pushTo(grid, keeps_inside, entry.place_m - start_m * inward, hip_m);
    const double true_m = std::abs(there.distance_m);
    const double percent = 100 * std::abs(found.depth_m / true_m - 1);
    const double degrees =
        found.depth_m > 0 ? angleBetween_deg(found.normal_in_world, there.foot_m - hip_m) : 180;
    const bool is_smooth = !nearest.isNearEdge(there.foot_m, grid.spacing_m) &&
                           true_m > kSamePart * depth_m &&
                           (truth.is_thin || nearest.isAloneFor(there, 2 * grid.spacing_m));
    (is_smooth ? smooth[keeps_inside ? 1 : 0] : rest).add(percent, degrees);
    if (is_smooth && !nearest.isNearEdge(there.foot_m, kFar * grid.spacing_m)) far.add(percent, degrees);
  }
  row.out = smooth[0].errors();
  row.in = smooth[1].errors();
  row.far = far.errors();
  row.rest = rest.errors();
}

}  // namespace

SolidRow measureSolid(const SolidCase& one, const SolidOptions& options) {
  SolidRow row{.of = one, .refusal = {}, .out = {}, .in = {}, .far = {}, .rest = {}};
  const Body body = makeBody(one.body, options.divisions);
  const DamagedBody mesh = damaged(body, one.damage, options.seed);
  row.faces = mesh.mesh.triangles.size();
  row.fold_deg = medianFold_deg(body.mesh);
  solids::FieldOptions field_options;
  field_options.tolerance_m = one.tolerance_m;
  field_options.reader = solids::splineReader;
  const auto begin = std::chrono::steady_clock::now();
  const auto field = solids::fieldOfMesh(mesh.mesh, std::string(nameOf(one.body)), field_options);
  if (!field) {
    row.refusal = field.error().what;
    return row;
  }
  const auto solid =
      solids::splineOf(field->field, {.source = "study", .error_m = field->report.surface.max_m});
  row.make_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  row.spacing_m = solid->grid().spacing_m;
  row.bytes = solid->bytes();
  const ExactSurface exact(mesh.truth);
  measurePlaces(solid->grid(), mesh.truth, exact, options, row);
  measurePushes(solid->grid(), mesh.truth, exact, options, row);
  return row;
}

SpacingError sphereError(double spacing_m, int places, double radius_m) {
  constexpr double kFromEnds = 6;  // spacings, where the ends of the rows no longer change the spline
  const double half_m = radius_m + kReach_m + kFromEnds * spacing_m;
  const int samples = 2 * static_cast<int>(std::ceil(half_m / spacing_m)) + 1;
  solids::SampledField field{{samples, samples, samples}, spacing_m, {}, {}};
  // not centred on a sample, which would be a special case
  const double first_m = -spacing_m * (0.5 * (samples - 1) + 0.137);
  field.origin_m = {first_m, first_m, first_m};
  field.distance_m.resize(field.count());
  for (int z = 0; z < samples; ++z)
    for (int y = 0; y < samples; ++y)
      for (int x = 0; x < samples; ++x)
        field.distance_m[field.indexOf(x, y, z)] =
            static_cast<float>(norm(field.placeOf(x, y, z)) - radius_m);
  const auto value = solids::splineReader(field);
  std::mt19937_64 random(1);
  std::normal_distribution<double> component;
  std::uniform_real_distribution<double> off(-kReach_m, kReach_m);
  Spread error_m;
  for (int i = 0; i < places; ++i) {
    const Vec3 d{component(random), component(random), component(random)};
    const double off_m = off(random);
    error_m.add(std::abs(value(((radius_m + off_m) / norm(d)) * d) - off_m));
  }
  return {spacing_m, error_m.max(), error_m.rms()};
}

}  // namespace hapticd::tools

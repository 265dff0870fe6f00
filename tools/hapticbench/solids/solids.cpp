// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <utility>

#include "rt/fixtures/distance_grid.h"
#include "rt/fixtures/grid_region.h"
#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/solids/solids.h"
#include "tools/lib/solids/field/mesh_field.h"
#include "tools/lib/solids/field/sampled_field.h"

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

namespace {

constexpr const char* kSolidsExplanation =
    "Signed distance of a mesh on a grid, as the force loop reads it, compared with the mesh itself: "
    "nearest\n"
    "triangle, sign by the winding number. max, rms, within: of the distance at places up to 5 mm from the\n"
    "surface; surface: at those within one spacing of it; wrong signs: farther from it than the tolerance.\n"
    "smooth: places at least one spacing from an edge and two from a medial surface; gradient errors are of\n"
    "these. fold: median angle between neighbouring faces, by half of which any smooth surface is off.\n\n";

constexpr const char* kPushExplanation =
    "\nForces of hands pushed 1 to 3 mm through the surface, out of the body and into it, compared with the\n"
    "nearest point of the mesh, on smooth parts. far: those three spacings from an edge. rest: next to "
    "edges, or nearer to another part of the surface, which a "
    "proxy\n"
    "must not jump to.\n";

std::string describe(const SolidRow& row) {
  return fmt::format("{}, {}, {:g} mm", nameOf(row.of.body), nameOf(row.of.damage), 1e3 * row.of.tolerance_m);
}

bool isMade(const SolidRow& row) {
  return row.refusal.empty();
}

Row caseCells(const SolidRow& r) {
  return {{"/body", "body", 0, nameOf(r.of.body)},
          {"/mesh", "mesh", 0, nameOf(r.of.damage)},
          {"/tolerance_m", "tolerance mm", 1, r.of.tolerance_m, 1e3}};
}

Row fieldCells(const SolidRow& r) {
  const auto ofMade = [&r](Figure figure) { return Figure::where(isMade(r), std::move(figure)); };
  return joined(caseCells(r), {{"/refusal", "", 0, Figure::where(!isMade(r), r.refusal)},
                               {"/faces", "faces", 0, r.faces},
                               {"/fold_deg", "fold deg", 2, r.fold_deg},
                               {"/spacing_m", "spacing mm", 2, ofMade(r.spacing_m), 1e3},
                               {"/bytes", "MB", 2, ofMade(static_cast<double>(r.bytes)), 1e-6},
                               {"/make_s", "made in s", 1, ofMade(r.make_s)},
                               {"/max_m", "max mm", 3, ofMade(r.max_m), 1e3},
                               {"/rms_m", "rms mm", 4, ofMade(r.rms_m), 1e3},
                               {"/surface_max_m", "surface mm", 3, ofMade(r.surface_max_m), 1e3},
                               {"/within_percent", "within %", 2, ofMade(r.within_percent)},
                               {"/wrong_signs", "wrong signs", 0, ofMade(r.wrong_signs)},
                               {"/smooth_percent", "smooth %", 0, ofMade(r.smooth_percent)},
                               {"/gradient/median_deg", "gradient median", 2, ofMade(r.gradient_median_deg)},
                               {"/gradient/p99_deg", "p99 deg", 2, ofMade(r.gradient_p99_deg)}});
}

Row pushCells(const SolidRow& r) {
  Row row = caseCells(r);
  const auto add = [&](const std::string& name, const PushErrors& errors) {
    const auto cell = [&](const char* key, const char* heading, int decimals, Figure figure) {
      row.push_back(
          {"/" + name + key, name + heading, decimals, Figure::where(isMade(r), std::move(figure))});
    };
    cell("/pushes", "", 0, errors.pushes);
    cell("/p99_percent", " p99 %", 3, errors.p99_percent);
    cell("/max_percent", " max %", 2, errors.max_percent);
    cell("/p99_deg", " p99 deg", 2, errors.p99_deg);
    cell("/max_deg", " max deg", 2, errors.max_deg);
  };
  add("out", r.out);
  add("in", r.in);
  add("far", r.far);
  add("rest", r.rest);
  return row;
}

std::vector<Limit> solidLimits(const SolidRow& r) {
  constexpr double kMaxForce_percent = 0.1;
  constexpr double kMaxForce_deg = 0.5;
  const bool has_pushes = isMade(r) && r.out.pushes + r.in.pushes > 0;
  return {{"meshes refused", true, isMade(r) ? 0.0 : 1.0, 0},
          {"distance at places within one spacing of the surface by the tolerance", isMade(r),
           r.surface_max_m / r.of.tolerance_m, 1},
          {"distance at places within 5 mm by the tolerance", isMade(r), r.max_m / r.of.tolerance_m, 1},
          {"wrong signs beyond the tolerance", isMade(r), static_cast<double>(r.wrong_signs), 0},
          {"force on smooth parts, 99th percentile, %", has_pushes,
           std::max(r.out.p99_percent, r.in.p99_percent), kMaxForce_percent},
          {"its direction, 99th percentile, degrees", has_pushes, std::max(r.out.p99_deg, r.in.p99_deg),
           kMaxForce_deg}};
}

Row spacingCells(const SpacingError& of) {
  return {{"/spacing_m", "spacing mm", 3, of.spacing_m, 1e3},
          {"/max_m", "max um", 2, of.max_m, 1e6},
          {"/rms_m", "rms um", 3, of.rms_m, 1e6}};
}

Row costCells(const QueryCost& of) {
  return {{"/query", "one value and gradient", 0, of.query},
          {"/spline_ns", "spline ns", 1, of.spline_ns},
          {"/trilinear_ns", "trilinear ns", 1, of.trilinear_ns},
          {"/ratio", "ratio", 2, of.ratio()}};
}

struct SolidsOptions {
  SolidOptions options;
  std::vector<BodyKind> bodies = everyOne<BodyKind>();
  std::vector<Damage> meshes = everyOne<Damage>();
  std::vector<double> tolerances_mm{0.5, 0.2};
  int rounds = 300;
};

Report reportOf(const SolidsOptions& chosen, const std::vector<SolidRow>& rows) {
  Report report;
  report.table("rows", kSolidsExplanation, rowsOf(rows, fieldCells));
  report.table("pushes", kPushExplanation, rowsOf(rows, pushCells));
  for (const SolidRow& row : rows)
    if (!isMade(row)) report.say(fmt::format("\n{} is refused: {}\n", describe(row), row.refusal));
  std::vector<SpacingError> spacings;
  for (const double spacing_mm : {4.0, 2.0, 1.0, 0.5})
    spacings.push_back(sphereError(1e-3 * spacing_mm, chosen.options.places));
  report.table("spacings", "\nthe spline of a sphere of radius 15 mm, sampled exactly; counts of 16 bits\n",
               rowsOf(spacings, spacingCells));
  showProgress("cost");
  const SolidCost cost = measureSolidCost(chosen.rounds);
  report.table("cost", "\ncost with 128 samples along each axis, 4.2 MB\n", rowsOf(cost.queries, costCells));
  report.say(fmt::format("\neight ticks of one region in contact: {:.0f} ns\n", cost.eight_ticks_ns));
  report.note("/eight_ticks_ns", cost.eight_ticks_ns);
  report.requirements(checked(
      {"clean meshes", "damaged meshes"}, rows,
      [](const SolidRow& r, const std::string& meshes) {
        return (r.of.damage == Damage::none) == (meshes == "clean meshes");
      },
      solidLimits, describe));
  return report;
}

}  // namespace

StudyCommand solidsCommand(CLI::App& app) {
  const auto chosen = std::make_shared<SolidsOptions>();
  StudyCommand command(app, "solids",
                       "how exactly fixtures of any shape follow meshes, and what a query costs");
  command.quick("a box and a sphere, small, clean and with missing faces", [chosen] {
    chosen->options = {.divisions = 24, .places = 2000, .pushes = 200};
    chosen->bodies = {BodyKind::box, BodyKind::sphere};
    chosen->meshes = {Damage::none, Damage::missing};
    chosen->tolerances_mm = {0.5};
    chosen->rounds = 10;
  });
  command.choices("--bodies", chosen->bodies, kAllOf<BodyKind>, "all");
  command.choices("--meshes", chosen->meshes, kAllOf<Damage>, "all");
  command.numbers("--tolerances", chosen->tolerances_mm, 0.05, 5.0, "of the distance, mm (0.5,0.2)");
  command.number("--divisions", chosen->options.divisions, 8, 512, "of the meshes along an edge (96)");
  command.seed(chosen->options.seed, "of the places, the pushes and the damage (1)");
  command.onReport([chosen] {
    std::vector<double> tolerances_m;
    for (const double tolerance_mm : chosen->tolerances_mm) tolerances_m.push_back(1e-3 * tolerance_mm);
    std::vector<SolidCase> cases = varied(std::vector<SolidCase>(1), &SolidCase::body, chosen->bodies);
    cases = varied(cases, &SolidCase::damage, chosen->meshes);
    cases = varied(cases, &SolidCase::tolerance_m, tolerances_m);
    std::vector<SolidRow> rows;
    for (const SolidCase& one : cases) {
      showProgress(
          fmt::format("{}, {}, {:g} mm", nameOf(one.body), nameOf(one.damage), 1e3 * one.tolerance_m));
      rows.push_back(measureSolid(one, chosen->options));
    }
    return reportOf(*chosen, rows);
  });
  return command;
}

}  // namespace hapticd::tools

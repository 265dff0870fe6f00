// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/solids/solids.h"

namespace hapticd::tools {
namespace {

constexpr double kMaxForce_percent = 0.1;
constexpr double kMaxForce_deg = 0.5;

constexpr const char* kExplanation =
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

using Row = SolidRow;

std::string describe(const Row& row) {
  return fmt::format("{}, {}, {:g} mm", nameOf(row.of.body), nameOf(row.of.damage), 1e3 * row.of.tolerance_m);
}

Columns<Row> caseColumns() {
  return {{"/body", "body", 0, [](const Row& r) { return std::string(nameOf(r.of.body)); }},
          {"/mesh", "mesh", 0, [](const Row& r) { return std::string(nameOf(r.of.damage)); }},
          {"/tolerance_m", "tolerance mm", 1, [](const Row& r) { return r.of.tolerance_m; }, 1e3}};
}

bool isMade(const Row& row) {
  return row.refusal.empty();
}

/// A figure of rows whose mesh is not refused.
template <typename Figure>
auto ofMade(Figure figure) {
  return [figure](const Row& r) { return figureWhere(isMade(r), Json(std::invoke(figure, r))); };
}

Columns<Row> fieldColumns() {
  return joined<Row>(
      caseColumns(),
      {{"/refusal", "", 0, [](const Row& r) { return figureWhere(!isMade(r), Json(r.refusal)); }},
       {"/faces", "faces", 0, &Row::faces},
       {"/fold_deg", "fold deg", 2, &Row::fold_deg},
       {"/spacing_m", "spacing mm", 2, ofMade(&Row::spacing_m), 1e3},
       {"/bytes", "MB", 2, ofMade([](const Row& r) { return static_cast<double>(r.bytes); }), 1e-6},
       {"/make_s", "made in s", 1, ofMade(&Row::make_s)},
       {"/max_m", "max mm", 3, ofMade(&Row::max_m), 1e3},
       {"/rms_m", "rms mm", 4, ofMade(&Row::rms_m), 1e3},
       {"/surface_max_m", "surface mm", 3, ofMade(&Row::surface_max_m), 1e3},
       {"/within_percent", "within %", 2, ofMade(&Row::within_percent)},
       {"/wrong_signs", "wrong signs", 0, ofMade(&Row::wrong_signs)},
       {"/smooth_percent", "smooth %", 0, ofMade(&Row::smooth_percent)},
       {"/gradient/median_deg", "gradient median", 2, ofMade(&Row::gradient_median_deg)},
       {"/gradient/p99_deg", "p99 deg", 2, ofMade(&Row::gradient_p99_deg)}});
}

void addPushes(Columns<Row>& columns, const std::string& key, const std::string& heading,
               PushErrors Row::*pushes) {
  const auto add = [&](const std::string& name, const std::string& text, int decimals,
                       double PushErrors::*figure) {
    columns.push_back({"/" + key + name, heading + text, decimals,
                       ofMade([pushes, figure](const Row& r) { return r.*pushes.*figure; })});
  };
  columns.push_back(
      {"/" + key + "/pushes", heading, 0, ofMade([pushes](const Row& r) { return (r.*pushes).pushes; })});
  add("/p99_percent", " p99 %", 3, &PushErrors::p99_percent);
  add("/max_percent", " max %", 2, &PushErrors::max_percent);
  add("/p99_deg", " p99 deg", 2, &PushErrors::p99_deg);
  add("/max_deg", " max deg", 2, &PushErrors::max_deg);
}

Columns<Row> pushColumns() {
  Columns<Row> columns = caseColumns();
  addPushes(columns, "out", "out", &Row::out);
  addPushes(columns, "in", "in", &Row::in);
  addPushes(columns, "far", "far", &Row::far);
  addPushes(columns, "rest", "rest", &Row::rest);
  return columns;
}

std::vector<Requirement> requirementsOf(const std::vector<Row>& rows) {
  const auto hasPushes = [](const Row& r) { return isMade(r) && r.out.pushes + r.in.pushes > 0; };
  const std::array<RowRequirement<Row>, 6> all{
      {{"meshes refused", [](const Row& r) { return figureIf(true, isMade(r) ? 0 : 1, 0); }},
       {"distance at places within one spacing of the surface by the tolerance",
        [](const Row& r) { return figureIf(isMade(r), r.surface_max_m / r.of.tolerance_m, 1); }},
       {"distance at places within 5 mm by the tolerance",
        [](const Row& r) { return figureIf(isMade(r), r.max_m / r.of.tolerance_m, 1); }},
       {"wrong signs beyond the tolerance",
        [](const Row& r) { return figureIf(isMade(r), static_cast<double>(r.wrong_signs), 0); }},
       {"force on smooth parts, 99th percentile, %",
        [=](const Row& r) {
          return figureIf(hasPushes(r), std::max(r.out.p99_percent, r.in.p99_percent), kMaxForce_percent);
        }},
       {"its direction, 99th percentile, degrees", [=](const Row& r) {
          return figureIf(hasPushes(r), std::max(r.out.p99_deg, r.in.p99_deg), kMaxForce_deg);
        }}}};
  std::vector<Requirement> requirements;
  for (const bool is_clean : {true, false})
    for (const RowRequirement<Row>& requirement : all)
      requirements.push_back(checked(
          is_clean ? "clean meshes" : "damaged meshes", requirement, rows,
          [&](const Row& r) { return (r.of.damage == Damage::none) == is_clean; }, describe));
  return requirements;
}

Columns<SpacingError> spacingColumns() {
  using Of = SpacingError;
  return {{"/spacing_m", "spacing mm", 3, &Of::spacing_m, 1e3},
          {"/max_m", "max um", 2, &Of::max_m, 1e6},
          {"/rms_m", "rms um", 3, &Of::rms_m, 1e6}};
}

Columns<QueryCost> costColumns() {
  using Of = QueryCost;
  return {{"/query", "one value and gradient", 0, &Of::query},
          {"/spline_ns", "spline ns", 1, &Of::spline_ns},
          {"/trilinear_ns", "trilinear ns", 1, &Of::trilinear_ns},
          {"/ratio", "ratio", 2, &Of::ratio}};
}

struct Chosen {
  SolidOptions options;
  std::vector<BodyKind> bodies{kAllBodies.begin(), kAllBodies.end()};
  std::vector<Damage> meshes{kAllDamages.begin(), kAllDamages.end()};
  std::vector<double> tolerances_mm{0.5, 0.2};
  int rounds = 300;
};

Report reportOf(const Chosen& chosen, const std::vector<Row>& rows) {
  Report report;
  report.table("rows", kExplanation, fieldColumns(), rows);
  report.show("pushes", kPushExplanation, pushColumns(), rows);
  report.note("pushes", tableJson(pushColumns(), rows));
  for (const Row& row : rows)
    if (!isMade(row)) report.say(fmt::format("\n{} is refused: {}\n", describe(row), row.refusal));
  std::vector<SpacingError> spacings;
  for (const double spacing_mm : {4.0, 2.0, 1.0, 0.5})
    spacings.push_back(sphereError(1e-3 * spacing_mm, chosen.options.places));
  report.table("spacings", "\nthe spline of a sphere of radius 15 mm, sampled exactly; counts of 16 bits\n",
               spacingColumns(), spacings);
  showProgress("cost");
  const SolidCost cost = measureSolidCost(chosen.rounds);
  report.table("cost", "\ncost with 128 samples along each axis, 4.2 MB\n", costColumns(), cost.queries);
  report.say(fmt::format("\neight ticks of one region in contact: {:.0f} ns\n", cost.eight_ticks_ns));
  report.note("eight_ticks_ns", cost.eight_ticks_ns);
  report.requirements(requirementsOf(rows));
  return report;
}

}  // namespace

StudyCommand solidsCommand(CLI::App& app) {
  const auto chosen = std::make_shared<Chosen>();
  StudyCommand command(app, "solids",
                       "how exactly fixtures of any shape follow meshes, and what a query costs");
  command.quick("a box and a sphere, small, clean and with missing faces", [chosen] {
    chosen->options = {.divisions = 24, .places = 2000, .pushes = 200};
    chosen->bodies = {BodyKind::box, BodyKind::sphere};
    chosen->meshes = {Damage::none, Damage::missing};
    chosen->tolerances_mm = {0.5};
    chosen->rounds = 10;
  });
  command.choices("--bodies", chosen->bodies, kAllBodies, "all");
  command.choices("--meshes", chosen->meshes, kAllDamages, "all");
  command.numbers("--tolerances", chosen->tolerances_mm, 0.05, 5.0, "of the distance, mm (0.5,0.2)");
  command->add_option("--divisions", chosen->options.divisions, "of the meshes along an edge (96)")
      ->check(within(8, 512));
  command.seed(chosen->options.seed, "of the places, the pushes and the damage (1)");
  command.onRun([chosen](const StudyCommand& self) {
    std::vector<Row> rows;
    for (const BodyKind body : chosen->bodies)
      for (const Damage damage : chosen->meshes)
        for (const double tolerance_mm : chosen->tolerances_mm) {
          const SolidCase one{body, damage, 1e-3 * tolerance_mm};
          showProgress(fmt::format("{}, {}, {:g} mm", nameOf(body), nameOf(damage), tolerance_mm));
          rows.push_back(measureSolid(one, chosen->options));
        }
    return self.report(reportOf(*chosen, rows));
  });
  return command;
}

}  // namespace hapticd::tools

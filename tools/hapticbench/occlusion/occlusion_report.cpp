// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/occlusion/occlusion_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "tools/hapticbench/requirement.h"

namespace hapticd::tools {
namespace {

constexpr const char* kExplanation =
    "passages: a body of that thickness and 80 mm width passes at 0.3 m/s, at that gap in front of the\n"
    "  line of sight to the HIP. free: 30 mm in front of the wall; pressing: 6 mm deep; stroking: 8 mm\n"
    "  deep, 0.1 m/s; entering, leaving: while it is hidden. ghost: force on a HIP in front of the wall;\n"
    "  error: against the true force; change: against the force before the body set out; ms: the longest\n"
    "  time above the limit.\n"
    "entries: shares of the ticks with the HIP in the solid. body: force of the body that was entered; no\n"
    "  force, reported: the contact state is `behind`; silent: it does not; wrong: another force.\n"
    "  ghost: force outside; sideways: force along the motion where there is no side to come through.\n"
    "near: a surface approaches a still HIP nearer than near_m, waits two seconds and recedes.\n"
    "pushes: 45 mm deep beside silhouettes and the image border; popped: gave way for good below 20 N.\n";

const std::vector<Column<PassageRow>>& passageColumns() {
  using Row = PassageRow;
  static const std::vector<Column<Row>> all{
      {"/law", "law", 0, &Row::law},
      {"/wall_m", "wall m", 2, &Row::wall_m},
      {"/noise", "noise", 0, [](const Row& r) { return nameOf(r.noise); }},
      {"/hand", "hand", 0, [](const Row& r) { return nameOf(r.hand); }},
      {"/thickness_m", "thick mm", 0, &Row::thickness_m, 1000},
      {"/gap_m", "gap mm", 0, &Row::gap_m, 1000},
      {"/passages", "", 0, &Row::passages},
      {"/ghost_largest_n", "ghost N", 3, [](const Row& r) { return r.result.ghost.largest; }},
      {"/ghost_percent", "% >0.1", 2, [](const Row& r) { return r.result.ghost.percent(); }},
      {"/ghost_longest_ms", "ms", 0, [](const Row& r) { return r.result.ghost.longest; }},
      {"/error_largest_n", "error N", 3, [](const Row& r) { return r.result.error.largest; }},
      {"/error_longest_ms", "ms >0.5", 0, [](const Row& r) { return r.result.error.longest; }},
      {"/change_largest_n", "change N", 3, [](const Row& r) { return r.result.change.largest; }},
      {"/change_longest_ms", "ms >0.5", 0, [](const Row& r) { return r.result.change.longest; }},
      {"/lost_percent", "lost %", 2,
       [](const Row& r) { return percentOf(r.result.lost, r.result.pressed); }}};
  return all;
}

const std::vector<Column<EntryRow>>& entryColumns() {
  using Row = EntryRow;
  const auto share = [](std::size_t EntryResult::*ticks) {
    return [ticks](const Row& r) { return percentOf(r.result.*ticks, r.result.inside); };
  };
  static const std::vector<Column<Row>> all{
      {"/law", "law", 0, &Row::law},
      {"/wall_m", "wall m", 2, &Row::wall_m},
      {"/noise", "noise", 0, [](const Row& r) { return nameOf(r.noise); }},
      {"/entry", "entry", 0, [](const Row& r) { return nameOf(r.kind); }},
      {"/below_m", "below mm", 0, &Row::below_m, 1000},
      {"/ticks_inside", "", 0, [](const Row& r) { return r.result.inside; }},
      {"/of_body", "", 0, [](const Row& r) { return r.result.of_body; }},
      {"/none_reported", "", 0, [](const Row& r) { return r.result.none_reported; }},
      {"/none_silent", "", 0, [](const Row& r) { return r.result.none_silent; }},
      {"/wrong", "", 0, [](const Row& r) { return r.result.wrong; }},
      {"", "body %", 1, share(&EntryResult::of_body)},
      {"", "none, reported %", 1, share(&EntryResult::none_reported)},
      {"", "none, silent %", 1, share(&EntryResult::none_silent)},
      {"", "wrong %", 1, share(&EntryResult::wrong)},
      {"/ghost_n", "ghost N", 3, [](const Row& r) { return r.result.ghost_n; }},
      {"/sideways_n", "sideways N", 3, [](const Row& r) { return r.result.sideways_n; }}};
  return all;
}

const std::vector<Column<NearRow>>& nearColumns() {
  using Row = NearRow;
  static const std::vector<Column<Row>> all{
      {"/law", "law", 0, &Row::law},
      {"/speed_m_per_s", "m/s", 2, &Row::speed_m_per_s},
      {"/force_n", "force N", 3, [](const Row& r) { return r.result.force_n; }},
      {"/held_ms", "held ms", 0, [](const Row& r) { return r.result.held_ms; }},
      {"/least_held_n", "least N", 3, [](const Row& r) { return r.result.least_held_n; }},
      {"/released_ms", "released ms", 0, [](const Row& r) { return r.result.released_ms; }},
      {"/largest_step_n", "step N", 3, [](const Row& r) { return r.result.largest_step_n; }},
      {"/cause_named", "cause named", 0, [](const Row& r) { return r.result.cause_named; }},
      {"/came_back", "came back", 0, [](const Row& r) { return r.result.came_back; }}};
  return all;
}

const std::vector<Column<PushRow>>& pushColumns() {
  using Row = PushRow;
  static const std::vector<Column<Row>> all{
      {"/law", "law", 0, &Row::law},
      {"/wall_m", "wall m", 2, &Row::wall_m},
      {"/noise", "noise", 0, [](const Row& r) { return nameOf(r.noise); }},
      {"/border", "border", 0, [](const Row& r) { return nameOf(r.kind); }},
      {"/surface_moves", "surface moves", 0, &Row::surface_moves},
      {"/pushes", "pushes", 0, [](const Row& r) { return r.result.pushes; }},
      {"/popped", "popped", 0, [](const Row& r) { return r.result.popped; }},
      {"/least_n", "least N", 2, [](const Row& r) { return r.result.least_n; }}};
  return all;
}

/// Returns the sum of the results of the rows for which `belongs` is true.
template <typename Rows, typename Belongs>
auto together(const Rows& rows, const Belongs& belongs) {
  decltype(rows.front().result) sum{};
  for (const auto& row : rows) {
    if (belongs(row)) sum.add(row.result);
  }
  return sum;
}

/// Beyond that gap nothing depends on the thickness of the body, which nobody can know: the solid behind a
/// visible surface is taken to be 35 mm thick, and 60 mm is the least that must be free.
bool isClear(const PassageRow& row) {
  return row.gap_m >= 0.0599 && row.thickness_m <= 0.08;
}

void addPassages(const OcclusionResult& result, const std::string& law, SceneNoise noise,
                 std::vector<Requirement>& list) {
  const auto of = [&](HandDuringPassage hand, bool clear) {
    return together(result.passages, [&](const PassageRow& row) {
      return row.law == law && row.noise == noise && row.hand == hand && isClear(row) == clear;
    });
  };
  const auto add = [&](bool measured, const char* text, double limit, double figure, const char* unit) {
    if (!measured) return;
    list.push_back(
        Requirement::atMost(law, fmt::format("{}, noise {}, {}", text, nameOf(noise), unit), limit, figure));
  };
  const PassageResult clear = of(HandDuringPassage::free, true);
  const PassageResult close = of(HandDuringPassage::free, false);
  const PassageResult pressing = of(HandDuringPassage::pressing, true);
  const PassageResult stroking = of(HandDuringPassage::stroking, true);
  add(clear.ghost.ticks > 0, "force on a free HIP, a body 60 to 300 mm in front", 0.1, clear.ghost.largest,
      "N");
  add(clear.ghost.ticks > 0, "the same, ticks above 0.1 N", 0, clear.ghost.percent(), "%");
  add(close.ghost.ticks > 0, "force on a free HIP, a body 20 to 60 mm in front", 1, close.ghost.largest, "N");
  // With noise the error includes the sensor's own; the passage adds the change.
  const Exceedance& judged = noise == SceneNoise::none ? pressing.error : pressing.change;
  add(pressing.pressed > 0, "error of a pressing HIP above 0.5 N while a body passes", 100,
      static_cast<double>(judged.longest), "ms");
  add(stroking.pressed > 0, "contact lost in strokes while a body passes", 0,
      percentOf(stroking.lost, stroking.pressed), "%");
}

void addEntries(const OcclusionResult& result, const std::string& law, std::vector<Requirement>& list) {
  const auto of_law = [&law](const EntryRow& row) { return row.law == law && row.noise == SceneNoise::none; };
  const EntryResult all = together(result.entries, of_law);
  const EntryResult at_border = together(result.entries, [&of_law](const EntryRow& row) {
    return of_law(row) && (row.kind == EntryKind::into_image || row.kind == EntryKind::out_of_image);
  });
  if (all.inside == 0) return;
  const auto add = [&](const char* text, double limit, double figure) {
    list.push_back(Requirement::atMost(law, text, limit, figure));
  };
  add("entries from the side: another force than the body's, %", 0, percentOf(all.wrong, all.inside));
  add("entries from the side: no force and no report of it, %", 0, percentOf(all.none_silent, all.inside));
  add("entries from the side: force outside the body, N", 0.1, all.ghost_n);
  add("force sideways at the image border, N", 0.2, at_border.sideways_n);
}

void addNear(const OcclusionResult& result, const std::string& law, std::vector<Requirement>& list) {
  // safety.depth_timeout_s; and that with safety.depth_ramp_s, after ten frames in which what is missing may
  // only flicker, and a tenth more.
  constexpr double kLeastHeld_ms = 500;
  constexpr double kLatestRelease_ms = 1130;
  double least_held_ms = std::numeric_limits<double>::infinity();
  double latest_ms = 0;
  int unnamed = 0;
  for (const NearRow& row : result.near) {
    if (row.law != law) continue;
    const NearLimitResult& r = row.result;
    least_held_ms = std::min(least_held_ms, r.held_ms);
    latest_ms = r.released_ms < 0 ? std::numeric_limits<double>::max() : std::max(latest_ms, r.released_ms);
    unnamed += r.cause_named ? 0 : 1;
  }
  if (result.near.empty()) return;
  list.push_back(Requirement::atLeast(law, "a surface nearer than near_m: the force is held for, ms",
                                      kLeastHeld_ms, least_held_ms));
  list.push_back(
      Requirement::atMost(law, "the same: the force is released after, ms", kLatestRelease_ms, latest_ms));
  list.push_back(Requirement::atMost(law, "the same: runs that do not name the cause", 0, unnamed));
}

void addPushes(const OcclusionResult& result, const std::string& law, std::vector<Requirement>& list) {
  const auto all = together(result.pushes, [&law](const PushRow& row) { return row.law == law; });
  if (all.pushes == 0) return;
  list.push_back(Requirement::atMost(
      law, fmt::format("pop-through below 20 N beside borders, of {} pushes", all.pushes), 0, all.popped));
}

std::vector<Requirement> requirementsOf(const OcclusionResult& result) {
  std::vector<Requirement> list;
  for (const std::string& law : result.options.laws) {
    for (const SceneNoise noise : result.options.noises) addPassages(result, law, noise, list);
    addEntries(result, law, list);
    addNear(result, law, list);
    addPushes(result, law, list);
  }
  return list;
}

}  // namespace

std::string occlusionText(const OcclusionResult& result) {
  std::string text = kExplanation;
  for (const std::string& table :
       {tableText(passageColumns(), result.passages), tableText(entryColumns(), result.entries),
        tableText(nearColumns(), result.near), tableText(pushColumns(), result.pushes)}) {
    if (!table.empty()) text += "\n" + table;
  }
  return text + requirementsText(requirementsOf(result));
}

std::string occlusionJson(const OcclusionResult& result) {
  const Json document{{"passages", tableJson(passageColumns(), result.passages)},
                      {"entries", tableJson(entryColumns(), result.entries)},
                      {"near", tableJson(nearColumns(), result.near)},
                      {"pushes", tableJson(pushColumns(), result.pushes)},
                      {"requirements", requirementsJson(requirementsOf(result))}};
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "rt/base/parameters.h"
#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/occlusion.h"

namespace hapticd::tools {
namespace {

/// A part of the study.
enum class OcclusionPart : std::uint8_t {
  passages,  ///< bodies pass between the camera and the hand
  entries,   ///< hands enter from the side
  outlines,  ///< of bodies that move come over a hand that presses
  near,      ///< surfaces come nearer than the camera measures
  pushes,    ///< up to 20 N beside silhouettes and the image's border
};
constexpr std::array kAllParts{OcclusionPart::passages, OcclusionPart::entries, OcclusionPart::outlines,
                               OcclusionPart::near, OcclusionPart::pushes};
std::string_view nameOf(OcclusionPart part) {
  constexpr std::array<std::string_view, 5> kNames{"passages", "entries", "outlines", "near", "pushes"};
  return kNames.at(static_cast<std::size_t>(part));
}

struct OcclusionOptions {
  std::vector<OcclusionPart> parts{kAllParts.begin(), kAllParts.end()};
  std::vector<std::string> laws = kProxyLawChoices;
  std::vector<double> distances_m{1, 2};
  std::vector<SceneNoise> noises{SceneNoise::none, SceneNoise::sensor, SceneNoise::harsh};
  std::uint32_t seed = 1;
  int seeds = 10;      ///< of the noise, each for all entries, outlines and pushes
  bool quick = false;  ///< few passages

  bool has(OcclusionPart part) const { return std::ranges::find(parts, part) != parts.end(); }
};

/// What came of all cases like `like` under a law.
template <typename Case, typename Result>
struct OcclusionRow {
  std::string law;
  Case like;
  Result result{};
};
using PassageRow = OcclusionRow<PassageCase, PassageResult>;
using EntryRow = OcclusionRow<EntryCase, EntryResult>;
using OutlineRow = OcclusionRow<OutlineCase, OutlineResult>;
using NearRow = OcclusionRow<double, NearLimitResult>;  ///< like: the speed of the surface, m/s
using PushRow = OcclusionRow<BorderPushCase, BorderPushResult>;

struct OcclusionRows {
  std::vector<PassageRow> passages;
  std::vector<EntryRow> entries;
  std::vector<OutlineRow> outlines;
  std::vector<NearRow> near;
  std::vector<PushRow> pushes;
};

/// Returns the passages whose results make up a row: of a plate that goes right, of one that pauses and goes
/// left, and of an arm, which without noise throws no shadow.
std::vector<PassageCase> passagesLike(const PassageCase& usual, bool quick) {
  if (quick) return {usual};
  PassageCase pausing = usual;
  pausing.speed_m_per_s = -usual.speed_m_per_s;
  pausing.pause_s = 1;
  PassageCase round = usual;
  round.shape = OccluderShape::elliptic_cylinder;
  round.projector_shadow = usual.noise != SceneNoise::none;
  return {usual, pausing, round};
}

/// True if the camera measures the body.
bool isMeasured(const PassageCase& passage) {
  constexpr double kBeyondNear_m = 0.03;
  constexpr double kHandBeforeWall_m = 0.03;
  const double front_m = passage.wall_m - kHandBeforeWall_m - passage.gap_m - passage.thickness_m;
  return front_m > rt::DepthModelParameters{}.near_m + kBeyondNear_m;
}

/// Calls `measure(case)` for the noise of each seed; once without noise.
template <typename Case, typename Measure>
void forEachSeed(const OcclusionOptions& options, Case one, const Measure& measure) {
  const int seeds = one.noise == SceneNoise::none ? 1 : options.seeds;
  for (int i = 0; i < seeds; ++i) {
    one.seed = options.seed + static_cast<std::uint32_t>(i);
    measure(one);
  }
}

/// Calls `measure` with a case of each noise and distance.
template <typename Case, typename Measure>
void forEachSetting(const OcclusionOptions& options, const Measure& measure) {
  for (const SceneNoise noise : options.noises) {
    for (const double wall_m : options.distances_m) {
      Case one;
      one.wall_m = wall_m;
      one.noise = noise;
      one.seed = options.seed;
      measure(one);
    }
  }
}

std::vector<PassageCase> passagesOf(const OcclusionOptions& options) {
  using Hand = HandDuringPassage;
  const std::vector<double> few_gaps_m = options.quick ? std::vector{0.06, 0.1} : std::vector{0.06, 0.2};
  const std::vector<double> gaps_m =
      options.quick ? few_gaps_m : std::vector{0.01, 0.02, 0.03, 0.06, 0.1, 0.2, 0.3};
  const std::vector<double> thicknesses_m = options.quick ? std::vector{0.08} : std::vector{0.02, 0.08};
  const std::vector<Hand> hands = options.quick ? std::vector{Hand::free, Hand::pressing}
                                                : std::vector(kAllHands.begin(), kAllHands.end());
  std::vector<PassageCase> cases;
  forEachSetting<PassageCase>(options, [&](PassageCase one) {
    for (const Hand hand : hands) {
      one.hand = hand;
      const bool all_gaps = hand == Hand::free || hand == Hand::pressing;
      for (const double thickness_m : thicknesses_m) {
        one.thickness_m = thickness_m;
        for (const double gap_m : all_gaps ? gaps_m : few_gaps_m) {
          one.gap_m = gap_m;
          if (isMeasured(one)) cases.push_back(one);
        }
      }
    }
  });
  return cases;
}

/// Measures the passages, each rendered once for all laws.
std::vector<PassageRow> measurePassages(const OcclusionOptions& options) {
  const std::vector<PassageCase> cases = passagesOf(options);
  std::vector<PassageRow> rows;
  for (const std::string& law : options.laws) {
    for (const PassageCase& one : cases) rows.push_back({law, one});
  }
  for (std::size_t i = 0; i < cases.size(); ++i) {
    showProgress(fmt::format("{} hand at {} m, a body {:.0f} mm before it", nameOf(cases[i].hand),
                             cases[i].wall_m, 1000 * cases[i].gap_m));
    for (const PassageCase& one : passagesLike(cases[i], options.quick)) {
      Passage passage(one);
      for (std::size_t row = i; row < rows.size(); row += cases.size())
        rows[row].result.add(passage.run(rows[row].law));
    }
  }
  return rows;
}

std::vector<BlockSide> sidesOf(const OcclusionOptions& options) {
  if (options.quick) return {kAllSides.front()};
  return {kAllSides.begin(), kAllSides.end()};
}

/// The entries whose results make up a row each: those through a side by depth and speed, through all four
/// sides; those at the image's border, and from behind, at one speed.
std::vector<EntryCase> entriesAt(const EntryCase& at, bool quick) {
  const std::vector<double> depths_m = quick ? std::vector{0.01} : std::vector{0.003, 0.01, 0.02, 0.03};
  const std::vector<double> speeds_m_per_s = quick ? std::vector{0.1} : std::vector{0.02, 0.1, 0.5};
  std::vector<EntryCase> cases;
  EntryCase one = at;
  for (const EntryKind kind : {EntryKind::visible_side, EntryKind::hidden_side}) {
    one.kind = kind;
    for (const double below_m : depths_m) {
      one.below_m = below_m;
      for (const double speed_m_per_s : speeds_m_per_s) {
        one.speed_m_per_s = speed_m_per_s;
        cases.push_back(one);
      }
    }
  }
  one.speed_m_per_s = EntryCase{}.speed_m_per_s;
  for (const double below_m : {0.008, 0.02, 0.06}) {
    one.below_m = below_m;
    one.kind = EntryKind::into_image;
    cases.push_back(one);
    // from behind there is no level of the front, and 60 mm is deeper than a hand presses
    if (below_m != 0.008) continue;
    for (const EntryKind kind : {EntryKind::from_behind, EntryKind::out_of_image}) {
      one.kind = kind;
      cases.push_back(one);
    }
  }
  return cases;
}

std::vector<EntryRow> measureEntries(const OcclusionOptions& options) {
  std::vector<EntryRow> rows;
  for (const std::string& law : options.laws) {
    forEachSetting<EntryCase>(options, [&](const EntryCase& at) {
      for (const EntryCase& like : entriesAt(at, options.quick)) {
        showProgress(fmt::format("{}: {} at {} m", law, nameOf(like.kind), like.wall_m));
        EntryRow& row = rows.emplace_back(EntryRow{law, like});
        for (const BlockSide side : sidesOf(options)) {
          if (!isThroughSide(like.kind) && side != kAllSides.front()) continue;
          EntryCase one = like;
          one.side = side;
          forEachSeed(options, one, [&](const EntryCase& entry) { row.result.add(runEntry(law, entry)); });
        }
      }
    });
  }
  return rows;
}

std::vector<OutlineCase> outlinesAt(const OutlineCase& at) {
  std::vector<OutlineCase> cases;
  OutlineCase one = at;
  for (const bool visible : {true, false}) {
    one.visible = visible;
    cases.push_back(one);
  }
  one.visible = true;
  one.motion = OutlineMotion::comes_on;
  for (const double passes_at_m : {0.016, 0.02, 0.026}) {
    one.passes_at_m = passes_at_m;
    cases.push_back(one);
  }
  return cases;
}

std::vector<OutlineRow> measureOutlines(const OcclusionOptions& options) {
  std::vector<OutlineRow> rows;
  for (const std::string& law : options.laws) {
    forEachSetting<OutlineCase>(options, [&](const OutlineCase& at) {
      for (const OutlineCase& like : outlinesAt(at)) {
        showProgress(fmt::format("{}: outline {} at {} m", law, nameOf(like.motion), like.wall_m));
        OutlineRow& row = rows.emplace_back(OutlineRow{law, like});
        for (const BlockSide side : sidesOf(options)) {
          OutlineCase one = like;
          one.side = side;
          forEachSeed(options, one,
                      [&](const OutlineCase& outline) { row.result.add(runOutline(law, outline)); });
        }
      }
    });
  }
  return rows;
}

std::vector<NearRow> measureNear(const OcclusionOptions& options) {
  std::vector<NearRow> rows;
  for (const std::string& law : options.laws) {
    for (const double speed_m_per_s : {0.03, 0.1, 0.3})
      rows.push_back({law, speed_m_per_s, runNearLimit(law, speed_m_per_s)});
  }
  return rows;
}

std::vector<PushRow> measurePushes(const OcclusionOptions& options) {
  constexpr BorderKind kKinds[] = {BorderKind::silhouette_hidden, BorderKind::silhouette_visible,
                                   BorderKind::image_border};
  constexpr double kBeside_m[] = {0.005, 0.01, 0.02, 0.04};
  constexpr double kSpeeds_m_per_s[] = {0.1, 0.5};
  constexpr double kNoisyEdge_px = 3;  // with noise, contact may end this near to the edge of a body
  const double fx_px = rt::DepthModelParameters{}.fx_px;
  std::vector<PushRow> rows;
  const auto measure = [&](const std::string& law, const BorderPushCase& at) {
    PushRow hand_moves{law, at};
    PushRow surface_moves{law, at};
    surface_moves.like.surface_moves = true;
    for (const double beside_m : kBeside_m) {
      const bool noisy = at.noise != SceneNoise::none;
      BorderPushCase push = at;
      push.beside_m = noisy ? std::max(beside_m, kNoisyEdge_px * at.wall_m / fx_px) : beside_m;
      forEachSeed(options, push,
                  [&](const BorderPushCase& one) { hand_moves.result.add(runBorderPush(law, one)); });
      // half of the positions for surfaces that move, each with all speeds
      if (beside_m == kBeside_m[1] || beside_m == kBeside_m[3]) continue;
      push.surface_moves = true;
      for (const double speed_m_per_s : kSpeeds_m_per_s) {
        push.speed_m_per_s = speed_m_per_s;
        forEachSeed(options, push,
                    [&](const BorderPushCase& one) { surface_moves.result.add(runBorderPush(law, one)); });
      }
    }
    rows.push_back(hand_moves);
    rows.push_back(surface_moves);
  };
  for (const std::string& law : options.laws) {
    forEachSetting<BorderPushCase>(options, [&](BorderPushCase at) {
      showProgress(fmt::format("{}: pushes beside borders at {} m", law, at.wall_m));
      for (const BorderKind kind : kKinds) {
        at.kind = kind;
        measure(law, at);
      }
    });
  }
  return rows;
}

OcclusionRows measureOcclusion(const OcclusionOptions& options) {
  OcclusionRows rows;
  if (options.has(OcclusionPart::passages)) rows.passages = measurePassages(options);
  if (options.has(OcclusionPart::entries)) rows.entries = measureEntries(options);
  if (options.has(OcclusionPart::outlines)) rows.outlines = measureOutlines(options);
  if (options.has(OcclusionPart::near)) rows.near = measureNear(options);
  if (options.has(OcclusionPart::pushes)) rows.pushes = measurePushes(options);
  return rows;
}

constexpr const char* kExplanation =
    "passages: a body of that thickness and 80 mm width passes at 0.3 m/s, at that gap in front of the\n"
    "  line of sight to the HIP. free: 30 mm in front of the wall; pressing: 6 mm deep; stroking: 8 mm\n"
    "  deep, 0.1 m/s; entering, leaving: while it is hidden. ghost: force on a HIP in front of the wall;\n"
    "  error: against the true force; change: against the force before the body set out; ms: the longest\n"
    "  time above the limit.\n"
    "entries: shares of the ticks with the HIP in the solid. body: within 30 degrees of the normal of the\n"
    "  surface that was touched, or of the front where that is nearer, and within 0.5 N or 1 JND of the\n"
    "  spring to it, or between the two while the force turns over, as long as the blend takes for that;\n"
    "  no force, reported: the contact state is `behind`; silent: it does not; wrong: another force.\n"
    "  ghost: force outside; sideways: force along the motion where there is no side to come through;\n"
    "  step: largest change in a tick after the blend, beyond the spring of the HIP's own motion;\n"
    "  20 ms: largest force in the first 20 ms inside; angle: largest one from that normal, of forces\n"
    "  above 0.5 N.\n"
    "outlines: the body moves at 0.1 m/s, its outline passes over a hand that presses 8 mm into its front.\n"
    "  drop: largest fall of the force in one tick; frames: fewest in which it fell from 90 to 10 %, or "
    "would\n"
    "  have at the speed at which it fell to half; a dash: in more than ten, or less. not pressed: no force\n"
    "  before the body moved; held: at the end more than half of the largest force.\n"
    "near: a surface approaches a still HIP nearer than near_m, waits two seconds and recedes.\n"
    "pushes: 45 mm deep beside silhouettes and the image border; popped: gave way for good below 20 N\n"
    "  with the ray to the HIP 3 px or more from the border; at outline: the same, nearer to it.\n";

/// The columns of the law and of what all cases have, and `figures`.
template <typename Row>
Columns<Row> columnsWith(const Columns<Row>& figures) {
  return joined<Row>({{"/law", "law", 0, &Row::law},
                      {"/wall_m", "wall m", 2, [](const Row& r) { return r.like.wall_m; }},
                      {"/noise", "noise", 0, [](const Row& r) { return nameOf(r.like.noise); }}},
                     figures);
}

Columns<PassageRow> passageColumns() {
  using Row = PassageRow;
  return columnsWith<Row>(
      {{"/hand", "hand", 0, [](const Row& r) { return nameOf(r.like.hand); }},
       {"/thickness_m", "thick mm", 0, [](const Row& r) { return r.like.thickness_m; }, 1000},
       {"/gap_m", "gap mm", 0, [](const Row& r) { return r.like.gap_m; }, 1000},
       {"/ghost_largest_n", "ghost N", 3, [](const Row& r) { return r.result.ghost.largest; }},
       {"/ghost_percent", "% >0.1", 2, [](const Row& r) { return r.result.ghost.percent(); }},
       {"/ghost_longest_ms", "ms", 0, [](const Row& r) { return r.result.ghost.longest; }},
       {"/error_largest_n", "error N", 3, [](const Row& r) { return r.result.error.largest; }},
       {"/error_longest_ms", "ms >0.5", 0, [](const Row& r) { return r.result.error.longest; }},
       {"/change_largest_n", "change N", 3, [](const Row& r) { return r.result.change.largest; }},
       {"/change_longest_ms", "ms >0.5", 0, [](const Row& r) { return r.result.change.longest; }},
       {"/lost_percent", "lost %", 2,
        [](const Row& r) { return percentOf(r.result.lost, r.result.pressed); }}});
}

Columns<EntryRow> entryColumns() {
  using Row = EntryRow;
  const auto share = [](std::size_t EntryResult::*ticks) {
    return [ticks](const Row& r) { return percentOf(r.result.*ticks, r.result.inside); };
  };
  return columnsWith<Row>(
      {{"/entry", "entry", 0, [](const Row& r) { return nameOf(r.like.kind); }},
       {"/below_m", "below mm", 0, [](const Row& r) { return r.like.below_m; }, 1000},
       {"/speed_m_per_s", "m/s", 2, [](const Row& r) { return r.like.speed_m_per_s; }},
       {"/body_percent", "body %", 1, share(&EntryResult::of_body)},
       {"/none_reported_percent", "none, reported %", 1, share(&EntryResult::none_reported)},
       {"/none_silent_percent", "none, silent %", 1, share(&EntryResult::none_silent)},
       {"/wrong_percent", "wrong %", 1, share(&EntryResult::wrong)},
       {"/ghost_n", "ghost N", 3, [](const Row& r) { return r.result.ghost_n; }},
       {"/sideways_n", "sideways N", 3, [](const Row& r) { return r.result.sideways_n; }},
       {"/step_n", "step N", 2, [](const Row& r) { return r.result.step_n; }},
       {"/early_n", "20 ms N", 2, [](const Row& r) { return r.result.early_n; }},
       {"/angle_deg", "angle", 0, [](const Row& r) { return r.result.angle_deg; }}});
}

Columns<OutlineRow> outlineColumns() {
  using Row = OutlineRow;
  const auto comes_on = [](const Row& r) { return r.like.motion == OutlineMotion::comes_on; };
  return columnsWith<Row>(
      {{"/motion", "body", 0, [](const Row& r) { return nameOf(r.like.motion); }},
       {"/visible_side", "visible side", 0, [](const Row& r) { return r.like.visible; }},
       {"/passes_at_m", "passes at mm", 0,
        [comes_on](const Row& r) { return figureWhere(comes_on(r), r.like.passes_at_m); }, 1000},
       {"/runs", "runs", 0, [](const Row& r) { return r.result.runs; }},
       {"/not_pressed", "not pressed", 0, [](const Row& r) { return r.result.not_pressed; }},
       {"/held", "held", 0, [](const Row& r) { return r.result.held; }},
       {"/drop_n", "drop N", 2, [](const Row& r) { return r.result.drop_n; }},
       {"/fewest_frames", "frames", 1, [](const Row& r) {
          const double frames = r.result.fewest_frames;
          return ifKnown(std::isfinite(frames) ? std::optional(frames) : std::nullopt);
        }}});
}

Columns<NearRow> nearColumns() {
  using Row = NearRow;
  return {{"/law", "law", 0, &Row::law},
          {"/speed_m_per_s", "m/s", 2, &Row::like},
          {"/force_n", "force N", 3, [](const Row& r) { return r.result.force_n; }},
          {"/held_ms", "held ms", 0, [](const Row& r) { return r.result.held_ms; }},
          {"/least_held_n", "least N", 3, [](const Row& r) { return r.result.least_held_n; }},
          {"/released_ms", "released ms", 0, [](const Row& r) { return r.result.released_ms; }},
          {"/largest_step_n", "step N", 3, [](const Row& r) { return r.result.largest_step_n; }},
          {"/cause_named", "cause named", 0, [](const Row& r) { return r.result.cause_named; }},
          {"/came_back", "came back", 0, [](const Row& r) { return r.result.came_back; }}};
}

Columns<PushRow> pushColumns() {
  using Row = PushRow;
  return columnsWith<Row>(
      {{"/border", "border", 0, [](const Row& r) { return nameOf(r.like.kind); }},
       {"/surface_moves", "surface moves", 0, [](const Row& r) { return r.like.surface_moves; }},
       {"/pushes", "pushes", 0, [](const Row& r) { return r.result.pushes; }},
       {"/popped", "popped", 0, [](const Row& r) { return r.result.popped; }},
       {"/popped_at_outline", "at outline", 0, [](const Row& r) { return r.result.at_outline; }},
       {"/least_n", "least N", 2, [](const Row& r) { return r.result.least_n; }}});
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

/// A body whose back is that far before a free HIP must not push it.
bool isBeforeHand(const PassageCase& passage) {
  return passage.gap_m >= 0.0199;
}

/// Beyond that gap nothing depends on the thickness of the body, which nobody can know: the solid behind a
/// visible surface is taken to be 35 mm thick, and 60 mm is the least that must be free.
bool isClear(const PassageCase& passage) {
  return passage.gap_m >= 0.0599 && passage.thickness_m <= 0.08;
}

void addPassages(const OcclusionRows& rows, const std::string& law, SceneNoise noise,
                 std::vector<Requirement>& list) {
  const auto of = [&](HandDuringPassage hand, bool clear) {
    return together(rows.passages, [&](const PassageRow& row) {
      return row.law == law && row.like.noise == noise && row.like.hand == hand && isClear(row.like) == clear;
    });
  };
  const auto add = [&](bool measured, const char* text, double limit, double figure, const char* unit) {
    if (!measured) return;
    list.push_back(
        Requirement::atMost(law, fmt::format("{}, noise {}, {}", text, nameOf(noise), unit), limit, figure));
  };
  const PassageResult free = together(rows.passages, [&](const PassageRow& row) {
    return row.law == law && row.like.noise == noise && row.like.hand == HandDuringPassage::free &&
           isBeforeHand(row.like);
  });
  const PassageResult pressing = of(HandDuringPassage::pressing, true);
  const PassageResult stroking = of(HandDuringPassage::stroking, true);
  add(free.ghost.ticks > 0, "force on a free HIP, the back of a body 20 mm or more in front", 0.1,
      free.ghost.largest, "N");
  add(free.ghost.ticks > 0, "the same, ticks above 0.1 N", 0, free.ghost.percent(), "%");
  // With noise the error includes the sensor's own; the passage adds the change.
  const Exceedance& judged = noise == SceneNoise::none ? pressing.error : pressing.change;
  add(pressing.pressed > 0, "error of a pressing HIP above 0.5 N while a body passes", 100,
      static_cast<double>(judged.longest), "ms");
  add(stroking.pressed > 0, "contact lost in strokes while a body passes", 0,
      percentOf(stroking.lost, stroking.pressed), "%");
}

void addEntries(const OcclusionRows& rows, const std::string& law, std::vector<Requirement>& list) {
  const auto of_law = [&law](const EntryRow& row) {
    return row.law == law && row.like.noise == SceneNoise::none;
  };
  const EntryResult all = together(rows.entries, of_law);
  const EntryResult at_border = together(rows.entries, [&of_law](const EntryRow& row) {
    return of_law(row) &&
           (row.like.kind == EntryKind::into_image || row.like.kind == EntryKind::out_of_image);
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

void addSides(const OcclusionRows& rows, const std::string& law, SceneNoise noise,
              std::vector<Requirement>& list) {
  const EntryResult sides = together(rows.entries, [&](const EntryRow& row) {
    return row.law == law && row.like.noise == noise && isThroughSide(row.like.kind);
  });
  if (sides.inside == 0) return;
  const auto add = [&](const char* text, double limit, double figure, const char* unit) {
    list.push_back(
        Requirement::atMost(law, fmt::format("{}, noise {}, {}", text, nameOf(noise), unit), limit, figure));
  };
  add("entries through sides: change of the blended force in a tick that no motion explains", 0.5,
      sides.step_n, "N");
  add("entries through sides: angle from the side's normal", kRightDirection_deg, sides.angle_deg, "degrees");
}

void addOutlines(const OcclusionRows& rows, const std::string& law, std::vector<Requirement>& list) {
  constexpr double kFewest_frames = 3;
  const OutlineResult all = together(rows.outlines, [&law](const OutlineRow& row) { return row.law == law; });
  if (all.runs == all.not_pressed) return;
  list.push_back(Requirement::atLeast(law, "an outline over a pressing hand: the force falls within, frames",
                                      kFewest_frames, all.fewest_frames));
}

void addNear(const OcclusionRows& rows, const std::string& law, std::vector<Requirement>& list) {
  // safety.depth_timeout_s; and that with safety.depth_ramp_s, after ten frames in which what is missing may
  // only flicker, and a tenth more.
  constexpr double kMinHeld_ms = 500;
  constexpr double kLatestRelease_ms = 1130;
  double least_held_ms = std::numeric_limits<double>::infinity();
  double latest_ms = 0;
  int unnamed = 0;
  for (const NearRow& row : rows.near) {
    if (row.law != law) continue;
    const NearLimitResult& r = row.result;
    least_held_ms = std::min(least_held_ms, r.held_ms);
    latest_ms = r.released_ms < 0 ? std::numeric_limits<double>::max() : std::max(latest_ms, r.released_ms);
    unnamed += r.cause_named ? 0 : 1;
  }
  if (rows.near.empty()) return;
  list.push_back(Requirement::atLeast(law, "a surface nearer than near_m: the force is held for, ms",
                                      kMinHeld_ms, least_held_ms));
  list.push_back(
      Requirement::atMost(law, "the same: the force is released after, ms", kLatestRelease_ms, latest_ms));
  list.push_back(Requirement::atMost(law, "the same: runs that do not name the cause", 0, unnamed));
}

void addPushes(const OcclusionRows& rows, const std::string& law, std::vector<Requirement>& list) {
  const auto all = together(rows.pushes, [&law](const PushRow& row) { return row.law == law; });
  if (all.pushes == 0) return;
  list.push_back(Requirement::atMost(
      law, fmt::format("pop-through below 20 N 3 px or more inside borders, of {} pushes", all.pushes), 0,
      all.popped));
}

std::vector<Requirement> requirementsOf(const OcclusionRows& rows, const OcclusionOptions& options) {
  std::vector<Requirement> list;
  for (const std::string& law : options.laws) {
    for (const SceneNoise noise : options.noises) addPassages(rows, law, noise, list);
    addEntries(rows, law, list);
    for (const SceneNoise noise : options.noises) addSides(rows, law, noise, list);
    addOutlines(rows, law, list);
    addNear(rows, law, list);
    addPushes(rows, law, list);
  }
  return list;
}

}  // namespace

StudyCommand occlusionCommand(CLI::App& app) {
  const auto options = std::make_shared<OcclusionOptions>();
  StudyCommand command(
      app, "occlusion",
      "forces while a body passes between the camera and the hand, and where the hand enters from "
      "the side");
  command.quick("one passage each at 1 m, 60 and 100 mm in front of a free and a pressing hand", [options] {
    options->distances_m = {1};
    options->noises = {SceneNoise::none};
    options->seeds = 1;
    options->quick = true;
  });
  command.choices("--parts", options->parts, kAllParts, "all");
  command.names("--laws", options->laws, kProxyLawChoices, "all");
  command.numbers("--distances", options->distances_m, 0.6, 3.8, "of the wall, metres (1,2)");
  command.choices("--noises", options->noises, kAllNoises, "none,sensor,harsh");
  command.seed(options->seed, "of the noise (1)");
  command
      ->add_option("--seeds", options->seeds,
                   "how many noises entries, outlines and pushes are seen with (10)")
      ->check(within(1, 1000));
  command.onRun([options](const StudyCommand& self) {
    const OcclusionRows rows = measureOcclusion(*options);
    Report report;
    report.say(kExplanation);
    report.table("passages", "\n", passageColumns(), rows.passages);
    report.table("entries", "\n", entryColumns(), rows.entries);
    report.table("outlines", "\n", outlineColumns(), rows.outlines);
    report.table("near", "\n", nearColumns(), rows.near);
    report.table("pushes", "\n", pushColumns(), rows.pushes);
    report.requirements(requirementsOf(rows, *options));
    return self.report(report);
  });
  return command;
}

}  // namespace hapticd::tools

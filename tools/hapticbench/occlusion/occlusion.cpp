// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "rt/base/parameters.h"
#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/occlusion/occlusion.h"

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
constexpr auto wordsOf(OcclusionPart) {
  return rt::words<OcclusionPart>("passages", "entries", "outlines", "near", "pushes");
}

struct OcclusionOptions {
  std::vector<OcclusionPart> parts = everyOne<OcclusionPart>();
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

/// A case of each noise and distance.
template <typename Case>
std::vector<Case> settingsOf(const OcclusionOptions& options) {
  std::vector<Case> cases(1);
  cases.front().seed = options.seed;
  return varied(varied(cases, &Case::noise, options.noises), &Case::wall_m, options.distances_m);
}

std::vector<PassageCase> passagesOf(const OcclusionOptions& options) {
  using Hand = HandDuringPassage;
  const std::vector<double> few_gaps_m = options.quick ? std::vector{0.06, 0.1} : std::vector{0.06, 0.2};
  const std::vector<double> gaps_m =
      options.quick ? few_gaps_m : std::vector{0.01, 0.02, 0.03, 0.06, 0.1, 0.2, 0.3};
  const std::vector<double> thicknesses_m = options.quick ? std::vector{0.08} : std::vector{0.02, 0.08};
  const std::vector<Hand> hands = options.quick ? std::vector{Hand::free, Hand::pressing} : everyOne<Hand>();
  std::vector<PassageCase> cases;
  for (const PassageCase& like : varied(varied(settingsOf<PassageCase>(options), &PassageCase::hand, hands),
                                        &PassageCase::thickness_m, thicknesses_m)) {
    const bool all_gaps = like.hand == Hand::free || like.hand == Hand::pressing;
    for (const PassageCase& one : varied({like}, &PassageCase::gap_m, all_gaps ? gaps_m : few_gaps_m))
      if (isMeasured(one)) cases.push_back(one);
  }
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

/// A row for each law and each of `likes`: the sum of `run(law, case)` of the cases of `variants(like)`, each
/// with the noise of each seed, and once without noise.
template <typename Result, typename Case, typename Variants, typename Run>
std::vector<OcclusionRow<Case, Result>> measured(const OcclusionOptions& options,
                                                 const std::vector<Case>& likes, const Variants& variants,
                                                 const Run& run) {
  std::vector<OcclusionRow<Case, Result>> rows;
  for (const std::string& law : options.laws) {
    for (const Case& like : likes) {
      showProgress(fmt::format("{}, row {}, at {} m", law, rows.size() + 1, like.wall_m));
      auto& row = rows.emplace_back(OcclusionRow<Case, Result>{law, like});
      for (Case one : variants(like)) {
        const int seeds = one.noise == SceneNoise::none ? 1 : options.seeds;
        for (int i = 0; i < seeds; ++i) {
          one.seed = options.seed + static_cast<std::uint32_t>(i);
          row.result.add(run(law, one));
        }
      }
    }
  }
  return rows;
}

/// The case at each side of a block.
template <typename Case>
std::vector<Case> atSides(const Case& like, const OcclusionOptions& options) {
  return varied({like}, &Case::side, options.quick ? std::vector{BlockSide::left} : everyOne<BlockSide>());
}

/// The entries whose results make up a row each: those through a side by depth and speed, through all four
/// sides; those at the image's border, and from behind, at one speed.
std::vector<EntryCase> entriesOf(const OcclusionOptions& options) {
  const std::vector<double> depths_m =
      options.quick ? std::vector{0.01} : std::vector{0.003, 0.01, 0.02, 0.03};
  const std::vector<double> speeds_m_per_s = options.quick ? std::vector{0.1} : std::vector{0.02, 0.1, 0.5};
  std::vector<EntryCase> cases;
  const auto add = [&cases](EntryCase at, std::vector<EntryKind> kinds, const std::vector<double>& below_m,
                            const std::vector<double>& at_m_per_s) {
    const auto deep = varied(varied({at}, &EntryCase::kind, kinds), &EntryCase::below_m, below_m);
    for (const EntryCase& one : varied(deep, &EntryCase::speed_m_per_s, at_m_per_s)) cases.push_back(one);
  };
  for (const EntryCase& at : settingsOf<EntryCase>(options)) {
    using enum EntryKind;
    add(at, {visible_side, hidden_side}, depths_m, speeds_m_per_s);
    // from behind there is no level of the front, and 60 mm is deeper than a hand presses
    add(at, {into_image, from_behind, out_of_image}, {0.008}, {at.speed_m_per_s});
    add(at, {into_image}, {0.02, 0.06}, {at.speed_m_per_s});
  }
  return cases;
}

std::vector<OutlineCase> outlinesOf(const OcclusionOptions& options) {
  std::vector<OutlineCase> cases;
  for (OutlineCase one : settingsOf<OutlineCase>(options)) {
    for (const OutlineCase& aside : varied({one}, &OutlineCase::visible, {true, false}))
      cases.push_back(aside);
    one.motion = OutlineMotion::comes_on;
    for (const OutlineCase& on : varied({one}, &OutlineCase::passes_at_m, {0.016, 0.02, 0.026}))
      cases.push_back(on);
  }
  return cases;
}

std::vector<BorderPushCase> pushesOf(const OcclusionOptions& options) {
  const auto at = varied(settingsOf<BorderPushCase>(options), &BorderPushCase::kind, everyOne<BorderKind>());
  return varied(at, &BorderPushCase::surface_moves, {false, true});
}

/// The pushes whose results make up a row.
std::vector<BorderPushCase> pushesLike(const BorderPushCase& like) {
  constexpr double kNoisyEdge_px = 3;  // with noise, contact may end this near to the edge of a body
  const double least_m =
      like.noise == SceneNoise::none ? 0 : kNoisyEdge_px * like.wall_m / rt::DepthModelParameters{}.fx_px;
  // half of the positions for surfaces that move, each with all speeds
  std::vector<double> beside_m =
      like.surface_moves ? std::vector{0.005, 0.02} : std::vector{0.005, 0.01, 0.02, 0.04};
  for (double& beside : beside_m) beside = std::max(beside, least_m);
  const auto pushes = varied({like}, &BorderPushCase::beside_m, beside_m);
  return like.surface_moves ? varied(pushes, &BorderPushCase::speed_m_per_s, {0.1, 0.5}) : pushes;
}

OcclusionRows measureOcclusion(const OcclusionOptions& options) {
  OcclusionRows rows;
  if (options.has(OcclusionPart::passages)) rows.passages = measurePassages(options);
  if (options.has(OcclusionPart::entries)) {
    const auto variants = [&](const EntryCase& like) {
      return isThroughSide(like.kind) ? atSides(like, options) : std::vector{like};
    };
    rows.entries = measured<EntryResult>(options, entriesOf(options), variants, runEntry);
  }
  if (options.has(OcclusionPart::outlines)) {
    const auto variants = [&](const OutlineCase& like) { return atSides(like, options); };
    rows.outlines = measured<OutlineResult>(options, outlinesOf(options), variants, runOutline);
  }
  if (options.has(OcclusionPart::near)) {
    for (const std::string& law : options.laws) {
      for (const double speed_m_per_s : {0.03, 0.1, 0.3})
        rows.near.push_back({law, speed_m_per_s, runNearLimit(law, speed_m_per_s)});
    }
  }
  if (options.has(OcclusionPart::pushes))
    rows.pushes = measured<BorderPushResult>(options, pushesOf(options), pushesLike, runBorderPush);
  return rows;
}

constexpr const char* kOcclusionExplanation =
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

/// What all rows but those of `near` begin with.
template <typename Of>
Row cellsWith(const Of& r, const Row& figures) {
  return joined({{"/law", "law", 0, r.law},
                 {"/wall_m", "wall m", 2, r.like.wall_m},
                 {"/noise", "noise", 0, nameOf(r.like.noise)}},
                figures);
}

Row passageCells(const PassageRow& r) {
  return cellsWith(r, {{"/hand", "hand", 0, nameOf(r.like.hand)},
                       {"/thickness_m", "thick mm", 0, r.like.thickness_m, 1000},
                       {"/gap_m", "gap mm", 0, r.like.gap_m, 1000},
                       {"/ghost_largest_n", "ghost N", 3, r.result.ghost.largest},
                       {"/ghost_percent", "% >0.1", 2, r.result.ghost.percent()},
                       {"/ghost_longest_ms", "ms", 0, r.result.ghost.longest},
                       {"/error_largest_n", "error N", 3, r.result.error.largest},
                       {"/error_longest_ms", "ms >0.5", 0, r.result.error.longest},
                       {"/change_largest_n", "change N", 3, r.result.change.largest},
                       {"/change_longest_ms", "ms >0.5", 0, r.result.change.longest},
                       {"/lost_percent", "lost %", 2, percentOf(r.result.lost, r.result.pressed)}});
}

Row entryCells(const EntryRow& r) {
  const auto share = [&r](std::size_t ticks) { return percentOf(ticks, r.result.inside); };
  return cellsWith(r, {{"/entry", "entry", 0, nameOf(r.like.kind)},
                       {"/below_m", "below mm", 0, r.like.below_m, 1000},
                       {"/speed_m_per_s", "m/s", 2, r.like.speed_m_per_s},
                       {"/body_percent", "body %", 1, share(r.result.of_body)},
                       {"/none_reported_percent", "none, reported %", 1, share(r.result.none_reported)},
                       {"/none_silent_percent", "none, silent %", 1, share(r.result.none_silent)},
                       {"/wrong_percent", "wrong %", 1, share(r.result.wrong)},
                       {"/ghost_n", "ghost N", 3, r.result.ghost_n},
                       {"/sideways_n", "sideways N", 3, r.result.sideways_n},
                       {"/step_n", "step N", 2, r.result.step_n},
                       {"/early_n", "20 ms N", 2, r.result.early_n},
                       {"/angle_deg", "angle", 0, r.result.angle_deg}});
}

Row outlineCells(const OutlineRow& r) {
  return cellsWith(
      r, {{"/motion", "body", 0, nameOf(r.like.motion)},
          {"/visible_side", "visible side", 0, r.like.visible},
          {"/passes_at_m", "passes at mm", 0,
           Figure::where(r.like.motion == OutlineMotion::comes_on, r.like.passes_at_m), 1000},
          {"/runs", "runs", 0, r.result.runs},
          {"/not_pressed", "not pressed", 0, r.result.not_pressed},
          {"/held", "held", 0, r.result.held},
          {"/drop_n", "drop N", 2, r.result.drop_n},
          {"/fewest_frames", "frames", 1,
           std::isfinite(r.result.fewest_frames) ? Figure(r.result.fewest_frames) : Figure(nullptr)}});
}

Row nearCells(const NearRow& r) {
  return {{"/law", "law", 0, r.law},
          {"/speed_m_per_s", "m/s", 2, r.like},
          {"/force_n", "force N", 3, r.result.force_n},
          {"/held_ms", "held ms", 0, r.result.held_ms},
          {"/least_held_n", "least N", 3, r.result.least_held_n},
          {"/released_ms", "released ms", 0, r.result.released_ms},
          {"/largest_step_n", "step N", 3, r.result.largest_step_n},
          {"/cause_named", "cause named", 0, r.result.cause_named},
          {"/came_back", "came back", 0, r.result.came_back}};
}

Row pushCells(const PushRow& r) {
  return cellsWith(r, {{"/border", "border", 0, nameOf(r.like.kind)},
                       {"/surface_moves", "surface moves", 0, r.like.surface_moves},
                       {"/pushes", "pushes", 0, r.result.pushes},
                       {"/popped", "popped", 0, r.result.popped},
                       {"/popped_at_outline", "at outline", 0, r.result.at_outline},
                       {"/least_n", "least N", 2, r.result.least_n}});
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

/// The requirements on one law, one after the other.
class LawRequirements {
 public:
  LawRequirements(const OcclusionRows& rows, const std::string& law) : rows_(rows), law_(law) {}

  void passages(SceneNoise noise) {
    const auto of = [&](HandDuringPassage hand, const auto& belongs) {
      return together(rows_.passages, [&](const PassageRow& row) {
        return row.law == law_ && row.like.noise == noise && row.like.hand == hand && belongs(row.like);
      });
    };
    const PassageResult free = of(HandDuringPassage::free, isBeforeHand);
    const PassageResult pressing = of(HandDuringPassage::pressing, isClear);
    const PassageResult stroking = of(HandDuringPassage::stroking, isClear);
    if (free.ghost.ticks > 0) {
      atMost(0.1, free.ghost.largest, "force on a free HIP, the back of a body 20 mm or more in front", noise,
             "N");
      atMost(0, free.ghost.percent(), "the same, ticks above 0.1 N", noise, "%");
    }
    // With noise the error includes the sensor's own; the passage adds the change.
    const Exceedance& judged = noise == SceneNoise::none ? pressing.error : pressing.change;
    if (pressing.pressed > 0) {
      atMost(100, static_cast<double>(judged.longest),
             "error of a pressing HIP above 0.5 N while a body passes", noise, "ms");
    }
    if (stroking.pressed > 0) {
      atMost(0, percentOf(stroking.lost, stroking.pressed), "contact lost in strokes while a body passes",
             noise, "%");
    }
  }

  void entries() {
    const auto of = [this](const auto& belongs) {
      return together(rows_.entries, [&](const EntryRow& row) {
        return row.law == law_ && row.like.noise == SceneNoise::none && belongs(row.like.kind);
      });
    };
    const EntryResult all = of([](EntryKind) { return true; });
    const EntryResult at_border =
        of([](EntryKind kind) { return kind == EntryKind::into_image || kind == EntryKind::out_of_image; });
    if (all.inside == 0) return;
    atMost(0, percentOf(all.wrong, all.inside), "entries from the side: another force than the body's, %");
    atMost(0, percentOf(all.none_silent, all.inside),
           "entries from the side: no force and no report of it, %");
    atMost(0.1, all.ghost_n, "entries from the side: force outside the body, N");
    atMost(0.2, at_border.sideways_n, "force sideways at the image border, N");
  }

  void sides(SceneNoise noise) {
    const EntryResult sides = together(rows_.entries, [&](const EntryRow& row) {
      return row.law == law_ && row.like.noise == noise && isThroughSide(row.like.kind);
    });
    if (sides.inside == 0) return;
    atMost(0.5, sides.step_n,
           "entries through sides: change of the blended force in a tick that no motion explains", noise,
           "N");
    atMost(kRightDirection_deg, sides.angle_deg, "entries through sides: angle from the side's normal", noise,
           "degrees");
  }

  void outlines() {
    constexpr double kFewest_frames = 3;
    const OutlineResult all =
        together(rows_.outlines, [this](const OutlineRow& row) { return row.law == law_; });
    if (all.runs == all.not_pressed) return;
    atLeast(kFewest_frames, all.fewest_frames,
            "an outline over a pressing hand: the force falls within, frames");
  }

  void near() {
    // safety.depth_timeout_s; and that with safety.depth_ramp_s, after ten frames in which what is missing
    // may only flicker, and a tenth more.
    constexpr double kMinHeld_ms = 500;
    constexpr double kLatestRelease_ms = 1130;
    double least_held_ms = std::numeric_limits<double>::infinity();
    double latest_ms = 0;
    int unnamed = 0;
    for (const NearRow& row : rows_.near) {
      if (row.law != law_) continue;
      const NearLimitResult& r = row.result;
      least_held_ms = std::min(least_held_ms, r.held_ms);
      latest_ms = r.released_ms < 0 ? std::numeric_limits<double>::max() : std::max(latest_ms, r.released_ms);
      unnamed += r.cause_named ? 0 : 1;
    }
    if (rows_.near.empty()) return;
    atLeast(kMinHeld_ms, least_held_ms, "a surface nearer than near_m: the force is held for, ms");
    atMost(kLatestRelease_ms, latest_ms, "the same: the force is released after, ms");
    atMost(0, unnamed, "the same: runs that do not name the cause");
  }

  void pushes() {
    const BorderPushResult all =
        together(rows_.pushes, [this](const PushRow& row) { return row.law == law_; });
    if (all.pushes == 0) return;
    atMost(0, all.popped,
           fmt::format("pop-through below 20 N 3 px or more inside borders, of {} pushes", all.pushes));
  }

  const std::vector<Requirement>& list() const { return list_; }

 private:
  void atMost(double limit, double figure, const std::string& text) {
    list_.push_back(Requirement::atMost(law_, text, limit, figure));
  }
  void atMost(double limit, double figure, const char* text, SceneNoise noise, const char* unit) {
    atMost(limit, figure, fmt::format("{}, noise {}, {}", text, nameOf(noise), unit));
  }
  void atLeast(double limit, double figure, const std::string& text) {
    list_.push_back(Requirement::atLeast(law_, text, limit, figure));
  }

  const OcclusionRows& rows_;
  const std::string& law_;
  std::vector<Requirement> list_;
};

std::vector<Requirement> requirementsOf(const OcclusionRows& rows, const OcclusionOptions& options) {
  std::vector<Requirement> list;
  for (const std::string& law : options.laws) {
    LawRequirements of_law(rows, law);
    for (const SceneNoise noise : options.noises) of_law.passages(noise);
    of_law.entries();
    for (const SceneNoise noise : options.noises) of_law.sides(noise);
    of_law.outlines();
    of_law.near();
    of_law.pushes();
    list.insert(list.end(), of_law.list().begin(), of_law.list().end());
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
  command.choices("--parts", options->parts, kAllOf<OcclusionPart>, "all");
  command.names("--laws", options->laws, kProxyLawChoices, "all");
  command.numbers("--distances", options->distances_m, 0.6, 3.8, "of the wall, metres (1,2)");
  command.choices("--noises", options->noises, kAllNoises, "none,sensor,harsh");
  command.seed(options->seed, "of the noise (1)");
  command.number("--seeds", options->seeds, 1, 1000,
                 "how many noises entries, outlines and pushes are seen with (10)");
  command.onReport([options] {
    const OcclusionRows rows = measureOcclusion(*options);
    Report report;
    report.say(kOcclusionExplanation);
    report.table("passages", "\n", rowsOf(rows.passages, passageCells));
    report.table("entries", "\n", rowsOf(rows.entries, entryCells));
    report.table("outlines", "\n", rowsOf(rows.outlines, outlineCells));
    report.table("near", "\n", rowsOf(rows.near, nearCells));
    report.table("pushes", "\n", rowsOf(rows.pushes, pushCells));
    report.requirements(requirementsOf(rows, *options));
    return report;
  });
  return command;
}

}  // namespace hapticd::tools

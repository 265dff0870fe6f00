// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/occlusion/occlusion_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "rt/parameters.h"

namespace hapticd::tools {
namespace {

/// Returns the passages whose results make up a row.
std::vector<PassageCase> casesOf(const PassageRow& row, const OcclusionOptions& options) {
  const PassageCase usual{.wall_m = row.wall_m,
                          .hand = row.hand,
                          .thickness_m = row.thickness_m,
                          .gap_m = row.gap_m,
                          .noise = row.noise,
                          .seed = options.seed};
  if (options.one_passage) return {usual};
  PassageCase pausing = usual;
  pausing.speed_m_per_s = -usual.speed_m_per_s;
  pausing.pause_s = 1;
  if (row.noise != SceneNoise::none) return {usual, pausing};
  PassageCase round = usual;
  round.shape = OccluderShape::elliptic_cylinder;
  round.projector_shadow = false;
  return {usual, pausing, round};
}

/// True if the camera measures the body.
bool isMeasured(const PassageRow& row) {
  constexpr double kBeyondNear_m = 0.03;
  constexpr double kHandBeforeWall_m = 0.03;
  const double front_m = row.wall_m - kHandBeforeWall_m - row.gap_m - row.thickness_m;
  return front_m > rt::DepthModelParameters{}.near_m + kBeyondNear_m;
}

/// The rows of one law; those of the other laws differ in the law alone.
std::vector<PassageRow> rowsOf(const std::string& law, const OcclusionOptions& options) {
  std::vector<PassageRow> rows;
  for (const SceneNoise noise : options.noises) {
    for (const double wall_m : options.distances_m) {
      for (const HandDuringPassage hand : options.hands) {
        const bool all_gaps = hand == HandDuringPassage::free || hand == HandDuringPassage::pressing;
        for (const double thickness_m : options.thicknesses_m) {
          for (const double gap_m : all_gaps ? options.gaps_m : options.few_gaps_m) {
            const PassageRow row{law, wall_m, noise, hand, thickness_m, gap_m};
            if (isMeasured(row)) rows.push_back(row);
          }
        }
      }
    }
  }
  return rows;
}

using Progress = std::function<void(const std::string&)>;

bool isChosen(const OcclusionOptions& options, OcclusionPart part) {
  return std::ranges::find(options.parts, part) != options.parts.end();
}

/// Measures the passages, each rendered once for all laws.
std::vector<PassageRow> measurePassages(const OcclusionOptions& options, const Progress& progress) {
  std::vector<std::vector<PassageRow>> rows_of_law;
  for (const std::string& law : options.laws) rows_of_law.push_back(rowsOf(law, options));
  const std::size_t rows = rows_of_law.empty() ? 0 : rows_of_law.front().size();
  for (std::size_t i = 0; i < rows; ++i) {
    const PassageRow& usual = rows_of_law.front()[i];
    progress(fmt::format("{} hand at {} m, a body {:.0f} mm before it", nameOf(usual.hand), usual.wall_m,
                         1000 * usual.gap_m));
    for (const PassageCase& passage_case : casesOf(usual, options)) {
      Passage passage(passage_case);
      for (std::vector<PassageRow>& of_law : rows_of_law) {
        of_law[i].result.add(passage.run(of_law[i].law));
        ++of_law[i].passages;
      }
    }
  }
  std::vector<PassageRow> all;
  for (std::vector<PassageRow>& of_law : rows_of_law) all.insert(all.end(), of_law.begin(), of_law.end());
  return all;
}

/// Calls `measure(law, noise, wall_m)` for each combination of the options.
template <typename Measure>
void forEachSetting(const OcclusionOptions& options, const Measure& measure) {
  for (const std::string& law : options.laws) {
    for (const SceneNoise noise : options.noises) {
      for (const double wall_m : options.distances_m) measure(law, noise, wall_m);
    }
  }
}

std::vector<EntryRow> measureEntries(const OcclusionOptions& options, const Progress& progress) {
  constexpr EntryKind kKinds[] = {EntryKind::visible_side, EntryKind::hidden_side, EntryKind::from_behind,
                                  EntryKind::into_image, EntryKind::out_of_image};
  constexpr double kBelow_m[] = {0.008, 0.02, 0.06};
  std::vector<EntryRow> rows;
  forEachSetting(options, [&](const std::string& law, SceneNoise noise, double wall_m) {
    progress(fmt::format("{}: entries from the side at {} m", law, wall_m));
    for (const EntryKind kind : kKinds) {
      for (const double below_m : kBelow_m) {
        // from behind there is no level of the front, and 60 mm is deeper than a hand presses
        const bool once = kind == EntryKind::from_behind || kind == EntryKind::out_of_image;
        if (once && below_m != kBelow_m[0]) continue;
        rows.push_back({law, wall_m, noise, kind, below_m,
                        runEntry(law, {.kind = kind,
                                       .wall_m = wall_m,
                                       .below_m = below_m,
                                       .noise = noise,
                                       .seed = options.seed})});
      }
    }
  });
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

std::vector<PushRow> measurePushes(const OcclusionOptions& options, const Progress& progress) {
  constexpr BorderKind kKinds[] = {BorderKind::silhouette_hidden, BorderKind::silhouette_visible,
                                   BorderKind::image_border};
  constexpr double kBeside_m[] = {0.005, 0.01, 0.02, 0.04};
  constexpr double kSpeeds_m_per_s[] = {0.1, 0.5};
  constexpr double kNoisyEdge_px = 3;  // with noise, contact may end this near to the edge of a body
  const double fx_px = rt::DepthModelParameters{}.fx_px;
  std::vector<PushRow> rows;
  forEachSetting(options, [&](const std::string& law, SceneNoise noise, double wall_m) {
    progress(fmt::format("{}: pushes beside borders at {} m", law, wall_m));
    for (const BorderKind kind : kKinds) {
      PushRow hand_moves{.law = law, .wall_m = wall_m, .noise = noise, .kind = kind};
      PushRow surface_moves = hand_moves;
      surface_moves.surface_moves = true;
      for (const double beside_m : kBeside_m) {
        BorderPushCase push{.kind = kind, .wall_m = wall_m, .beside_m = beside_m, .noise = noise};
        if (noise != SceneNoise::none) push.beside_m = std::max(beside_m, kNoisyEdge_px * wall_m / fx_px);
        push.seed = options.seed;
        hand_moves.result.add(runBorderPush(law, push));
        // half of the positions for surfaces that move, each with all speeds
        if (beside_m == kBeside_m[1] || beside_m == kBeside_m[3]) continue;
        push.surface_moves = true;
        for (const double speed_m_per_s : kSpeeds_m_per_s) {
          push.speed_m_per_s = speed_m_per_s;
          surface_moves.result.add(runBorderPush(law, push));
        }
      }
      rows.push_back(hand_moves);
      rows.push_back(surface_moves);
    }
  });
  return rows;
}

}  // namespace

std::string_view nameOf(OcclusionPart part) {
  constexpr std::array<std::string_view, 4> kNames{"passages", "entries", "near", "pushes"};
  return kNames.at(static_cast<std::size_t>(part));
}

OcclusionResult measureOcclusion(const OcclusionOptions& options, const Progress& progress) {
  OcclusionResult result{.options = options};
  if (isChosen(options, OcclusionPart::passages)) result.passages = measurePassages(options, progress);
  if (isChosen(options, OcclusionPart::entries)) result.entries = measureEntries(options, progress);
  if (isChosen(options, OcclusionPart::near)) result.near = measureNear(options);
  if (isChosen(options, OcclusionPart::pushes)) result.pushes = measurePushes(options, progress);
  return result;
}

}  // namespace hapticd::tools

#include "tools/hapticbench/occlusion/occlusion_study.h"

#include <fmt/format.h>

#include "rt/parameters.h"

namespace hapticd::tools {
namespace {

/// The passages that a row is made of.
std::vector<PassageCase> casesOf(const PassageRow& row, const OcclusionOptions& options) {
  const PassageCase usual{.wall_m = row.wall_m,
                          .hand = row.hand,
                          .thickness_m = row.thickness_m,
                          .gap_m = row.gap_m,
                          .noise = row.noise,
                          .seed = options.seed};
  if (options.one_passage) return {usual};
  PassageCase to_left = usual;
  to_left.speed_m_per_s = -usual.speed_m_per_s;
  PassageCase pausing = usual;
  pausing.pause_s = 1;
  PassageCase without_shadow = usual;
  without_shadow.projector_shadow = false;
  PassageCase round = usual;
  round.shape = OccluderShape::elliptic_cylinder;
  return {usual, to_left, pausing, without_shadow, round};
}

/// True if the camera measures the body.
bool isMeasured(const PassageRow& row) {
  constexpr double kBeyondNear_m = 0.03;
  constexpr double kHandBeforeWall_m = 0.03;
  const double front_m = row.wall_m - kHandBeforeWall_m - row.gap_m - row.thickness_m;
  return front_m > rt::DepthModelParameters{}.near_m + kBeyondNear_m;
}

std::vector<PassageRow> rowsOf(const OcclusionOptions& options) {
  std::vector<PassageRow> rows;
  for (const config::LawChoice law : options.laws) {
    for (const SceneNoise noise : options.noises) {
      for (const double wall_m : options.distances_m) {
        for (const HandDuringPassage hand : options.hands) {
          for (const double thickness_m : options.thicknesses_m) {
            for (const double gap_m : options.gaps_m) {
              const PassageRow row{.law = law,
                                   .wall_m = wall_m,
                                   .noise = noise,
                                   .hand = hand,
                                   .thickness_m = thickness_m,
                                   .gap_m = gap_m,
                                   .result = {}};
              if (isMeasured(row)) rows.push_back(row);
            }
          }
        }
      }
    }
  }
  return rows;
}

}  // namespace

OcclusionResult measureOcclusion(const OcclusionOptions& options,
                                 const std::function<void(const std::string&)>& progress) {
  OcclusionResult result{.passages = rowsOf(options)};
  for (PassageRow& row : result.passages) {
    progress(fmt::format("{}: {} hand at {} m, a body {:.0f} mm before it", nameOf(row.law), nameOf(row.hand),
                         row.wall_m, 1000 * row.gap_m));
    for (const PassageCase& passage : casesOf(row, options)) {
      row.result.add(runPassage(row.law, passage));
      ++row.passages;
    }
  }
  return result;
}

}  // namespace hapticd::tools

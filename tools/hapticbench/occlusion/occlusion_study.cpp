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

/// A law's rows under `law`; those of the other laws differ in that alone.
std::vector<PassageRow> rowsOf(config::LawChoice law, const OcclusionOptions& options) {
  std::vector<PassageRow> rows;
  const auto add = [&](SceneNoise noise, double wall_m, HandDuringPassage hand, double thickness_m,
                       double gap_m) {
    PassageRow row{.law = law, .wall_m = wall_m, .noise = noise, .hand = hand, .result = {}};
    row.thickness_m = thickness_m;
    row.gap_m = gap_m;
    if (isMeasured(row)) rows.push_back(row);
  };
  for (const SceneNoise noise : options.noises) {
    for (const double wall_m : options.distances_m) {
      for (const HandDuringPassage hand : options.hands) {
        for (const double thickness_m : options.thicknesses_m) {
          for (const double gap_m : options.gaps_m) add(noise, wall_m, hand, thickness_m, gap_m);
        }
      }
    }
  }
  return rows;
}

}  // namespace

OcclusionResult measureOcclusion(const OcclusionOptions& options,
                                 const std::function<void(const std::string&)>& progress) {
  std::vector<std::vector<PassageRow>> rows_of_law;
  for (const config::LawChoice law : options.laws) rows_of_law.push_back(rowsOf(law, options));
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
  OcclusionResult result;
  for (std::vector<PassageRow>& of_law : rows_of_law)
    result.passages.insert(result.passages.end(), of_law.begin(), of_law.end());
  return result;
}

}  // namespace hapticd::tools

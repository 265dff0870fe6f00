// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/sweep/sweep_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "config/law_choice.h"
#include "tools/hapticbench/stability/wall.h"
#include "tools/hapticbench/sweep/sweep_score.h"

namespace hapticd::tools {
namespace {

void addHeading(fmt::memory_buffer& text) {
  fmt::format_to(std::back_inserter(text),
                 "  {:<17}{:>5}{:>6}{:>6}{:>8}{:>10}{:>9}{:>8}{:>9}{:>9}{:>9}{:>8}{:>8}  {}\n", "law", "k_s",
                 "D", "N_max", "felt", "steepest", "pops at", "edge", "ridge", "noise", "largest", "margin",
                 "us", "score");
  fmt::format_to(std::back_inserter(text),
                 "  {:<17}{:>5}{:>6}{:>6}{:>8}{:>10}{:>9}{:>8}{:>9}{:>9}{:>9}{:>8}{:>8}\n", "", "N/m", "mm",
                 "", "N/m", "N/m", "N", "mm", "mm", "N s.d.", "N s.d.", "", "median");
}

void addRow(fmt::memory_buffer& text, const SweepResult& r, const std::string& score) {
  const SweepPoint& point = r.point;
  fmt::format_to(
      std::back_inserter(text),
      "  {:<17}{:>5.0f}{:>6}{:>6}{:>8.0f}{:>10.0f}{:>9}{:>8}{:>9}{:>9.3f}{:>9.3f}{:>8.2f}{:>8.2f}  {}\n",
      config::nameOf(point.law), point.springs.stiffness_n_per_m,
      point.usesRadius() ? fmt::format("{:.0f}", point.springs.radius_m * 1e3) : "-",
      point.usesMaxPoints() ? fmt::format("{}", point.springs.max_points) : "-",
      r.feel.felt_stiffness_n_per_m, r.feel.steepest_stiffness_n_per_m,
      r.feel.pop_through_n >= kNoPopThrough_n ? "20+" : fmt::format("{:.2f}", r.feel.pop_through_n),
      fmt::format("{:+.1f}", (r.feel.edge_is_outside ? 1e3 : -1e3) * r.feel.edge_radius_m),
      r.feel.smallest_ridge_m > 0 ? fmt::format("{:.2f}", r.feel.smallest_ridge_m * 1e3) : "none",
      r.noise.median_n, r.noise.largest_n, r.stability_margin, r.feel.median_force_us, score);
}

std::string scoreText(const SweepResult& result, const std::vector<SweepResult>& results,
                      const SweepResult* papers) {
  std::string text = papers != nullptr ? fmt::format("{:+.2f}", scoreOf(result, *papers)) : "";
  if (isParetoOptimal(result, results)) text += " *";
  const std::string broken = papers != nullptr ? brokenBy(result, *papers) : "";
  if (!broken.empty()) text += " (" + broken + ")";
  return text;
}

/// How many of the three parameters differ from the paper's.
int changesFromPapers(const SweepPoint& point) {
  const rt::SpringParameters papers;
  return (point.springs.stiffness_n_per_m != papers.stiffness_n_per_m ? 1 : 0) +
         (point.springs.radius_m != papers.radius_m ? 1 : 0) +
         (point.springs.max_points != papers.max_points ? 1 : 0);
}

/// The paper's law with one parameter changed at a time.
void addTradeOff(fmt::memory_buffer& text, const std::vector<SweepResult>& results) {
  const SweepResult* papers = recommend(results).papers;
  if (papers == nullptr) return;
  fmt::format_to(std::back_inserter(text),
                 "\nThe trade-off: the paper's set with one parameter changed at a time\n");
  addHeading(text);
  const auto addRowsWhere = [&](auto&& is_changed) {
    for (const SweepResult& result : results) {
      const bool is_papers = result.point.isPapers();
      const bool is_one_off = result.point.law == rt::ForceLaw::nearest_springs &&
                              changesFromPapers(result.point) == 1 && is_changed(result.point.springs);
      if (is_papers || is_one_off) {
        addRow(text, result,
               fmt::format("{:+.2f}{}", scoreOf(result, *papers), is_papers ? " the paper's" : ""));
      }
    }
  };
  const rt::SpringParameters base;
  addRowsWhere([&base](const auto& springs) { return springs.max_points != base.max_points; });
  addRowsWhere([&base](const auto& springs) { return springs.stiffness_n_per_m != base.stiffness_n_per_m; });
  addRowsWhere([&base](const auto& springs) { return springs.radius_m != base.radius_m; });
}

void addRecommendation(fmt::memory_buffer& text, const std::vector<SweepResult>& results) {
  const Recommendation recommendation = recommend(results);
  if (recommendation.papers == nullptr) return;
  const SweepConstraints constraints;
  fmt::format_to(std::back_inserter(text),
                 "\nThe paper's set, and the best of each law: highest score with margin >= {:g}, "
                 "pop-through >= {:g} N,\n"
                 "at most {:g} us and {:g} times the paper's noise. score: doublings gained over the paper's "
                 "set in felt\n"
                 "stiffness and pop-through force, less those lost in edge and ridge, less half of those "
                 "lost in noise.\n",
                 constraints.smallest_margin, constraints.smallest_pop_through_n, constraints.largest_time_us,
                 constraints.largest_noise_by_papers);
  addHeading(text);
  addRow(text, *recommendation.papers, "+0.00 the paper's");
  for (const SweepResult* best : recommendation.best_of_law) {
    addRow(text, *best,
           fmt::format("{:+.2f}{}", scoreOf(*best, *recommendation.papers),
                       best == recommendation.best ? " recommended" : ""));
  }
  if (recommendation.best == nullptr) {
    fmt::format_to(std::back_inserter(text), "No set keeps the constraints.\n");
    return;
  }
  const Feel& ours = recommendation.best->feel;
  const Feel& theirs = recommendation.papers->feel;
  fmt::format_to(
      std::back_inserter(text),
      "Recommended: {} with k_s {:g} N/m. Felt stiffness {:.0f} (paper's {:.0f}) N/m, pop-through {}"
      " (paper's {:.2f}) N,\nedge {:.1f} ({:.1f}) mm, ridge {:.2f} ({:.2f}) mm, noise {:.3f} ({:.3f}) N,"
      " margin {:.2f} ({:.2f}), {:.2f} ({:.2f}) us.\n",
      config::nameOf(recommendation.best->point.law), recommendation.best->point.springs.stiffness_n_per_m,
      ours.felt_stiffness_n_per_m, theirs.felt_stiffness_n_per_m,
      ours.pop_through_n >= kNoPopThrough_n ? "above 20" : fmt::format("{:.2f}", ours.pop_through_n),
      theirs.pop_through_n, ours.edge_radius_m * 1e3, theirs.edge_radius_m * 1e3, ours.smallest_ridge_m * 1e3,
      theirs.smallest_ridge_m * 1e3, recommendation.best->noise.median_n,
      recommendation.papers->noise.median_n, recommendation.best->stability_margin,
      recommendation.papers->stability_margin, ours.median_force_us, theirs.median_force_us);
}

}  // namespace

std::string sweepTable(const SweepPart& part) {
  fmt::memory_buffer text;
  const ForceNoise noise = part.results.empty() ? ForceNoise{} : part.results.front().noise;
  fmt::format_to(std::back_inserter(text),
                 "Surfaces 1 m away, known exactly; noise: {}.\n"
                 "felt, steepest: -dF/dh from 5 to 15 mm penetration, or from the onset of a spring law to "
                 "its peak, mean and\n"
                 "over 1 mm. pops at: force at which the surface gives way. edge: where the force is half of "
                 "the plane's, mm\n"
                 "beyond (+) or before (-) the end of a half-plane. ridge: height of the lowest ridge of 20 "
                 "mm width that\n"
                 "changes the force by one JND (7 %, 0.1 N at least). noise: s.d. of the force from frame to "
                 "frame, median and\n"
                 "largest of {} still places {:.2f} to {:.2f} m away, depth filter {}. margin: largest "
                 "stable stiffness of a\n"
                 "45 g device in a light hand at {} ms delay by the steepest. *: no other set is better in "
                 "one and no worse in the others (time left out).\n\n",
                 part.settings.noise_source, noise.sites, noise.nearest_m, noise.farthest_m,
                 part.settings.filter ? "on" : "off", part.settings.delay_ticks);
  std::vector<SweepResult> sorted = part.results;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const SweepResult& a, const SweepResult& b) { return a.point.law < b.point.law; });
  const SweepResult* papers = recommend(sorted).papers;
  addHeading(text);
  for (const SweepResult& result : sorted) addRow(text, result, scoreText(result, sorted, papers));
  if (part.shard.count == 1) {
    addTradeOff(text, sorted);
    addRecommendation(text, sorted);
  }
  return fmt::to_string(text);
}

}  // namespace hapticd::tools

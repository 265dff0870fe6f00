#include "tools/hapticbench/occlusion/occlusion_report.h"

#include <fmt/format.h>

#include <iterator>
#include <nlohmann/json.hpp>

#include "tools/hapticbench/accuracy/accuracy_study.h"

namespace hapticd::tools {
namespace {

using Json = nlohmann::ordered_json;

double lostPercent(const PassageResult& result) {
  return result.pressed == 0 ? 0
                             : 100 * static_cast<double>(result.lost) / static_cast<double>(result.pressed);
}

void addPassages(fmt::memory_buffer& text, const std::vector<PassageRow>& rows) {
  fmt::format_to(std::back_inserter(text),
                 "{:<9}{:>6}  {:<10}{:<10}{:>6}{:>5} |{:>9}{:>8}{:>7} |{:>9}{:>7} |{:>9}{:>7} |{:>7}\n",
                 "law", "wall m", "noise", "hand", "thick", "gap", "ghost N", "% >0.1", "ms", "error N",
                 "ms>0.5", "change N", "ms>0.5", "lost %");
  for (const PassageRow& row : rows) {
    const PassageResult& r = row.result;
    fmt::format_to(std::back_inserter(text),
                   "{:<9}{:>6.2f}  {:<10}{:<10}{:>6.0f}{:>5.0f} |{:>9.3f}{:>8.2f}{:>7} |{:>9.3f}{:>7} "
                   "|{:>9.3f}{:>7} |{:>7.2f}\n",
                   nameOf(row.law), row.wall_m, nameOf(row.noise), nameOf(row.hand), 1000 * row.thickness_m,
                   1000 * row.gap_m, r.ghost.largest, r.ghost.percent(), r.ghost.longest, r.error.largest,
                   r.error.longest, r.disturbance.largest, r.disturbance.longest, lostPercent(r));
  }
}

}  // namespace

std::string occlusionTable(const OcclusionResult& result) {
  fmt::memory_buffer text;
  addPassages(text, result.passages);
  return fmt::to_string(text);
}

std::string occlusionJson(const OcclusionResult& result) {
  Json document;
  for (const PassageRow& row : result.passages) {
    const PassageResult& r = row.result;
    document["passages"].push_back({{"law", nameOf(row.law)},
                                    {"wall_m", row.wall_m},
                                    {"noise", nameOf(row.noise)},
                                    {"hand", nameOf(row.hand)},
                                    {"thickness_m", row.thickness_m},
                                    {"gap_m", row.gap_m},
                                    {"passages", row.passages},
                                    {"ghost_largest_n", r.ghost.largest},
                                    {"ghost_percent", r.ghost.percent()},
                                    {"ghost_longest_ms", r.ghost.longest},
                                    {"error_largest_n", r.error.largest},
                                    {"error_longest_ms", r.error.longest},
                                    {"change_largest_n", r.disturbance.largest},
                                    {"change_longest_ms", r.disturbance.longest},
                                    {"lost_percent", lostPercent(r)}});
  }
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/sweep/sweep_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "config/law_choice.h"

namespace hapticd::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;

config::Error error(const std::string& where, const std::string& what, const std::string& remedy = {}) {
  return {where, what, remedy};
}

/// Calls `visit(key, figure)` for each figure of a result in a file, to write or to read it.
template <typename Result, typename Visit>
void visitFigures(Result& result, const Visit& visit) {
  visit("felt_stiffness_n_per_m", result.feel.rendered_stiffness_n_per_m);
  visit("steepest_stiffness_n_per_m", result.feel.steepest_stiffness_n_per_m);
  visit("pop_through_n", result.feel.pop_through_n);
  visit("edge_radius_m", result.feel.edge_radius_m);
  visit("edge_is_outside", result.feel.edge_is_outside);
  visit("smallest_ridge_m", result.feel.smallest_ridge_m);
  visit("stroke_h_m", result.feel.stroke_h_m);
  visit("median_force_us", result.feel.median_force_us);
  visit("noise_median_n", result.noise.median_n);
  visit("noise_largest_n", result.noise.largest_n);
  visit("noise_sites", result.noise.sites);
  visit("noise_nearest_m", result.noise.nearest_m);
  visit("noise_farthest_m", result.noise.farthest_m);
}

Json jsonOf(const SweepResult& result) {
  Json row{{"index", result.point.index},
           {"law", config::nameOf(result.point.law)},
           {"stiffness_n_per_m", result.point.springs.stiffness_n_per_m}};
  if (result.point.usesRadius()) row["radius_m"] = result.point.springs.radius_m;
  if (result.point.usesMaxPoints()) row["max_points"] = result.point.springs.max_points;
  visitFigures(result, [&row](const char* key, const auto& figure) { row[key] = figure; });
  row["pops_through"] = result.feel.pop_through_n < kNoPopThrough_n;
  // JSON has no infinity
  if (std::isfinite(result.stability_margin)) row["stability_margin"] = result.stability_margin;
  return row;
}

SweepResult resultOf(const Json& row, const std::vector<SweepPoint>& points) {
  SweepResult result;
  result.point = points.at(row.at("index").get<std::size_t>());
  if (row.at("law") != config::nameOf(result.point.law) ||
      row.at("stiffness_n_per_m") != result.point.springs.stiffness_n_per_m) {
    throw std::out_of_range("point " + row.at("index").dump() + " is another one here");
  }
  visitFigures(result, [&row](const char* key, auto& figure) { row.at(key).get_to(figure); });
  result.stability_margin = row.value("stability_margin", std::numeric_limits<double>::infinity());
  return result;
}

std::string partName(const Shard& shard) {
  return fmt::format("{}/{}", shard.number, shard.count);
}

/// Returns the problem with the points of a part; empty if there is none.
std::string wrongPoints(const SweepPart& part, std::size_t grid_size) {
  std::vector<int> times(grid_size);
  for (const SweepResult& result : part.results) {
    if (!part.shard.has(result.point.index)) {
      return fmt::format("holds point {}, which is not of part {}", result.point.index, partName(part.shard));
    }
    if (++times[result.point.index] > 1) return fmt::format("holds point {} twice", result.point.index);
  }
  for (std::size_t index = 0; index < grid_size; ++index) {
    if (part.shard.has(index) && times[index] == 0) return fmt::format("lacks point {}", index);
  }
  return {};
}

}  // namespace

std::string sweepJson(const SweepPart& part) {
  Json document{{"benchmark", "sweep"},
                {"format", kFormat},
                {"quick", part.settings.quick},
                {"filter", part.settings.filter},
                {"delay_ticks", part.settings.delay_ticks},
                {"noise_source", part.settings.noise_source},
                {"noise_digest", part.settings.noise_digest},
                {"shard", part.shard.number},
                {"shards", part.shard.count},
                {"points", Json::array()}};
  for (const SweepResult& result : part.results) document["points"].push_back(jsonOf(result));
  return document.dump(1) + "\n";
}

config::Result<SweepPart> parseSweep(const std::string& name, const std::string& text) {
  try {
    const Json document = Json::parse(text);
    if (document.at("benchmark") != "sweep" || document.at("format") != kFormat) {
      return std::unexpected(
          error(name, "is no part of a sweep by this version", "write it with --shard and --json"));
    }
    SweepPart part{.name = name};
    document.at("quick").get_to(part.settings.quick);
    document.at("filter").get_to(part.settings.filter);
    document.at("delay_ticks").get_to(part.settings.delay_ticks);
    document.at("noise_source").get_to(part.settings.noise_source);
    document.at("noise_digest").get_to(part.settings.noise_digest);
    document.at("shard").get_to(part.shard.number);
    document.at("shards").get_to(part.shard.count);
    if (part.shard.number < 1 || part.shard.number > part.shard.count) {
      return std::unexpected(error(name, "has the impossible part number " + partName(part.shard)));
    }
    const std::vector<SweepPoint> points = pointsOf(gridOf(part.settings));
    for (const Json& row : document.at("points")) part.results.push_back(resultOf(row, points));
    return part;
  } catch (const std::exception& problem) {
    return std::unexpected(error(name, fmt::format("is no part of a sweep: {}", problem.what()),
                                 "write it with --shard and --json"));
  }
}

config::Result<SweepPart> mergeSweep(const std::vector<SweepPart>& parts) {
  if (parts.empty()) return std::unexpected(error("--merge", "names no files"));
  const SweepPart& first = parts.front();
  const std::size_t grid_size = pointsOf(gridOf(first.settings)).size();
  std::map<std::size_t, const SweepPart*> by_number;
  SweepPart whole{.name = "merged", .settings = first.settings};
  for (const SweepPart& part : parts) {
    if (!(part.settings == first.settings)) {
      return std::unexpected(error(part.name, "is of another sweep than " + first.name,
                                   "use the same --quick, --filter, --delay and --recordings for all parts"));
    }
    if (part.shard.count != first.shard.count) {
      return std::unexpected(
          error(part.name, fmt::format("is part {}, but {} is part {}", partName(part.shard), first.name,
                                       partName(first.shard))));
    }
    if (const auto [other, is_new] = by_number.emplace(part.shard.number, &part); !is_new) {
      return std::unexpected(error(
          part.name, fmt::format("is part {}, and so is {}", partName(part.shard), other->second->name)));
    }
    if (const std::string wrong = wrongPoints(part, grid_size); !wrong.empty()) {
      return std::unexpected(error(part.name, wrong, "compute the part again"));
    }
    whole.results.insert(whole.results.end(), part.results.begin(), part.results.end());
  }
  std::string missing;
  for (std::size_t number = 1; number <= first.shard.count; ++number) {
    if (!by_number.contains(number)) missing += fmt::format(" {}/{}", number, first.shard.count);
  }
  if (!missing.empty()) return std::unexpected(error("--merge", "these parts are missing:" + missing));
  std::sort(whole.results.begin(), whole.results.end(),
            [](const SweepResult& a, const SweepResult& b) { return a.point.index < b.point.index; });
  return whole;
}

}  // namespace hapticd::tools

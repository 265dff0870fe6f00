// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/noise/noise_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

namespace hapticd::tools {
namespace {

constexpr int kWindowOfLags_px = 64;

std::string text(const Estimate& estimate) {
  return std::isnan(estimate.value) ? "-" : fmt::format("{:.3f}", estimate.value);
}

nlohmann::json json(const Estimate& estimate) {
  const auto number = [](double value) {
    return std::isnan(value) ? nlohmann::json() : nlohmann::json(value);
  };
  return {{"value", number(estimate.value)},
          {"spread", number(estimate.spread)},
          {"standard_error", number(estimate.standard_error)}};
}

nlohmann::json json(const std::vector<Estimate>& estimates) {
  nlohmann::json list = nlohmann::json::array();
  for (const Estimate& estimate : estimates) list.push_back(json(estimate));
  return list;
}

void printLags(std::string& table, const char* title, const std::vector<Estimate>& lags) {
  fmt::format_to(std::back_inserter(table), "{}\n  lag ", title);
  for (std::size_t i = 0; i < lags.size(); ++i) fmt::format_to(std::back_inserter(table), "{:>7}", i);
  table += "\n      ";
  for (const Estimate& lag : lags) fmt::format_to(std::back_inserter(table), "{:>7}", text(lag));
  table += "\n";
}

}  // namespace

std::string noiseTable(const std::string& source, const std::vector<NoiseStatistics>& statistics) {
  std::string table = fmt::format("noise of {}, raw units\n", source);
  table += "window  measured  holes  rough  moving  temporal  standing  halves  after 8\n";
  for (const NoiseStatistics& s : statistics) {
    fmt::format_to(std::back_inserter(table), "{:>4} px{:>10}{:>7}{:>7}{:>8}{:>10}{:>10}{:>8}{:>9}\n",
                   s.window_px, s.windows, s.with_holes, s.not_smooth, s.moving, text(s.temporal_raw),
                   text(s.standing_raw), text(s.halves_correlation), text(s.left_after_8_raw));
  }
  if (statistics.empty()) return table;
  const auto chosen = std::ranges::find(statistics, kWindowOfLags_px, &NoiseStatistics::window_px);
  const NoiseStatistics& s = chosen != statistics.end() ? *chosen : statistics.back();
  printLags(table, fmt::format("autocovariance in time, frame periods ({} px)", s.window_px).c_str(),
            s.in_time);
  printLags(table, fmt::format("autocovariance in space, pixels ({} px)", s.window_px).c_str(), s.in_space);
  return table;
}

std::string noiseJson(const std::string& source, int frames, const std::vector<NoiseStatistics>& statistics) {
  nlohmann::json document{{"source", source}, {"frames", frames}, {"windows", nlohmann::json::array()}};
  for (const NoiseStatistics& s : statistics) {
    document["windows"].push_back({{"window_px", s.window_px},
                                   {"windows", s.windows},
                                   {"with_holes", s.with_holes},
                                   {"not_smooth", s.not_smooth},
                                   {"moving", s.moving},
                                   {"temporal_raw", json(s.temporal_raw)},
                                   {"standing_raw", json(s.standing_raw)},
                                   {"halves_correlation", json(s.halves_correlation)},
                                   {"left_after_8_raw", json(s.left_after_8_raw)},
                                   {"in_time_raw2", json(s.in_time)},
                                   {"in_space_raw2", json(s.in_space)}});
  }
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools

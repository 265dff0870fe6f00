// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/noise/noise_statistics.h"

#include <fmt/format.h>

#include <cmath>

#include "tools/hapticbench/table.h"

namespace hapticd::tools {
namespace {

Json ifKnown(double figure) {
  return std::isnan(figure) ? Json() : Json(figure);
}

Json objectOf(const Estimate& estimate) {
  return {{"value", ifKnown(estimate.value)},
          {"spread", ifKnown(estimate.spread)},
          {"standard_error", ifKnown(estimate.standard_error)}};
}

Json listOf(const std::vector<Estimate>& estimates) {
  Json list = Json::array();
  for (const Estimate& estimate : estimates) list.push_back(objectOf(estimate));
  return list;
}

void addEstimate(std::vector<Column<NoiseStatistics>>& columns, const char* key, const char* heading,
                 Estimate NoiseStatistics::*estimate) {
  columns.push_back({key, "", 0, [estimate](const NoiseStatistics& s) { return objectOf(s.*estimate); }});
  columns.push_back(
      {"", heading, 3, [estimate](const NoiseStatistics& s) { return ifKnown((s.*estimate).value); }});
}

const std::vector<Column<NoiseStatistics>>& columns() {
  using Row = NoiseStatistics;
  static const std::vector<Column<Row>> all = [] {
    std::vector<Column<Row>> list{{"/window_px", "window px", 0, &Row::window_px},
                                  {"/windows", "measured", 0, &Row::windows},
                                  {"/with_holes", "holes", 0, &Row::with_holes},
                                  {"/not_smooth", "rough", 0, &Row::not_smooth},
                                  {"/moving", "moving", 0, &Row::moving}};
    addEstimate(list, "/temporal_raw", "temporal", &Row::temporal_raw);
    addEstimate(list, "/standing_raw", "static", &Row::static_raw);
    addEstimate(list, "/halves_correlation", "halves", &Row::halves_correlation);
    addEstimate(list, "/left_after_8_raw", "after 8", &Row::left_after_8_raw);
    list.push_back({"/in_time_raw2", "", 0, [](const Row& s) { return listOf(s.in_time); }});
    list.push_back({"/in_space_raw2", "", 0, [](const Row& s) { return listOf(s.in_space); }});
    return list;
  }();
  return all;
}

}  // namespace

std::string noiseText(const std::string& source, const std::vector<NoiseStatistics>& statistics) {
  return fmt::format("noise of {}, raw units\n", source) + tableText(columns(), statistics);
}

std::string noiseJson(const std::string& source, std::size_t frames,
                      const std::vector<NoiseStatistics>& statistics) {
  const Json document{{"source", source}, {"frames", frames}, {"windows", tableJson(columns(), statistics)}};
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools

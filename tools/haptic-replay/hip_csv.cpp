// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-replay/hip_csv.h"

#include "rt/haptic_core.h"
#include "tools/lib/registration/point_table.h"

namespace hapticd::tools {
namespace {

constexpr const char* kHeader = "t_s,x_m,y_m,z_m";
constexpr double kLongest_s = 1e9;  // nanoseconds of it fit into 64 bits

}  // namespace

std::expected<std::vector<HipSample>, std::vector<config::Error>> readHipCsv(
    const std::filesystem::path& file) {
  PointTable table(file, kHeader, "check --hip");
  std::vector<HipSample> samples;
  table.readInto([&](const PointTable::Fields& fields) {
    const auto metres = [&](std::size_t column) {
      return table.number(column, fields, -rt::kWorkspaceHalfEdge_m, rt::kWorkspaceHalfEdge_m, "m");
    };
    const double time_s = table.number(0, fields, 0, kLongest_s, "s");
    samples.push_back({time_s, {metres(1), metres(2), metres(3)}});
  });
  if (!table.errors().empty()) return std::unexpected(std::move(table.errors()));
  return samples;
}

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#include "tests/system/support/bridge_log.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>

namespace hapticd::test {

std::vector<BridgeRow> bridgeRows(const std::filesystem::path& log) {
  std::ifstream file(log);
  std::string line;
  if (!std::getline(file, line) || file.eof()) return {};
  EXPECT_EQ(
      line,
      "t_ns,command_sequence,command_made_ns,command_age_ns,force_tick,force_tick_ns,mode,fx_n,fy_n,fz_n,"
      "exerted_x_n,exerted_y_n,exerted_z_n,x_m,y_m,z_m");
  std::vector<BridgeRow> rows;
  while (std::getline(file, line) && !file.eof()) {  // the last line may be half written
    std::ranges::replace(line, ',', ' ');
    std::istringstream fields(line);
    BridgeRow row;
    std::string mode;
    fields >> row.time_ns >> row.sequence >> row.made_ns >> row.age_ns >> row.force_tick >>
        row.force_tick_ns >> mode;
    for (rt::Vec3* vector : {&row.commanded_n, &row.exerted_n, &row.position_m}) {
      fields >> vector->x >> vector->y >> vector->z;
    }
    EXPECT_TRUE(fields) << line;
    row.active = mode == "active";
    rows.push_back(row);
  }
  return rows;
}

std::string ownLoopback(int host) {
  constexpr int kHosts = 8;  // of each process: 0 to 7
  const int process = ::getpid() * kHosts;
  return fmt::format("127.{}.{}.{}", 64 + (process >> 16) % 128, (process >> 8) & 255,
                     (process & 255) + host);
}

}  // namespace hapticd::test

// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/sweep/sweep_grid.h"

#include <charconv>

#include "config/value_text.h"

namespace hapticd::tools {

bool SweepPoint::isPapers() const {
  const rt::SpringParameters papers;
  return law == rt::ForceLaw::nearest_springs && springs.stiffness_n_per_m == papers.stiffness_n_per_m &&
         springs.radius_m == papers.radius_m && springs.min_points == papers.min_points &&
         springs.max_points == papers.max_points;
}

std::vector<SweepPoint> pointsOf(const SweepGrid& grid) {
  std::vector<SweepPoint> points;
  const auto add = [&points](rt::ForceLaw law, const rt::SpringParameters& springs) {
    points.push_back({points.size(), law, springs});
  };
  for (const double stiffness : grid.stiffnesses_n_per_m) {
    rt::SpringParameters springs{.stiffness_n_per_m = stiffness};
    add(rt::ForceLaw::proxy, springs);
    add(rt::ForceLaw::surface, springs);
    for (const double radius : grid.radii_m) {
      springs.radius_m = radius;
      add(rt::ForceLaw::smooth_springs, springs);
      for (const int count : grid.max_points) {
        springs.max_points = count;
        add(rt::ForceLaw::nearest_springs, springs);
      }
      springs.max_points = rt::SpringParameters{}.max_points;
    }
  }
  return points;
}

config::Result<Shard> parseShard(const std::string& text) {
  const config::Error wrong{"--shard", config::inQuotes(text) + " is not i/n with i from 1 to n",
                            "for example --shard 3/8"};
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos) return std::unexpected(wrong);
  const auto read = [&text](std::size_t first, std::size_t last, std::size_t& value) {
    const auto [end, error] = std::from_chars(text.data() + first, text.data() + last, value);
    return error == std::errc() && end == text.data() + last;
  };
  Shard shard;
  const bool is_read = read(0, slash, shard.number) && read(slash + 1, text.size(), shard.count);
  if (!is_read || shard.number < 1 || shard.number > shard.count) return std::unexpected(wrong);
  return shard;
}

}  // namespace hapticd::tools

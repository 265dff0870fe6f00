// SPDX-License-Identifier: Apache-2.0
// Files of solids: what is accepted is written back as it was, and is finite everywhere.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tests/fuzz/seeds.h"
#include "tests/support/made_solid.h"

std::vector<std::string> seeds() {
  using hapticd::test::ballBytes;
  return {ballBytes(0.005, 0.002), ballBytes(0.003, 0.003)};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto solid = hapticd::config::solidFrom(bytes, "a.solid");
  if (!solid) {
    require(!solid.error().where.empty() && !solid.error().what.empty() && !solid.error().remedy.empty());
    return 0;
  }
  require((*solid)->file() == bytes);
  for (const double x_m : {-20.0, -0.01, 0.0, 0.004, 20.0})
    require(std::isfinite(distanceAt((*solid)->grid(), {x_m, -x_m, 0.5 * x_m}).distance_m));
  return 0;
}

// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/touch.h"

#include <algorithm>

namespace hapticd::tools {

rt::Vec3 Touch::mean_m_in_world() const {
  rt::Vec3 sum;
  for (const rt::Vec3& reading : readings_m_) sum += reading;
  return (1.0 / static_cast<double>(readings_m_.size())) * sum;
}

double Touch::spread_m() const {
  const rt::Vec3 mean = mean_m_in_world();
  double farthest_m = 0;
  for (const rt::Vec3& reading : readings_m_) farthest_m = std::max(farthest_m, rt::norm(reading - mean));
  return farthest_m;
}

}  // namespace hapticd::tools

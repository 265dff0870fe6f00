// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <span>

#include "rt/base/clock.h"
#include "rt/fixtures/distance_grid.h"
#include "rt/fixtures/grid_region.h"
#include "tools/hapticbench/engine/measures.h"
#include "tools/hapticbench/solids/solids.h"
#include "tools/lib/solids/field/sampled_field.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr int kSamples = 128;
constexpr double kSpacing_m = 0.0005, kRadius_m = 0.02;

solids::SampledField bumpyField() {
  solids::SampledField field{{kSamples, kSamples, kSamples}, kSpacing_m, {}, {}};
  field.origin_m = -0.5 * kSpacing_m * (kSamples - 1) * Vec3{1, 1, 1};
  field.distance_m.reserve(field.count());
  for (int z = 0; z < kSamples; ++z)
    for (int y = 0; y < kSamples; ++y)
      for (int x = 0; x < kSamples; ++x) {
        const Vec3 p = field.placeOf(x, y, z);
        const double bump_m = 0.0005 * std::sin(400 * p.x) * std::cos(300 * p.y);
        field.distance_m.push_back(static_cast<float>(norm(p) - kRadius_m + bump_m));
      }
  return field;
}

/// The trilinear value and gradient of the same counts: what the spline is compared with.
rt::GridDistance trilinearAt(const rt::DistanceGrid& grid, const Vec3& place_m) {
  const Vec3 u = (1 / grid.spacing_m) * (place_m - grid.origin_m);
  const auto cell = [](double position, std::uint32_t samples) {
    return std::clamp(static_cast<int>(position), 0, static_cast<int>(samples) - 2);
  };
  const int i = cell(u.x, grid.samples[0]), j = cell(u.y, grid.samples[1]), k = cell(u.z, grid.samples[2]);
  const auto x = static_cast<float>(u.x - i), y = static_cast<float>(u.y - j),
             z = static_cast<float>(u.z - k);
  const std::size_t row = grid.samples[0], slice = row * grid.samples[1];
  const std::int16_t* const at = grid.coefficients + static_cast<std::size_t>(k) * slice +
                                 static_cast<std::size_t>(j) * row + static_cast<std::size_t>(i);
  const auto value = [at](std::size_t index) { return static_cast<float>(at[index]); };
  const float dx00 = value(1) - value(0), dx10 = value(row + 1) - value(row),
              dx01 = value(slice + 1) - value(slice), dx11 = value(slice + row + 1) - value(slice + row);
  const float v00 = value(0) + x * dx00, v10 = value(row) + x * dx10, v01 = value(slice) + x * dx01,
              v11 = value(slice + row) + x * dx11;
  const float v0 = v00 + y * (v10 - v00), v1 = v01 + y * (v11 - v01);
  const float dx0 = dx00 + y * (dx10 - dx00), dx1 = dx01 + y * (dx11 - dx01);
  const float dy0 = v10 - v00, dy1 = v11 - v01;
  const double scale = grid.scale_m, slope = grid.scale_m / grid.spacing_m;
  return {scale * static_cast<double>(v0 + z * (v1 - v0)),
          slope * Vec3{static_cast<double>(dx0 + z * (dx1 - dx0)), static_cast<double>(dy0 + z * (dy1 - dy0)),
                       static_cast<double>(v1 - v0)}};
}

std::vector<Vec3> placesNearSurface(int count) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> component;
  std::uniform_real_distribution<double> off(-0.002, 0.002);
  std::vector<Vec3> places;
  for (int i = 0; i < count; ++i) {
    const Vec3 d{component(random), component(random), component(random)};
    places.push_back(((kRadius_m + off(random)) / norm(d)) * d);
  }
  return places;
}

volatile double used;  // so that no result is optimised away

/// The mean time of a query of each place, one after the other.
template <typename Query>
double timeOf_ns(const std::vector<Vec3>& places, const Query& query) {
  double sum = 0;
  const std::int64_t begin_ns = rt::monotonicNow_ns();
  for (const Vec3& place : places) {
    const rt::GridDistance found = query(place);
    sum += found.distance_m + found.gradient.x + found.gradient.y + found.gradient.z;
  }
  const std::int64_t end_ns = rt::monotonicNow_ns();
  used = sum;
  return static_cast<double>(end_ns - begin_ns) / static_cast<double>(places.size());
}

/// The same queries in turns, each round as warm as `prepare` leaves it.
template <typename Prepare>
QueryCost inTurns(const std::string& name, const rt::DistanceGrid& grid, const std::vector<Vec3>& places,
                  int rounds, const Prepare& prepare) {
  std::vector<double> spline_ns, trilinear_ns;
  for (int round = 0; round < rounds; ++round) {
    prepare(round);
    spline_ns.push_back(timeOf_ns(places, [&](const Vec3& p) { return rt::distanceAt(grid, p); }));
    prepare(round);
    trilinear_ns.push_back(timeOf_ns(places, [&](const Vec3& p) { return trilinearAt(grid, p); }));
  }
  return {name, quantile(spline_ns, 0.5), quantile(trilinear_ns, 0.5)};
}

/// Queries of one place each, from memory that was not read for a while; the clock's own cost is subtracted.
QueryCost coldCost(const rt::DistanceGrid& grid, int rounds) {
  constexpr std::size_t kEvicting = std::size_t{64} << 20;
  std::vector<char> other(kEvicting);
  const auto evict = [&] {
    for (std::size_t i = 0; i < other.size(); i += 64) ++other[i];
    used = other[static_cast<std::size_t>(rt::monotonicNow_ns()) % other.size()];
  };
  const std::vector<Vec3> places = placesNearSurface(rounds);
  std::vector<double> spline_ns, trilinear_ns, clock_ns;
  for (const Vec3& place : places) {
    evict();
    spline_ns.push_back(timeOf_ns({place}, [&](const Vec3& p) { return rt::distanceAt(grid, p); }));
    evict();
    trilinear_ns.push_back(timeOf_ns({place}, [&](const Vec3& p) { return trilinearAt(grid, p); }));
    evict();
    clock_ns.push_back(timeOf_ns({place}, [](const Vec3& p) { return rt::GridDistance{p.x, p}; }));
  }
  const double clock = quantile(clock_ns, 0.5);
  return {"cold", quantile(spline_ns, 0.5) - clock, quantile(trilinear_ns, 0.5) - clock};
}

double eightTicks_ns(const rt::DistanceGrid& grid, int rounds) {
  constexpr int kTicks = 8;
  constexpr double kDepth_m = 0.002, kSpeed_m_per_tick = 1e-4;
  const rt::Shape pose;
  rt::GridMemory memory{};
  Vec3 proxy_m{kRadius_m + 0.002, 0, 0};
  std::vector<double> times_ns;
  int tick = 0;
  const auto hipAt = [&](int at) {
    const double angle = kSpeed_m_per_tick / kRadius_m * at;
    return (kRadius_m - kDepth_m) * Vec3{std::cos(angle), std::sin(angle), 0.1};
  };
  for (int round = 0; round < 10 * rounds; ++round) {
    const std::int64_t begin_ns = rt::monotonicNow_ns();
    for (int i = 0; i < kTicks; ++i)
      proxy_m = rt::followSolid(pose, grid, false, 0, hipAt(++tick), proxy_m, memory).proxy_m_in_world;
    times_ns.push_back(static_cast<double>(rt::monotonicNow_ns() - begin_ns));
  }
  used = proxy_m.x;
  return quantile(times_ns, 0.5);
}

}  // namespace

SolidCost measureSolidCost(int rounds) {
  const auto solid = solids::splineOf(bumpyField(), {.source = "study", .error_m = 0});
  const rt::DistanceGrid& grid = solid->grid();
  const auto nothing = [](int) {};
  constexpr int kFew = 64, kMany = 100'000;
  return {{inTurns("warm, 64 places again and again", grid, placesNearSurface(kFew), 20 * rounds, nothing),
           inTurns("warm, 100,000 places", grid, placesNearSurface(kMany), std::max(1, rounds / 10), nothing),
           coldCost(grid, rounds)},
          eightTicks_ns(grid, rounds)};
}

}  // namespace hapticd::tools

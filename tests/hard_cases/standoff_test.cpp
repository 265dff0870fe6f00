// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "rt/fixtures/fixture_forces.h"
#include "tests/hard_cases/hard_rig.h"
#include "tests/support/recordings/recording.h"

namespace hapticd::test {
namespace {

using rt::FixtureKind;
using rt::Shape;
using rt::ShapeKind;
using rt::Vec3;
using tools::SceneKind;
using tools::TrueScene;

// Stand-off fixtures over the live surface, alone, together with other fixtures, and on recordings.

constexpr double kDistance_m = 1;
constexpr double kClearance_m = 0.005;
constexpr double kStiffness = 1000;

/// A box with fixtures. They have no damping of their own and no limit but the device's.
class FixtureBox {
 public:
  explicit FixtureBox(const rt::DepthModelParameters& depth_model = {})
      : rig(rt::ForceLaw::surface, depth_model) {
    rig.box.setAdditions(set.get(), nullptr);
  }
  rt::Fixture& add(FixtureKind kind, const Shape& shape = {}) {
    rt::Fixture& fixture = set->fixtures[set->count++];
    fixture.identity = set->count;
    fixture.definition = set->count;
    fixture.kind = kind;
    fixture.shape = shape;
    fixture.stiffness_n_per_m = kStiffness;
    fixture.damping_n_s_per_m = 0;
    fixture.max_force_n = 40;
    fixture.fade_in_s = 0;
    ++set->generation;
    if (kind == FixtureKind::standoff) {
      fixture.clearance_m = kClearance_m;
      rig.box.parameters().standoff_clearance_m = kClearance_m;
    }
    return fixture;
  }

  std::unique_ptr<rt::FixtureSet> set = std::make_unique<rt::FixtureSet>();
  HardRig rig;
};

class Places {
 public:
  explicit Places(unsigned seed) : engine_(seed) {}
  double between(double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(engine_);
  }

 private:
  std::mt19937 engine_;
};

TEST(Standoff, ItAndTheSurfaceActOneAfterTheOther) {
  TrueScene plane({.kind = SceneKind::plane, .distance_m = kDistance_m}, fineCameraFor(kDistance_m));
  FixtureBox box(plane.depthModel());
  box.add(FixtureKind::standoff).max_force_n = 2;
  box.rig.show(plane);
  box.rig.jumpTo({0, 0, -kDistance_m + 0.02});
  box.rig.tick(box.rig.hip());
  rt::Tick tick = box.rig.moveTo({0, 0, -kDistance_m + 0.001});
  EXPECT_NEAR(tick.fixture_force_n_in_world.z, 2, 1e-9);
  EXPECT_EQ(tick.law_force_n_in_world, Vec3{});
  tick = box.rig.moveTo({0, 0, -kDistance_m - 0.004});
  EXPECT_NEAR(tick.fixture_force_n_in_world.z, 2, 1e-9) << "its largest force never moves its proxy";
  EXPECT_NEAR(tick.law_force_n_in_world.z, box.rig.stiffness_n_per_m() * 0.004, 0.05)
      << "within the rounding of the camera";
  EXPECT_NEAR(tick.fixture_proxy_m_in_world.z, -kDistance_m + kClearance_m, 1e-4);
}

TEST(Standoff, KeepsOffTheSidesOfABody) {
  TrueScene edge({.kind = SceneKind::half_plane, .distance_m = kDistance_m}, fineCameraFor(kDistance_m));
  FixtureBox box(edge.depthModel());
  box.add(FixtureKind::standoff);
  box.rig.show(edge);
  // from the free side towards the outline at x = 0, at the height of the front
  const double solid_side = edge.signedDistance({0.02, 0, -kDistance_m - 0.01}, 0) < 0 ? 1 : -1;
  box.rig.jumpTo({-solid_side * 0.02, 0, -kDistance_m + 0.0005});
  box.rig.tick(box.rig.hip());
  const rt::Tick tick = box.rig.moveTo({-solid_side * 0.002, 0, -kDistance_m + 0.0005}, 0.0005);
  EXPECT_NEAR(-solid_side * tick.fixture_force_n_in_world.x, kStiffness * (kClearance_m - 0.002), 2.0)
      << "within a pixel, 1.7 mm";
  EXPECT_GT(-solid_side * tick.fixture_force_n_in_world.x, 1);
}

TEST(ForbiddenRegions, NoPushGetsThroughAPlateWithTheLiveSurfaceBehind) {
  TrueScene plane({.kind = SceneKind::plane, .distance_m = kDistance_m, .tilt_rad = 0.2},
                  fineCameraFor(kDistance_m));
  Places random(2);
  constexpr int kPushes = 250;
  for (int i = 0; i < kPushes; ++i) {
    FixtureBox box(plane.depthModel());
    const double gap = random.between(0.001, 0.01);
    Shape plate{.kind = ShapeKind::box, .position_m_in_world = {0, 0, -kDistance_m + gap}};
    plate.half_size_m = {0.3, 0.3, 0.0005};
    const double angle = random.between(-0.3, 0.3);
    plate.rotation = {std::cos(angle), 0, std::sin(angle), 0, 1, 0, -std::sin(angle), 0, std::cos(angle)};
    box.add(FixtureKind::box, plate);
    box.rig.show(plane);
    const Vec3 up{std::sin(angle), 0, std::cos(angle)};
    Vec3 hip{0, 0, -kDistance_m + 0.03};
    box.rig.jumpTo(hip);
    box.rig.tick(hip);
    const double speed_x = random.between(-0.3, 0.3);
    const double speed_y = random.between(-0.3, 0.3);
    rt::Tick tick;
    for (int step = 0; step < 100; ++step) {
      hip += {speed_x * kTick_s, speed_y * kTick_s, -0.0006};
      tick = box.rig.tick(hip);
      if ((tick.fixtures_in_contact & 1U) == 0) continue;
      const double side = dot(tick.fixture_proxy_m_in_world - plate.position_m_in_world, up);
      ASSERT_GT(side, 0.0005 - 1e-6) << "push " << i << " step " << step;
    }
    const bool under_plate = dot(hip - plate.position_m_in_world, up) < 0;
    if (under_plate) {
      ASSERT_TRUE((tick.fixtures_in_contact & 1U) != 0 || rt::isHeld(tick.contact)) << "push " << i;
    }
  }
}

constexpr double kPush_n = 2;
constexpr double kHandDamping = 5;

/// A hand of 0.15 kg that pushes with 2 N along a line.
struct PushingHand {
  Vec3 place_m;
  Vec3 direction;
  Vec3 velocity;
  Vec3 force_n;

  rt::Tick tick(tools::OfflineBox& box) {
    constexpr double kMass_kg = 0.15;
    const double along_n = dot(force_n, direction) + kPush_n - kHandDamping * dot(velocity, direction);
    velocity += (kTick_s / kMass_kg * along_n) * direction;
    place_m += kTick_s * velocity;
    const rt::Tick tick = box.tick(place_m, kTick_s, velocity);
    force_n = tick.command_force_n_in_world;
    return tick;
  }
};

double rawUnit_m(double depth_m) {
  return std::abs(rt::DepthModelParameters{}.a_per_m) * depth_m * depth_m;
}

/// The surface that the pixels around the image of a place measure: a plane through their depths.
struct SeenSurface {
  double depth_m;
  Vec3 normal_in_camera;
};

/// Fits the pixels around the image of a place, or returns nothing beside an outline.
std::optional<SeenSurface> surfaceAround(const rt::DepthModel& model, const rt::DepthFrame& frame,
                                         const Vec3& p) {
  const rt::DepthModelParameters& camera = model.parameters();
  const int column = static_cast<int>(std::lround(camera.cx_px + camera.fx_px * p.x / -p.z));
  const int row = static_cast<int>(std::lround(camera.cy_px - camera.fy_px * p.y / -p.z));
  constexpr int kRadius_px = 4;
  double sum = 0, across = 0, down = 0, squares = 0, columns = 0, rows = 0;
  double nearest = 10, farthest = 0;
  int count = 0;
  for (int r = -kRadius_px; r <= kRadius_px; ++r) {
    for (int c = -kRadius_px; c <= kRadius_px; ++c) {
      const int at_row = row + r;
      const int at_column = column + c;
      if (at_row < 0 || at_row >= drivers::kKinectHeight || at_column < 0 ||
          at_column >= drivers::kKinectWidth)
        return std::nullopt;
      const double depth =
          model.depth_m(std::min<std::uint16_t>(frame.raw[at_row * drivers::kKinectWidth + at_column], 2047));
      if (depth <= 0) continue;
      sum += depth;
      across += depth * c;
      down += depth * r;
      squares += c * c;  // the same for rows
      columns += c;
      rows += r;
      nearest = std::min(nearest, depth);
      farthest = std::max(farthest, depth);
      ++count;
    }
  }
  constexpr int kMinPixels = 60;
  if (count < kMinPixels) return std::nullopt;
  const double mean = sum / count;
  // Missing pixels are few, so rows and columns are still nearly orthogonal and have a mean near zero.
  const double per_column = (across - mean * columns) / squares;
  const double per_row = (down - mean * rows) / squares;
  const double slope_m_per_px = std::hypot(per_column, per_row);
  constexpr double kMaxSpread_raw = 6;  // of the noise; the rest is slope
  if (farthest - nearest >
      kMaxSpread_raw * rawUnit_m(mean) + 2 * kRadius_px * slope_m_per_px * std::numbers::sqrt2)
    return std::nullopt;
  // the plane N * X = 1 with 1 / Z linear in the image, see rt::SurfaceView
  const double w = 1 / mean;
  const double w_u = -per_column * w * w;
  const double w_v = -per_row * w * w;
  const Vec3 plane{w_u * camera.fx_px, w_v * camera.fy_px,
                   w - w_u * (column - camera.cx_px) - w_v * (row - camera.cy_px)};
  return SeenSurface{mean, (1 / norm(plane)) * Vec3{-plane.x, plane.y, plane.z}};
}

/// What one frame shows at the HIP; depth 0: nothing.
struct Sample {
  double depth_m = 0;
  double hip_depth_m = 0;
  double cosine = 0;  ///< of the ray, of depth 1, to the surface's normal
};

constexpr double kAtRest_raw = 1.5;

/// The mean depth around the i-th frame if the surface rests from ten frames before to five frames after it.
std::optional<double> depthAtRest(const std::vector<Sample>& samples, std::size_t i) {
  constexpr std::size_t kBefore = 10;
  constexpr std::size_t kAfter = 5;
  if (i < kBefore || i + kAfter >= samples.size()) return std::nullopt;
  double sum = 0;
  double least = 10;
  double most = 0;
  for (std::size_t k = i - kBefore; k <= i + kAfter; ++k) {
    const double depth = samples[k].depth_m;
    if (depth <= 0) return std::nullopt;
    sum += depth;
    least = std::min(least, depth);
    most = std::max(most, depth);
  }
  const double mean = sum / (kBefore + kAfter + 1);
  return most - least <= kAtRest_raw * rawUnit_m(mean) ? std::optional(mean) : std::nullopt;
}

/// Pushes towards many places of a recording. Wherever the pixels around the HIP have rested for half a
/// second, it must not be nearer to them than the clearance less what the spring allows and the noise.
void pushOnRecording(const std::string& archive) {
  const Recording recording(archive);
  const auto reader = drivers::RecordingReader::open(recording.path());
  ASSERT_TRUE(reader.has_value()) << reader.error().text();
  constexpr std::size_t kFrames = 90;
  const std::size_t frames = std::min(reader->frames().size(), kFrames);
  auto frame = std::make_unique<rt::DepthFrame>();
  int compared = 0;
  constexpr int kPlaces = 36;
  for (int place = 0; place < kPlaces; ++place) {
    FixtureBox box;
    box.add(FixtureKind::standoff);
    const rt::DepthModel& model = box.rig.box.depthModel();
    ASSERT_TRUE(reader->read(0, *frame).has_value());
    const int column = 100 + 40 * (place % 12);
    const int row = 100 + 90 * (place / 12);
    const std::uint16_t raw = std::min<std::uint16_t>(frame->raw[row * drivers::kKinectWidth + column], 2047);
    if (model.depth_m(raw) <= 0 || model.depth_m(raw) > 3.5) continue;
    const Vec3 aim = model.pointInWorld(
        rt::PackedPixel::pack(static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row), raw));
    const std::optional<SeenSurface> start = surfaceAround(model, *frame, model.positionInCamera(aim));
    if (!start) continue;
    // The hand is guided along the surface's normal, so that it does not slide off.
    const Vec3 inward = -model.directionInWorld(start->normal_in_camera);
    PushingHand hand{.place_m = aim - 0.03 * inward, .direction = inward, .velocity = {}, .force_n = {}};
    std::vector<Sample> samples;
    for (std::size_t index = 0; index < frames; ++index) {
      ASSERT_TRUE(reader->read(index, *frame).has_value());
      frame->sequence = index + 1;
      box.rig.box.show(*frame);
      for (int i = 0; i < kTicksPerFrame; ++i) hand.tick(box.rig.box);
      const Vec3 p = model.positionInCamera(hand.place_m);
      const std::optional<SeenSurface> seen = surfaceAround(model, *frame, p);
      const Vec3 ray = (1 / p.z) * p;  // of depth -1
      samples.push_back(seen ? Sample{seen->depth_m, -p.z, dot(ray, seen->normal_in_camera)} : Sample{});
    }
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const std::optional<double> rest_m = depthAtRest(samples, i);
      if (!rest_m) continue;
      const double before_m = (*rest_m - samples[i].hip_depth_m) * samples[i].cosine;
      // Somebody who passes between camera and HIP hides it; it is not pushed through him.
      if (before_m < -box.rig.box.parameters().surface.shell_m) continue;
      ++compared;
      // The part of the noise that stands still has 0.35 raw units (the resting room); four of them, because
      // some hundred places are compared. The surface may have moved by kAtRest_raw meanwhile.
      const double noise_m = (4 * 0.35 + kAtRest_raw) * rawUnit_m(*rest_m);
      ASSERT_GT(before_m, kClearance_m - kPush_n / kStiffness - noise_m)
          << archive << " place " << place << " frame " << i << " at " << *rest_m << " m";
    }
  }
  EXPECT_GT(compared, 50) << archive;
}

TEST(Standoff, HoldsOffTwoNewtonOnEachRecording) {
  pushOnRecording("01_raw11_room_gesture/room_gesture.tar.xz");
  pushOnRecording("02_raw11_desk_near/desk_near.tar.xz");
  pushOnRecording("03_raw11_room_static/room_static.tar.xz");
}

TEST(Standoff, HoldsOffTwoNewtonBeforeAMovingBody) {
  for (const double speed : {0.05, 0.15}) {
    for (const auto noise : {tools::SceneNoise::sensor, tools::SceneNoise::harsh}) {
      TrueScene plane({.kind = SceneKind::plane, .distance_m = kDistance_m, .speed_m_per_s = speed});
      FixtureBox box;
      auto frame = std::make_unique<rt::DepthFrame>();
      box.add(FixtureKind::standoff);
      PushingHand hand{
          .place_m = {0, 0, -kDistance_m + 0.04}, .direction = {0, 0, -1}, .velocity = {}, .force_n = {}};
      double worst_m = 1;
      for (int index = 0; index < 40; ++index) {
        const double shown_s = index * kFrame_s;
        const auto number = static_cast<std::uint64_t>(index) + 1;
        plane.render(shown_s, number, noise, *frame);
        frame->sequence = number;
        frame->arrival_ns = 1'000'000'000 + std::llround(shown_s * 1e9);
        box.rig.box.show(*frame, frame->arrival_ns);
        for (int i = 0; i < kTicksPerFrame; ++i) {
          hand.tick(box.rig.box);
          const double distance = plane.signedDistance(hand.place_m, shown_s + i * kTick_s);
          if (index >= 15) worst_m = std::min(worst_m, distance);
        }
      }
      // the part of the noise that stands still, 0.35 raw units of 3.1 mm, three times
      const double noise_m = 3 * 0.35 * 0.0031;
      const double pushed_n = kPush_n + kHandDamping * speed;
      EXPECT_GT(worst_m, kClearance_m - pushed_n / kStiffness - noise_m)
          << speed << " m/s, noise " << nameOf(noise);
    }
  }
}

// A tick of a stand-off begins with what the last one saw of the surface; here it is compared with ticks that
// have seen nothing.

constexpr double kStartDistance_m = 0.8;
constexpr int kTicks = 1000;
/// A proxy lags behind where distance and normal of the surface disagree, as far as a friction of that share
/// of the force would hold it: with a disagreement of 1e-3 at a depth of 11 mm by 22 um, and where the HIP
/// hardly moves by up to 8e-3 of the depth.
constexpr double kLag_m = 1e-4;

/// A circling stroke through the boundary of the stand-off: 40 mm wide, up to 0.4 m/s, 4 mm up and down.
Vec3 placeAt(int tick) {
  const double angle = 2 * std::numbers::pi * tick * kTick_s;
  return {0.02 * std::sin(3 * angle), 0.02 * std::cos(2 * angle),
          -kStartDistance_m + kClearance_m - 0.002 + 0.004 * std::sin(5 * angle)};
}

/// Fixture forces over a scene, which forget what they saw of the surface before each tick, or do not.
class Standoffs {
 public:
  explicit Standoffs(bool forgets) : forgets_(forgets) {}

  Vec3 proxyAfter(const rt::FixtureInput& input) {
    if (forgets_) {
      auto memory = forces_.memory();
      for (rt::FixtureMemory& fixture : memory.fixtures) fixture.standoff.model = 0;
      forces_.restore(memory);
    }
    return forces_.step(input).proxy_m_in_world;
  }

 private:
  rt::FixtureForces forces_;
  bool forgets_;
};

class StandoffStart : public testing::TestWithParam<SceneKind> {};

TEST_P(StandoffStart, HoldsTheProxyWhereANewLookDoes) {
  TrueScene scene({.kind = GetParam(), .distance_m = kStartDistance_m, .tilt_rad = 0.3, .radius_m = 0.1},
                  fineCameraFor(kStartDistance_m));
  HardRig rig(rt::ForceLaw::surface, scene.depthModel());
  rig.box.parameters().standoff_clearance_m = kClearance_m;
  rig.show(scene);
  const auto fixtures = std::make_unique<rt::FixtureSet>();
  rt::FixtureSet& set = *fixtures;
  set.count = 1;
  set.generation = 1;
  set.fixtures[0].kind = rt::FixtureKind::standoff;
  set.fixtures[0].identity = 1;
  set.fixtures[0].definition = 1;
  set.fixtures[0].clearance_m = kClearance_m;
  Standoffs as_used(false);
  Standoffs anew(true);
  double largest = 0;
  int held = 0;
  for (int i = 0; i < kTicks; ++i) {
    const Vec3 hip = placeAt(i);
    rig.tick(hip);
    const rt::ForceSample law;
    const rt::FixtureInput input{.set = set,
                                 .scene = rig.box.scene(),
                                 .hip_m_in_world = hip,
                                 .velocity_m_per_s_in_world = {},
                                 .parameters = rig.box.parameters(),
                                 .stiffness_n_per_m = rig.box.parameters().force.stiffness_n_per_m,
                                 .law = law,
                                 .surface_law = true,
                                 .period_s = kTick_s};
    const Vec3 used = as_used.proxyAfter(input);
    const Vec3 fresh = anew.proxyAfter(input);
    largest = std::max(largest, norm(used - fresh));
    if (norm(fresh - hip) > 0) ++held;
  }
  EXPECT_LT(largest, kLag_m);
  EXPECT_GT(held, kTicks / 4);
}

// Not at edges and corners: there the nearest of several surfaces changes from look to look.
INSTANTIATE_TEST_SUITE_P(Scenes, StandoffStart,
                         testing::Values(SceneKind::plane, SceneKind::sphere, SceneKind::bowl,
                                         SceneKind::cylinder));

}  // namespace
}  // namespace hapticd::test

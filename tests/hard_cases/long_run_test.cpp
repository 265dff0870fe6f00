// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "rt/laws/force_blend.h"
#include "rt/modelling/occlusion_memory.h"
#include "tests/hard_cases/hard_rig.h"
#include "tests/support/recordings/recording.h"
#include "tests/support/sanitizer.h"

namespace hapticd::test {
namespace {

using rt::Vec3;
using tools::SceneKind;
using tools::TrueScene;

// Ten million ticks of mixed motion and scenes, divided among the laws.

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kTicksPerLaw = 50'000;  // each takes fifty times as long
#else
constexpr int kTicksPerLaw = 2'500'000;
#endif

constexpr double kDistance_m = 0.9;

/// A hand that wanders, rests, darts, presses, leaves the scene and is occasionally invalid.
class WildHand {
 public:
  explicit WildHand(std::uint32_t seed) : random_(seed) {}

  Vec3 next() {
    if (ticks_left_-- <= 0) choose();
    place_ = place_ + velocity_;
    for (double* coordinate : {&place_.x, &place_.y}) {
      if (std::abs(*coordinate) > 0.2) *coordinate *= 0.99;
    }
    if (place_.z > -0.6 || place_.z < -1.2) place_.z += place_.z > -0.9 ? -0.002 : 0.002;
    return odd_ ? Vec3{std::numeric_limits<double>::quiet_NaN(), 1e200, 0} : place_;
  }

 private:
  double within(double limit) { return std::uniform_real_distribution<double>(-limit, limit)(random_); }

  void choose() {
    ticks_left_ = std::uniform_int_distribution<int>(1, 120)(random_);
    const int kind = std::uniform_int_distribution<int>(0, 99)(random_);
    odd_ = kind == 0;
    if (odd_) ticks_left_ = 3;
    if (kind == 1) place_ = {within(0.2), within(0.2), -0.9 + within(0.1)};  // a jump
    const double speed_m_per_tick = kind < 40 ? 0.0003 : kind < 60 ? 0 : kind < 95 ? 0.001 : 0.005;
    velocity_ = {within(speed_m_per_tick), within(speed_m_per_tick), within(speed_m_per_tick)};
  }

  std::mt19937 random_;
  Vec3 place_{0, 0, -0.85};
  Vec3 velocity_;
  int ticks_left_ = 0;
  bool odd_ = false;
};

/// Frames of several scenes, rendered once.
std::vector<std::unique_ptr<rt::DepthFrame>> someFrames() {
  std::vector<std::unique_ptr<rt::DepthFrame>> frames;
  for (const SceneKind kind :
       {SceneKind::plane, SceneKind::sphere, SceneKind::bowl, SceneKind::cylinder, SceneKind::convex_edge,
        SceneKind::half_plane, SceneKind::inner_corner, SceneKind::thin_plate, SceneKind::step}) {
    TrueScene scene({.kind = kind, .distance_m = kDistance_m, .speed_m_per_s = 0.3});
    for (int i = 0; i < 4; ++i) {
      frames.push_back(std::make_unique<rt::DepthFrame>());
      scene.render(i * kFrame_s, static_cast<std::uint64_t>(i) + 1,
                   i < 2 ? tools::SceneNoise::sensor : tools::SceneNoise::quantised, *frames.back());
      frames.back()->arrival_ns = 0;
    }
  }
  return frames;
}

/// Runs the box; `on_tick` is called for every tick. `frame_period_s`: time between the arrivals of two
/// frames.
void run(tools::OfflineBox& box, int ticks, std::uint32_t seed,
         const std::function<void(int, const rt::Tick&)>& on_tick, double frame_period_s = 0) {
  static const auto frames = someFrames();
  WildHand hand(seed);
  std::mt19937 random(seed + 1);
  auto shown = std::make_unique<rt::DepthFrame>();
  std::uint64_t sequence = 0;
  for (int i = 0; i < ticks; ++i) {
    if (i % kTicksPerFrame == 0 && (sequence == 0 || random() % 4 == 0)) {
      *shown = *frames[random() % frames.size()];
      shown->sequence = ++sequence;
      shown->arrival_ns = static_cast<std::int64_t>(1e9 * frame_period_s * static_cast<double>(sequence));
      box.show(*shown);
    }
    on_tick(i, box.tick(hand.next(), kTick_s));
  }
}

TEST_P(EachLaw, KeepsItsLimitsOverMillionsOfRandomTicks) {
  tools::OfflineBox box({}, {}, {});
  box.parameters().law = GetParam();
  const rt::SafetyParameters limits = box.parameters().safety;
  Vec3 before;
  double released_from_n = 0;
  run(box, kTicksPerLaw, 7, [&](int i, const rt::Tick& tick) {
    const Vec3 force = tick.command_force_n_in_world;
    ASSERT_TRUE(isFinite(force)) << "tick " << i;
    ASSERT_TRUE(isFinite(tick.law_force_n_in_world)) << "tick " << i;
    ASSERT_LE(norm(force), limits.max_force_n * (1 + 1e-12)) << "tick " << i;
    if (!tick.released) released_from_n = norm(force);
    const double step_n =
        tick.released ? released_from_n / rt::SafetyChain::kReleaseTicks : limits.max_slew_n_per_s * kTick_s;
    ASSERT_LE(norm(force - before), step_n * (1 + 1e-9)) << "tick " << i;
    ASSERT_NE(tick.mode, rt::Mode::faulted) << "tick " << i;
    before = force;
  });
}

TEST_P(EachLaw, GivesTheSameForcesForTheSameInput) {
  std::vector<Vec3> first;
  tools::OfflineBox one({}, {}, {});
  tools::OfflineBox other({}, {}, {});
  one.parameters().law = other.parameters().law = GetParam();
  constexpr int kTicks = 30'000;
  run(one, kTicks, 11, [&](int, const rt::Tick& tick) { first.push_back(tick.command_force_n_in_world); });
  run(other, kTicks, 11, [&](int i, const rt::Tick& tick) {
    ASSERT_EQ(tick.command_force_n_in_world, first[static_cast<std::size_t>(i)]) << "tick " << i;
  });
}

TEST_P(EachLaw, GivesTheSameForceWhetherTheReachOrTheWholeFrameIsModelled) {
  rt::GridParameters whole;
  whole.extent = rt::ModelExtent::frame;
  tools::OfflineBox reach({}, {}, {});
  tools::OfflineBox frame({}, {}, whole);
  reach.parameters().law = frame.parameters().law = GetParam();
  std::vector<Vec3> first_n;
  constexpr int kTicks = 20'000;
  // Sums of up to 65536 terms in another order. The law proxy fits planes to single-precision positions,
  // which have errors of 2.4e-7 m at up to 4 m from the grid's origin: 1.2e-4 N at 500 N/m, and over a patch
  // of 8 mm a tilt equivalent to 6e-4 N when the HIP is 40 mm deep.
  const double tolerance_n = GetParam() == rt::ForceLaw::proxy ? 1e-3 : 1e-8;
  // Deeper than a hand can push, a proxy may move farther within a tick than the modelled reach.
  constexpr double kMax_n = 20;
  // Surfaces seen in earlier frames are remembered only near the hand, so each frame must count as the first.
  constexpr double kFramePeriod_s = 2 * rt::OcclusionMemory::kMaxGap_s;
  run(
      reach, kTicks, 13, [&](int, const rt::Tick& tick) { first_n.push_back(tick.law_force_n_in_world); },
      kFramePeriod_s);
  int compared = 0;
  run(
      frame, kTicks, 13,
      [&](int i, const rt::Tick& tick) {
        const Vec3& force_n = tick.law_force_n_in_world;
        const Vec3& other_n = first_n[static_cast<std::size_t>(i)];
        if (std::max(norm(force_n), norm(other_n)) > kMax_n) return;
        ++compared;
        ASSERT_LE(norm(force_n - other_n), tolerance_n) << "tick " << i;
      },
      kFramePeriod_s);
  EXPECT_GT(compared, kTicks / 2);
}

// A HIP that is passed by people's hands, or by a ball if no recordings of people are available.

/// Returns the nearest measured point of a frame near the middle of the image.
Vec3 nearestPoint(const rt::DepthModel& model, const rt::DepthFrame& frame) {
  Vec3 nearest{0, 0, -1e9};
  for (int row = 100; row < 380; ++row) {
    for (int column = 140; column < 500; ++column) {
      const std::uint16_t raw =
          std::min<std::uint16_t>(frame.raw[row * drivers::kKinectWidth + column], 2047);
      if (model.depth_m(raw) <= 0) continue;
      const Vec3 point = model.pointInWorld(
          rt::PackedPixel::pack(static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row), raw));
      if (point.z > nearest.z) nearest = point;
    }
  }
  return nearest;
}

void holdInThePathOfHands(rt::ForceLaw law, const std::string& archive) {
  const Recording recording(archive);
  const auto reader = drivers::RecordingReader::open(recording.path());
  ASSERT_TRUE(reader.has_value()) << reader.error().text();
  const std::size_t frames = reader->frames().size();

  // held at the nearest hand in the middle of the recording, so that the hand comes and goes
  auto middle = std::make_unique<rt::DepthFrame>();
  ASSERT_TRUE(reader->read(frames / 2, *middle).has_value());
  tools::OfflineBox box({}, {}, {});
  box.parameters().law = law;
  const double inside_m = rt::hasProxy(law) ? 0.008 : 0;
  const Vec3 nearest = nearestPoint(box.depthModel(), *middle);
  const Vec3 ray = (1 / norm(nearest)) * nearest;
  const Vec3 hip = nearest + inside_m * ray;
  ASSERT_GT(hip.z, -4);

  const rt::SafetyParameters limits = box.parameters().safety;
  const double max_n = box.parameters().force.stiffness_n_per_m * rt::kFastestSurface_m_per_s * kTick_s;
  constexpr double kApproach_m = 0.06;
  Vec3 before;
  int in_contact = 0;
  auto frame = std::make_unique<rt::DepthFrame>();
  for (std::size_t index = 0; index < frames; ++index) {
    ASSERT_TRUE(reader->read(index, *frame).has_value());
    frame->sequence = index + 1;
    box.show(*frame);
    for (int i = 0; i < kTicksPerFrame; ++i) {
      // moved there from the camera's side while the first frame is shown
      const double left = index == 0 ? 1 - static_cast<double>(i + 1) / kTicksPerFrame : 0;
      const rt::Tick tick = box.tick(hip - kApproach_m * left * ray, kTick_s);
      const Vec3 force = tick.command_force_n_in_world;
      ASSERT_TRUE(isFinite(force));
      ASSERT_LE(norm(force), limits.max_force_n * (1 + 1e-12));
      // the HIP is still, so only the scene changes the force
      if (index > 0) {
        ASSERT_LE(norm(force - before), max_n + 1e-9) << "frame " << index << " tick " << i;
      }
      before = force;
      in_contact += rt::inContact(tick) ? 1 : 0;
    }
  }
  EXPECT_GT(in_contact, kTicksPerFrame) << "the hand is touched";
}

TEST_P(EachLaw, HeldInThePathOfAGesturingPersonHasNoForceStep) {
  holdInThePathOfHands(GetParam(), "01_raw11_room_gesture/room_gesture.tar.xz");
}

TEST_P(EachLaw, HeldInThePathOfHandsAtADeskHasNoForceStep) {
  holdInThePathOfHands(GetParam(), "02_raw11_desk_near/desk_near.tar.xz");
}

/// A person who pushes the HIP in and out of what a recording shows, far beyond where the spring saturates,
/// for a minute. People in it push back. No such energy is a sign of an unstable loop.
int debtsWhilePushing(const std::string& archive) {
  const Recording recording(archive);
  const auto reader = drivers::RecordingReader::open(recording.path());
  if (!reader.has_value()) return -1;
  tools::OfflineBox box({}, {}, {});
  box.parameters().law = rt::ForceLaw::surface;
  auto frame = std::make_unique<rt::DepthFrame>();
  Vec3 nearest;
  Vec3 hip;
  int debts = 0;
  constexpr int kFrames = 30 * (kMemoryOfSanitizer ? 5 : 60);
  for (int index = 0; index < kFrames; ++index) {
    const std::size_t count = reader->frames().size();
    if (!reader->read(static_cast<std::size_t>(index) % count, *frame).has_value()) return -1;
    frame->sequence = static_cast<std::uint64_t>(index) + 1;
    box.show(*frame);
    // A person does not follow what flickers from frame to frame.
    const Vec3 now = nearestPoint(box.depthModel(), *frame);
    nearest += (index == 0 ? 1 : 0.1) * (now - nearest);
    const Vec3 ray = (1 / norm(nearest)) * nearest;
    for (int i = 0; i < kTicksPerFrame; ++i) {
      const double time_s = kTick_s * (index * kTicksPerFrame + i);
      const Vec3 aim = nearest + (0.01 + 0.04 * std::sin(2 * std::numbers::pi * 0.7 * time_s)) * ray;
      // as fast as a hand, towards what is nearest now
      constexpr double kHand_m = 0.5 * kTick_s;
      const Vec3 way = aim - hip;
      const Vec3 before = hip;
      hip = index == 0 || norm(way) < kHand_m ? aim : hip + (kHand_m / norm(way)) * way;
      const rt::Tick tick = box.tick(hip, kTick_s, index == 0 ? Vec3{} : (1 / kTick_s) * (hip - before));
      if (tick.cause == rt::Cause::energy_debt && tick.mode == rt::Mode::holding) ++debts;
    }
  }
  return debts;
}

TEST(Recordings, APersonWhoPushesCausesNoDebtOfEnergy) {
  for (const char* archive :
       {"01_raw11_room_gesture/room_gesture.tar.xz", "02_raw11_desk_near/desk_near.tar.xz",
        "03_raw11_room_static/room_static.tar.xz"})
    EXPECT_EQ(debtsWhilePushing(archive), 0) << archive;
}

}  // namespace
}  // namespace hapticd::test

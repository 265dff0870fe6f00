// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "rt/laws/force_blend.h"
#include "tests/hard_cases/hard_rig.h"
#include "tests/support/recordings/recording.h"
#include "tests/support/sanitizer.h"

// A HIP that is passed by people's hands, or by a ball if no recordings of people are available.
namespace hapticd::test {
namespace {

using rt::Vec3;

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

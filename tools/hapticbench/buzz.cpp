// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/buzz.h"

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "config/settings/settings.h"
#include "drivers/handle/simulated/device_and_hand.h"
#include "drivers/handle/velocity_estimator.h"
#include "tools/hapticbench/engine/spectrum.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/body_scene.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kPeriod_s = 0.001;
constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr long kSettle_ticks = 2500;  // the law has seen its frames, and the device has come to rest
constexpr long kMeasured_ticks = 9 * static_cast<long>(Spectrum::kSegment) / 2;  // 8 segments, 4.6 s
constexpr double kStart_m = 0.02;                                                // before the surface
constexpr double kTarget_m = 0.014;  // of the hand, behind it: 4 mm deep at 500 N/m against 200 N/m
constexpr double kBreath_m = 0.01;   // amplitude of the breathing, 20 mm from end to end
constexpr double kApproach_m_per_s = 0.1;
constexpr double kEncoder_m = 5e-5;
constexpr double kStrokeReach_m = 0.03;
constexpr double kStroke_m_per_s = 0.1;
constexpr double kTilt_rad = 0.3;
constexpr double kBeyond_m = 0.15;
constexpr int kSubSteps = 20;

const drivers::DeviceAndHand kDevice{.mass_kg = 0.045,
                                     .damping_n_s_per_m = 0.05,
                                     .coulomb_friction_n = 0.05,
                                     .hand_stiffness_n_per_m = 200,
                                     .hand_damping_n_s_per_m = 4};

rt::DepthModelParameters cameraOf(const BuzzCase& buzz) {
  return buzz.without == BuzzWithout::noise ? fineDepthModelAround(buzz.distance_m, kBeyond_m)
                                            : rt::DepthModelParameters{};
}

/// A plane whose normal is z, off the middle of the image, tilted about an oblique axis.
RigidFrame surfaceAt(double distance_m) {
  const Vec3 tilt = kTilt_rad * unitOf(Vec3{1, 0.4, 0});
  return {{0.021 * distance_m, 0.013 * distance_m, -distance_m},
          turned({1, 0, 0}, tilt),
          turned({0, 1, 0}, tilt),
          turned({0, 0, 1}, tilt)};
}

BodyScene sceneOf(const BuzzCase& buzz) {
  BodyMotion motion;
  if (buzz.scene == BuzzScene::breathing) motion.beat = {.hz = 0.25, .amplitudes_m = {kBreath_m}};
  return {{ConvexBody{{{{0, 0, 1}, 0}}}}, surfaceAt(buzz.distance_m), motion, cameraOf(buzz), buzz.seed};
}

/// Where the hand leads the device along the surface: to and fro at constant speed.
double alongAt_m(const BuzzCase& buzz, long tick) {
  if (buzz.hand == BuzzHand::still || tick < kSettle_ticks / 2) return 0;
  const double travelled_m = kStroke_m_per_s * kPeriod_s * static_cast<double>(tick - kSettle_ticks / 2);
  const double turn =
      std::fmod(travelled_m / (4 * kStrokeReach_m) + 0.25, 1.0);  // 0.25: in the middle, going on
  return kStrokeReach_m * (1 - 4 * std::abs(turn - 0.5));
}

/// Force, device and hand, tick by tick.
class BuzzLoop {
 public:
  explicit BuzzLoop(const BuzzCase& buzz)
      : buzz_(buzz),
        surface_(surfaceAt(buzz.distance_m)),
        scene_(sceneOf(buzz)),
        box_(shippedBox(buzz.law, buzz.distance_m, cameraOf(buzz))),
        tracker_(buzz.without == BuzzWithout::encoder ? 0 : kEncoder_m),
        velocity_(config::HandleSettings{}.resolution_m),
        motion_(kDevice, kPeriod_s, kSubSteps) {
    if (buzz.without == BuzzWithout::damping) {
      box_->parameters().contact.damping_n_s_per_m = 0;
      box_->parameters().safety.contact_damping = rt::ContactDamping::off;
    }
    motion_.place(kStart_m, 0);
  }

  /// The next tick's command.
  Vec3 tick() {
    showFrame();
    const std::int64_t now_ns = (tick_ + 1) * kPeriod_ns;
    const Vec3 measured = tracker_.add(measuredPosition_m(), now_ns);
    const Vec3 velocity = velocity_.add(measured, now_ns);
    const Vec3 command_n = box_->tick(measured, kPeriod_s, velocity).command_force_n_in_world;
    // a surface that breathes comes towards the hand by twice that from where it begins
    const double deepest_m = kTarget_m - (buzz_.scene == BuzzScene::breathing ? kBreath_m : 0);
    const double target_m =
        std::max(kStart_m - kApproach_m_per_s * kPeriod_s * static_cast<double>(tick_), -deepest_m);
    motion_.advance(dot(command_n, surface_.z), 0, target_m);
    ++tick_;
    return command_n;
  }

 private:
  void showFrame() {
    if (tickOfRegularFrame(next_frame_) > tick_) return;
    const bool frozen = buzz_.without == BuzzWithout::frames && tick_ >= kSettle_ticks;
    if (!frozen) {
      const double t_s = kPeriod_s * static_cast<double>(tick_);
      const SceneNoise noise = buzz_.without == BuzzWithout::noise ? SceneNoise::none : SceneNoise::harsh;
      rt::DepthFrame& frame = frames_[static_cast<std::size_t>(next_frame_ % 2)];
      scene_.render(t_s, static_cast<std::uint64_t>(next_frame_) + 1, noise, frame);
      frame.arrival_ns = tick_ * kPeriod_ns;
      frozen_ = &frame;
      box_->show(frame, tick_ * kPeriod_ns);
    } else if (frozen_ != nullptr) {
      box_->show(*std::exchange(frozen_, nullptr));
    }
    ++next_frame_;
  }

  Vec3 measuredPosition_m() const {
    const Vec3 exact = surface_.positionOut({alongAt_m(buzz_, tick_), 0, motion_.position_m()});
    if (buzz_.without == BuzzWithout::encoder) return exact;
    const auto rounded = [](double value) { return kEncoder_m * std::round(value / kEncoder_m); };
    return {rounded(exact.x), rounded(exact.y), rounded(exact.z)};
  }

  const BuzzCase& buzz_;
  RigidFrame surface_;
  BodyScene scene_;
  std::unique_ptr<OfflineBox> box_;
  drivers::PositionTracker tracker_;
  drivers::VelocityEstimator velocity_;
  drivers::Motion motion_;
  std::vector<rt::DepthFrame> frames_ = std::vector<rt::DepthFrame>(2);
  const rt::DepthFrame* frozen_ = nullptr;  ///< the newest frame while others may come
  int next_frame_ = 0;
  long tick_ = 0;
};

}  // namespace

std::string_view nameOf(BuzzHand hand) {
  constexpr std::array<std::string_view, 2> kNames{"still", "stroking"};
  return kNames.at(static_cast<std::size_t>(hand));
}

std::string_view nameOf(BuzzScene scene) {
  constexpr std::array<std::string_view, 2> kNames{"still", "breathing"};
  return kNames.at(static_cast<std::size_t>(scene));
}

std::string_view nameOf(BuzzWithout without) {
  constexpr std::array<std::string_view, 5> kNames{"nothing", "noise", "encoder", "frames", "damping"};
  return kNames.at(static_cast<std::size_t>(without));
}

BuzzResult runBuzz(const BuzzCase& buzz) {
  BuzzLoop loop(buzz);
  for (long i = 0; i < kSettle_ticks; ++i) loop.tick();
  std::array<std::vector<double>, 3> command_n;
  BuzzResult result;
  for (long i = 0; i < kMeasured_ticks; ++i) {
    const Vec3 now = loop.tick();
    command_n[0].push_back(now.x);
    command_n[1].push_back(now.y);
    command_n[2].push_back(now.z);
    result.mean_force_n += norm(now) / kMeasured_ticks;
  }
  Spectrum spectrum(command_n[0], 1 / kPeriod_s);
  spectrum.add(Spectrum(command_n[1], 1 / kPeriod_s));
  spectrum.add(Spectrum(command_n[2], 1 / kPeriod_s));
  result.rms_n = spectrum.rms(kBuzzLow_hz, kBuzzHigh_hz);
  const Spectrum::Line line = spectrum.largestLine(kBuzzLow_hz, kBuzzHigh_hz);
  result.line_n = line.amplitude;
  result.line_hz = line.frequency_hz;
  return result;
}

}  // namespace hapticd::tools

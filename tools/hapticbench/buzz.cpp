// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "config/settings/settings.h"
#include "drivers/handle/simulated/simulated_hand.h"
#include "drivers/handle/velocity_estimator.h"
#include "tools/hapticbench/engine/study.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/body_scene.h"

namespace hapticd::tools {
namespace {

/// What a hand does with a device on a surface.
enum class BuzzHand : std::uint8_t {
  still,     ///< presses
  stroking,  ///< presses and strokes to and fro at 0.1 m/s
};
constexpr auto wordsOf(BuzzHand) {
  return rt::words<BuzzHand>("still", "stroking");
}

enum class BuzzScene : std::uint8_t {
  still,
  breathing,  ///< 20 mm from end to end, 0.25 Hz, along the optical axis
};
constexpr auto wordsOf(BuzzScene) {
  return rt::words<BuzzScene>("still", "breathing");
}

/// One cause of vibration is left out.
enum class BuzzWithout : std::uint8_t {
  nothing,  ///< all is as shipped
  noise,    ///< of the camera: exact depth
  encoder,  ///< the position is not rounded
  frames,   ///< no new frame comes once contact has settled; the last one counts as new. Not of a scene that
            ///< moves, which would be two changes at once
  damping,  ///< of contact
};
constexpr auto wordsOf(BuzzWithout) {
  return rt::words<BuzzWithout>("nothing", "noise", "encoder", "frames", "damping");
}

struct BuzzCase {
  std::string law = "auto";  ///< of kProxyLawChoices
  double distance_m = 1;
  BuzzHand hand = BuzzHand::still;
  BuzzScene scene = BuzzScene::still;
  BuzzWithout without = BuzzWithout::nothing;
  std::uint32_t seed = 1;
};

/// What a person feels as vibration: from 60 to 500 Hz.
constexpr double kBuzzLow_hz = 60;
constexpr double kBuzzHigh_hz = 500;

/// The command after the whole safety chain, once contact has settled.
struct BuzzResult {
  double rms_n = 0;         ///< within the band, of all three directions together
  double line_n = 0;        ///< amplitude of the largest sine there
  double line_hz = 0;       ///< its frequency
  double mean_force_n = 0;  ///< mean magnitude, which shows that there was contact
};

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

/// A simulated device of 45 g with friction of 0.05 N and an encoder with steps of 50 um, held by a hand
/// (200 N/m, 4 N s/m) whose target is behind a plane with the harsher noise, so that contact is 4 mm deep, 1
/// to 7 mm where the plane breathes: the force never reaches the limit, which would hide what it does. The
/// device moves freely along the normal; along the surface the hand leads it. 1 kHz, 30 frames per
/// second.
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

struct BuzzOptions {
  std::vector<std::string> laws{"auto"};
  std::vector<double> distances_m{0.6, 1, 1.2};
  std::vector<BuzzHand> hands = everyOne<BuzzHand>();
  std::vector<BuzzScene> scenes = everyOne<BuzzScene>();
  std::vector<BuzzWithout> without = everyOne<BuzzWithout>();
  std::uint32_t seed = 1;
};

struct BuzzRow {
  BuzzCase buzz;
  BuzzResult result;
};

std::vector<BuzzRow> measureBuzz(const BuzzOptions& options) {
  std::vector<BuzzCase> cases{{.seed = options.seed}};
  cases = varied(cases, &BuzzCase::law, options.laws);
  cases = varied(cases, &BuzzCase::distance_m, options.distances_m);
  cases = varied(cases, &BuzzCase::hand, options.hands);
  cases = varied(cases, &BuzzCase::scene, options.scenes);
  cases = varied(cases, &BuzzCase::without, options.without);
  std::vector<BuzzRow> rows;
  for (const BuzzCase& one : cases) {
    if (one.without == BuzzWithout::frames && one.scene != BuzzScene::still) continue;
    showProgress(fmt::format("{} at {} m, without {}", one.law, one.distance_m, nameOf(one.without)));
    rows.push_back({one, runBuzz(one)});
  }
  return rows;
}

constexpr const char* kBuzzExplanation =
    "A simulated device of 45 g (encoder 50 um, friction 0.05 N) in a hand, about 4 mm deep in a plane with "
    "the\n"
    "harsher noise, still and stroking at 0.1 m/s; breathing: 20 mm, 0.25 Hz. The command behind the whole\n"
    "safety chain from 60 to 500 Hz (Welch, Hann window, 1024 ms): RMS, and amplitude of the largest line.\n"
    "without: what is left out, to show what causes it; frames: the picture stands still.\n\n";

Row buzzCells(const BuzzRow& r) {
  return {{"/law", "law", 0, r.buzz.law},
          {"/distance_m", "m", 2, r.buzz.distance_m},
          {"/hand", "hand", 0, nameOf(r.buzz.hand)},
          {"/scene", "scene", 0, nameOf(r.buzz.scene)},
          {"/without", "without", 0, nameOf(r.buzz.without)},
          {"/rms_n", "RMS mN", 1, r.result.rms_n, 1000},
          {"/line_n", "line mN", 1, r.result.line_n, 1000},
          {"/line_hz", "at Hz", 0, r.result.line_hz},
          {"/mean_force_n", "force N", 2, r.result.mean_force_n}};
}

std::vector<Limit> buzzLimits(const BuzzRow& r) {
  const bool applies = r.buzz.distance_m <= 1.2;
  return {{"vibration of the command, 60 to 500 Hz, to 1.2 m, mN RMS", applies, 1000 * r.result.rms_n, 10},
          {"its largest line, mN", applies, 1000 * r.result.line_n, 5}};
}

}  // namespace

StudyCommand buzzCommand(CLI::App& app) {
  const auto options = std::make_shared<BuzzOptions>();
  StudyCommand command(app, "buzz", "vibration of the command in contact, and what causes it");
  command.quick("a hand that strokes over a still plane at 1 m, as shipped", [options] {
    options->distances_m = {1};
    options->hands = {BuzzHand::stroking};
    options->scenes = {BuzzScene::still};
    options->without = {BuzzWithout::nothing};
  });
  command.names("--laws", options->laws, kProxyLawChoices, "auto");
  command.numbers("--distances", options->distances_m, 0.6, 3.0, "of the plane, metres (0.6,1,1.2)");
  command.choices("--hands", options->hands, kAllOf<BuzzHand>, "all");
  command.choices("--scenes", options->scenes, kAllOf<BuzzScene>, "all");
  command.choices("--without", options->without, kAllOf<BuzzWithout>, "all");
  command.seed(options->seed, "of the noise (1)");
  command.onReport([options] {
    const std::vector<BuzzRow> rows = measureBuzz(*options);
    Report report;
    report.say(kBuzzExplanation);
    report.table("rows", "", rowsOf(rows, buzzCells));
    report.requirements(checked(
        options->laws, rows,
        [](const BuzzRow& r, const std::string& law) {
          return r.buzz.law == law && r.buzz.without == BuzzWithout::nothing;
        },
        buzzLimits,
        [](const BuzzRow& r) {
          return fmt::format("{:g} m, hand {}, scene {}", r.buzz.distance_m, nameOf(r.buzz.hand),
                             nameOf(r.buzz.scene));
        }));
    return report;
  });
  return command;
}

}  // namespace hapticd::tools

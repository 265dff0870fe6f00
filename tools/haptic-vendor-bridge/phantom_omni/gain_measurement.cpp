// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-vendor-bridge/phantom_omni/gain_measurement.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace hapticd::tools::phantom_omni {
namespace {

constexpr double kGravity_m_per_s2 = 9.80665;
constexpr double kDegree_rad = std::numbers::pi / 180;
constexpr double kRampPerStep = GainMeasurement::kCountsPerS * BenchArm::kStep_s;

constexpr PerJoint<const char*> kNames{"waist", "shoulder", "elbow"};
/// The direction away from where the mass pulls: to the left, up, up.
constexpr PerJoint<double> kAway{-1, 1, 1};
/// A hanging forearm bears no load: the mass counts only once it is held out.
constexpr double kElbowMark_rad = 0.6;

base::Error wrong(std::size_t joint, const std::string& what, const std::string& remedy) {
  return {kNames[joint], what, remedy + "; nothing was stored"};
}

/// How far the joint has gone away from its rest.
double goneOf(std::size_t joint, const JointAngles& angles_rad, const JointAngles& rest_rad) {
  return kAway[joint] * (angles_rad[joint] - rest_rad[joint]);
}

}  // namespace

double GainMeasurement::Sweep::friction_counts() const {
  return std::abs(up_counts - down_counts) / 2;
}

base::Result<OmniCalibration> GainMeasurement::run() {
  PerJoint<Unloaded> unloaded;
  const auto measureAlone = [&](std::size_t joint) -> base::Result<void> {
    const auto measured = measureUnloaded(joint);
    if (!measured) return std::unexpected(measured.error());
    unloaded[joint] = *measured;
    return {};
  };
  OmniCalibration calibration;
  const auto measureGain = [&](std::size_t joint) -> base::Result<Loaded> {
    const auto loaded = measureLoaded(joint, unloaded[joint]);
    if (!loaded) return loaded;
    calibration.n_m_per_count[joint] = loaded->n_m_per_count;
    person_.say(fmt::format("{}: {:.3g} N m for a count", kNames[joint], loaded->n_m_per_count));
    return loaded;
  };
  const std::string mass = fmt::format("the mass of {:.3f} kg", mass_kg_);

  if (auto ok = ask(
          "Take everything off the stylus. Lay the upper arm down to its lower stop, in the middle, let the "
          "forearm hang, and let go.");
      !ok)
    return std::unexpected(ok.error());
  for (const std::size_t joint : {kShoulder, kElbow}) {
    if (auto ok = measureAlone(joint); !ok) return std::unexpected(ok.error());
  }
  if (auto ok = ask(fmt::format("Hang {} from the stylus, let it come to rest, and let go.", mass)); !ok)
    return std::unexpected(ok.error());
  const auto shoulder = measureGain(kShoulder);
  if (!shoulder) return std::unexpected(shoulder.error());
  const auto releases = releasesWithoutPackets(*shoulder);
  if (!releases) return std::unexpected(releases.error());
  calibration.releases_without_packets = *releases;
  if (auto ok = measureGain(kElbow); !ok) return std::unexpected(ok.error());

  if (auto ok = ask("Take the mass off. Turn the arm to the middle, and let go."); !ok)
    return std::unexpected(ok.error());
  if (auto ok = measureAlone(kWaist); !ok) return std::unexpected(ok.error());
  if (auto ok = ask(
          fmt::format("Lead a string from the stylus level to your right over a pulley and hang {} on it, so "
                      "that the arm turns to its right stop and the string leaves it at a right angle, seen "
                      "from above. Let go.",
                      mass));
      !ok)
    return std::unexpected(ok.error());
  if (auto ok = measureGain(kWaist); !ok) return std::unexpected(ok.error());
  return calibration;
}

base::Result<void> GainMeasurement::ask(const std::string& request) {
  if (person_.isReady(request)) return {};
  return std::unexpected(base::Error{"calibration", "was given up; nothing was stored", ""});
}

base::Result<JointAngles> GainMeasurement::stepOf(std::size_t joint, double counts) {
  if (person_.givesUp())
    return std::unexpected(base::Error{"calibration", "was given up; nothing was stored", ""});
  PerJoint<int> all{};
  all[joint] = static_cast<int>(std::lround(counts));
  return arm_.step(all);
}

base::Result<JointAngles> GainMeasurement::awaitRest() {
  constexpr double kStill_rad = 0.1 * kDegree_rad;
  constexpr int kStillSteps = static_cast<int>(0.4 / BenchArm::kStep_s);
  constexpr int kMostSteps = static_cast<int>(20 / BenchArm::kStep_s);
  JointAngles still_rad{};
  for (int step = 0, since = 0; step < kMostSteps; ++step) {
    const auto angles_rad = stepOf(kWaist, 0);
    if (!angles_rad) return angles_rad;
    for (std::size_t joint = 0; joint < still_rad.size(); ++joint) {
      if (step > 0 && std::abs((*angles_rad)[joint] - still_rad[joint]) <= kStill_rad) continue;
      still_rad = *angles_rad;
      since = step;
      break;
    }
    if (step - since >= kStillSteps) return angles_rad;
  }
  return std::unexpected(
      base::Error{"arm", "does not come to rest; nothing was stored", "let go of it, and calm the mass"});
}

base::Result<GainMeasurement::Sweep> GainMeasurement::undisturbedSweep(std::size_t joint, int sign) {
  constexpr int kTries = 5;
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const std::uint64_t late = arm_.lateSteps();
    auto done = sweep(joint, sign);
    if (arm_.lateSteps() == late) return done;
  }
  return std::unexpected(base::Error{"calibration", "this computer is too busy for it; nothing was stored",
                                     "end other programs"});
}

base::Result<GainMeasurement::Sweep> GainMeasurement::sweep(std::size_t joint, int sign) {
  const auto rest_rad = awaitRest();
  if (!rest_rad) return std::unexpected(rest_rad.error());
  Sweep sweep;
  if (auto ok = goAway(joint, sign, *rest_rad, sweep); !ok) return std::unexpected(ok.error());
  if (sweep.end != Sweep::End::came_back) return sweep;
  if (auto ok = comeBack(joint, sign, *rest_rad, sweep); !ok) return std::unexpected(ok.error());
  return sweep;
}

base::Result<void> GainMeasurement::goAway(std::size_t joint, int sign, const JointAngles& rest_rad,
                                           Sweep& sweep) {
  const double mark_rad =
      joint == kElbow ? std::max(kDegree_rad, kElbowMark_rad - rest_rad[kElbow]) : kDegree_rad;
  for (double counts = 0; counts <= kMostRampCounts; counts += kRampPerStep) {
    const auto angles_rad = stepOf(joint, sign * counts);
    if (!angles_rad) return std::unexpected(angles_rad.error());
    const double gone_rad = goneOf(joint, *angles_rad, rest_rad);
    if (gone_rad < -kDegree_rad) {
      sweep.end = Sweep::End::went_the_other_way;
      return {};
    }
    if (gone_rad < mark_rad) continue;
    sweep.end = Sweep::End::came_back;
    sweep.up_counts = sign * counts;
    sweep.up_rad = *angles_rad;
    return {};
  }
  return {};
}

base::Result<void> GainMeasurement::comeBack(std::size_t joint, int sign, const JointAngles& rest_rad,
                                             Sweep& sweep) {
  constexpr double kMostOver_rad = 0.5;  // beyond where it was when its counts began to fall
  const double turned_rad = goneOf(joint, sweep.up_rad, rest_rad);
  double farthest_rad = turned_rad;
  for (double counts = sign * sweep.up_counts; counts >= -kMostRampCounts; counts -= kRampPerStep) {
    const auto angles_rad = stepOf(joint, sign * counts);
    if (!angles_rad) return std::unexpected(angles_rad.error());
    const double gone_rad = goneOf(joint, *angles_rad, rest_rad);
    farthest_rad = std::max(farthest_rad, gone_rad);
    if (farthest_rad > turned_rad + kMostOver_rad)
      return std::unexpected(wrong(joint, "runs away", "let nothing push it, and calibrate again"));
    if (gone_rad > farthest_rad - kDegree_rad) continue;
    sweep.down_counts = sign * counts;
    sweep.down_rad = *angles_rad;
    return {};
  }
  return std::unexpected(wrong(joint, "does not come back", "let nothing hold it, and calibrate again"));
}

base::Result<GainMeasurement::Unloaded> GainMeasurement::measureUnloaded(std::size_t joint) {
  person_.say(fmt::format("Moving the {} without the mass.", kNames[joint]));
  for (const int sign : {1, -1}) {
    const auto moved = undisturbedSweep(joint, sign);
    if (!moved) return std::unexpected(moved.error());
    if (moved->end == Sweep::End::came_back) return Unloaded{sign, *moved};
  }
  return std::unexpected(
      wrong(joint, fmt::format("its gain is not found: {} counts do not move it", kMostRampCounts),
            "let nothing hold it, and see that the device is switched on"));
}

base::Result<GainMeasurement::Loaded> GainMeasurement::measureLoaded(std::size_t joint,
                                                                     const Unloaded& unloaded) {
  person_.say(fmt::format("Moving the {} with the mass.", kNames[joint]));
  const auto loaded = undisturbedSweep(joint, unloaded.sign);
  if (!loaded) return std::unexpected(loaded.error());
  if (loaded->end == Sweep::End::did_not_move)
    return std::unexpected(
        wrong(joint, fmt::format("{} counts do not move the mass", kMostRampCounts), "take a lighter mass"));
  constexpr double kTurned_rad = 0.2;
  if (joint == kWaist && loaded->up_rad[kWaist] < kTurned_rad)
    return std::unexpected(
        wrong(joint, "the mass has not turned it to the right", "lead the string to the right"));
  const double held_counts = loaded->mean_counts() - unloaded.sweep.mean_counts();
  if (loaded->end == Sweep::End::went_the_other_way || held_counts * unloaded.sign <= 0)
    return std::unexpected(wrong(joint,
                                 "its sign is inconsistent: the mass pulls the other way than it should",
                                 "hang the mass as it is asked for"));
  const double friction_counts = std::max(loaded->friction_counts(), unloaded.sweep.friction_counts());
  if (friction_counts >= std::abs(held_counts))
    return std::unexpected(
        wrong(joint,
              fmt::format("its friction of {:.0f} counts is larger than the load of {:.0f}", friction_counts,
                          std::abs(held_counts)),
              "take a heavier mass"));
  const double load_n_m =
      (loadTorque_n_m(joint, loaded->up_rad) + loadTorque_n_m(joint, loaded->down_rad)) / 2;
  const double n_m_per_count = load_n_m / held_counts;
  if (!isPlausibleGain(n_m_per_count))
    return std::unexpected(wrong(joint,
                                 fmt::format("its gain of {:.3g} N m for a count is not within {:g} and {:g}",
                                             std::abs(n_m_per_count), kLeastGain_n_m, kMostGain_n_m),
                                 "see that --mass is the mass that hangs there"));
  return Loaded{n_m_per_count, loaded->mean_counts()};
}

/// The torque that holds the mass.
double GainMeasurement::loadTorque_n_m(std::size_t joint, const JointAngles& angles_rad) const {
  const double weight_n = mass_kg_ * kGravity_m_per_s2;
  const rt::Vec3 lever_m = jacobianAt(angles_rad)[joint];
  return kAway[joint] * weight_n * (joint == kWaist ? norm(lever_m) : lever_m.y);
}

base::Result<bool> GainMeasurement::releasesWithoutPackets(const Loaded& shoulder) {
  constexpr double kPause_s = 0.1;
  constexpr double kFallen_rad = kDegree_rad;
  constexpr int kTries = 5;
  person_.say("Holding the mass up without packets for 0.1 s: it should fall.");
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const auto rest_rad = awaitRest();
    if (!rest_rad) return std::unexpected(rest_rad.error());
    const std::uint64_t late = arm_.lateSteps();
    const auto held_rad = holdUp(shoulder, *rest_rad);
    if (!held_rad) return std::unexpected(held_rad.error());
    if (*held_rad < 2 * kFallen_rad || arm_.lateSteps() != late) continue;
    const auto after_rad = arm_.pausePackets(kPause_s);
    if (!after_rad) return std::unexpected(after_rad.error());
    return *held_rad - goneOf(kShoulder, *after_rad, *rest_rad) >= kFallen_rad;
  }
  return std::unexpected(
      wrong(kShoulder, "cannot hold the mass up for the test without packets", "take a lighter mass"));
}

/// Returns how far above its rest the shoulder stands still; 0: it does not.
base::Result<double> GainMeasurement::holdUp(const Loaded& shoulder, const JointAngles& rest_rad) {
  constexpr double kUp_rad = 4 * kDegree_rad;
  constexpr double kUp_s = 1;
  constexpr double kHold_s = 1.5;
  constexpr double kStill_rad = 0.5 * kDegree_rad;
  constexpr double kStiffness_n_m = 0.5;
  constexpr double kDamping_n_m_s = 0.03;
  constexpr int kSteps = static_cast<int>((kUp_s + kHold_s) / BenchArm::kStep_s);
  constexpr int kLook = static_cast<int>(0.1 / BenchArm::kStep_s);  // over which it is still at the end
  double gone_rad = 0;
  double velocity_rad_per_s = 0;
  double looked_rad = 0;
  double counts = 0;
  for (int step = 0; step < kSteps; ++step) {
    const auto angles_rad = stepOf(kShoulder, counts);
    if (!angles_rad) return std::unexpected(angles_rad.error());
    const double now_rad = goneOf(kShoulder, *angles_rad, rest_rad);
    constexpr double kSmoothing = 0.1;
    velocity_rad_per_s += kSmoothing * ((now_rad - gone_rad) / BenchArm::kStep_s - velocity_rad_per_s);
    gone_rad = now_rad;
    if (step == kSteps - kLook) looked_rad = gone_rad;
    const double wanted_rad = kUp_rad * std::min(1.0, step * BenchArm::kStep_s / kUp_s);
    const double more_n_m = kStiffness_n_m * (wanted_rad - gone_rad) - kDamping_n_m_s * velocity_rad_per_s;
    counts = std::clamp(shoulder.mean_counts + more_n_m / shoulder.n_m_per_count, -double{kMostRampCounts},
                        double{kMostRampCounts});
  }
  return std::abs(gone_rad - looked_rad) <= kStill_rad ? gone_rad : 0;
}

}  // namespace hapticd::tools::phantom_omni

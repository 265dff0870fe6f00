// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/phantom_omni/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string_view>
#include <system_error>

#include "config/base/file_content.h"
#include "config/base/whole_file.h"

namespace hapticd::tools::phantom_omni {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kFormat = "haptic-vendor-bridge calibration phantom-omni 1";
constexpr const char* kAgain = "calibrate the device again: haptic-bridge calibrate phantom-omni";

std::string_view variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

std::unexpected<base::Error> unusable(const std::filesystem::path& file, const std::string& what) {
  return std::unexpected(base::Error{file.string(), what, kAgain});
}

/// What is wrong with a calibration; empty: it was taken over.
std::string take(const Json& json, OmniCalibration& calibration) {
  if (!json.is_object()) return "is not a JSON object";
  if (json.value("format", Json()) != kFormat) return fmt::format("its format is not \"{}\"", kFormat);
  const Json serial = json.value("serial", Json());
  if (!serial.is_string()) return "serial is not a text";
  const Json gains = json.value("nMPerCount", Json());
  if (!gains.is_array() || gains.size() != calibration.n_m_per_count.size())
    return "nMPerCount is not a list of three numbers";
  const Json releases = json.value("releasesWithoutPackets", Json());
  if (!releases.is_boolean()) return "releasesWithoutPackets is neither true nor false";
  for (std::size_t joint = 0; joint < gains.size(); ++joint) {
    if (!gains[joint].is_number()) return "nMPerCount is not a list of three numbers";
    calibration.n_m_per_count[joint] = gains[joint].get<double>();
  }
  if (!std::ranges::all_of(calibration.n_m_per_count, isPlausibleGain))
    return fmt::format("nMPerCount is not within {} and {} N m", kLeastGain_n_m, kMostGain_n_m);
  calibration.serial = serial.get<std::string>();
  calibration.releases_without_packets = releases.get<bool>();
  return {};
}

}  // namespace

bool isPlausibleGain(double n_m_per_count) {
  return std::abs(n_m_per_count) >= kLeastGain_n_m && std::abs(n_m_per_count) <= kMostGain_n_m;
}

base::Result<std::filesystem::path> calibrationFile(const std::string& file, const std::string& serial) {
  if (!file.empty()) return file;
  const std::string name = fmt::format("phantom-omni-{}.json", serial);
  const std::string_view services = variable("STATE_DIRECTORY");  // of systemd; a list with colons
  if (!services.empty()) return std::filesystem::path(services.substr(0, services.find(':'))) / name;
  constexpr const char* kFolder = "haptic-vendor-bridge";
  const std::string_view state = variable("XDG_STATE_HOME");
  if (!state.empty()) return std::filesystem::path(state) / kFolder / name;
  const std::string_view home = variable("HOME");
  if (!home.empty()) return std::filesystem::path(home) / ".local/state" / kFolder / name;
  return std::unexpected(base::Error{"calibration",
                                     "none of $STATE_DIRECTORY, $XDG_STATE_HOME and $HOME says where it is",
                                     "give its file with --calibration"});
}

base::Result<std::optional<OmniCalibration>> readCalibration(const std::filesystem::path& file,
                                                             const std::string& serial) {
  constexpr std::size_t kLongest = 1 << 16;
  const auto content = base::fileContent(file, {.longest = kLongest});
  if (!content && content.error().error_number == ENOENT) return std::nullopt;
  if (!content) return unusable(file, content.error().text());
  OmniCalibration calibration;
  const std::string wrong = take(Json::parse(*content, nullptr, false), calibration);
  if (!wrong.empty()) return unusable(file, wrong);
  if (calibration.serial != serial) {
    return unusable(file, fmt::format("belongs to the device with serial number {}, not to {}",
                                      calibration.serial, serial));
  }
  return calibration;
}

base::Result<void> storeCalibration(const std::filesystem::path& file, const OmniCalibration& calibration) {
  std::error_code failed;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), failed);
  if (failed) {
    return std::unexpected(base::Error{file.parent_path().string(), "cannot be made: " + failed.message(),
                                       "give another file with --calibration"});
  }
  const Json json{{"format", kFormat},
                  {"serial", calibration.serial},
                  {"nMPerCount", calibration.n_m_per_count},
                  {"releasesWithoutPackets", calibration.releases_without_packets}};
  return base::writeWholeFile(file, json.dump(2) + "\n", base::IfExists::replace);
}

namespace {

constexpr double kGravity_m_per_s2 = 9.80665;
constexpr double kDegree_rad = std::numbers::pi / 180;
/// Where a joint's counts are measured: this far from its rest, within so much before and behind it. It turns
/// round far enough behind that its speed is steady there.
constexpr double kMark_rad = 8 * kDegree_rad;
constexpr double kWindow_rad = 3 * kDegree_rad;
constexpr double kTurn_rad = 8 * kDegree_rad;
constexpr double kSpeed_rad_per_s = 0.25;
constexpr double kMostOver_rad = 0.4;  // beyond where it turns round

constexpr PerJoint<const char*> kNames{"waist", "shoulder", "elbow"};
/// The direction away from where the mass pulls: to the left, up, up.
constexpr PerJoint<double> kAway{-1, 1, 1};
/// A hanging forearm bears no load: the mass counts only once it is held out.
constexpr double kElbowMark_rad = 0.6;

base::Error wrong(std::size_t joint, const std::string& what, const std::string& remedy) {
  return {kNames[joint], what, remedy + "; nothing was stored"};
}

/// The speed of a joint, smoothed over what its encoder resolves.
class Speed {
 public:
  explicit Speed(double start_rad) : last_rad_(start_rad) {}
  double after(double now_rad, double seconds) {
    constexpr double kSmoothing_s = 0.02;
    rad_per_s_ += ((now_rad - last_rad_) - rad_per_s_ * seconds) / (kSmoothing_s + seconds);
    last_rad_ = now_rad;
    return rad_per_s_;
  }

 private:
  double last_rad_;
  double rad_per_s_ = 0;
};

/// The counts that move a joint slowly: they rise, or fall, by kCountsPerS while it stands still, and slower
/// the nearer it is to its speed. The gain that is to be found may be anywhere in its range.
class SlowMotion {
 public:
  double countsAt(double gone_rad, double seconds, double wanted_rad_per_s) {
    constexpr double kPerRad = GainMeasurement::kCountsPerS / kSpeed_rad_per_s;
    constexpr double kPerRadPerS = 100;
    const double missing_rad_per_s = wanted_rad_per_s - speed_.after(gone_rad, seconds);
    counts_ += kPerRad * missing_rad_per_s * seconds;
    return counts_ + kPerRadPerS * missing_rad_per_s;
  }

 private:
  Speed speed_{0};
  double counts_ = 0;
};

/// Mean of what was measured near the mark.
class AtMark {
 public:
  void add(double counts, double seconds, double gone_rad, double mark_rad) {
    if (std::abs(gone_rad - mark_rad) > kWindow_rad) return;
    counts_s_ += counts * seconds;
    seconds_ += seconds;
  }
  double counts() const { return seconds_ > 0 ? counts_s_ / seconds_ : 0; }

 private:
  double counts_s_ = 0;
  double seconds_ = 0;
};

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

base::Result<BenchStep> GainMeasurement::stepOf(std::size_t joint, double counts) {
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
    const auto stepped = stepOf(kWaist, 0);
    if (!stepped) return std::unexpected(stepped.error());
    const JointAngles& angles_rad = stepped->angles_rad;
    for (std::size_t joint = 0; joint < still_rad.size(); ++joint) {
      if (step > 0 && std::abs(angles_rad[joint] - still_rad[joint]) <= kStill_rad) continue;
      still_rad = angles_rad;
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
  Sweep sweep{.end = Sweep::End::did_not_move, .mark_rad = *rest_rad};
  const double mark_rad =
      joint == kElbow ? std::max(kMark_rad, kElbowMark_rad - (*rest_rad)[kElbow]) : kMark_rad;
  SlowMotion motion;
  AtMark up;
  AtMark down;
  bool returns = false;
  for (double counts = 0; std::abs(counts) <= kMostRampCounts;) {
    const auto stepped = stepOf(joint, sign * counts);
    if (!stepped) return std::unexpected(stepped.error());
    const double gone_rad = goneOf(joint, stepped->angles_rad, *rest_rad);
    if (gone_rad < -kDegree_rad) {
      sweep.end = Sweep::End::went_the_other_way;
      return sweep;
    }
    (returns ? down : up).add(sign * counts, stepped->seconds, gone_rad, mark_rad);
    if (std::abs(gone_rad - mark_rad) < std::abs(goneOf(joint, sweep.mark_rad, *rest_rad) - mark_rad))
      sweep.mark_rad = stepped->angles_rad;
    if (gone_rad > mark_rad + kTurn_rad + kMostOver_rad)
      return std::unexpected(wrong(joint, "runs away", "let nothing push it, and calibrate again"));
    returns = returns || gone_rad > mark_rad + kTurn_rad;
    if (returns && gone_rad < mark_rad - kWindow_rad) {
      sweep.end = Sweep::End::came_back;
      sweep.up_counts = up.counts();
      sweep.down_counts = down.counts();
      return sweep;
    }
    counts = motion.countsAt(gone_rad, stepped->seconds, returns ? -kSpeed_rad_per_s : kSpeed_rad_per_s);
  }
  if (returns)
    return std::unexpected(wrong(joint, "does not come back", "let nothing hold it, and calibrate again"));
  return sweep;
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
  constexpr double kTurned_rad = 0.2;
  if (joint == kWaist && loaded->mark_rad[kWaist] < kTurned_rad)
    return std::unexpected(
        wrong(joint, "the mass has not turned it to the right", "lead the string to the right"));
  if (loaded->end == Sweep::End::did_not_move)
    return std::unexpected(
        wrong(joint, fmt::format("{} counts do not move the mass", kMostRampCounts), "take a lighter mass"));
  const double held_counts = loaded->mean_counts() - unloaded.sweep.mean_counts();
  const double friction_counts = std::max(loaded->friction_counts(), unloaded.sweep.friction_counts());
  const bool other_way = loaded->end == Sweep::End::went_the_other_way;
  if (!other_way && friction_counts >= std::abs(held_counts))
    return std::unexpected(
        wrong(joint,
              fmt::format("its friction of {:.0f} counts is larger than the load of {:.0f}", friction_counts,
                          std::abs(held_counts)),
              "take a heavier mass"));
  if (other_way || held_counts * unloaded.sign < 0)
    return std::unexpected(wrong(joint,
                                 "its sign is inconsistent: the mass pulls the other way than it should",
                                 "hang the mass as it is asked for"));
  const double n_m_per_count = loadTorque_n_m(joint, loaded->mark_rad) / held_counts;
  if (!isPlausibleGain(n_m_per_count))
    return std::unexpected(wrong(joint,
                                 fmt::format("its gain of {:.3g} N m for a count is not within {:g} and {:g}",
                                             std::abs(n_m_per_count), kLeastGain_n_m, kMostGain_n_m),
                                 "see that --mass is the mass that hangs there"));
  return Loaded{unloaded.sign, n_m_per_count, loaded->mean_counts()};
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
  constexpr double kUp_rad = kMark_rad;
  constexpr double kStill_rad = 0.5 * kDegree_rad;
  constexpr double kStiffness_n_m = 0.5;
  constexpr double kDamping_n_m_s = 0.03;
  constexpr int kMostSteps = static_cast<int>(20 / BenchArm::kStep_s);
  constexpr int kSteps = static_cast<int>(1 / BenchArm::kStep_s);
  constexpr int kLook = static_cast<int>(0.1 / BenchArm::kStep_s);  // over which it is still at the end
  double gone_rad = 0;
  double counts = 0;
  SlowMotion motion;
  for (int step = 0; gone_rad < kUp_rad; ++step) {
    const auto stepped = stepOf(kShoulder, shoulder.sign * counts);
    if (!stepped) return std::unexpected(stepped.error());
    gone_rad = goneOf(kShoulder, stepped->angles_rad, rest_rad);
    counts = motion.countsAt(gone_rad, stepped->seconds, kSpeed_rad_per_s);
    if (step > kMostSteps || std::abs(counts) > kMostRampCounts) return 0;
  }
  const double wanted_rad = gone_rad;
  Speed speed(wanted_rad);
  double looked_rad = 0;
  counts = shoulder.mean_counts;
  for (int step = 0; step < kSteps; ++step) {
    const auto stepped = stepOf(kShoulder, counts);
    if (!stepped) return std::unexpected(stepped.error());
    gone_rad = goneOf(kShoulder, stepped->angles_rad, rest_rad);
    if (step == kSteps - kLook) looked_rad = gone_rad;
    const double more_n_m =
        kStiffness_n_m * (wanted_rad - gone_rad) - kDamping_n_m_s * speed.after(gone_rad, stepped->seconds);
    counts = std::clamp(shoulder.mean_counts + more_n_m / shoulder.n_m_per_count, -double{kMostRampCounts},
                        double{kMostRampCounts});
  }
  return std::abs(gone_rad - looked_rad) <= kStill_rad ? gone_rad : 0;
}

}  // namespace hapticd::tools::phantom_omni

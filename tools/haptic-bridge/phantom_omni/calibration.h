// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "config/base/error.h"
#include "tools/haptic-bridge/phantom_omni/arm.h"
#include "tools/lib/device_check/person.h"

namespace hapticd::tools::phantom_omni {

/// What was measured of one device, without which it exerts nothing: no source states it.
struct OmniCalibration {
  std::string serial;
  PerJoint<double> n_m_per_count{};       ///< torque of a joint for a count of its motor, with its sign
  bool releases_without_packets = false;  ///< its motors let go when no packets come any more
};

/// A gain outside this range is no gain of an Omni: with 2047 counts a joint then exerts less than 0.1 N m or
/// more than 2 N m, where 3.3 N at a reach of 0.135 to 0.27 m need 0.45 to 0.9 N m.
inline constexpr double kLeastGain_n_m = 5e-5;
inline constexpr double kMostGain_n_m = 1e-3;

/// Whether a gain lies in that range, with either sign.
bool isPlausibleGain(double n_m_per_count);

/// Where the calibration of a device is kept: `file` unless it is empty; else phantom-omni-SERIAL.json in
/// $STATE_DIRECTORY, in $XDG_STATE_HOME/haptic-vendor-bridge, or in ~/.local/state/haptic-vendor-bridge.
/// Errors: none of these is set.
base::Result<std::filesystem::path> calibrationFile(const std::string& file, const std::string& serial);

/// Nothing: there is no such file.
/// Errors: it cannot be read, is damaged, or belongs to a device of another serial number.
base::Result<std::optional<OmniCalibration>> readCalibration(const std::filesystem::path& file,
                                                             const std::string& serial);

/// Writes the file completely or not at all, with its folder.  Errors: the disk's.
base::Result<void> storeCalibration(const std::filesystem::path& file, const OmniCalibration& calibration);

/// What a step of an arm has led to.
struct BenchStep {
  JointAngles angles_rad{};
  double seconds = 0;  ///< since the angles of the step before: what a loaded computer makes of kStep_s
};

/// An arm whose motors are driven by counts, for its calibration. Thread: one.
class BenchArm {
 public:
  static constexpr double kStep_s = 0.002;

  virtual ~BenchArm() = default;
  /// Has the motors at these counts until the next step, and returns the joints' angles kStep_s later.
  /// Without a next step the motors are turned off.  Errors: the device is lost.
  virtual base::Result<BenchStep> step(const PerJoint<int>& counts) = 0;
  /// Sends no packets for that long, as if the program had been killed, and returns the angles at the end;
  /// packets without torque follow.  Errors: the device is lost.
  virtual base::Result<JointAngles> pausePackets(double seconds) = 0;
  /// How many steps have come so late that the motion before them counts for nothing.
  virtual std::uint64_t lateSteps() const = 0;
};

/// Leads a person through the measurement of the torque for a count of each motor, with a known mass.
/// A motor's counts rise slowly until its joint leaves its rest, and fall until the joint comes back:
/// friction delays both by the same torque and is not in their mean. The mean with the mass, less that
/// without it, holds the mass, whose torque follows from its weight and the measured angles. Thread: one.
class GainMeasurement {
 public:
  static constexpr double kLeastMass_kg = 0.02;
  static constexpr double kMostMass_kg = 0.2;
  static constexpr double kUsualMass_kg = 0.1;
  static constexpr int kMostRampCounts = kMostCounts * 2 / 5;  ///< of what a motor has
  static constexpr double kCountsPerS = 200;

  GainMeasurement(BenchArm& arm, Person& person, double mass_kg)
      : arm_(arm), person_(person), mass_kg_(mass_kg) {}

  /// Measures everything but the serial number.
  /// Errors: a gain is not found or implausible, the device is lost, the person gave up.
  base::Result<OmniCalibration> run();

 private:
  /// The signed counts of one motor while its joint goes away from its rest, past a mark, and comes back.
  struct Sweep {
    enum class End { came_back, did_not_move, went_the_other_way };
    End end = End::did_not_move;
    double up_counts = 0;    ///< at the mark, on the way away
    double down_counts = 0;  ///< at the mark, on the way back
    JointAngles mark_rad{};

    double mean_counts() const { return (up_counts + down_counts) / 2; }
    double friction_counts() const;
  };
  /// How a joint moves without the mass.
  struct Unloaded {
    int sign = 1;  ///< of the counts that move it away from where the mass pulls
    Sweep sweep;
  };
  struct Loaded {
    int sign = 1;  ///< of the counts that move it away
    double n_m_per_count = 0;
    double mean_counts = 0;  ///< that hold the joint with the mass
  };

  base::Result<void> ask(const std::string& request);
  base::Result<BenchStep> stepOf(std::size_t joint, double counts);
  base::Result<JointAngles> awaitRest();
  base::Result<Sweep> sweep(std::size_t joint, int sign);
  base::Result<Sweep> undisturbedSweep(std::size_t joint, int sign);
  base::Result<Unloaded> measureUnloaded(std::size_t joint);
  base::Result<Loaded> measureLoaded(std::size_t joint, const Unloaded& unloaded);
  double loadTorque_n_m(std::size_t joint, const JointAngles& angles_rad) const;
  base::Result<bool> releasesWithoutPackets(const Loaded& shoulder);
  base::Result<double> holdUp(const Loaded& shoulder, const JointAngles& rest_rad);

  BenchArm& arm_;
  Person& person_;
  double mass_kg_;
};

struct CalibrateOptions {
  std::string serial;  ///< of the device; empty: the first one
  std::string file;    ///< to write; empty: where the driver looks for it
  double mass_kg = 0;  ///< that hangs from the stylus
};

/// Leads the person at the terminal through the calibration of a Phantom Omni's motors, and stores it.
/// Returns the exit status.
int calibratePhantomOmni(const CalibrateOptions& options);

}  // namespace hapticd::tools::phantom_omni

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "rt/base/vec3.h"

namespace hapticd::drivers {

/// Kinematics of the Novint Falcon: three legs, each with a motor-driven thigh and a parallelogram of shins
/// that holds the grip. Positions are in metres along the device's axes: z points out of the device towards
/// the person, x and y as in libnifalcon. Angles are in radians.
/// All functions:  Thread: any.  RT: safe.

using FalconCounts = std::array<int, 3>;
using FalconAngles = std::array<double, 3>;

/// Middle of the workspace used by other software.
inline constexpr rt::Vec3 kFalconCentre_m{0, 0, 0.125};

/// Converts encoder counts, which increase with z, to the angles of the thighs.
FalconAngles thighAnglesOf(const FalconCounts& encoder_counts);

/// The three angles of one leg: of the thigh, and of the shins within and out of the leg's plane.
struct FalconLeg {
  double thigh_rad = 0;
  double shin_rad = 0;
  double tilt_rad = 0;
};

/// Position of the grip with the corresponding legs and Jacobian.
struct FalconPose {
  rt::Vec3 position_m;
  std::array<FalconLeg, 3> legs;
  /// Row k: gradient of leg k's thigh angle with respect to the position, rad/m.
  std::array<rt::Vec3, 3> jacobian;
};

/// Returns the pose in which the grip is at `position_m`.
/// Nothing: not finite, out of reach, or so close to a stretched leg that its motor has no leverage.
std::optional<FalconPose> falconPoseAt(const rt::Vec3& position_m);

/// Returns the pose with these thigh angles, found by Newton's method from `start_m` and within the reach of
/// the device (kFalconReach...).
/// Nothing: there is none, or it was not found within a fixed number of steps.
std::optional<FalconPose> falconPoseOf(const FalconAngles& thighs_rad, const rt::Vec3& start_m);

/// No Falcon's grip gets farther from the axis than this or leaves this range of z.
inline constexpr double kFalconReachFromAxis_m = 0.08;
inline constexpr double kFalconNearest_m = 0.05;
inline constexpr double kFalconFarthest_m = 0.19;

/// Returns the torques of the three motors in N m that exert `force_n` at the grip: J^T tau = F.
std::array<double, 3> thighTorquesOf(const FalconPose& pose, const rt::Vec3& force_n);

/// Frames of 16 bytes exchanged with a Falcon's firmware: '<', 14 bytes of 0x41 + value, '>'. Numbers are
/// signed 16 bit in four nibbles, least significant first (libnifalcon, FalconFirmwareNovintSDK.cpp).
/// Thread: one per object.  RT: safe.

inline constexpr std::size_t kFalconFrameBytes = 16;
using FalconFrame = std::array<std::uint8_t, kFalconFrameBytes>;

/// Largest number of counts that the firmware accepts for a motor.
inline constexpr int kMaxMotorCounts = 4095;

/// Colours as named by VRPN and ros_falcon; libnifalcon's header has them in another order.
enum class FalconLed : std::uint8_t { off = 0, green = 0x02, blue = 0x04, red = 0x08 };

/// A frame sent to the device.
struct FalconOrder {
  FalconCounts motor_counts{};  ///< clamped to +-kMaxMotorCounts
  FalconLed led = FalconLed::off;
  bool home = false;  ///< request a report of which encoders are homed
};

/// A frame received from the device.
struct FalconReply {
  FalconCounts encoder_counts{};  ///< signed 16 bit; relative until homed
  std::uint8_t buttons = 0;       ///< bits: plus, forward, centre, minus
  std::uint8_t homed = 0;         ///< bit k: encoder k is homed; valid while requested
};

/// Value of FalconReply::homed when all encoders are homed.
inline constexpr std::uint8_t kAllHomed = 0x7;

/// Encodes an order.
FalconFrame frameOf(const FalconOrder& order);

/// Decodes a reply; nothing if the frame is damaged.
std::optional<FalconReply> replyIn(const FalconFrame& frame);

/// Extracts replies from a stream of bytes that may have lost, damaged or inserted bytes. Where a frame
/// cannot continue it resynchronises at the next '<', so that a broken frame does not cost the following one.
class FalconReplyStream {
 public:
  /// Adds a byte; returns the reply that it completes.
  std::optional<FalconReply> add(std::uint8_t byte);
  /// Discards a partial frame.
  void reset();
  /// Returns how often invalid data was received.
  std::uint64_t damaged() const { return damaged_; }

 private:
  void resynchronise();

  FalconFrame frame_{};
  std::size_t length_ = 0;
  bool in_step_ = true;  // the last byte belonged to a frame
  std::uint64_t damaged_ = 0;
};

/// Removes the two modem status bytes with which an FTDI chip begins each USB packet of at most 64 bytes.
/// `transfer`: one bulk transfer; its payload is moved to the front. Returns the number of payload bytes.
std::size_t removeStatusBytes(std::span<std::uint8_t> transfer);

/// Motor command for a force.
struct FalconForce {
  FalconCounts motor_counts{};
  double exerted_share = 1;  ///< fraction of the requested force; below 1: a motor is at its limit
};

/// Returns the motor counts for a force at the grip in newtons, in the device's axes: -10000 counts per N m,
/// times `force_share` (0..1). If a motor would exceed its limit, all three are scaled alike, so that the
/// direction of the force is preserved. A force that is not finite counts as zero.
/// RT: safe.
FalconForce motorCountsFor(const FalconPose& pose, const rt::Vec3& force_n, double force_share);

/// State of a Falcon derived from its replies: whether its encoders are homed, and the position of the grip.
/// The encoders count from their position at power-up until the grip has been at both ends; before that a
/// position is meaningless and no force is exerted.
/// Thread: one.  RT: safe.
class FalconTracker {
 public:
  /// Number of consecutive replies that must agree before homing counts as done or lost.
  static constexpr int kSteadyReplies = 10;

  /// `force_share`: see motorCountsFor().
  explicit FalconTracker(double force_share) : force_share_(force_share) {}

  /// Processes a reply.
  void take(const FalconReply& reply);

  bool homed() const { return homed_; }
  /// Returns the pose of the newest reply; nothing while not homed or if the encoders report a position out
  /// of reach.
  const std::optional<FalconPose>& pose() const { return pose_; }

  /// Returns the next order. `force_n`: in the device's axes; nothing: no command, so no force is exerted.
  FalconOrder orderFor(const std::optional<rt::Vec3>& force_n);
  /// Returns whether a motor was at its limit in the newest order.
  bool forceCut() const { return force_cut_; }

 private:
  void takeHoming(std::uint8_t homed_encoders);

  double force_share_;
  bool homed_ = false;
  int contrary_replies_ = 0;  // number of consecutive ones
  std::optional<FalconPose> pose_;
  rt::Vec3 last_position_m_ = kFalconCentre_m;  // start of the search for the next pose
  bool force_cut_ = false;
};

}  // namespace hapticd::drivers

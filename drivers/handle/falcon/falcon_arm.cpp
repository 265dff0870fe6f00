// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/falcon/falcon_arm.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::drivers {
namespace {

using rt::Vec3;

// Lengths in metres and angles as in libnifalcon's FalconKinematicStamper, which follows Tsai and Stamper, "A
// parallel manipulator with only translational degrees of freedom", UMD ISR TR 97-72.
constexpr double kThigh = 0.060;     // a
constexpr double kShin = 0.1025;     // b
constexpr double kGrip = 0.01443;    // c: from the middle of the grip to the shins
constexpr double kJoints = 0.0225;   // d + e: the joints at both ends of the shins
constexpr double kOffset = -0.025;   // f: offset out of the leg's plane
constexpr double kBase = 0.0400;     // r
constexpr double kAside = -0.02309;  // s

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::array<double, 3> kAzimuths{105 * kDegree, -15 * kDegree, -135 * kDegree};

constexpr double kThighAtZero_rad = 35 * kDegree;
// A turn of the motor gives 4 * 320 counts and 0.01425 m of cable; a turn of the thigh takes 0.110 m.
constexpr double kThighPerCount_rad = 0.01425 / (4 * 320) / 0.110 * 2 * std::numbers::pi;

// Below this sine a motor moves the grip by less than a hundredth of what its thigh's length suggests.
constexpr double kMinSine = 0.01;

/// A leg's own axes turn with its azimuth about z; w is z.
struct LegFrame {
  double cosine;
  double sine;

  explicit LegFrame(double azimuth_rad) : cosine(std::cos(azimuth_rad)), sine(std::sin(azimuth_rad)) {}
  double u(const Vec3& p) const { return p.x * cosine + p.y * sine - kBase; }
  double v(const Vec3& p) const { return -p.x * sine + p.y * cosine - kAside; }
  Vec3 toDevice(const Vec3& g) const { return {cosine * g.x - sine * g.y, sine * g.x + cosine * g.y, g.z}; }
};

const std::array<LegFrame, 3> kFrames{LegFrame(kAzimuths[0]), LegFrame(kAzimuths[1]), LegFrame(kAzimuths[2])};

/// The leg closes where
///   u = a cos t1 - c + S cos t2,   v = b cos t3 - f,   w = a sin t1 + S sin t2,   S = d + e + b sin t3.
/// v gives t3. |(u + c, w) - a (cos t1, sin t1)| = S is a quadratic in tan(t1 / 2) with the coefficients
///   l0 = R - 2au - 2ac,  l1 = -4aw,  l2 = R + 2au + 2ac,  R = w^2 + u^2 + 2cu + a^2 + c^2 - S^2.
/// Its root (-l1 - q) / (2 l2), q = sqrt(l1^2 - 4 l0 l2), is the configuration in which the leg bends
/// outwards; written as 2 l0 / (-l1 + q) its denominator is never zero, since l1 < 0 above the base.
std::optional<FalconLeg> legAt(double u, double v, double w) {
  const double tilt_cosine = (v + kOffset) / kShin;
  if (!(std::abs(tilt_cosine) < 1) || !(w > 0)) return std::nullopt;
  const double tilt = std::acos(tilt_cosine);
  const double shin = kJoints + kShin * std::sin(tilt);
  const double r = w * w + u * u + 2 * kGrip * u + kThigh * kThigh + kGrip * kGrip - shin * shin;
  const double l0 = r - 2 * kThigh * (u + kGrip);
  const double l1 = -4 * kThigh * w;
  const double l2 = r + 2 * kThigh * (u + kGrip);
  const double under_root = l1 * l1 - 4 * l0 * l2;
  if (!(under_root >= 0)) return std::nullopt;
  const double thigh = 2 * std::atan2(2 * l0, -l1 + std::sqrt(under_root));
  const double along = u + kGrip - kThigh * std::cos(thigh);
  return FalconLeg{thigh, std::atan2(w - kThigh * std::sin(thigh), along), tilt};
}

/// Derivative of the closure: dv = -b sin t3 dt3, so dS = -(cos t3 / sin t3) dv; and cos t2 du + sin t2 dw =
/// a sin(t2 - t1) dt1 + dS, in which dt2 cancels. Hence
///   d t1 / d(u, v, w) = (cos t2 sin t3, cos t3, sin t2 sin t3) / (a sin t3 sin(t2 - t1)).
/// libnifalcon's closed form has sin^2 t2 in the third component, which contradicts its inverse kinematics
/// and makes forces along z 9 to 36 % too strong.
std::optional<Vec3> thighGradient(const FalconLeg& leg) {
  const double tilt_sine = std::sin(leg.tilt_rad);
  const double bend_sine = std::sin(leg.shin_rad - leg.thigh_rad);
  if (!(tilt_sine > kMinSine && bend_sine > kMinSine)) return std::nullopt;
  const double scale = 1 / (kThigh * tilt_sine * bend_sine);
  return scale *
         Vec3{std::cos(leg.shin_rad) * tilt_sine, std::cos(leg.tilt_rad), std::sin(leg.shin_rad) * tilt_sine};
}

/// Returns the columns of the inverse of the matrix with these rows; its determinant is not zero where
/// falconPoseAt() has found a pose.
std::array<Vec3, 3> inverseColumns(const std::array<Vec3, 3>& rows) {
  const std::array<Vec3, 3> adjugate{cross(rows[1], rows[2]), cross(rows[2], rows[0]),
                                     cross(rows[0], rows[1])};
  const double inverse_determinant = 1 / dot(rows[0], adjugate[0]);
  return {inverse_determinant * adjugate[0], inverse_determinant * adjugate[1],
          inverse_determinant * adjugate[2]};
}

bool isInReach(const Vec3& p) {
  return std::hypot(p.x, p.y) <= kFalconReachFromAxis_m && p.z >= kFalconNearest_m &&
         p.z <= kFalconFarthest_m;
}

/// Returns a step of Newton's method towards these angles, in metres.
Vec3 newtonStep(const FalconPose& pose, const FalconAngles& thighs_rad) {
  const std::array<Vec3, 3> columns = inverseColumns(pose.jacobian);
  Vec3 step;
  for (std::size_t k = 0; k < 3; ++k) step += (thighs_rad[k] - pose.legs[k].thigh_rad) * columns[k];
  return step;
}

/// Applies `step`, halved until it leads to a pose; nothing if not even a small part of it does.
std::optional<FalconPose> poseAlong(const FalconPose& from, Vec3 step) {
  constexpr double kMaxStep_m = 0.02;  // beyond this the linearisation is useless
  constexpr int kMaxHalvings = 6;
  const double length = norm(step);
  if (length > kMaxStep_m) step = (kMaxStep_m / length) * step;
  for (int halving = 0; halving < kMaxHalvings; ++halving) {
    if (auto pose = falconPoseAt(from.position_m + step)) return pose;
    step = 0.5 * step;
  }
  return std::nullopt;
}

}  // namespace

FalconAngles thighAnglesOf(const FalconCounts& encoder_counts) {
  FalconAngles angles{};
  for (std::size_t k = 0; k < 3; ++k) angles[k] = kThighAtZero_rad + kThighPerCount_rad * encoder_counts[k];
  return angles;
}

std::optional<FalconPose> falconPoseAt(const Vec3& position_m) {
  if (!isFinite(position_m)) return std::nullopt;
  FalconPose pose{position_m, {}, {}};
  for (std::size_t k = 0; k < 3; ++k) {
    const LegFrame& frame = kFrames[k];
    const auto leg = legAt(frame.u(position_m), frame.v(position_m), position_m.z);
    const auto gradient = leg ? thighGradient(*leg) : std::nullopt;
    if (!gradient) return std::nullopt;
    pose.legs[k] = *leg;
    pose.jacobian[k] = frame.toDevice(*gradient);
  }
  const Vec3& g0 = pose.jacobian[0];
  const double volume = dot(g0, cross(pose.jacobian[1], pose.jacobian[2]));
  const double cube = norm(g0) * norm(pose.jacobian[1]) * norm(pose.jacobian[2]);
  if (!(std::abs(volume) > kMinSine * cube)) return std::nullopt;
  return pose;
}

std::optional<FalconPose> falconPoseOf(const FalconAngles& thighs_rad, const Vec3& start_m) {
  constexpr int kMaxSteps = 30;            // 7 suffice on average from the centre, 2 from the last pose
  constexpr double kResidual_rad = 1e-10;  // a millionth of a count
  constexpr double kStill_m = 1e-12;
  auto pose = falconPoseAt(start_m);
  for (int i = 0; pose && i < kMaxSteps; ++i) {
    double residual = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      residual = std::max(residual, std::abs(thighs_rad[k] - pose->legs[k].thigh_rad));
    }
    const Vec3 step = newtonStep(*pose, thighs_rad);
    if (!isFinite(step)) return std::nullopt;
    if (residual < kResidual_rad || norm(step) < kStill_m) {
      return isInReach(pose->position_m) ? pose : std::nullopt;
    }
    pose = poseAlong(*pose, step);
  }
  return std::nullopt;
}

std::array<double, 3> thighTorquesOf(const FalconPose& pose, const Vec3& force_n) {
  const std::array<Vec3, 3> columns = inverseColumns(pose.jacobian);
  return {dot(columns[0], force_n), dot(columns[1], force_n), dot(columns[2], force_n)};
}

namespace {

constexpr std::uint8_t kFirstByte = '<';
constexpr std::uint8_t kLastByte = '>';
constexpr std::uint8_t kZero = 'A';
constexpr std::size_t kNibbles = 12;      // of three numbers, from byte 1 on
constexpr std::size_t kControlByte = 13;  // in orders; in replies: buttons and homed encoders
constexpr std::uint8_t kHomingRequest = 0x01;

std::uint8_t coded(unsigned value) {
  return static_cast<std::uint8_t>(kZero + value);
}

bool isNibble(std::uint8_t byte) {
  return byte >= kZero && byte < kZero + 16;
}

/// Returns whether a frame may have this byte at this index; the meaning of byte 14 is unknown.
bool mayStand(std::uint8_t byte, std::size_t index) {
  if (index == 0) return byte == kFirstByte;
  if (index <= kNibbles) return isNibble(byte);
  return index + 1 < kFalconFrameBytes || byte == kLastByte;
}

}  // namespace

FalconFrame frameOf(const FalconOrder& order) {
  FalconFrame frame{};
  frame.fill(kZero);
  frame.front() = kFirstByte;
  frame.back() = kLastByte;
  std::size_t at = 1;
  for (const int counts : order.motor_counts) {
    const auto bits = static_cast<std::uint16_t>(std::clamp(counts, -kMaxMotorCounts, kMaxMotorCounts));
    for (unsigned shift = 0; shift < 16; shift += 4) frame[at++] = coded((bits >> shift) & 0xFU);
  }
  frame[kControlByte] = coded(static_cast<unsigned>(order.led) | (order.home ? kHomingRequest : 0U));
  return frame;
}

std::optional<FalconReply> replyIn(const FalconFrame& frame) {
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (!mayStand(frame[i], i)) return std::nullopt;
  }
  FalconReply reply;
  std::size_t at = 1;
  for (int& counts : reply.encoder_counts) {
    unsigned bits = 0;
    for (unsigned shift = 0; shift < 16; shift += 4)
      bits |= static_cast<unsigned>(frame[at++] - kZero) << shift;
    counts = static_cast<std::int16_t>(bits);
  }
  const auto state = static_cast<std::uint8_t>(frame[kControlByte] - kZero);
  reply.buttons = state & 0xFU;
  reply.homed = (state >> 4U) & kAllHomed;
  return reply;
}

std::optional<FalconReply> FalconReplyStream::add(std::uint8_t byte) {
  frame_[length_] = byte;
  if (!mayStand(byte, length_)) {
    if (in_step_) ++damaged_;
    resynchronise();
    return std::nullopt;
  }
  in_step_ = true;
  if (++length_ < kFalconFrameBytes) return std::nullopt;
  length_ = 0;
  return replyIn(frame_);
}

/// Handles a byte that does not fit after the frame's first length_ bytes. Bytes 13 and 14 may have any
/// value, so the next frame may have begun among the last bytes.
void FalconReplyStream::resynchronise() {
  const std::size_t end = length_ + 1;
  length_ = 0;
  for (std::size_t i = 1; i < end; ++i) {
    if (!mayStand(frame_[i], length_)) length_ = 0;
    if (mayStand(frame_[i], length_)) frame_[length_++] = frame_[i];
  }
  in_step_ = length_ > 0;
}

void FalconReplyStream::reset() {
  if (length_ > 0) ++damaged_;
  length_ = 0;
}

std::size_t removeStatusBytes(std::span<std::uint8_t> transfer) {
  constexpr std::size_t kPacketBytes = 64;
  constexpr std::size_t kStatusBytes = 2;
  std::size_t carried = 0;
  for (std::size_t packet = 0; packet < transfer.size(); packet += kPacketBytes) {
    const std::size_t end = std::min(packet + kPacketBytes, transfer.size());
    for (std::size_t i = packet + kStatusBytes; i < end; ++i) transfer[carried++] = transfer[i];
  }
  return carried;
}

namespace {

// Scale of libnifalcon. Traces of the vendor's driver quoted there show 0.23 to 0.4 of it, hence
// `force_share`, which must be calibrated with a scale.
constexpr double kCountsPerNewtonMetre = -10000;

}  // namespace

FalconForce motorCountsFor(const FalconPose& pose, const rt::Vec3& force_n, double force_share) {
  FalconForce force;
  const std::array<double, 3> torques = thighTorquesOf(pose, force_n);
  std::array<double, 3> counts{};
  double largest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    counts[k] = kCountsPerNewtonMetre * force_share * torques[k];
    if (!std::isfinite(counts[k])) return {};
    largest = std::max(largest, std::abs(counts[k]));
  }
  if (largest > kMaxMotorCounts) force.exerted_share = kMaxMotorCounts / largest;
  for (std::size_t k = 0; k < 3; ++k) {
    force.motor_counts[k] = static_cast<int>(std::lround(force.exerted_share * counts[k]));
  }
  return force;
}

void FalconTracker::take(const FalconReply& reply) {
  takeHoming(reply.homed);
  pose_.reset();
  if (!homed_) return;
  const FalconAngles angles = thighAnglesOf(reply.encoder_counts);
  pose_ = falconPoseOf(angles, last_position_m_);
  if (!pose_) pose_ = falconPoseOf(angles, kFalconCentre_m);
  if (pose_) last_position_m_ = pose_->position_m;
}

void FalconTracker::takeHoming(std::uint8_t homed_encoders) {
  contrary_replies_ = (homed_encoders == kAllHomed) == homed_ ? 0 : contrary_replies_ + 1;
  if (contrary_replies_ < kSteadyReplies) return;
  homed_ = !homed_;
  contrary_replies_ = 0;
  last_position_m_ = kFalconCentre_m;
}

FalconOrder FalconTracker::orderFor(const std::optional<rt::Vec3>& force_n) {
  FalconOrder order;
  order.home = true;  // always, so that a loss of homing is noticed
  order.led = !homed_ ? FalconLed::red : force_n ? FalconLed::green : FalconLed::blue;
  force_cut_ = false;
  if (!pose_ || !force_n) return order;
  const FalconForce force = motorCountsFor(*pose_, *force_n, force_share_);
  order.motor_counts = force.motor_counts;
  force_cut_ = force.exerted_share < 1;
  return order;
}

}  // namespace hapticd::drivers

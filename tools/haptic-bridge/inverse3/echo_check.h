// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "rt/base/vec3.h"

namespace hapticd::tools::inverse3 {

/// Whether the force that the service says it exerts follows the one that it was given. A service that does
/// not know the member in which a force is written ignores it without a word, and one that keeps an old force
/// pushes although nothing is commanded.
///
/// Filters of the service weaken a force and delay it by a few frames, so only the direction, a share of
/// kLeastShare to kMostShare, and zero for zero are expected, each within kLag frames.
/// Thread: one.  RT: safe.
class EchoCheck {
 public:
  static constexpr std::size_t kLag = 8;      ///< frames after which an answer shows a command
  static constexpr double kUnproven_n = 0.1;  ///< most that may be commanded before the proof
  static constexpr double kLeast_n = 0.05;    ///< shorter commands prove nothing
  static constexpr double kZero_n = 0.01;     ///< a shorter answer counts as none
  static constexpr double kLeastShare = 0.1;  ///< gain of the force gate 0.3, scale 0.5, and a margin
  static constexpr double kMostShare = 1.5;   ///< damping of the service adds to the force
  static constexpr double kMostAcross = 0.5;  ///< of the command's length
  static constexpr int kNeeded = 10;          ///< answers in a row that follow
  static constexpr int kPatience = 50;        ///< answers in a row that do not

  enum class Verdict {
    unproven,  ///< not enough was commanded yet
    proven,
    ignored,  ///< forces are commanded, and the answers do not follow
    pushes,   ///< zero is commanded, and the answers are not
  };

  /// Takes what was commanded in a frame, and what its answer said. `damping_n`: what the service's own
  /// damping may exert at most at this velocity.
  void add(const rt::Vec3& commanded_n, const rt::Vec3& echoed_n, double damping_n);
  Verdict verdict() const { return verdict_; }
  /// Whether the service exerts nothing while nothing is commanded, which comes before any force.
  bool isQuiet() const { return quiet_ >= kNeeded; }
  /// Most that may be commanded now.
  double most_n(double limit_n) const;

 private:
  bool followsOne(const rt::Vec3& echoed_n, double tolerance_n) const;

  std::array<rt::Vec3, kLag> commanded_n_{};
  std::size_t next_ = 0;
  int quiet_ = 0;
  int follows_ = 0;
  int ignores_ = 0;
  int pushes_ = 0;
  Verdict verdict_ = Verdict::unproven;
};

}  // namespace hapticd::tools::inverse3

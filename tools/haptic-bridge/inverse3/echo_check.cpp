// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/inverse3/echo_check.h"

#include <algorithm>

namespace hapticd::tools::inverse3 {
namespace {

bool follows(const rt::Vec3& commanded_n, const rt::Vec3& echoed_n, double tolerance_n) {
  const double squared = dot(commanded_n, commanded_n);
  const double share = dot(echoed_n, commanded_n) / squared;
  const double across_n = norm(echoed_n - share * commanded_n);
  const double length_n = norm(commanded_n);
  return share >= EchoCheck::kLeastShare &&
         share * length_n <= EchoCheck::kMostShare * length_n + tolerance_n &&
         across_n <= EchoCheck::kMostAcross * length_n + tolerance_n;
}

}  // namespace

double EchoCheck::most_n(double limit_n) const {
  if (!isQuiet() || verdict_ == Verdict::ignored || verdict_ == Verdict::pushes) return 0;
  return verdict_ == Verdict::proven ? limit_n : std::min(limit_n, kUnproven_n);
}

bool EchoCheck::followsOne(const rt::Vec3& echoed_n, double tolerance_n) const {
  return std::ranges::any_of(
      commanded_n_, [&](const rt::Vec3& commanded_n) { return follows(commanded_n, echoed_n, tolerance_n); });
}

void EchoCheck::add(const rt::Vec3& commanded_n, const rt::Vec3& echoed_n, double damping_n) {
  commanded_n_[next_] = commanded_n;
  next_ = (next_ + 1) % kLag;
  const auto [shortest, longest] =
      std::ranges::minmax(commanded_n_, {}, [](const rt::Vec3& command) { return norm(command); });
  const double tolerance_n = kZero_n + damping_n;
  // a command that is neither none nor long enough says nothing about either
  if (norm(longest) == 0) {
    const bool silent = norm(echoed_n) <= tolerance_n;
    quiet_ = silent ? std::min(quiet_ + 1, kNeeded) : isQuiet() ? quiet_ : 0;
    pushes_ = silent ? 0 : pushes_ + 1;
  } else if (norm(shortest) >= kLeast_n) {
    const bool one = followsOne(echoed_n, tolerance_n);
    follows_ = one ? std::min(follows_ + 1, kNeeded) : 0;
    ignores_ = one ? 0 : ignores_ + 1;
  }
  if (follows_ >= kNeeded && verdict_ == Verdict::unproven) verdict_ = Verdict::proven;
  if (ignores_ >= kPatience) verdict_ = Verdict::ignored;
  if (pushes_ >= kPatience) verdict_ = Verdict::pushes;
}

}  // namespace hapticd::tools::inverse3

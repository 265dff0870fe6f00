// SPDX-License-Identifier: Apache-2.0
#include "rt/safety/latency_probe.h"

#include <cmath>

namespace hapticd::rt {
namespace {

/// Second differences are taken over this: a hand's own motion is straight for so long.
constexpr std::size_t kSpan_ticks = 20;
/// A fit that explains less has seen something else than the knock. Devices of 45 to 300 g with encoders of
/// 55 um explain 0.96 and more; the jitter of one that does not move explains up to 0.8 by chance.
constexpr double kConclusive = 0.9;

/// Sign of each pair of pulses, the Thue-Morse sequence: it cancels constant, linear and quadratic drift.
double signOf(std::size_t pair) noexcept {
  std::size_t ones = 0;
  for (std::size_t bits = pair; bits != 0; bits >>= 1U) ones += bits & 1U;
  return ones % 2 == 0 ? 1 : -1;
}

/// Second difference at sample t >= 2 kSpan_ticks of a series that was zero before it was shifted by `shift`.
template <std::size_t kSize>
double secondDifference(const std::array<double, kSize>& series, std::size_t t,
                        std::size_t shift = 0) noexcept {
  const auto at = [&](std::size_t i) { return i >= shift ? series[i - shift] : 0.0; };
  return at(t) - 2 * at(t - kSpan_ticks) + at(t - 2 * kSpan_ticks);
}

/// Replaces a symmetric positive matrix by its Cholesky factor, the lower half. A row that depends on those
/// above becomes zero.
template <std::size_t kSize>
void factorise(std::array<std::array<double, kSize>, kSize>& m) noexcept {
  constexpr double kDependent = 1e-12;
  for (std::size_t i = 0; i < kSize; ++i) {
    const double size = m[i][i];
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = m[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= m[i][k] * m[j][k];
      if (j < i) {
        m[i][j] = m[j][j] > 0 ? sum / m[j][j] : 0;
      } else {
        m[i][i] = sum > kDependent * size ? std::sqrt(sum) : 0;
      }
    }
  }
}
/// Solves L L^T x = right. Returns x, and in `explained` right . x.
template <std::size_t kSize>
std::array<double, kSize> solved(const std::array<std::array<double, kSize>, kSize>& factor,
                                 const std::array<double, kSize>& right, double& explained) noexcept {
  std::array<double, kSize> x{};
  explained = 0;
  for (std::size_t i = 0; i < kSize; ++i) {
    double sum = right[i];
    for (std::size_t k = 0; k < i; ++k) sum -= factor[i][k] * x[k];
    x[i] = factor[i][i] > 0 ? sum / factor[i][i] : 0;
    explained += x[i] * x[i];
  }
  for (std::size_t i = kSize; i-- > 0;) {
    double sum = x[i];
    for (std::size_t k = i + 1; k < kSize; ++k) sum -= factor[k][i] * x[k];
    x[i] = factor[i][i] > 0 ? sum / factor[i][i] : 0;
  }
  return x;
}

}  // namespace

void LatencyProbe::start() noexcept {
  const Result result = result_;
  *this = {};
  result_ = result;
  phase_ = Phase::knocking;
}

double LatencyProbe::step(const Input& input) HAPTICD_RT {
  if (phase_ == Phase::off) return 0;
  if (phase_ == Phase::comparing) {
    compare();
    return 0;
  }
  period_s_ = input.period_s;
  const auto before = [this](const std::array<double, kSamples>& series) {
    return tick_ > 0 ? series[tick_ - 1] : 0.0;
  };
  // The command of the previous tick has acted until now.
  momentum_n_s_ += input.command_n * input.period_s;
  pushed_kg_m_[tick_] = before(pushed_kg_m_) + momentum_n_s_ * input.period_s;
  if (tick_ == 0) origin_m_ = input.position_m;
  motion_[0][tick_] = input.position_m - origin_m_;
  for (std::size_t term = 1; term < kIntegrals; ++term)
    motion_[term][tick_] = before(motion_[term]) + motion_[term - 1][tick_] * input.period_s;
  const std::size_t pulse = tick_ / kPulse_ticks;
  const bool knocks = tick_ < kKnock_ticks;
  if (++tick_ == kSamples) prepare();
  return knocks ? signOf(pulse / 2) * (pulse % 2 == 0 ? kKnock_n : -kKnock_n) : 0;
}

/// One term of the fit at a sample; all are scaled to about the same size.
double LatencyProbe::termAt(std::size_t term, std::size_t t) const noexcept {
  constexpr std::array<double, kIntegrals> kScales{1e4, 1e6, 1e8};
  if (term < kIntegrals) return kScales[term] * secondDifference(motion_[term], t);
  const double time = static_cast<double>(t) / kSamples - 0.5;
  return term == kIntegrals ? 1 : term == kIntegrals + 1 ? time : time * time;
}

/// Sums up what the fits with all latencies have in common.
void LatencyProbe::prepare() noexcept {
  phase_ = Phase::comparing;
  tick_ = 0;
  for (std::size_t t = 2 * kSpan_ticks; t < kSamples; ++t) {
    for (std::size_t i = 0; i < kTerms; ++i) {
      for (std::size_t j = 0; j <= i; ++j) normal_[i][j] += termAt(i, t) * termAt(j, t);
    }
  }
  factorise(normal_);
}

/// Fits the motion with one latency.
void LatencyProbe::compare() noexcept {
  std::array<double, kTerms> right{};
  double all = 0;
  for (std::size_t t = 2 * kSpan_ticks; t < kSamples; ++t) {
    const double pushed = secondDifference(pushed_kg_m_, t, tick_);
    all += pushed * pushed;
    for (std::size_t i = 0; i < kTerms; ++i) right[i] += termAt(i, t) * pushed;
  }
  double explained = 0;
  const std::array<double, kTerms> fit = solved(normal_, right, explained);
  if (all > 0 && fit[0] > 0 && explained > best_.explained * all) {
    constexpr double kScaleOfMass = 1e4;  // as in termAt()
    best_ = {.conclusive = explained > kConclusive * all,
             .latency_s = static_cast<double>(tick_) * period_s_,
             .explained = explained / all,
             .mass_kg = kScaleOfMass * fit[0]};
  }
  if (++tick_ <= kMaxLatency_ticks) return;
  phase_ = Phase::off;
  best_.number = result_.number + 1;
  result_ = best_;
}

}  // namespace hapticd::rt

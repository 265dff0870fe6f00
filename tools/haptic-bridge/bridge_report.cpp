// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/bridge_report.h"

#include <fmt/format.h>

namespace hapticd::tools {

std::string bridgeTable(const BridgeSummary& summary) {
  const drivers::LinkStatus& link = summary.link;
  const auto us = [](std::uint64_t ns) { return static_cast<double>(ns) * 1e-3; };
  std::string text = fmt::format(
      "ticks of the device      {:>10}   skipped {}\n"
      "states sent              {:>10}\n"
      "packets received         {:>10}   lost {}, duplicated {}, reordered {}, rejected {}\n"
      "round trip, us           {:>10.0f}   p99 {:.0f}, p99.9 {:.0f}, max {:.0f} (the first number: p50)\n"
      "ticks with a force       {:>10}   of these {} less than commanded: the command was old\n"
      "strongest force, N       {:>10.3f}\n"
      "energy to the hand, mJ   {:>10.3f}\n",
      summary.ticks, summary.skipped_ticks, link.sent, link.received, link.lost, link.duplicated,
      link.reordered, link.rejected, us(link.round_trip.p50_ns), us(link.round_trip.p99_ns),
      us(link.round_trip.p999_ns), us(link.round_trip.max_ns), summary.active_ticks, summary.dead_man_ticks,
      summary.most_force_n, summary.energy_j * 1e3);
  if (summary.log_rows_dropped > 0)
    text +=
        fmt::format("log rows dropped         {:>10}   the disk was too slow\n", summary.log_rows_dropped);
  if (!summary.last_refusal.empty())
    text += fmt::format("last packet rejected     {}\n", summary.last_refusal);
  return text;
}

}  // namespace hapticd::tools

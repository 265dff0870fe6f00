// SPDX-License-Identifier: Apache-2.0
#include <sysexits.h>

#include "tools/hapticbench/jitter/jitter_study.h"
#include "tools/hapticbench/study_command.h"

namespace hapticd::tools {

StudyCommand jitterCommand(CLI::App& app) {
  const auto options = std::make_shared<JitterOptions>();
  StudyCommand command(app, "jitter", "wake-up latency of hapticd's loop beside cyclictest, in one run");
  command->add_option("--seconds", options->seconds, "length of each phase (2)")->check(within(1, 86400));
  command->add_option("--rounds", options->rounds, "phases of each loop and load (30)")
      ->check(within(1, 1000));
  command.names("--loads", options->loads, {"idle", "stress"}, "both");
  command->add_option("--cpu", options->cpu, "CPU of both loops (the last one)")->check(within(-1, 1023));
  command->add_option("--priority", options->priority, "SCHED_FIFO priority of both loops (80)")
      ->check(within(1, 98));
  command->add_option("--period-us", options->period_us, "period of both loops (1000)")
      ->check(within(500, 10000));
  command.json();
  command->footer(
      "The loops take turns on one CPU at one priority, each in a fresh thread or process whose other\n"
      "threads are kept off that CPU. stress-ng loads all other CPUs. Latencies are whole microseconds,\n"
      "rounded down. A run takes 2 x loads x rounds x seconds. Many short phases spread disturbances by\n"
      "other programs over both\n"
      "loops. Needs cyclictest (package rt-tests), stress-ng for the load, and the right to SCHED_FIFO.");
  command.onRun([options](const StudyCommand& self) {
    constexpr int kInterrupted = 130;  // as shells report it
    const Interrupt interrupt;
    const auto result = measureJitter(*options, interrupt, showProgress);
    if (result) return self.report(jitterText(*result), jitterJson(*result));
    return fail(result.error(), interrupt.requested() ? kInterrupted : EX_UNAVAILABLE);
  });
  return command;
}

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/jitter/jitter_command.h"

#include <fmt/format.h>
#include <sysexits.h>
#include <unistd.h>

#include <cstdio>

#include "tools/gnuplot/gnuplot.h"
#include "tools/hapticbench/jitter/jitter_report.h"
#include "tools/options/output_file.h"
#include "tools/options/within.h"
#include "tools/whole_file/whole_file.h"

namespace hapticd::tools {
namespace {

constexpr int kInterrupted = 130;  // as shells have it

int fail(const config::Error& error, int status) {
  fmt::print(stderr, "hapticbench: {}\n", error.text());
  return status;
}

void progress(const std::string& what) {
  if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r{:<60}\r", what);
}

int plot(const JitterResult& result, const std::string& file) {
  const auto plotted = runGnuplot(jitterPlotScript(result), file, "--json writes the data");
  return plotted ? EX_OK : fail(plotted.error(), EX_UNAVAILABLE);
}

}  // namespace

JitterCommand::JitterCommand(CLI::App& app)
    : command_(
          app.add_subcommand("jitter", "wake-up latency of hapticd's loop beside cyclictest, in one run")) {
  command_->add_option("--seconds", options_.seconds, "length of each phase (2)")->check(within(1, 86400));
  command_->add_option("--rounds", options_.rounds, "phases of each loop and load (30)")
      ->check(within(1, 1000));
  command_->add_option("--loads", options_.loads, "idle, stress (both)")
      ->delimiter(',')
      ->check(CLI::IsMember({"idle", "stress"}));
  command_->add_option("--cpu", options_.cpu, "CPU of both loops (the last one)")->check(within(-1, 1023));
  command_->add_option("--priority", options_.priority, "SCHED_FIFO priority of both loops (80)")
      ->check(within(1, 98));
  command_->add_option("--period-us", options_.period_us, "period of both loops (1000)")
      ->check(within(500, 10000));
  command_->add_option("--plot", plot_file_, "plot the histograms with gnuplot")
      ->type_name("FILE.svg")
      ->check(endsIn(".svg"));
  command_->add_option("--json", json_file_, "write the result there too, with the histograms")
      ->type_name("FILE")
      ->check(endsIn(".json"));
  command_->footer(
      "The loops take turns on one CPU at one priority, each in a fresh thread or process, whose other "
      "threads are\n"
      "kept off that CPU. stress-ng loads all other CPUs. Latencies are whole microseconds, rounded down. It "
      "takes\n"
      "2 x loads x rounds x seconds. Many short phases spread what the machine does meanwhile over both "
      "loops.\n"
      "Needs cyclictest (package rt-tests), stress-ng for the load, and the right to SCHED_FIFO.");
}

int JitterCommand::run() const {
  const Interrupt interrupt;
  const auto result = measureJitter(options_, interrupt, progress);
  progress("");
  if (!result) return fail(result.error(), interrupt.requested() ? kInterrupted : EX_UNAVAILABLE);
  fmt::print("{}", jitterTable(*result));
  if (!json_file_.empty()) {
    const auto written = writeWholeFile(json_file_, jitterJson(*result), IfExists::replace);
    if (!written) return fail(written.error(), EX_CANTCREAT);
  }
  return plot_file_.empty() ? EX_OK : plot(*result, plot_file_);
}

}  // namespace hapticd::tools

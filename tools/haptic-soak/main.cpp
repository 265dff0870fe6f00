// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <random>
#include <string>

#include "config/program.h"
#include "tools/haptic-soak/flood_study.h"
#include "tools/haptic-soak/load_study.h"
#include "tools/haptic-soak/soak_report.h"
#include "tools/lib/options/output_file.h"
#include "tools/lib/options/within.h"
#include "tools/lib/whole_file/whole_file.h"

namespace hapticd::tools {
namespace {

namespace fs = std::filesystem;

int fail(const config::Error& error, int status) {
  fmt::print(stderr, "haptic-soak: {}\n", error.text());
  return status;
}

/// The program of that name beside this one, or where an installation has the daemon.
fs::path ownProgram(const char* name) {
  std::error_code unknown;
  const fs::path here = fs::read_symlink("/proc/self/exe", unknown).parent_path();
  const fs::path installed = here.parent_path() / "libexec/hapticd" / name;
  return fs::exists(installed, unknown) ? installed : here / name;
}

void showTime(double now_s, double seconds) {
  if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r{:.0f} of {:.0f} s ", now_s, seconds);
}

bool writeJson(const std::string& file, const std::string& text) {
  if (file.empty()) return true;
  const auto written = writeWholeFile(file, text, IfExists::replace);
  if (!written) fail(written.error(), EX_CANTCREAT);
  return written.has_value();
}

int compareLoads(const LoadOptions& options, const std::string& json_file) {
  const Interrupt interrupt;
  const double seconds = options.round_s * options.rounds * static_cast<double>(kLoads);
  const auto result = studyLoad(options, interrupt, [&](double now_s) { showTime(now_s, seconds); });
  if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r{:<30}\r", "");
  if (!result) return fail(result.error(), EX_UNAVAILABLE);
  fmt::print("{}", loadTable(*result));
  return writeJson(json_file, loadJson(*result)) ? EX_OK : EX_CANTCREAT;
}

int floodDaemon(const FloodOptions& options, const std::string& json_file) {
  const Interrupt interrupt;
  const auto result =
      studyFlood(options, interrupt, [&](double now_s) { showTime(now_s, options.soak.seconds); });
  if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r{:<30}\r", "");
  if (!result) return fail(result.error(), EX_UNAVAILABLE);
  const auto findings = findingsOf(*result, options);
  const bool kept = std::ranges::none_of(findings, &SoakFinding::broken);
  fmt::print("{}\nhaptic-soak: {}\n", floodTable(*result, findings),
             kept ? "all limits kept" : "limits broken");
  if (!writeJson(json_file, floodJson(*result, findings))) return EX_CANTCREAT;
  return kept ? EX_OK : 1;
}

int report(const SoakResult& result, const SoakLimits& limits, const std::string& json_file) {
  const auto findings = findingsOf(result, limits);
  fmt::print("{}", soakTable(result, findings));
  const auto broken = std::ranges::count_if(findings, &SoakFinding::broken);
  fmt::print("\nhaptic-soak: {}{}\n", result.interrupted ? "ended early; " : "",
             broken == 0 ? "all limits kept" : fmt::format("{} limits broken", broken));
  if (!writeJson(json_file, soakJson(result, findings))) return EX_CANTCREAT;
  return broken == 0 ? EX_OK : 1;
}

int run(int argc, char** argv) {
  CLI::App app{
      "haptic-soak: runs hapticd with many clients, changes and reloads, and reports what was lost or grew"};
  app.set_version_flag("-V,--version", std::string("haptic-soak ") + HAPTICD_VERSION);
  SoakOptions options;
  options.daemon = ownProgram("hapticd");
  options.hapticctl = ownProgram("hapticctl");
  options.seed = std::random_device{}();
  SoakLimits limits;
  double minutes = 10;
  double seconds = 0;
  std::string json_file;
  app.add_option("-c,--config", options.config_file, "configuration of hapticd (YAML)")
      ->required()
      ->type_name("FILE");
  app.add_option("-s,--set", options.assignments, "set a parameter after the file is read; may be repeated")
      ->type_name("NAME=VALUE")
      ->take_all()
      ->allow_extra_args(false);
  auto* const in_minutes =
      app.add_option("--minutes", minutes, "how long it runs (10)")->check(within(0.1, 1e5));
  app.add_option("--seconds", seconds, "the same in seconds")->check(within(1.0, 6e6))->excludes(in_minutes);
  app.add_option("--seed", options.seed, "of what is random (chosen and printed)")
      ->type_name("N")
      ->check(within(std::uint64_t{0}, std::numeric_limits<std::uint64_t>::max()));
  app.add_option("--daemon", options.daemon, "hapticd (the one of this build or installation)")
      ->type_name("FILE");
  app.add_option(
         "--on-replug", options.on_replug,
         "command for the shell that unplugs and plugs devices, run again and again; knows $HAPTICD_PID")
      ->type_name("CMD");
  app.add_option("--replug-every", options.replug_every_s, "seconds between two of them (5)")
      ->check(within(0.1, 3600.0));
  app.add_flag("--strict", limits.strict,
               "late and left-out ticks break a limit too: for a machine with real time");
  app.add_option("--max-memory-growth-kb", limits.memory_growth_kb,
                 "beyond the noise (1024, per 10 minutes in longer runs)")
      ->check(within(0.0, 1e9));
  app.add_option("--max-memory-kb", limits.memory_kb, "at any time (no limit)")->check(within(0.0, 1e9));
  LoadOptions load;
  bool compare = false;
  auto* const compare_loads =
      app.add_flag("--compare-loads", compare,
                   "instead: how late ticks begin without load, under clients, and while tracing");
  app.add_option("--clients", load.clients, "of --compare-loads (30)")
      ->check(within(1, 1000))
      ->needs(compare_loads);
  app.add_option("--round", load.round_s, "seconds of one round of --compare-loads (10)")
      ->check(within(1.0, 60.0))
      ->needs(compare_loads);
  app.add_option("--rounds", load.rounds, "of each load (4)")->check(within(1, 10'000))->needs(compare_loads);
  FloodOptions flood;
  bool floods = false;
  auto* const flood_flag =
      app.add_flag(
             "--flood", floods,
             "instead: connections of another user (as root: uid 65534) that ask without a pause and hang "
             "up; judges the longest wait of the watchdog, of hapticctl disengage, and ticks lost")
          ->excludes(compare_loads);
  app.add_option("--connections", flood.connections, "of --flood (40)")
      ->check(within(1, 1000))
      ->needs(flood_flag);
  app.add_option("--max-gap-s", flood.max_gap_s, "of --flood: the longest wait of the watchdog (0.5)")
      ->check(within(0.0, 3600.0))
      ->needs(flood_flag);
  app.add_option("--max-disengage-s", flood.max_disengage_s,
                 "of --flood: the longest hapticctl disengage (0.1)")
      ->check(within(0.0, 3600.0))
      ->needs(flood_flag);
  app.add_option("--json", json_file, "write the result there too")
      ->type_name("FILE")
      ->check(endsIn(".json"));
  app.footer(
      "Ctrl-C ends it early, with the table.\n"
      "Exit status: 0 all limits kept, 1 a limit is broken, 64 usage, 69 hapticd does not start, 73 --json "
      "cannot be written.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return config::endWithoutWork(app, error, EX_USAGE);
  }
  if (compare) {
    load.soak = options;
    return compareLoads(load, json_file);
  }
  options.seconds = seconds > 0 ? seconds : minutes * 60;
  if (floods) {
    flood.soak = options;
    return floodDaemon(flood, json_file);
  }
  fmt::print("haptic-soak: {:.0f} s, --seed {}\n", options.seconds, options.seed);
  config::flushOutput();
  const Interrupt interrupt;
  const auto result = runSoak(options, interrupt, [&](double now_s) { showTime(now_s, options.seconds); });
  if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r{:<30}\r", "");
  return result ? report(*result, limits, json_file) : fail(result.error(), EX_UNAVAILABLE);
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::config::runProgram("haptic-soak", [&] { return hapticd::tools::run(argc, argv); });
}

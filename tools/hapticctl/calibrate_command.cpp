// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <expected>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "tools/hapticctl/calibration_text.h"
#include "tools/hapticctl/command_line.h"
#include "tools/hapticctl/error_text.h"
#include "tools/hapticctl/terminal_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/options/within.h"

namespace hapticd::tools {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPeriod{100};
constexpr double kLeast_n_per_m = 1;
constexpr double kMost_n_per_m = 5000;

struct CalibrateOptions {
  std::optional<double> ceiling_n_per_m;
  double limit_s = 15;
  bool apply = false;
  bool fixed = false;
};

int failed(const CommandOptions& options, const std::string& what, const std::string& remedy) {
  return report(config::Error{"calibrate", what, remedy}, options.json);
}

/// Waits until the daemon has measured the noise of the surface. Errors: the exit code, after the report.
std::expected<Json, int> measure(const CommandOptions& options, VarlinkClient& client, double limit_s) {
  const auto end = Clock::now() + std::chrono::duration<double>(limit_s);
  std::string shown;
  while (true) {
    const auto reply = client.call("io.hapticd.Status.GetStatus");
    if (!reply) return std::unexpected(report(reply.error(), options.json));
    const Json* status = fieldAt(*reply, "status");
    if (status == nullptr || fieldAt(*status, "stiffness") == nullptr) {
      return std::unexpected(failed(options, "hapticd does not report what limits the stiffness",
                                    "is it of another version than hapticctl? See 'hapticctl version'"));
    }
    const std::string needs = calibrationNeeds(*status);
    if (needs.empty()) return *status;
    if (Clock::now() >= end) {
      return std::unexpected(
          failed(options, fmt::format("the noise of the surface was not measured within {:.0f} s", limit_s),
                 "needs " + needs));
    }
    if (needs != shown && !options.json) fmt::print(stderr, "waiting for {}\n", needs);
    shown = needs;
    std::this_thread::sleep_for(kPeriod);
  }
}

int calibrate(const CommandOptions& options, const CalibrateOptions& requested) {
  auto client = connectTo(options, requested.apply);
  if (!client) return report(client.error(), options.json);
  const auto status = measure(options, *client, requested.limit_s);
  if (!status) return status.error();
  Json calibration = calibrationOf(*status, requested.ceiling_n_per_m);
  if (requested.apply) {
    Json values = Json::object();
    const double stiffness =
        std::clamp(std::floor(numberAt(calibration, "stiffnessNPerM")), kLeast_n_per_m, kMost_n_per_m);
    values["force.stiffness_n_per_m"] = requested.fixed ? Json(stiffness) : Json("auto");
    if (requested.ceiling_n_per_m) values["force.stiffness_ceiling_n_per_m"] = *requested.ceiling_n_per_m;
    const auto reply = client->call("io.hapticd.Control.SetParameters", {{"parameters", values}});
    if (!reply) return report(reply.error(), options.json);
    calibration["applied"] = values;
  }
  if (options.json) {
    printJson(calibration);
    return kOk;
  }
  fmt::print("{}", calibrationText(calibration, terminalSize().columns));
  if (const Json* applied = fieldAt(calibration, "applied")) {
    for (const auto& [name, value] : applied->items()) fmt::print("{}: {}\n", name, valueText(value));
  }
  return kOk;
}

}  // namespace

void addCalibrateCommand(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto requested = std::make_shared<CalibrateOptions>();
  CLI::App& command = line.add("calibrate", "Measure how stiff the surface may be, and what limits it",
                               [&options, requested] { return calibrate(options, *requested); });
  command
      .add_option("--ceiling", requested->ceiling_n_per_m,
                  "Largest stiffness, instead of force.stiffness_ceiling_n_per_m")
      ->type_name("N/M")
      ->check(within(kLeast_n_per_m, kMost_n_per_m));
  auto* apply = command.add_flag("--apply", requested->apply,
                                 "Set force.stiffness_n_per_m to auto, and the ceiling if it is given");
  command
      .add_flag("--fixed", requested->fixed, "With --apply: set the number that was found instead of auto")
      ->needs(apply);
  command.add_option("--limit", requested->limit_s, "Longest time to measure, seconds (default 15)")
      ->type_name("S")
      ->check(within(1.0, 120.0));
}

}  // namespace hapticd::tools

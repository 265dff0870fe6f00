// SPDX-License-Identifier: Apache-2.0
// hapticctl-register: the commands of hapticctl that measure where the camera is, and how stiff a surface may
// be.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <expected>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <thread>

#include "tools/hapticctl/additions/handle_touch.h"
#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/commands.h"
#include "tools/hapticctl/text/calibration_text.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/registration/point_files.h"
#include "tools/lib/registration/rigid_fit.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

using base::Error;
using base::Result;

struct RegisterOptions {
  std::string points;
  std::string landmarks;
  double max_residual_m = 0.01;
  bool force = false;
  bool dry_run = false;
  bool show = false;
  bool reset = false;
};

/// Pairs, or the exit code when the error has been printed.
using Pairs = std::expected<std::vector<PointPair>, int>;

double degrees(double rad) {
  return rad * 180 / std::numbers::pi;
}

Json poseJson(const rt::PoseParameters& pose) {
  return {{"xM", pose.position_m.x},  {"yM", pose.position_m.y},    {"zM", pose.position_m.z},
          {"rollRad", pose.roll_rad}, {"pitchRad", pose.pitch_rad}, {"yawRad", pose.yaw_rad}};
}

std::string poseText(const Json& pose) {
  const auto metres = [&](const char* name) { return fixed(numberAt(pose, name), 4); };
  const auto angle = [&](const char* name) { return fixed(degrees(numberAt(pose, name)), 2); };
  return fmt::format("at ({}, {}, {}) m, roll {}, pitch {}, yaw {} degrees", metres("xM"), metres("yM"),
                     metres("zM"), angle("rollRad"), angle("pitchRad"), angle("yawRad"));
}

// --- touches of the handle

/// The world's side of each landmark, by the hand; those left out are taken from `pairs`.
std::expected<void, int> touchAll(const CommandOptions& options, std::vector<PointPair>& pairs) {
  auto client = connectTo(options, false);
  if (!client) return std::unexpected(report(client.error(), options.json));
  for (std::size_t i = 0; i < pairs.size();) {
    const auto place =
        touch({*client, "register", options.json}, fmt::format("'{}'", printable(pairs[i].name)), true);
    if (!place) return std::unexpected(place.error());
    if (*place) {
      pairs[i++].world_m = **place;
    } else {
      pairs.erase(pairs.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  return {};
}

// --- sources of the pairs

Pairs pairsByTouch(const CommandOptions& options, const std::string& file) {
  const auto landmarks = readLandmarks(file);
  if (!landmarks) return std::unexpected(report(landmarks.error(), options.json));
  const auto snapshot = fetchSnapshot(options);
  if (!snapshot) return std::unexpected(snapshot.error());
  std::vector<PointPair> pairs;
  std::vector<Error> unseen;
  for (const Landmark& landmark : *landmarks) {
    const auto seen = positionInCamera(landmark, snapshot->raw, snapshot->depth_model);
    if (!seen) unseen.push_back(seen.error());
    pairs.push_back({landmark.name, seen.value_or(rt::Vec3()), {}});
  }
  if (!unseen.empty()) return std::unexpected(report(unseen, options.json));
  if (const auto touched = touchAll(options, pairs); !touched) return std::unexpected(touched.error());
  return pairs;
}

Pairs pairsFor(const CommandOptions& options, const RegisterOptions& requested) {
  if (!requested.landmarks.empty()) return pairsByTouch(options, requested.landmarks);
  auto pairs = readPointPairs(requested.points);
  if (!pairs) return std::unexpected(report(pairs.error(), options.json));
  return std::move(*pairs);
}

// --- output and calls

Json fitJson(const std::vector<PointPair>& pairs, const RigidFit& fit) {
  Json residuals = Json::array();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    residuals.push_back({{"name", pairs[i].name}, {"residualM", fit.residuals_m[i]}});
  }
  return {{"cameraPose", poseJson(fit.T_world_camera)},
          {"rmsM", fit.rms_m},
          {"largestM", fit.largest_m},
          {"pairs", residuals}};
}

void showFit(const Json& fit) {
  fmt::print("camera {}\n", poseText(fit["cameraPose"]));
  for (const Json& pair : fit["pairs"]) {
    fmt::print("  {:<20} {:>7} mm\n", textAt(pair, "name"), fixed(1000 * numberAt(pair, "residualM"), 2));
  }
  fmt::print("  {:<20} {:>7} mm\n", "root mean square", fixed(1000 * numberAt(fit, "rmsM"), 2));
}

Result<void> checkResidual(const RigidFit& fit, const RegisterOptions& requested) {
  if (requested.force || fit.largest_m <= requested.max_residual_m) return {};
  return std::unexpected(
      Error{"register",
            fmt::format("nothing was changed: a point is off by {:.1f} mm, at most {:.1f} mm are allowed",
                        1000 * fit.largest_m, 1000 * requested.max_residual_m),
            "measure the worst point again, or --max-residual or --force"});
}

/// Sends a pose, or null to go back to the configuration's; adds the daemon's reply to `document`.
int sendPose(const CommandOptions& options, const Json& parameters, Json document) {
  const auto reply = callOnce(options, {"io.hapticd.Control.SetCalibration", parameters, true});
  if (!reply) return report(reply.error(), options.json);
  const bool restart = flagAt(*reply, "restartRequired");
  document["restartRequired"] = restart;
  if (options.json) {
    printJson(document);
  } else {
    fmt::print("{}\n", restart ? "saved; it takes effect at the next start: systemctl restart hapticd"
                               : "saved, and in use");
  }
  return kOk;
}

int registerCamera(const CommandOptions& options, const RegisterOptions& requested) {
  const Pairs pairs = pairsFor(options, requested);
  if (!pairs) return pairs.error();
  const auto fit = fitRigid(*pairs);
  if (!fit) return report(fit.error(), options.json);
  const Json document = fitJson(*pairs, *fit);
  if (!options.json) showFit(document);
  if (const auto good = checkResidual(*fit, requested); !good) return report(good.error(), options.json);
  if (!requested.dry_run) {
    return sendPose(options, {{"cameraPose", document["cameraPose"]}, {"residualM", fit->rms_m}}, document);
  }
  if (options.json) printJson(document);
  return kOk;
}

std::string poseInUseText(const Json& reply) {
  const Json* calibration = fieldAt(reply, "calibration");
  if (!calibration) return "-\n";
  const Json* pose = fieldAt(*calibration, "cameraPose");
  std::string text = fmt::format("in use   {}, from the {}\n", poseText(pose ? *pose : Json()),
                                 textAt(*calibration, "source"));
  if (const Json* waiting = fieldAt(*calibration, "waiting"); waiting && waiting->is_object()) {
    text += fmt::format("waiting  {}, takes effect at the next start\n", poseText(*waiting));
  }
  if (const double residual_m = numberAt(*calibration, "residualM"); !std::isnan(residual_m)) {
    text += fmt::format("residual {} mm, registered {}\n", fixed(1000 * residual_m, 2),
                        textAt(*calibration, "time"));
  }
  return text;
}

int runRegister(const CommandOptions& options, const RegisterOptions& requested) {
  if (requested.show) return callAndPrint(options, {"io.hapticd.Status.GetCalibration"}, poseInUseText);
  if (requested.reset) return sendPose(options, Json::object(), Json::object());
  if (!requested.points.empty() || !requested.landmarks.empty()) return registerCamera(options, requested);
  return reportUsage("hapticctl register", "one of --points, --landmarks, --show and --reset is required",
                     options.json);
}

void addRegisterCommand(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto requested = std::make_shared<RegisterOptions>();
  CLI::App& command =
      line.addHelped("register", [&options, requested] { return runRegister(options, *requested); });
  auto* points = command
                     .add_option("--points", requested->points,
                                 fmt::format("Points in the frames of the camera and of the world; CSV: {}",
                                             kPairsHeader))
                     ->type_name("FILE");
  auto* landmarks =
      command
          .add_option("--landmarks", requested->landmarks,
                      fmt::format("Pixels of a snapshot, which are then touched with the handle; CSV: {}",
                                  kLandmarksHeader))
          ->type_name("FILE");
  command
      .add_option("--max-residual", requested->max_residual_m,
                  "Refuse a pose that leaves a residual larger than this (default 0.01)")
      ->type_name("M")
      ->check(within(0.0, 1.0));
  command.add_flag("--force", requested->force, "Accept the pose, however large the residuals are");
  command.add_flag("--dry-run", requested->dry_run, "Only show the pose, without sending it");
  auto* show = command.add_flag("--show", requested->show, "Show the pose in use and the one that waits");
  auto* reset =
      command.add_flag("--reset", requested->reset, "Go back to the pose of the configuration file");
  points->excludes(landmarks)->excludes(show)->excludes(reset);
  landmarks->excludes(show)->excludes(reset);
  show->excludes(reset);
}

// --- how stiff the surface may be

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPeriod{100};
constexpr double kMin_n_per_m = 1;
constexpr double kMax_n_per_m = 5000;

struct CalibrateOptions {
  std::optional<double> ceiling_n_per_m;
  double limit_s = 15;
  bool apply = false;
  bool fixed = false;
};

int failed(const CommandOptions& options, const std::string& what, const std::string& remedy) {
  return report(base::Error{"calibrate", what, remedy}, options.json);
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

int runCalibrate(const CommandOptions& options, const CalibrateOptions& requested) {
  auto client = connectTo(options, requested.apply);
  if (!client) return report(client.error(), options.json);
  const auto status = measure(options, *client, requested.limit_s);
  if (!status) return status.error();
  Json calibration = calibrationOf(*status, requested.ceiling_n_per_m);
  if (requested.apply) {
    Json values = Json::object();
    const double stiffness =
        std::clamp(std::floor(numberAt(calibration, "stiffnessNPerM")), kMin_n_per_m, kMax_n_per_m);
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
  const std::size_t columns = terminalSize().columns;
  fmt::print("{}", fitted(calibrationText(calibration, columns), columns));
  if (const Json* applied = fieldAt(calibration, "applied")) {
    for (const auto& [name, value] : applied->items()) fmt::print("{}: {}\n", name, valueText(value));
  }
  return kOk;
}

void addCalibrateCommand(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto requested = std::make_shared<CalibrateOptions>();
  CLI::App& command =
      line.addHelped("calibrate", [&options, requested] { return runCalibrate(options, *requested); });
  command
      .add_option("--ceiling", requested->ceiling_n_per_m,
                  "Largest stiffness, instead of force.stiffness_ceiling_n_per_m")
      ->type_name("N/M")
      ->check(within(kMin_n_per_m, kMax_n_per_m));
  auto* apply = command.add_flag("--apply", requested->apply,
                                 "Set force.stiffness_n_per_m to auto, and the ceiling if it is given");
  command
      .add_flag("--fixed", requested->fixed, "With --apply: set the number that was found instead of auto")
      ->needs(apply);
  command.add_option("--limit", requested->limit_s, "Longest time to measure, seconds (default 15)")
      ->type_name("S")
      ->check(within(1.0, 120.0));
}

void addCommands(CommandLine& line) {
  addRegisterCommand(line);
  addCalibrateCommand(line);
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::tools::runCommandLine(argc, argv, /*is_helper=*/true, hapticd::tools::addCommands);
}

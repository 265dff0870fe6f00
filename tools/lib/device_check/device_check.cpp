// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/device_check/device_check.h"

#include <fmt/format.h>
#include <sysexits.h>

#include <algorithm>
#include <cmath>

#include "config/base/file_content.h"
#include "config/base/program.h"
#include "config/base/whole_file.h"
#include "rt/base/clock.h"
#include "tools/lib/device_check/person.h"

namespace hapticd::tools {
namespace {

constexpr std::int64_t kTick_ns = 1'000'000;
constexpr std::array<const char*, 3> kDirections{"to your right", "up", "towards you"};
constexpr int kTries = 3;

std::array<double, 3> componentsOf(const rt::Vec3& v) {
  return {v.x, v.y, v.z};
}

rt::Vec3 row(const std::array<double, 9>& rotation, std::size_t index) {
  return {rotation[3 * index], rotation[3 * index + 1], rotation[3 * index + 2]};
}

base::Error gaveUp() {
  return {"check", "was given up", ""};
}

/// Sum of squares of what the best parabola with its kink at `onset_s` leaves, and its acceleration.
struct Fit {
  double residual = 0;
  double acceleration = 0;
};

Fit fitAt(std::span<const CheckSample> samples, const rt::Vec3& direction, double onset_s) {
  // normal equations of p, v and a
  std::array<std::array<double, 4>, 3> rows{};
  double squares = 0;
  for (const CheckSample& sample : samples) {
    const double after_s = std::max(0.0, sample.time_s - onset_s);
    const std::array<double, 3> terms{1, sample.time_s, 0.5 * after_s * after_s};
    const double value = dot(sample.position_m - samples.front().position_m, direction);
    squares += value * value;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) rows[i][j] += terms[i] * terms[j];
      rows[i][3] += terms[i] * value;
    }
  }
  const std::array<double, 3> right{rows[0][3], rows[1][3], rows[2][3]};
  for (std::size_t pivot = 0; pivot < 3; ++pivot) {
    if (!(std::abs(rows[pivot][pivot]) > 1e-15)) return {squares, 0};
    for (std::size_t i = 0; i < 3; ++i) {
      if (i == pivot) continue;
      const double factor = rows[i][pivot] / rows[pivot][pivot];
      for (std::size_t j = pivot; j < 4; ++j) rows[i][j] -= factor * rows[pivot][j];
    }
  }
  Fit fit{squares, rows[2][3] / rows[2][2]};
  for (std::size_t i = 0; i < 3; ++i) fit.residual -= right[i] * rows[i][3] / rows[i][i];
  return fit;
}

}  // namespace

std::int64_t CheckClock::now_ns() {
  return rt::monotonicNow_ns();
}

void CheckClock::sleepUntil(std::int64_t when_ns) {
  rt::sleepUntil(when_ns);
}

std::optional<std::array<double, 9>> rotationFrom(const std::array<rt::Vec3, 3>& movements_m) {
  std::array<double, 9> rotation{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::array<double, 3> moved = componentsOf(movements_m[axis]);
    const auto longest = std::ranges::max_element(moved, {}, [](double m) { return std::abs(m); });
    const double length = norm(movements_m[axis]);
    constexpr double kAlong = 0.8;  // of the movement; 37 degrees off
    if (!(length >= DeviceCheck::kMinMove_m) || std::abs(*longest) < kAlong * length) return std::nullopt;
    rotation[3 * axis + static_cast<std::size_t>(longest - moved.begin())] = *longest > 0 ? 1 : -1;
  }
  const bool right_handed = dot(cross(row(rotation, 0), row(rotation, 1)), row(rotation, 2)) > 0.5;
  return right_handed ? std::optional(rotation) : std::nullopt;
}

std::optional<Onset> onsetOf(std::span<const CheckSample> samples, const rt::Vec3& direction, double from_s) {
  constexpr double kStep_s = 0.00025;
  constexpr double kShortest_s = 0.01;  // of the motion that shows an acceleration
  if (samples.size() < 20) return std::nullopt;
  const double last_s = samples.back().time_s;
  std::optional<Onset> best;
  const double line = fitAt(samples, direction, last_s).residual;
  double least = line;
  for (double onset_s = from_s; onset_s < last_s - kShortest_s; onset_s += kStep_s) {
    const Fit fit = fitAt(samples, direction, onset_s);
    if (!(fit.acceleration > 0) || fit.residual >= least) continue;
    least = fit.residual;
    best = Onset{onset_s, fit.acceleration};
  }
  // a straight line that explains as much has no kink
  return least < 0.5 * line ? best : std::nullopt;
}

ForceAxes forceAxesOf(std::span<const Push> pushes) {
  std::size_t moved = 0;
  bool as_commanded = true;
  bool with_tool = true;
  bool against_tool = true;
  for (const Push& push : pushes) {
    if (norm(push.moved_m) <= DeviceCheck::kMinYield_m) continue;
    ++moved;
    const auto went = [&](const rt::Vec3& direction) {  // within 45 degrees
      return dot(push.moved_m, direction) > M_SQRT1_2 * norm(push.moved_m);
    };
    as_commanded = as_commanded && went(push.direction);
    with_tool = with_tool && went(rotated(push.orientation, push.direction));
    against_tool = against_tool && went(rotated(inverse(push.orientation), push.direction));
  }
  // where fewer than two thirds moved the handle, an orientation or an axis may be missing
  const bool turned = with_tool || against_tool;
  if (3 * moved < 2 * pushes.size() || as_commanded == turned) return ForceAxes::unclear;
  return turned ? ForceAxes::turned : ForceAxes::as_commanded;
}

base::Result<void> DeviceCheck::run(CheckReport& report) {
  if (auto ok = waitUntilReady(); !ok) return ok;
  const DeviceReading reading = device_.read();
  report.max_force_n = device_.limits().force_n;
  report.measures_orientation = reading.orientation.has_value();
  report.measures_gripper = reading.gripper_rad.has_value();
  report.stated_latency_ms = static_cast<double>(reading.latency_ns) * 1e-6;
  if (auto ok = checkAxes(report); !ok) return ok;
  if (auto ok = checkForces(report); !ok) return ok;
  return measureTimes(report);
}

base::Result<void> DeviceCheck::waitUntilReady() {
  const std::int64_t until_ns = clock_.now_ns() + static_cast<std::int64_t>(kReady_s * 1e9);
  person_.say("Waiting for the device.");
  while (clock_.now_ns() < until_ns) {
    const DeviceReading reading = device_.read();
    if (!reading.fault && reading.calibrated) return {};
    if (person_.givesUp()) return std::unexpected(gaveUp());
    clock_.sleepUntil(clock_.now_ns() + kTick_ns);
  }
  return std::unexpected(base::Error{"device", fmt::format("was not ready within {:.0f} s", kReady_s),
                                     "the messages above say what it needs"});
}

base::Result<rt::Vec3> DeviceCheck::place() {
  const DeviceReading reading = device_.read();
  if (!reading.fault) return reading.position_m;
  return std::unexpected(base::Error{"device", "was lost", "the messages above say why"});
}

base::Result<void> DeviceCheck::checkAxes(CheckReport& report) {
  for (int attempt = 1; attempt <= kTries; ++attempt) {
    std::array<rt::Vec3, 3> movements;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!person_.isReady("Hold the handle in the middle of its reach, and keep it there."))
        return std::unexpected(gaveUp());
      const auto from = place();
      if (!from) return std::unexpected(from.error());
      if (!person_.isReady(fmt::format("Move it about 5 cm {}, and hold it there.", kDirections[axis])))
        return std::unexpected(gaveUp());
      const auto to = place();
      if (!to) return std::unexpected(to.error());
      report.axes[axis].moved_m = movements[axis] = *to - *from;
    }
    if (const auto rotation = rotationFrom(movements)) {
      report.rotation_world_handle = *rotation;
      return {};
    }
    person_.say("These movements do not show the three axes: each has to be 2 cm or longer and straight.");
  }
  report.problems.emplace_back(
      "The movements do not show three right-handed axes: the driver's axes may be wrong.");
  return {};
}

base::Result<Push> DeviceCheck::push(const rt::Vec3& direction, const std::string& words) {
  constexpr double kRamp_s = 0.2;
  constexpr double kPush_s = 0.8;
  if (!person_.isReady(
          fmt::format("The device will push gently {} for a second. Hold the handle loosely.", words)))
    return std::unexpected(gaveUp());
  const rt::Quaternion orientation = device_.read().orientation.value_or(rt::Quaternion{});
  const auto samples = drive(kPush_s, [&](double time_s) {
    const double share = std::min({1.0, time_s / kRamp_s, (kPush_s - time_s) / kRamp_s});
    return std::optional(std::max(0.0, share) * kForce_n * direction);
  });
  if (!samples) return std::unexpected(samples.error());
  Push push{direction, {}, orientation};
  for (const CheckSample& sample : *samples) {
    const rt::Vec3 moved_m = sample.position_m - samples->front().position_m;
    if (norm(moved_m) > norm(push.moved_m)) push.moved_m = moved_m;
  }
  return push;
}

base::Result<void> DeviceCheck::checkForces(CheckReport& report) {
  if (report.rotation_world_handle == std::array<double, 9>{}) return {};
  std::vector<Push> pushes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    CheckedAxis& checked = report.axes[axis];
    const auto pushed = push(row(report.rotation_world_handle, axis), kDirections[axis]);
    if (!pushed) return std::unexpected(pushed.error());
    pushes.push_back(*pushed);
    checked.pushed_m = pushed->moved_m;
    const double along_m = dot(pushed->moved_m, pushed->direction);
    checked.yields = along_m > kMinYield_m;
    checked.confirmed = person_.answer(fmt::format("Did it push {}?", kDirections[axis]));
    if (!checked.confirmed) return std::unexpected(gaveUp());
    if (along_m < -kMinYield_m || !*checked.confirmed) {
      report.problems.push_back(fmt::format(
          "A force {} does not push there: do not use this device with hapticd.", kDirections[axis]));
    }
  }
  return turns_tool_ && report.measures_orientation ? checkTurnedForces(report, std::move(pushes))
                                                    : base::Result<void>{};
}

/// An arm may take a force along the axes of its tool or along its own, which is the same until the tool is
/// turned.
base::Result<void> DeviceCheck::checkTurnedForces(CheckReport& report, std::vector<Push> pushes) {
  constexpr int kTurns = 2;
  constexpr double kLeast_rad = 1.2;  // between any two orientations
  const auto isNew = [&](const rt::Quaternion& orientation) {
    return std::ranges::all_of(pushes, [&](const Push& push) {
      return norm(rotationVectorOf(inverse(push.orientation) * orientation)) > kLeast_rad;
    });
  };
  for (int turn = 0, attempt = 0; turn < kTurns; ++attempt) {
    if (attempt == kTurns + kTries) {
      report.problems.emplace_back(
          "The tool was not turned far enough: whether forces turn with it is not known.");
      return {};
    }
    if (!person_.isReady(
            "Turn the tool by a quarter turn or more, so that it points where it has not pointed "
            "before, and keep it so."))
      return std::unexpected(gaveUp());
    if (!isNew(device_.read().orientation.value_or(rt::Quaternion{}))) continue;
    ++turn;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto pushed = push(row(report.rotation_world_handle, axis), kDirections[axis]);
      if (!pushed) return std::unexpected(pushed.error());
      pushes.push_back(*pushed);
    }
  }
  report.force_axes = forceAxesOf(pushes);
  if (report.force_axes != ForceAxes::as_commanded) {
    report.problems.emplace_back(
        "Where the tool is turned a force does not push where it points: do not use this device with "
        "hapticd.");
  }
  return {};
}

base::Result<void> DeviceCheck::measureTimes(CheckReport& report) {
  constexpr double kBefore_s = 0.03;
  constexpr double kPush_s = 0.06;
  constexpr double kAfter_s = 0.08;
  constexpr double kSettled_s = 0.01;   // after the onset, so that its error does not count
  constexpr double kLatestEnd_ms = 30;  // the dead man's 20 ms, and what a measurement may be off
  if (report.rotation_world_handle == std::array<double, 9>{}) return {};
  const rt::Vec3 direction = row(report.rotation_world_handle, 0);
  if (!person_.isReady("The device will knock to your right once. Hold the handle loosely and still."))
    return std::unexpected(gaveUp());
  const auto samples = drive(kBefore_s + kPush_s + kAfter_s, [&](double time_s) -> std::optional<rt::Vec3> {
    if (time_s < kBefore_s) return rt::Vec3{};
    if (time_s < kBefore_s + kPush_s) return kForce_n * direction;
    return std::nullopt;  // from here on the dead man has to end the force
  });
  if (!samples) return std::unexpected(samples.error());
  const auto pushed = std::ranges::find_if(
      *samples, [&](const CheckSample& sample) { return sample.time_s >= kBefore_s + kPush_s; });
  const auto onset = onsetOf({samples->begin(), pushed}, direction, kBefore_s);
  if (!onset) {
    report.problems.emplace_back("The latency could not be measured: the handle did not yield to a knock.");
    return {};
  }
  report.latency_ms = 1e3 * (onset->time_s - kBefore_s);
  // The end of a force is the onset of one that points back, after the motion that the force goes on to
  // cause.
  std::vector<CheckSample> ends;
  for (CheckSample sample : *samples) {
    const double since_s = sample.time_s - onset->time_s;
    if (since_s < kSettled_s) continue;
    sample.position_m =
        sample.position_m - 0.5 * onset->acceleration_m_per_s2 * since_s * since_s * direction;
    ends.push_back(sample);
  }
  const auto end = onsetOf(ends, -1 * direction, kBefore_s + kPush_s);
  if (end && end->acceleration_m_per_s2 > 0.5 * onset->acceleration_m_per_s2)
    report.dead_man_ms = 1e3 * (end->time_s - kBefore_s - kPush_s);
  if (!report.dead_man_ms || *report.dead_man_ms > kLatestEnd_ms + *report.latency_ms) {
    report.problems.push_back(fmt::format(
        "The force did not end within {:.0f} ms of the last command: the dead man of 20 ms does not act.",
        kLatestEnd_ms + *report.latency_ms));
  }
  return {};
}

base::Result<std::vector<CheckSample>> DeviceCheck::drive(
    double duration_s, const std::function<std::optional<rt::Vec3>(double)>& force) {
  std::vector<CheckSample> samples;
  const std::int64_t began_ns = clock_.now_ns();
  rt::PeriodicClock clock(kTick_ns);
  clock.start(began_ns);
  while (true) {
    clock_.sleepUntil(clock.planned_ns());
    const double time_s = static_cast<double>(clock_.now_ns() - began_ns) * 1e-9;
    if (time_s >= duration_s) break;
    const auto at = place();
    if (!at) return std::unexpected(at.error());
    samples.push_back({time_s, *at});
    if (const auto force_n = force(time_s)) {
      const double most_n = std::min(kForce_n, device_.limits().force_n);
      device_.exert({.force_n = boundedForce(*force_n, most_n), .torque_n_m = {}, .gripper_force_n = 0});
    }
    clock.advance(clock_.now_ns());
  }
  device_.exert({});
  return samples;
}

namespace {

int failed(const CheckOptions& options, const base::Error& error, int status) {
  fmt::print(stderr, "{}: {}\n", options.program, error.text());
  return status;
}

}  // namespace

int checkDevice(const CheckOptions& options, ThreadedDevice& device) {
  const Interrupt interrupt;  // no signal ends the program before the device is without force
  if (auto ok = device.start(); !ok) return failed(options, ok.error(), EX_OSERR);
  const std::string path =
      options.log.empty() ? fmt::format("haptic-check-{}.json", options.kind) : options.log;
  PersonAtTerminal person(interrupt);
  CheckClock clock;
  CheckReport report;
  report.version = options.version;
  report.kind = options.kind;
  const auto done = DeviceCheck(device, person, clock, options.remedy != nullptr).run(report);
  if (const std::string remedy = options.remedy ? options.remedy(report.force_axes) : ""; !remedy.empty())
    report.problems.push_back(remedy);
  const DeviceAbout about = device.about();
  report.model = about.model;
  report.serial = about.serial;
  if (!done) report.problems.push_back("The check ended early: " + done.error().text() + ".");
  fmt::print("\n{}", textOf(report));
  if (auto ok = base::writeWholeFile(path, logOf(report), base::IfExists::replace); !ok)
    return failed(options, ok.error(), EX_CANTCREAT);
  fmt::print("log written to {}; please send it in\n", path);
  return report.problems.empty() ? EX_OK : EX_UNAVAILABLE;
}

namespace {

/// Prints a log that somebody sent. Returns the exit status.
int printLog(const CheckOptions& options) {
  constexpr std::size_t kLongest = 1 << 20;
  const auto content = base::fileContent(options.read, {.longest = kLongest});
  if (!content) return failed(options, {options.read, content.error().text(), ""}, EX_NOINPUT);
  const auto report = reportIn(*content);
  if (!report) return failed(options, report.error(), EX_DATAERR);
  fmt::print("{}", textOf(*report));
  return EX_OK;
}

}  // namespace

std::optional<int> parseCheck(CLI::App& app, CheckOptions& options, int argc, char** argv) {
  app.add_option("--log", options.log,
                 fmt::format("the log to write; one of the same name is replaced (haptic-check-{}.json)",
                             options.kind.empty() ? "KIND" : options.kind))
      ->type_name("FILE");
  CLI::Option* read =
      app.add_option("--read", options.read, "print a log that was written before")->type_name("FILE");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  return read->count() > 0 ? std::optional(printLog(options)) : std::nullopt;
}

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/checks.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstring>

#include "rt/base/realtime_thread.h"
#include "rt/loop/loop_state.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {
namespace {

struct Check {
  const char* name;
  Findings (*look)(const Examination& box);
};
constexpr Check kChecks[]{{"kernel", checkKernel},
                          {"clock", checkClock},
                          {"throttling", checkThrottling},
                          {"isolation", checkIsolation},
                          {"cpu kind", checkCpuKind},
                          {"interrupts", checkInterrupts},
                          {"sibling", checkSibling},
                          {"governor", checkGovernor},
                          {"idle states", checkIdleStates},
                          {"cpu quota", checkCpuQuota},
                          {"memory", checkMemory},
                          {"limits", checkLimits},
                          {"accounts", checkAccounts},
                          {"you", checkCaller},
                          {"configuration", checkConfiguration},
                          {"udev rules", checkUdevRules},
                          {"other udev rules", checkOtherRules},
                          {"kinect", checkKinect},
                          {"depth camera", checkCameras},
                          {"hid", checkHid},
                          {"gpio", checkGpio},
                          {"handle", checkHandle},
                          {"vendor handle", checkVendorHandles},
                          {"traces", checkTraces},
                          {"storage", checkStorage},
                          {"gnuplot", checkGnuplot},
                          {"service", checkService},
                          {"daemon", checkDaemon}};

}  // namespace

Findings examine(const Examination& box) {
  Findings all;
  for (const auto& [name, look] : kChecks) all.add(named(name, look(box)));
  return all;
}

std::string_view verdictText(Verdict verdict) {
  switch (verdict) {
    case Verdict::ok:
      return "ok";
    case Verdict::warn:
      return "warn";
    case Verdict::fail:
      return "fail";
  }
  return "?";
}

int exitStatus(const Findings& findings) {
  return std::ranges::count(findings, Verdict::fail, &Finding::verdict) > 0 ? 1 : 0;
}

std::string textOf(const Findings& findings) {
  std::string text;
  for (const Finding& finding : findings) {
    text += fmt::format("{:<4}  {}: {}", verdictText(finding.verdict), finding.name, printable(finding.fact));
    if (!finding.remedy.empty()) text += fmt::format(" ({})", printable(finding.remedy));
    text += '\n';
  }
  return text;
}

std::string jsonOf(const Findings& findings) {
  Json list = Json::array();
  for (const Finding& finding : findings) {
    list.push_back({{"name", finding.name},
                    {"verdict", verdictText(finding.verdict)},
                    {"fact", finding.fact},
                    {"remedy", finding.remedy}});
  }
  return list.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

namespace {

constexpr const char* kTriggerRules = "udevadm control --reload && udevadm trigger --action=change";

bool isReadableAndWritable(mode_t mode, mode_t read, mode_t write) {
  return (mode & read) != 0 && (mode & write) != 0;
}

}  // namespace

Findings::Findings(const Unread& unread) {
  const auto& [error, path] = unread;
  push_back(unread.denied() ? warning(fmt::format("/{} cannot be read as this user", path), "run as root")
            : unread.absent()
                ? warning(fmt::format("there is no /{}, so it is not known", path), "")
                : warning(fmt::format("/{} cannot be read: {}", path, std::strerror(error)), ""));
}

Findings named(const std::string& name, Findings findings) {
  for (Finding& finding : findings) {
    if (finding.name.empty()) finding.name = name;
  }
  return findings;
}

Findings findingsOfInUse(const DeviceInUse& device) {
  if (device.state.empty()) return {};
  const std::string fact = fmt::format("hapticd uses {}: {}", device.identity, device.state);
  if (device.works) return good(fact);
  return warning(fact, device.detail.empty() ? "hapticctl status shows its state" : device.detail);
}

Finding good(std::string fact) {
  return {Verdict::ok, "", std::move(fact), ""};
}

Finding warning(std::string fact, std::string remedy) {
  return {Verdict::warn, "", std::move(fact), std::move(remedy)};
}

Finding failure(std::string fact, std::string remedy) {
  return {Verdict::fail, "", std::move(fact), std::move(remedy)};
}

Finding failureOfTheService(const Examination& box, std::string fact, std::string remedy) {
  return {isInstalled(box.unit) ? Verdict::fail : Verdict::warn, "", std::move(fact), std::move(remedy)};
}

std::string someOf(const std::vector<std::string>& words, std::size_t most) {
  std::string text;
  for (std::size_t i = 0; i < words.size() && i < most; ++i) text += (i == 0 ? "" : ", ") + words[i];
  return words.size() <= most ? text : fmt::format("{} and {} more", text, words.size() - most);
}

Findings accessFindings(const Examination& box, const std::string& device, const std::string& path) {
  const Reading<Access> access = box.machine.access(path);
  if (!access) return access.error();
  const mode_t mode = access->mode;
  const std::string fact = fmt::format("{}: /{} has mode {:04o}", device, path, mode);
  if ((mode & (S_IROTH | S_IWOTH)) != 0) {
    return warning(fact + ", so that others than hapticd may use it",
                   fmt::format("see the findings on udev rules, then {}", kTriggerRules));
  }
  const auto group = box.machine.group(kDeviceGroup);
  if (!group) return group.error();
  const bool is_own =
      group->has_value() && (*group)->id == access->group && isReadableAndWritable(mode, S_IRGRP, S_IWGRP);
  const bool usable =
      is_own || (group->has_value() &&
                 std::ranges::find(access->more_groups, gid_t{(*group)->id}) != access->more_groups.end());
  if (usable) return {};
  return failureOfTheService(box, fact + ", which keeps the group hapticd out",
                             fmt::format("{}; hapticd's rules give it to the group", kTriggerRules));
}

namespace {

constexpr std::uint64_t kMib = 1U << 20U;

// measured with the synthetic camera, see daemon_memory_test: what the daemon maps, against the size of the
// images and grid.point_capacity
constexpr std::uint64_t kProgram = 65 * kMib;
constexpr std::uint64_t kPerPoint = 145;
constexpr std::uint64_t kPerPixel = 90;

/// Camera, handle, scene, force, trace and the limit of its folder.
constexpr std::uint64_t kThreads = 6;

// of the recorder of raw depth
constexpr std::uint64_t kFramesWaiting = 8;
constexpr std::uint64_t kBytesPerPixel = 2;
constexpr std::uint64_t kCompressedWaiting = 36 * kMib;

}  // namespace

MemoryNeed memoryNeed(const config::Settings& settings) {
  const rt::DepthModelParameters camera = settings.camera.effectiveDepthModel();
  const std::uint64_t pixels = static_cast<std::uint64_t>(std::max(camera.width_px, 0)) *
                               static_cast<std::uint64_t>(std::max(camera.height_px, 0));
  const auto points = static_cast<std::uint64_t>(settings.grid.point_capacity);
  const bool has_leds = settings.leds.driver != config::LedDriver::none;
  const bool depth = settings.trace.depth;
  MemoryNeed need;
  need.program = kProgram;
  need.stacks = (kThreads + (has_leds ? 1 : 0) + (depth ? 1 : 0)) * rt::kThreadStackBytes;
  need.points = points * kPerPoint;
  need.frames = pixels * kPerPixel;
  need.ticks =
      static_cast<std::uint64_t>(settings.trace.flight_recorder_s * settings.loop.rate_hz) * sizeof(rt::Tick);
  if (depth) need.depth = kFramesWaiting * pixels * kBytesPerPixel + kCompressedWaiting;
  return need;
}

}  // namespace hapticd::tools

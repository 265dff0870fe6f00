// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <sstream>

#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/findings.h"

namespace hapticd::tools {
namespace {

constexpr const char* kRelease = "proc/sys/kernel/osrelease";
constexpr const char* kThrottling = "proc/sys/kernel/sched_rt_runtime_us";
constexpr const char* kClocks = "sys/devices/system/clocksource/clocksource0/";
constexpr std::int64_t kUsualRuntimeUs = 950'000;
constexpr std::int64_t kLeastRuntimeUs =
    500'000;  // half of each second: twice what the most expensive tick needs
constexpr std::int64_t kLittleMemoryMib = 256;
constexpr std::int64_t kTooLittleMemoryMib = 64;

/// The Debian package of the newest real-time kernel for this architecture.
std::string realtimePackage(const Machine& machine) {
  const std::string arch = machine.read("proc/sys/kernel/arch").value_or("x86_64");
  if (arch == "aarch64") return "linux-image-rt-arm64";
  if (arch == "armv7l") return "linux-image-rt-armmp";
  return "linux-image-rt-amd64";
}

/// "6.1.0-50-rt-amd64 from linux-image-6.1.0-50-rt-amd64"; without the package if dpkg does not know it.
std::string kernelText(const Machine& machine, const std::string& release) {
  const std::string package = "linux-image-" + release;
  const bool known = machine.exists("var/lib/dpkg/info/" + package + ".list") ||
                     machine.exists("var/lib/dpkg/info/" + package + ":amd64.list");
  return known ? release + " from " + package : release;
}

/// A real-time kernel that is installed in /boot.
std::optional<std::string> installedRealtimeKernel(const Machine& machine) {
  for (const std::string& name : machine.list("boot").value_or(Names{})) {
    if (name.starts_with("vmlinuz-") && name.find("-rt") != std::string::npos) return name.substr(8);
  }
  return std::nullopt;
}

/// The value of a row of /proc/meminfo, in MiB.
std::optional<std::int64_t> memoryMib(const std::string& table, const std::string& row) {
  std::istringstream lines(table);
  std::string title;
  std::int64_t kib = 0;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    if (words >> title >> kib && title == row + ":") return kib / 1024;
  }
  return std::nullopt;
}

}  // namespace

Findings checkKernel(const Examination& box) {
  const Machine& machine = box.machine;
  const Reading<std::string> release = machine.read(kRelease);
  if (!release) return {unreadable("kernel", kRelease, release.error())};
  const std::string kernel = kernelText(machine, *release);
  const Reading<std::string> realtime = machine.read("sys/kernel/realtime");
  if (realtime && *realtime == "1") return {good("kernel", kernel + ", PREEMPT_RT")};
  if (!realtime && !realtime.error().absent()) {
    return {unreadable("kernel", "sys/kernel/realtime", realtime.error())};
  }
  const auto installed = installedRealtimeKernel(machine);
  const std::string remedy = installed ? fmt::format("boot {}, which is installed", *installed)
                                       : fmt::format("apt install {}, then reboot", realtimePackage(machine));
  return {warning("kernel", kernel + ", without PREEMPT_RT: wake-ups can be milliseconds late", remedy)};
}

Findings checkClock(const Examination& box) {
  const Reading<std::string> clock = box.machine.read(std::string(kClocks) + "current_clocksource");
  if (!clock) return {unreadable("clock", std::string(kClocks) + "current_clocksource", clock.error())};
  if (*clock == "tsc" || *clock == "arch_sys_counter") return {good("clock", *clock)};
  const std::string available = box.machine.read(std::string(kClocks) + "available_clocksource").value_or("");
  if ((available + " ").find("tsc ") != std::string::npos) {
    return {warning("clock", *clock + ", although the kernel offers tsc, which is read faster",
                    fmt::format("echo tsc > /{}current_clocksource", kClocks))};
  }
  if (*clock == "hpet" || *clock == "acpi_pm") {
    return {
        warning("clock", *clock + ": each reading takes microseconds; the kernel does not trust the tsc",
                "'dmesg | grep -i tsc' shows why; a newer firmware may help, or tsc=reliable on the kernel "
                "command line")};
  }
  return {warning("clock", *clock + ", a virtual machine's: its host decides when the force loop runs",
                  "run the box on hardware")};
}

Findings checkThrottling(const Examination& box) {
  const Reading<std::int64_t> runtime_us = box.machine.readNumber(kThrottling);
  const std::string remedy =
      fmt::format("sysctl -w kernel.sched_rt_runtime_us={0}; the same line in /etc/sysctl.d/hapticd.conf",
                  kUsualRuntimeUs);
  if (!runtime_us && runtime_us.error().absent()) {
    return {good("throttling", "this kernel does not limit real-time threads")};
  }
  if (!runtime_us) return {unreadable("throttling", kThrottling, runtime_us.error())};
  if (*runtime_us < 0) {
    return {warning("throttling", "off: a runaway real-time thread takes its CPU forever", remedy)};
  }
  const std::string fact = fmt::format("real-time threads get {} us of a CPU's period", *runtime_us);
  if (*runtime_us == 0) return {failure("throttling", "real-time threads get no time at all", remedy)};
  if (*runtime_us < kLeastRuntimeUs)
    return {warning("throttling", fact + ": the force loop may be paused", remedy)};
  return {good("throttling", fact)};
}

Findings checkMemory(const Examination& box) {
  const Reading<std::string> table = box.machine.read("proc/meminfo");
  if (!table) return {unreadable("memory", "proc/meminfo", table.error())};
  const auto available = memoryMib(*table, "MemAvailable");
  if (!available) return {warning("memory", "/proc/meminfo does not list the available memory", "")};
  const std::int64_t swap = memoryMib(*table, "SwapTotal").value_or(0);
  const std::string fact = fmt::format("{} MiB available, {} MiB of swap", *available, swap);
  const std::string remedy = "close other programs, or give the box more memory";
  if (*available < kTooLittleMemoryMib) return {failure("memory", fact, remedy)};
  if (*available < kLittleMemoryMib) return {warning("memory", fact, remedy)};
  if (swap > 0 && box.daemon.answers && !box.daemon.memory_locked) {
    return {
        warning("memory", fact + ", and hapticd's memory is not locked: it can be paged out",
                "loop.lock_memory: true in /etc/hapticd/hapticd.yaml and LimitMEMLOCK=infinity in the unit, "
                "or swapoff -a")};
  }
  return {good("memory", fact)};
}

}  // namespace hapticd::tools

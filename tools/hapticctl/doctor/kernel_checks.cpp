// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <sstream>

#include "tools/hapticctl/doctor/checks.h"

namespace hapticd::tools {
namespace {

constexpr const char* kRelease = "proc/sys/kernel/osrelease";
constexpr const char* kThrottling = "proc/sys/kernel/sched_rt_runtime_us";
constexpr const char* kClocks = "sys/devices/system/clocksource/clocksource0/";
constexpr std::int64_t kUsualRuntimeUs = 950'000;
constexpr std::int64_t kMinRuntimeUs =
    500'000;  // half of each second: twice what the most expensive tick needs
constexpr std::int64_t kLittleMemoryMib = 256;
constexpr std::int64_t kTooLittleMemoryMib = 64;
constexpr std::int64_t kMib = 1 << 20;

/// Debian's kernels for an architecture: the package of the newest real-time one, and how the releases of its
/// kernels end.
struct DebianKernels {
  std::string_view architecture;  ///< as uname prints it
  std::string_view package;
  std::array<std::string_view, 2> endings;
};
constexpr std::array kDebianKernels{
    DebianKernels{"x86_64", "linux-image-rt-amd64", {"-amd64", "-amd64"}},
    DebianKernels{"aarch64", "linux-image-rt-arm64", {"-arm64", "-arm64-16k"}},
    DebianKernels{"armv7l", "linux-image-rt-armmp", {"-armmp", "-armmp-lpae"}},
};

/// What to do for a kernel with PREEMPT_RT. Only where Debian's own kernel runs is it known which package has
/// one, and that it boots; a board with a kernel of its maker or of a derived distribution may not start with
/// Debian's.
std::string realtimeRemedy(const Examination& box, const std::string& release) {
  const auto kernels = std::ranges::find(kDebianKernels, architectureOf(box), &DebianKernels::architecture);
  const bool is_known = kernels != kDebianKernels.end();
  const bool runs_debians = is_known && std::ranges::any_of(kernels->endings, [&](std::string_view ending) {
                              return release.ends_with(ending);
                            });
  if (runs_debians) return fmt::format("apt install {}, then reboot", kernels->package);
  return fmt::format(
      "this kernel is not Debian's{}: 'apt-cache search linux-image | grep -w rt' lists those of this "
      "system's archives; "
      "otherwise ask its maker for one with CONFIG_PREEMPT_RT=y, or build it",
      is_known ? fmt::format(", and {} may not start this machine", kernels->package) : "");
}

/// "6.1.0-50-rt-amd64 from linux-image-6.1.0-50-rt-amd64"; without the package if dpkg does not know it.
std::string kernelText(const Machine& machine, const std::string& release) {
  const std::string package = "linux-image-" + release;
  const std::string list = "var/lib/dpkg/info/" + package;
  const bool known = std::ranges::any_of(std::array{".list", ":amd64.list", ":arm64.list", ":armhf.list"},
                                         [&](const char* ending) { return machine.exists(list + ending); });
  return known ? release + " from " + package : release;
}

/// Whether the kernel says PREEMPT_RT of itself: only those with Debian's patches have /sys/kernel/realtime.
bool saysPreemptRt(const Machine& machine) {
  return machine.read("proc/sys/kernel/version").value_or("").find("PREEMPT_RT") != std::string::npos;
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

std::int64_t mibOf(std::uint64_t bytes) {
  return static_cast<std::int64_t>(bytes) / kMib;
}

/// Which settings take how much of it.
std::string memoryRemedy(const MemoryNeed& need) {
  return fmt::format(
      "more memory, or less for the camera's frames ({} MiB, by its size), grid.point_capacity ({} MiB), "
      "trace.flight_recorder_s ({} MiB) and trace.depth ({} MiB) in /etc/hapticd/hapticd.yaml",
      mibOf(need.frames), mibOf(need.points), mibOf(need.ticks), mibOf(need.depth));
}

}  // namespace

Findings checkKernel(const Examination& box) {
  const Machine& machine = box.machine;
  const Reading<std::string> release = machine.read(kRelease);
  if (!release) return release.error();
  const std::string kernel = kernelText(machine, *release);
  const Reading<std::string> realtime = machine.read("sys/kernel/realtime");
  if ((realtime && *realtime == "1") || saysPreemptRt(machine)) return good(kernel + ", PREEMPT_RT");
  if (!realtime && !realtime.error().absent()) {
    return realtime.error();
  }
  const auto installed = installedRealtimeKernel(machine);
  const std::string remedy =
      installed ? fmt::format("boot {}, which is installed", *installed) : realtimeRemedy(box, *release);
  return warning(kernel + ", without PREEMPT_RT: wake-ups can be milliseconds late", remedy);
}

Findings checkClock(const Examination& box) {
  const Reading<std::string> clock = box.machine.read(std::string(kClocks) + "current_clocksource");
  if (!clock) return clock.error();
  if (*clock == "tsc" || *clock == "arch_sys_counter") return good(*clock);
  const std::string available = box.machine.read(std::string(kClocks) + "available_clocksource").value_or("");
  if ((available + " ").find("tsc ") != std::string::npos) {
    return warning(*clock + ", although the kernel offers tsc, which is read faster",
                   fmt::format("echo tsc > /{}current_clocksource", kClocks));
  }
  if (*clock == "hpet" || *clock == "acpi_pm") {
    return warning(
        *clock + ": each reading takes microseconds; the kernel does not trust the tsc",
        "'dmesg | grep -i tsc' shows why; a newer firmware may help, or tsc=reliable on the kernel "
        "command line");
  }
  return warning(*clock + ", a virtual machine's: its host decides when the force loop runs",
                 "run the box on hardware");
}

Findings checkThrottling(const Examination& box) {
  const Reading<std::int64_t> runtime_us = box.machine.readNumber(kThrottling);
  const std::string remedy =
      fmt::format("sysctl -w kernel.sched_rt_runtime_us={0}; the same line in /etc/sysctl.d/hapticd.conf",
                  kUsualRuntimeUs);
  if (!runtime_us && runtime_us.error().absent()) {
    return good("this kernel does not limit real-time threads");
  }
  if (!runtime_us) return runtime_us.error();
  if (*runtime_us < 0) {
    return warning("off: a runaway real-time thread takes its CPU forever", remedy);
  }
  const std::string fact = fmt::format("real-time threads get {} us of a CPU's period", *runtime_us);
  if (*runtime_us == 0) return failure("real-time threads get no time at all", remedy);
  if (*runtime_us < kMinRuntimeUs) return warning(fact + ": the force loop may be paused", remedy);
  return good(fact);
}

Findings checkMemory(const Examination& box) {
  const Reading<std::string> table = box.machine.read("proc/meminfo");
  if (!table) return table.error();
  const auto available = memoryMib(*table, "MemAvailable");
  if (!available) return warning("/proc/meminfo does not list the available memory", "");
  const std::int64_t swap = memoryMib(*table, "SwapTotal").value_or(0);
  // a running daemon has its memory already
  const std::int64_t need = mibOf(memoryNeed(box.configuration.settings).total());
  const std::int64_t left = box.daemon.answers ? *available : *available - need;
  const std::string fact =
      fmt::format("{} MiB available, {} MiB of swap; hapticd takes about {} MiB", *available, swap, need);
  const std::string remedy = "close other programs, or give the box more memory";
  const auto total = memoryMib(*table, "MemTotal");
  if (total && *total < need + kLittleMemoryMib) {
    const Verdict verdict = *total < need + kTooLittleMemoryMib ? Verdict::fail : Verdict::warn;
    return {{verdict, "memory", fmt::format("{}, too much for {} MiB in all", fact, *total),
             memoryRemedy(memoryNeed(box.configuration.settings))}};
  }
  if (left < kTooLittleMemoryMib) return failure(fact, remedy);
  if (left < kLittleMemoryMib) return warning(fact, remedy);
  if (swap > 0 && box.daemon.answers && !box.daemon.memory_locked) {
    return warning(fact + ", and hapticd's memory is not locked: it can be paged out",
                   "LimitMEMLOCK=infinity in the unit, or swapoff -a");
  }
  return good(fact);
}

}  // namespace hapticd::tools

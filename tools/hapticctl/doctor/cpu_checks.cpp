// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>

#include "config/base/counted.h"
#include "drivers/base/cpus.h"
#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/machine.h"

namespace hapticd::tools {
namespace {

using drivers::CpuSet;

/// How fast each CPU of a machine is, for boards that have big and little ones.
struct CpuKinds {
  std::map<int, std::int64_t> speed;  ///< by CPU; empty where it is not known of every CPU
  std::string measure;                ///< "cpu_capacity" or "cpuinfo_max_freq"
};

/// Reads the capacity of each CPU, which ARM kernels state, or its largest frequency.
CpuKinds readCpuKinds(const Machine& machine, const CpuSet& online) {
  static constexpr std::array kMeasures{"cpu_capacity", "cpufreq/cpuinfo_max_freq"};
  for (const std::string file : kMeasures) {
    CpuKinds kinds{{}, file.substr(file.find('/') + 1)};
    for (const int cpu : online) {
      const auto speed = machine.readNumber(fmt::format("sys/devices/system/cpu/cpu{}/{}", cpu, file));
      if (speed && *speed > 0) kinds.speed[cpu] = *speed;
    }
    if (kinds.speed.size() == online.size()) return kinds;
  }
  return {};
}

/// The CPUs with at least nine tenths of the speed of the fastest: CPUs of one kind may differ by a few per
/// cent. CPU 0 is left out, because it cannot be kept free. All CPUs but 0 where their speeds are not known.
/// hapticd-realtime-setup chooses among the same CPUs.
CpuSet bigCpus(const CpuKinds& kinds, const CpuSet& online) {
  CpuSet cpus = online;
  cpus.erase(0);
  if (kinds.speed.empty()) return cpus;
  std::int64_t most = 0;
  for (const int cpu : cpus) most = std::max(most, kinds.speed.at(cpu));
  std::erase_if(cpus, [&](int cpu) { return kinds.speed.at(cpu) * 10 < most * 9; });
  return cpus;
}

using drivers::common;
using drivers::cpuListText;

const std::string kCpus = "sys/devices/system/cpu/";
constexpr const char* kSetACpuAside = "hapticd-realtime-setup apply, then reboot";
constexpr std::int64_t kSlowWakeUs = 10;

/// The CPUs listed in a file; none if it is absent or holds something else.
Reading<CpuSet> cpusIn(const Machine& machine, const std::string& path) {
  const Reading<std::string> text = machine.read(path);
  if (!text && text.error().absent()) return CpuSet{};
  if (!text) return std::unexpected(text.error());
  return drivers::parseCpuList(*text).value_or(CpuSet{});
}

CpuSet onlineCpus(const Machine& machine) {
  return cpusIn(machine, kCpus + "online").value_or(CpuSet{});
}

CpuSet isolatedCpus(const Machine& machine) {
  return cpusIn(machine, kCpus + "isolated").value_or(CpuSet{});
}

/// The CPUs on which the force loop runs or may run: its own, else the isolated ones.
CpuSet forceCpus(const Examination& box) {
  return box.daemon.cpu ? CpuSet{*box.daemon.cpu} : isolatedCpus(box.machine);
}

/// forceCpus(), or all CPUs if those are not known: what holds for all of them holds for the force loop's
/// too.
CpuSet forceCpusOrAll(const Examination& box) {
  const CpuSet cpus = forceCpus(box);
  return cpus.empty() ? onlineCpus(box.machine) : cpus;
}

std::string cpuFolder(int cpu) {
  return fmt::format("{}cpu{}/", kCpus, cpu);
}

bool isNumber(const std::string& text) {
  return !text.empty() &&
         std::ranges::all_of(text, [](unsigned char letter) { return std::isdigit(letter) != 0; });
}

bool isFolder(const Machine& machine, const std::string& path) {
  return machine.list(path).has_value();
}

/// "24 (xhci_hcd)"; empty if no driver handles this interrupt, so that it never occurs.
Reading<std::string> interruptName(const Machine& machine, const std::string& number) {
  const std::string folder = "proc/irq/" + number;
  const Reading<Names> entries = machine.list(folder);
  if (!entries) return std::unexpected(entries.error());
  for (const std::string& name : *entries) {
    if (isFolder(machine, folder + "/" + name)) return fmt::format("{} ({})", number, name);
  }
  return std::string();
}

/// Whether an interrupt may occur on one of `cpus`. With managed_irq the kernel places some interrupts
/// itself, regardless of their permitted CPUs: for those their actual CPUs count.
Reading<bool> mayCome(const Machine& machine, const std::string& number, const CpuSet& cpus,
                      bool kernel_keeps_away) {
  const std::string folder = "proc/irq/" + number + "/";
  const Reading<CpuSet> allowed = cpusIn(machine, folder + "smp_affinity_list");
  if (!allowed) return std::unexpected(allowed.error());
  if (common(*allowed, cpus).empty()) return false;
  const CpuSet actual = cpusIn(machine, folder + "effective_affinity_list").value_or(CpuSet{});
  return !kernel_keeps_away || actual.empty() || !common(actual, cpus).empty();
}

/// The CPU of the force loop: that of the running daemon, else the one that it takes at its start.
std::optional<int> forceCpu(const Examination& box) {
  if (box.daemon.cpu) return box.daemon.cpu;
  if (const int configured = box.configuration.settings.loop.cpu; configured >= 0) return configured;
  const CpuSet isolated = isolatedCpus(box.machine);
  const CpuSet online = onlineCpus(box.machine);
  if (!isolated.empty()) return *isolated.rbegin();
  return online.empty() ? std::nullopt : std::optional(*online.rbegin());
}

/// The CPU that suits the force loop best: the last of the big ones among `cpus`, else the last of them.
int bestOf(const Machine& machine, const CpuSet& cpus) {
  const CpuSet online = onlineCpus(machine);
  const CpuSet big = common(cpus, bigCpus(readCpuKinds(machine, online), online));
  return big.empty() ? *cpus.rbegin() : *big.rbegin();
}

/// The frequency policy that a CPU shares with others: "policy4"; empty if it is not known.
std::string frequencyPolicy(const Machine& machine, int cpu) {
  for (const std::string& name : machine.list(kCpus + "cpufreq").value_or(Names{})) {
    std::istringstream related(machine.read(kCpus + "cpufreq/" + name + "/related_cpus").value_or(""));
    for (int other = -1; related >> other;) {
      if (other == cpu) return name;
    }
  }
  return {};
}

/// "CPU 3", or "CPU 5 (policy4, of CPU 4-5)".
std::string cpuWithPolicy(const Machine& machine, int cpu, const std::string& policy) {
  if (policy.empty()) return fmt::format("CPU {}", cpu);
  std::istringstream related(machine.read(kCpus + "cpufreq/" + policy + "/related_cpus").value_or(""));
  CpuSet cpus;
  for (int other = -1; related >> other;) cpus.insert(other);
  return fmt::format("CPU {} ({}, of CPU {})", cpu, policy, cpuListText(cpus));
}

struct IdleState {
  std::string name;
  std::int64_t latency_us = 0;
};

/// The enabled idle state of a CPU from which it takes longest to wake up.
Reading<IdleState> deepestIdleState(const Machine& machine, int cpu) {
  IdleState deepest;
  const std::string folder = cpuFolder(cpu) + "cpuidle/";
  const Reading<Names> names = machine.list(folder);
  if (!names && names.error().absent()) return deepest;
  if (!names) return std::unexpected(names.error());
  for (const std::string& name : *names) {
    const Reading<std::int64_t> latency_us = machine.readNumber(folder + name + "/latency");
    if (!latency_us) return std::unexpected(latency_us.error());
    const bool disabled = machine.readNumber(folder + name + "/disable").value_or(0) != 0;
    if (!disabled && *latency_us > deepest.latency_us) {
      deepest = {machine.read(folder + name + "/name").value_or(name), *latency_us};
    }
  }
  return deepest;
}

/// The interrupts that may occur on one of `cpus`, by number and name.
Reading<Names> interruptsOn(const Machine& machine, const CpuSet& cpus) {
  const Reading<Names> entries = machine.list("proc/irq");
  if (!entries) return std::unexpected(entries.error());
  const bool kernel_keeps_away =
      machine.read("proc/cmdline").value_or("").find("managed_irq") != std::string::npos;
  Names coming;
  for (const std::string& number : *entries) {
    // 0 is the timer used at boot: it cannot be moved, and does not occur later
    if (!isNumber(number) || number == "0") continue;
    const Reading<std::string> name = interruptName(machine, number);
    if (!name) return std::unexpected(name.error());
    if (name->empty()) continue;
    const Reading<bool> may_come = mayCome(machine, number, cpus, kernel_keeps_away);
    if (!may_come) return std::unexpected(may_come.error());
    if (*may_come) coming.push_back(*name);
  }
  return coming;
}

}  // namespace

Findings checkIsolation(const Examination& box) {
  const Machine& machine = box.machine;
  const CpuSet online = onlineCpus(machine);
  if (online.size() == 1) {
    return warning("the machine has one CPU: none can be kept free for the force loop",
                   "use a machine with more CPUs");
  }
  const Reading<CpuSet> isolated = cpusIn(machine, kCpus + "isolated");
  if (!isolated) return isolated.error();
  const std::string tickless = machine.read(kCpus + "nohz_full").value_or("");
  std::string fact = isolated->empty() ? "no CPU is isolated" : "isolated: CPU " + cpuListText(*isolated);
  if (isNumber(tickless.substr(0, 1))) fact += ", without timer ticks: CPU " + tickless;
  if (box.daemon.cpu && isolated->contains(*box.daemon.cpu)) {
    return good(fmt::format("{}; the force loop runs on CPU {}", fact, *box.daemon.cpu));
  }
  if (isolated->empty()) return warning(fact + ": other programs delay the force loop", kSetACpuAside);
  const std::string remedy = fmt::format(
      "'loop:' with 'cpu: {}' below it in /etc/hapticd/hapticd.yaml, then systemctl restart hapticd",
      bestOf(machine, *isolated));
  if (box.daemon.cpu) {
    return warning(fmt::format("{}, but the force loop runs on CPU {}", fact, *box.daemon.cpu), remedy);
  }
  if (box.daemon.answers) return warning(fact + ", but the force loop is not pinned to a CPU", remedy);
  return good(fact);
}

Findings checkCpuKind(const Examination& box) {
  const Machine& machine = box.machine;
  const CpuSet online = onlineCpus(machine);
  const CpuKinds kinds = readCpuKinds(machine, online);
  const CpuSet big = bigCpus(kinds, online);
  const std::optional<int> cpu = forceCpu(box);
  if (kinds.speed.empty()) return good("no CPU is known to be slower than the others");
  if (!cpu || !kinds.speed.contains(*cpu)) {
    return warning("the CPU of the force loop is not one of the CPUs that are online: " + cpuListText(online),
                   "'cpu:' below 'loop:' in /etc/hapticd/hapticd.yaml");
  }
  CpuSet little = online;
  little.erase(0);
  for (const int one : big) little.erase(one);
  if (little.empty()) return good(fmt::format("all are alike ({})", kinds.measure));
  const std::string fact =
      fmt::format("big: CPU {}, little: CPU {} ({} {} and {}); the force loop takes CPU {}", cpuListText(big),
                  cpuListText(little), kinds.measure, kinds.speed.at(*big.rbegin()),
                  kinds.speed.at(*little.rbegin()), *cpu);
  if (big.contains(*cpu)) return good(fact);
  return warning(
      fact + (little.contains(*cpu) ? ", a little one" : ", which cannot be kept free"),
      fmt::format("hapticd-realtime-setup apply --cpu {0}, and 'loop:' with 'cpu: {0}' below it in "
                  "/etc/hapticd/hapticd.yaml, then reboot",
                  *big.rbegin()));
}

Findings checkInterrupts(const Examination& box) {
  const CpuSet cpus = forceCpus(box);
  if (cpus.empty()) return warning("no CPU is kept free of them", kSetACpuAside);
  const Reading<Names> coming = interruptsOn(box.machine, cpus);
  if (!coming) return Unread{coming.error().system_error, "proc/irq"};
  const std::string where = "CPU " + cpuListText(cpus);
  if (coming->empty()) return good("none can occur on " + where);
  return warning(fmt::format("{} can occur on {}: {}", base::counted(coming->size(), "interrupt(s)"), where,
                             someOf(*coming)),
                 "systemctl restart hapticd-realtime, which hapticd-realtime-setup apply sets up");
}

Findings checkSibling(const Examination& box) {
  const Machine& machine = box.machine;
  const CpuSet cpus = forceCpus(box);
  if (cpus.empty()) return good("does not matter while no CPU is kept free for the force loop");
  CpuSet siblings;
  for (const int cpu : cpus) {
    const std::string path = cpuFolder(cpu) + "topology/thread_siblings_list";
    const Reading<CpuSet> of_this = cpusIn(machine, path);
    if (!of_this) return of_this.error();
    siblings.insert(of_this->begin(), of_this->end());
  }
  for (const int cpu : cpus) siblings.erase(cpu);
  siblings = common(siblings, onlineCpus(machine));
  if (siblings.empty()) return good(fmt::format("CPU {} shares its core with no other", cpuListText(cpus)));
  return warning(
      fmt::format("CPU {} shares its core with CPU {}, whose programs slow it down", cpuListText(cpus),
                  cpuListText(siblings)),
      fmt::format("echo off > /{}smt/control; nosmt on the kernel command line keeps it so", kCpus));
}

Findings checkGovernor(const Examination& box) {
  std::vector<std::string> others;
  std::set<std::string> files;
  std::size_t scaled = 0;
  for (const int cpu : forceCpusOrAll(box)) {
    const std::string path = cpuFolder(cpu) + "cpufreq/scaling_governor";
    const Reading<std::string> governor = box.machine.read(path);
    if (!governor && governor.error().absent()) continue;
    if (!governor) return governor.error();
    ++scaled;
    if (*governor == "performance") continue;
    const std::string policy = frequencyPolicy(box.machine, cpu);
    others.push_back(fmt::format("{} {}", cpuWithPolicy(box.machine, cpu, policy), *governor));
    files.insert(policy.empty() ? path : fmt::format("{}cpufreq/{}/scaling_governor", kCpus, policy));
  }
  if (scaled == 0) return good("the kernel does not change the CPUs' frequency");
  if (others.empty()) return good("performance on " + base::counted(scaled, "CPU(s)"));
  const std::string command =
      files.size() == 1 ? fmt::format("echo performance > /{}", *files.begin())
                        : "echo performance | tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor";
  return warning(someOf(others) + ": the frequency rises only once the CPU is busy",
                 command + ", or hapticd-realtime-setup apply for the force loop's CPU at each boot");
}

Findings checkIdleStates(const Examination& box) {
  IdleState deepest;
  for (const int cpu : forceCpusOrAll(box)) {
    const Reading<IdleState> state = deepestIdleState(box.machine, cpu);
    if (!state) return Unread{state.error().system_error, cpuFolder(cpu) + "cpuidle"};
    if (state->latency_us > deepest.latency_us) deepest = *state;
  }
  if (deepest.latency_us == 0) return good("none that takes time to wake up from");
  if (deepest.latency_us <= kSlowWakeUs) {
    return good(fmt::format("waking up takes at most {} us", deepest.latency_us));
  }
  const std::string fact = fmt::format("waking up from {} takes {} us", deepest.name, deepest.latency_us);
  if (!box.machine.exists("dev/cpu_dma_latency")) {
    const bool is_pc = architectureOf(box) == "x86_64";
    return warning(
        fact + ", and there is no /dev/cpu_dma_latency to prevent it",
        fmt::format("{} on the kernel command line", is_pc ? "processor.max_cstate=1" : "cpuidle.off=1"));
  }
  Findings findings = accessFindings(box, fact, "dev/cpu_dma_latency");
  if (findings.empty()) {
    return good(fact + "; hapticd can prevent it while it runs (/dev/cpu_dma_latency)");
  }
  // only a warning: wake-ups are late, but the box works
  for (Finding& finding : findings) finding.verdict = Verdict::warn;
  return findings;
}

Findings checkCpuQuota(const Examination& box) {
  std::string process = "0";
  if (runsByHand(box)) {
    process = std::to_string(box.daemon.socket_process);
  } else if (box.unit && box.unit->contains("MainPID")) {  // whose sockets are the service manager's
    process = box.unit->at("MainPID");
  }
  if (process == "0") process = "self";
  const auto quota = drivers::cpuQuotaOf(process, box.machine.root());
  if (!quota) return good("no control group limits the CPU time of hapticd");
  if (quota->throttled == 0 && quota->cpus >= 1) return good(drivers::textOf(*quota));
  return warning(drivers::textOf(*quota), drivers::kRaiseCpuQuota);
}

}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
// tools/realtime-setup on a simulated machine.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "realtime_setup_fixture.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

const std::string kGrub = "etc/default/grub.d/hapticd.cfg";
const std::string kDropIn = "etc/systemd/system/hapticd.service.d/50-cpu.conf";
const std::string kUnit = "etc/systemd/system/hapticd-realtime.service";
const std::string kIrqbalance = "etc/systemd/system/irqbalance.service.d/hapticd.conf";
const std::string kEnabled = "etc/systemd/system/multi-user.target.wants/hapticd-realtime.service";
const std::string kGovernor = "sys/devices/system/cpu/cpu3/cpufreq/scaling_governor";

class RealtimeSetup : public RealtimeSetupOn {
 protected:
  RealtimeSetup() {
    fillWithAGoodBox(machine);
    machine.set("proc/cmdline", "quiet");
    machine.set("proc/irq/default_smp_affinity", "f");
    machine.set("proc/irq/24/smp_affinity_list", "0-3");
    machine.set(kGovernor, "powersave");
    machine.set("etc/default/grub", "GRUB_CMDLINE_LINUX_DEFAULT=\"quiet\"");
    machine.set("usr/sbin/update-grub", "");
    machine.set("usr/sbin/irqbalance", "");
    machine.set("etc/systemd/system/hapticd.service.d/60-udp-peer.conf",
                "[Service]\nIPAddressAllow=10.0.0.9");
    machine.makeFolder("var/lib");
    machine.makeFolder("run");
  }
};

TEST_F(RealtimeSetup, ShowsWhatIsMissingAndChangesNothing) {
  const auto before = treeBelow(machine.root());
  const Finished finished = run({});
  expectDone(finished);
  for (const char* part : {"CPU 3 of 0-3 for the force loop, 0-2 for everything else",
                           "missing  kernel command line: isolcpus=managed_irq,domain,3:",
                           "missing  interrupts elsewhere: 1 can occur on CPU 3", "missing  full speed",
                           "missing  loop.cpu in /etc/hapticd/hapticd.yaml: below 'loop:', the line 'cpu: 3'",
                           "set      a core of its own"}) {
    EXPECT_TRUE(has(finished.output, part)) << part << " in\n" << finished.output;
  }
  EXPECT_EQ(treeBelow(machine.root()), before);
}

TEST_F(RealtimeSetup, ShowsNothingMissingOnceAllIsSet) {
  expectDone(run({"apply"}));
  expectDone(run({"start"}));
  machine.set("proc/cmdline", "quiet isolcpus=managed_irq,domain,3 rcu_nocbs=3 irqaffinity=0-2");
  machine.set("etc/hapticd/hapticd.yaml", "camera:\n  cpu: 9\nloop:\n  # cpu: 1\n  cpu: 3  # ours\n");
  const Finished finished = run({"show"});
  expectDone(finished);
  EXPECT_FALSE(has(finished.output, "missing")) << finished.output;
}

TEST_F(RealtimeSetup, WritesEachFileForTheCpu) {
  const Finished finished = run({"apply", "--cpu", "2"});
  expectDone(finished);
  EXPECT_EQ(
      settings(kGrub),
      "GRUB_CMDLINE_LINUX_DEFAULT=\"$GRUB_CMDLINE_LINUX_DEFAULT isolcpus=managed_irq,domain,2 rcu_nocbs=2 "
      "irqaffinity=0-1,3\"\n");
  EXPECT_EQ(settings(kDropIn), "[Service]\nCPUAffinity=\nCPUAffinity=0-1,3\n");
  EXPECT_EQ(settings(kIrqbalance), "[Service]\nEnvironment=IRQBALANCE_BANNED_CPULIST=2\n");
  EXPECT_TRUE(has(content(kUnit), " start --cpu 2\n")) << content(kUnit);
  EXPECT_EQ(fs::read_symlink(machine.root() / kEnabled), "/" + kUnit);
  EXPECT_TRUE(has(finished.output, "below 'loop:', the line\n    cpu: 2\n")) << finished.output;
}

TEST_F(RealtimeSetup, WritesAUnitThatSystemdUnderstands) {
  if (!fs::exists("/usr/bin/systemd-analyze")) GTEST_SKIP() << "there is no systemd-analyze";
  expectDone(run({"apply"}));
  const Finished verified =
      runToEnd({"/usr/bin/systemd-analyze", "verify", "--man=no", (machine.root() / kUnit).string()});
  EXPECT_FALSE(has(verified.errors, "hapticd-realtime.service:")) << verified.errors;
}

TEST_F(RealtimeSetup, AppliedTwiceIsTheSameAsOnce) {
  expectDone(run({"apply"}));
  const auto once = treeBelow(machine.root());
  const Finished again = run({"apply"});
  expectDone(again);
  EXPECT_EQ(treeBelow(machine.root()), once);
  EXPECT_TRUE(has(again.output, "is set: /" + kGrub)) << again.output;
}

TEST_F(RealtimeSetup, RevertRestoresEveryFileExactly) {
  machine.set(kDropIn, "[Service]\nCPUAffinity=0\n\n# no newline at the end: ");
  machine.setMode(kDropIn, 0664);  // which no umask leaves to a new file
  expectRevertRestoresAll();
}

TEST_F(RealtimeSetup, RevertRestoresWhatWasBeforeTheFirstOfSeveralApplies) {
  const auto before = treeBelow(machine.root());
  expectDone(run({"apply", "--cpu", "1"}));
  expectDone(run({"apply", "--cpu", "3"}));
  EXPECT_EQ(settings(kDropIn), "[Service]\nCPUAffinity=\nCPUAffinity=0-2\n");
  expectDone(run({"revert"}));
  EXPECT_EQ(treeBelow(machine.root()), before);
}

TEST_F(RealtimeSetup, RevertWithoutApplyDoesNothing) {
  const auto before = treeBelow(machine.root());
  const Finished finished = run({"revert"});
  expectDone(finished);
  EXPECT_TRUE(has(finished.output, "nothing to revert"));
  EXPECT_EQ(treeBelow(machine.root()), before);
}

TEST_F(RealtimeSetup, LeavesForeignFilesAlone) {
  const auto before = treeBelow(machine.root());
  expectDone(run({"apply"}));
  auto after = treeBelow(machine.root());
  for (const auto& [path, what] : before) EXPECT_EQ(after[path], what) << path;
}

TEST_F(RealtimeSetup, KeepsWhatSomebodyHasEditedSince) {
  expectDone(run({"apply"}));
  machine.set(kDropIn, "[Service]\nCPUAffinity=1");
  expectDone(run({"revert"}));
  EXPECT_FALSE(fs::exists(machine.root() / kDropIn));
  EXPECT_EQ(content(kDropIn + ".edited"), "[Service]\nCPUAffinity=1\n");
}

TEST_F(RealtimeSetup, DryRunSaysWhatItWouldDoAndDoesNothing) {
  const auto before = treeBelow(machine.root());
  for (const char* command : {"apply", "start"}) {
    const Finished finished = run({command, "--dry-run"});
    expectDone(finished);
    EXPECT_TRUE(has(finished.output, "would ")) << finished.output;
  }
  EXPECT_EQ(treeBelow(machine.root()), before);
  expectDone(run({"apply"}));
  const auto applied = treeBelow(machine.root());
  const Finished revert = run({"revert", "--dry-run"});
  expectDone(revert);
  EXPECT_TRUE(has(revert.output, "would remove /" + kGrub)) << revert.output;
  EXPECT_EQ(treeBelow(machine.root()), applied);
}

TEST_F(RealtimeSetup, SaysTheKernelCommandLineWhereThereIsNoGrub) {
  machine.remove("usr/sbin/update-grub");
  machine.remove("usr/sbin/irqbalance");
  const Finished finished = run({"apply"});
  expectDone(finished);
  EXPECT_FALSE(fs::exists(machine.root() / kGrub));
  EXPECT_FALSE(fs::exists(machine.root() / kIrqbalance));
  EXPECT_TRUE(has(finished.output, "by hand")) << finished.output;
  EXPECT_TRUE(has(finished.output, "    isolcpus=managed_irq,domain,3 rcu_nocbs=3 irqaffinity=0-2\n"));
}

TEST_F(RealtimeSetup, RunsNoCommandBelowAnotherRoot) {
  machine.set("usr/sbin/update-grub", "#!/bin/sh\ntouch /nowhere");
  machine.setMode("usr/sbin/update-grub", 0755);
  const Finished finished = run({"apply"});
  EXPECT_TRUE(has(finished.output, "not run below --root: update-grub\n")) << finished.output;
  EXPECT_TRUE(has(finished.output, "not run below --root: systemctl daemon-reload\n"));
  EXPECT_FALSE(has(finished.output, "\nrun: "));
}

TEST_F(RealtimeSetup, StartMovesInterruptsAwayAndRaisesTheFrequency) {
  machine.set("proc/irq/25/smp_affinity_list", "1");
  expectDone(run({"start", "--cpu", "3"}));
  EXPECT_EQ(content("proc/irq/24/smp_affinity_list"), "0-2\n");
  EXPECT_EQ(content("proc/irq/25/smp_affinity_list"), "1\n");
  EXPECT_EQ(content("proc/irq/default_smp_affinity"), "00000007\n");
  EXPECT_EQ(content(kGovernor), "performance\n");
}

TEST_F(RealtimeSetup, StopRestoresInterruptsAndFrequency) {
  const auto before = treeBelow(machine.root());
  expectDone(run({"start", "--cpu", "3"}));
  expectDone(run({"start", "--cpu", "2"}));
  expectDone(run({"stop"}));
  EXPECT_EQ(treeBelow(machine.root()), before);
}

TEST_F(RealtimeSetup, WritesMasksOfAsManyGroupsAsTheKernelDoes) {
  machine.set("sys/devices/system/cpu/online", "0-39");
  machine.set("proc/irq/default_smp_affinity", "ff,ffffffff");
  expectDone(run({"start", "--cpu", "33"}));
  EXPECT_EQ(content("proc/irq/default_smp_affinity"), "000000fd,ffffffff\n");
}

TEST_F(RealtimeSetup, RefusesACpuThatCannotBeKeptFreeAndChangesNothing) {
  const auto before = treeBelow(machine.root());
  expectRefusal(run({"apply", "--cpu", "0"}), "CPU 0 cannot be kept free");
  expectRefusal(run({"apply", "--cpu", "4"}), "there is no CPU 4, or it is off; the machine has 0-3");
  EXPECT_EQ(treeBelow(machine.root()), before);
}

TEST_F(RealtimeSetup, RefusesAMachineWithOneCpu) {
  machine.set("sys/devices/system/cpu/online", "0");
  expectRefusal(run({"apply"}), "the machine has one CPU");
  const Finished shown = run({"show"});
  expectDone(shown);
  EXPECT_TRUE(has(shown.output, "one CPU"));
}

TEST_F(RealtimeSetup, RefusesOthersThanRoot) {
  const fs::path script = machine.root() / "script";
  fs::copy_file(REALTIME_SETUP, script);
  fs::permissions(script, fs::perms(0755));
  ProgramOptions options;
  if (::geteuid() == 0) options.user = 65534;
  for (const char* command : {"apply", "revert", "start", "stop"}) {
    expectRefusal(runToEnd({"/bin/bash", script, command}, options), "takes root: sudo script");
  }
}

TEST_F(RealtimeSetup, ExplainsWrongUsageWithExitStatus2) {
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"frobnicate"},
                                                    {"apply", "revert"},
                                                    {"apply", "--cpu"},
                                                    {"apply", "--cpu", "three"},
                                                    {"apply", "--cpu=-1"},
                                                    {"--root", "/nowhere/at/all"},
                                                    {"--nope"}}) {
    std::vector<std::string> command{"/bin/bash", REALTIME_SETUP};
    command.insert(command.end(), arguments.begin(), arguments.end());
    const Finished finished = runToEnd(command);
    EXPECT_EQ(finished.ending, exitedWith(2)) << arguments.front();
    EXPECT_TRUE(has(finished.errors, "--help")) << finished.errors;
  }
}

TEST_F(RealtimeSetup, PassesShellcheck) {
  if (!fs::exists("/usr/bin/shellcheck")) GTEST_SKIP() << "there is no shellcheck";
  const Finished finished = runToEnd({"/usr/bin/shellcheck", REALTIME_SETUP});
  EXPECT_EQ(finished.output, "");
}

}  // namespace
}  // namespace hapticd::test

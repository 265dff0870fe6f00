// SPDX-License-Identifier: Apache-2.0
// The checks of `hapticctl doctor` on synthetic files of /sys, /proc, /etc and /dev.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "doctor_fixture.h"

namespace hapticd::tools {
namespace {

using test::WithoutPrivileges;

class Doctor : public DoctorOnFiles {
 protected:
  Doctor() {
    test::fillWithAGoodBox(files);
    box.daemon = {true, "", 3, true, {}};
  }
};

const std::string kCpu3 = "sys/devices/system/cpu/cpu3/";
const std::string kCamera = "sys/bus/usb/devices/1-1.1/";
const std::string kIsolated = "sys/devices/system/cpu/isolated";
const std::string kClock = "sys/devices/system/clocksource/clocksource0/";

TEST_F(Doctor, FindsNothingWrongWithAGoodBox) {
  const Findings findings = examine(box);
  EXPECT_EQ(std::ranges::count(findings, Verdict::ok, &Finding::verdict), std::ssize(findings))
      << textOf(findings);
  EXPECT_EQ(exitStatus(findings), 0);
}

TEST_F(Doctor, SaysSomethingOfEveryCheckOnAMachineWithoutAnyFiles) {
  const test::MadeUpMachine empty;
  box.machine = Machine(empty.root());
  box.unit.reset();
  box.daemon = {};
  const Findings findings = examine(box);
  EXPECT_GE(findings.size(), 19U) << textOf(findings);
  EXPECT_EQ(exitStatus(findings), 0) << textOf(findings);
}

TEST_F(Doctor, NamesTheFileThatItMayNotReadAndSaysToRunAsRoot) {
  struct Case {
    Findings (*check)(const Examination&);
    std::string path;
  };
  const std::vector<Case> cases{{checkKernel, "proc/sys/kernel/osrelease"},
                                {checkClock, kClock + "current_clocksource"},
                                {checkThrottling, "proc/sys/kernel/sched_rt_runtime_us"},
                                {checkMemory, "proc/meminfo"},
                                {checkIsolation, kIsolated},
                                {checkInterrupts, "proc/irq"},
                                {checkSibling, kCpu3 + "topology/thread_siblings_list"},
                                {checkGovernor, kCpu3 + "cpufreq/scaling_governor"},
                                {checkIdleStates, kCpu3 + "cpuidle"},
                                {checkAccounts, "etc/group"},
                                {checkAccounts, "etc/passwd"},
                                {checkCaller, "etc/group"},
                                {checkUdevRules, "usr/lib/udev/rules.d"},
                                {checkOtherRules, "usr/lib/udev/rules.d"},
                                {checkKinect, "sys/bus/usb/devices"},
                                {checkHid, "sys/class/hidraw"},
                                {checkGpio, "dev"}};
  box.configuration.settings.leds.driver = config::LedDriver::gpiod;
  for (const auto& [check, path] : cases) {
    const auto mode = static_cast<unsigned>(std::filesystem::status(files.root() / path).permissions());
    files.setMode(path, 0);
    {
      const WithoutPrivileges nobody;
      const Finding finding = only(check);
      EXPECT_TRUE(says(finding, Verdict::warn, "/" + path + " cannot be read as this user", "run as root"))
          << path;
    }
    files.setMode(path, mode);
  }
}

TEST_F(Doctor, NamesTheInterruptWhoseAffinityItMayNotRead) {
  files.setMode("proc/irq/24/smp_affinity_list", 0);
  const WithoutPrivileges nobody;
  finds(checkInterrupts, warn, "cannot be read as this user", "run as root");
}

// --- kernel

TEST_F(Doctor, NamesTheKernelsPackage) {
  finds(checkKernel, ok, "6.1.0-50-rt-amd64 from linux-image-6.1.0-50-rt-amd64, PREEMPT_RT");
}

TEST_F(Doctor, SuggestsTheRealTimeKernelOfTheMachinesKind) {
  files.remove("sys/kernel/realtime");
  finds(checkKernel, warn, "without PREEMPT_RT", "apt install linux-image-rt-amd64");
  files.set("proc/sys/kernel/arch", "aarch64");
  for (const char* release : {"6.1.0-50-arm64", "6.12.117+deb13-arm64-16k"}) {
    files.set("proc/sys/kernel/osrelease", release);
    finds(checkKernel, warn, "without PREEMPT_RT", "apt install linux-image-rt-arm64, then reboot");
  }
}

TEST_F(Doctor, SaysToBootARealTimeKernelThatIsInstalled) {
  files.set("sys/kernel/realtime", "0");
  files.set("boot/vmlinuz-6.1.0-51-rt-amd64", "");
  finds(checkKernel, warn, "without PREEMPT_RT", "boot 6.1.0-51-rt-amd64");
}

TEST_F(Doctor, WarnsOfASlowClock) {
  files.set(kClock + "current_clocksource", "hpet");
  finds(checkClock, warn, "hpet, although", "echo tsc >");
  files.set(kClock + "available_clocksource", "hpet acpi_pm");
  finds(checkClock, warn, "microseconds", "tsc=reliable");
  files.set(kClock + "current_clocksource", "kvm-clock");
  finds(checkClock, warn, "virtual machine", "hardware");
}

TEST_F(Doctor, WeighsTheTimeThatRealTimeThreadsGet) {
  const std::string path = "proc/sys/kernel/sched_rt_runtime_us";
  files.set(path, "-1");
  finds(checkThrottling, warn, "off", "sysctl -w kernel.sched_rt_runtime_us=950000");
  files.set(path, "0");
  finds(checkThrottling, fail, "no time at all", "sysctl -w");
  files.set(path, "499999");
  finds(checkThrottling, warn, "may be paused", "sysctl -w");
  files.set(path, "500000");
  EXPECT_EQ(only(checkThrottling).verdict, Verdict::ok);
  files.set(path, "plenty");
  finds(checkThrottling, warn, "cannot be read");
}

// --- CPUs

TEST_F(Doctor, NamesTheNarrowestQuotaOfCpuTimeOfTheDaemon) {
  const std::string stat = "nr_periods 60\nnr_throttled 59\nthrottled_time 5";
  box.unit = test::goodUnit();
  (*box.unit)["MainPID"] = "77";
  files.set("proc/77/cgroup", "4:memory:/m\n3:cpu,cpuacct:/a/b\n0::/system.slice/hapticd.service");
  finds(checkCpuQuota, ok, "no control group limits");
  files.set("sys/fs/cgroup/cpu/a/b/cpu.cfs_quota_us", "-1");
  files.set("sys/fs/cgroup/cpu/a/b/cpu.cfs_period_us", "100000");
  files.set("sys/fs/cgroup/system.slice/hapticd.service/cpu.max", "max 100000");
  finds(checkCpuQuota, ok, "no control group limits");
  files.set("sys/fs/cgroup/system.slice/cpu.max", "400000 100000");
  finds(checkCpuQuota, ok, "/system.slice has 4 CPUs");
  files.set("sys/fs/cgroup/system.slice/cpu.stat", stat);
  finds(checkCpuQuota, warn, "paused in 59 of 60 periods", "CPUQuota=");
  files.set("sys/fs/cgroup/cpu/a/cpu.cfs_quota_us", "15000");
  files.set("sys/fs/cgroup/cpu/a/cpu.cfs_period_us", "100000");
  finds(checkCpuQuota, warn, "/a has 0.15 CPUs", "--cpus");
  // one that was started by hand, whose socket is its own
  (*box.unit)["LoadState"] = "not-found";
  box.daemon.settings.emplace();
  box.daemon.socket_process = 78;
  finds(checkCpuQuota, ok, "no control group limits");
  files.set("proc/78/cgroup", "0::/");
  files.set("sys/fs/cgroup/cpu.max", "50000 100000");
  finds(checkCpuQuota, warn, "/ has 0.5 CPUs", "--cpus");
}

TEST_F(Doctor, WarnsWhenNoCpuIsIsolated) {
  files.set(kIsolated, "");
  finds(checkIsolation, warn, "no CPU is isolated", "hapticd-realtime-setup apply");
}

TEST_F(Doctor, WarnsWhenTheForceLoopRunsOnAnotherCpuThanTheIsolatedOne) {
  box.daemon.cpu = 1;
  finds(checkIsolation, warn, "isolated: CPU 3, but the force loop runs on CPU 1", "'cpu: 3'");
  box.daemon.cpu.reset();
  finds(checkIsolation, warn, "not pinned", "'cpu: 3'");
}

TEST_F(Doctor, TakesTheIsolatedCpuForTheForceLoopsWhenThereIsNoDaemon) {
  box.daemon = {};
  finds(checkIsolation, ok, "isolated: CPU 3");
  finds(checkInterrupts, ok, "CPU 3");
}

TEST_F(Doctor, SaysThatOneCpuIsTooFew) {
  files.set("sys/devices/system/cpu/online", "0");
  finds(checkIsolation, warn, "one CPU", "more CPUs");
}

TEST_F(Doctor, MentionsCpusWithoutTimerTicks) {
  files.set("sys/devices/system/cpu/nohz_full", "2-3");
  finds(checkIsolation, ok, "without timer ticks: CPU 2-3");
}

TEST_F(Doctor, NamesTheInterruptsThatMayComeToTheForceLoopsCpu) {
  files.set("proc/irq/24/smp_affinity_list", "0-3");
  finds(checkInterrupts, warn, "1 interrupt can occur on CPU 3: 24 (xhci_hcd)", "hapticd-realtime");
}

TEST_F(Doctor, LeavesOutInterruptsThatTheKernelKeepsAwayItself) {
  files.set("proc/irq/24/smp_affinity_list", "3");
  files.set("proc/irq/24/effective_affinity_list", "0");
  EXPECT_EQ(only(checkInterrupts).verdict, Verdict::ok);
  files.set("proc/irq/24/effective_affinity_list", "3");
  EXPECT_EQ(only(checkInterrupts).verdict, Verdict::warn);
  files.set("proc/irq/24/effective_affinity_list", "0");
  files.set("proc/cmdline", "quiet");
  EXPECT_EQ(only(checkInterrupts).verdict, Verdict::warn);
}

TEST_F(Doctor, WarnsOfASiblingThatIsOnline) {
  files.set(kCpu3 + "topology/thread_siblings_list", "1,3");
  finds(checkSibling, warn, "CPU 3 shares its core with CPU 1", "smt/control");
  files.set("sys/devices/system/cpu/online", "0,2-3");
  EXPECT_EQ(only(checkSibling).verdict, Verdict::ok);
}

TEST_F(Doctor, LooksAtTheGovernorOfTheForceLoopsCpuOnly) {
  files.set("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave");
  EXPECT_EQ(only(checkGovernor).verdict, Verdict::ok);
  files.set(kCpu3 + "cpufreq/scaling_governor", "powersave");
  finds(checkGovernor, warn, "CPU 3 powersave", "echo performance > /" + kCpu3 + "cpufreq/scaling_governor");
}

TEST_F(Doctor, HasNothingAgainstACpuOfConstantFrequency) {
  files.remove(kCpu3 + "cpufreq");
  finds(checkGovernor, ok, "does not change");
}

TEST_F(Doctor, WarnsOfDeepIdleStatesThatTheDaemonMayNotForbid) {
  finds(checkIdleStates, ok, "waking up from C6 takes 133 us");
  files.setMode("dev/cpu_dma_latency", 0600);
  finds(checkIdleStates, warn, "mode 0600", "udevadm trigger");
  files.remove("dev/cpu_dma_latency");
  finds(checkIdleStates, warn, "no /dev/cpu_dma_latency", "processor.max_cstate=1");
  files.set("proc/sys/kernel/arch", "aarch64");
  finds(checkIdleStates, warn, "no /dev/cpu_dma_latency", "cpuidle.off=1");
}

TEST_F(Doctor, LeavesOutIdleStatesThatAreSwitchedOff) {
  files.setMode("dev/cpu_dma_latency", 0600);
  files.set(kCpu3 + "cpuidle/state1/disable", "1");
  EXPECT_EQ(only(checkIdleStates).verdict, Verdict::ok);
}

// --- rights

TEST_F(Doctor, FailsWhenTheServiceMayNotRunInRealTime) {
  (*box.unit)["LimitRTPRIO"] = "79";
  finds(checkLimits, fail, "priority 79", "LimitRTPRIO=80");
}

TEST_F(Doctor, FailsWhenTheServiceMayNotLockItsMemory) {
  (*box.unit)["LimitMEMLOCK"] = "8388608";
  finds(checkLimits, fail, "lock 8192 KiB", "LimitMEMLOCK=infinity");
}

TEST_F(Doctor, LooksAtTheCallersLimitsWhereThereIsNoService) {
  box.unit.reset();
  EXPECT_EQ(only(checkLimits).verdict, Verdict::ok);
  box.caller.rtprio = 0;
  finds(checkLimits, warn, "anna may take real-time priority 0", "anna - rtprio 80");
  box.caller.user = 0;
  EXPECT_EQ(only(checkLimits).verdict, Verdict::ok);
}

TEST_F(Doctor, NamesTheAccountsThatAreMissing) {
  files.set("etc/group", "hapticd2:x:7:");
  files.set("etc/passwd", "root:x:0:0::/:/bin/sh");
  finds(checkAccounts, fail, "no group haptic, group hapticd, user hapticd", "systemd-sysusers hapticd.conf");
  box.unit.reset();
  EXPECT_EQ(only(checkAccounts).verdict, Verdict::warn);
}

TEST_F(Doctor, ExplainsHowToJoinTheGroupToThoseWhoMayNotControl) {
  box.caller.groups = {1000};
  finds(checkCaller, warn, "anna is not in the group haptic", "usermod -aG haptic anna");
}

// --- devices

TEST_F(Doctor, FailsWithoutUdevRulesWhereThereIsAService) {
  files.remove("usr/lib/udev/rules.d/72-hapticd.rules");
  finds(checkUdevRules, fail, "not installed", "package");
  box.unit.reset();
  EXPECT_EQ(only(checkUdevRules).verdict, Verdict::warn);
}

TEST_F(Doctor, SeesThatTheRulesAreSwitchedOff) {
  files.makeFolder("etc/udev/rules.d");
  files.link("etc/udev/rules.d/72-hapticd.rules", "/dev/null");
  finds(checkUdevRules, fail, "/etc/udev/rules.d/72-hapticd.rules switches",
        "rm /etc/udev/rules.d/72-hapticd.rules");
}

TEST_F(Doctor, WarnsOfALaterRuleThatLetsEveryoneIn) {
  const std::string rule = R"(SUBSYSTEM=="usb", \
  ATTRS{idVendor}=="045E", ATTR{idProduct}=="02AE", MODE="0666")";
  files.set("etc/udev/rules.d/90-kinect.rules", rule);
  finds(checkOtherRules, warn, "/etc/udev/rules.d/90-kinect.rules lets everyone",
        "ln -s /dev/null /etc/udev/rules.d/90-kinect.rules");
}

TEST_F(Doctor, WarnsOfAnEarlierRuleThatIsFinal) {
  files.set("usr/lib/udev/rules.d/51-kinect.rules", R"(ATTR{idVendor}=="045e", MODE:="0666")");
  finds(checkOtherRules, warn, "51-kinect.rules", "ln -s /dev/null");
}

TEST_F(Doctor, HasNothingAgainstRulesForOthersOrForAGroup) {
  files.set("etc/udev/rules.d/90-a.rules", R"(ATTR{idVendor}=="1234", ATTR{idProduct}=="02ae", MODE="0666")");
  files.set("etc/udev/rules.d/90-b.rules", R"(ATTR{idVendor}=="045e", ATTR{idProduct}=="02ae", MODE="0660")");
  files.set("etc/udev/rules.d/90-c.rules", R"(ATTR{idVendor}=="045e", ATTR{idProduct}=="0745", MODE="0666")");
  files.set("etc/udev/rules.d/90-d.rules",
            R"(#ATTR{idVendor}=="045e", ATTR{idProduct}=="02ae", MODE="0666")");
  files.set("etc/udev/rules.d/90-e.disabled", R"(ATTR{idVendor}=="045e", MODE="0666")");
  EXPECT_EQ(only(checkOtherRules).verdict, Verdict::ok);
}

class DoctorsKinect : public Doctor {
 protected:
  Finding named(const std::string& name) const {
    const Findings findings = tools::named("kinect", checkKinect(box));
    const auto found = std::ranges::find(findings, name, &Finding::name);
    return found == findings.end() ? Finding{} : *found;
  }
  void addDevice(const std::string& name, const std::string& vendor, const std::string& product,
                 const std::string& bus, const std::string& device_class = "00") const {
    const std::string folder = "sys/bus/usb/devices/" + name + "/";
    files.set(folder + "idVendor", vendor);
    files.set(folder + "idProduct", product);
    files.set(folder + "busnum", bus);
    files.set(folder + "bDeviceClass", device_class);
  }
};

TEST_F(DoctorsKinect, IsFoundWithItsPlaceAndSpeed) {
  EXPECT_TRUE(says(named("kinect"), Verdict::ok, "045e:02ae at 1-1.1, 480 Mbit/s", ""));
  EXPECT_TRUE(says(named("kinect driver"), Verdict::ok, "gspca_kinect: harmless", ""));
}

TEST_F(DoctorsKinect, MayBeAbsent) {
  files.remove("sys/bus/usb");
  finds(checkKinect, warn, "none on USB", "plug it");
}

TEST_F(DoctorsKinect, LacksItsPowerSupplyWhenOnlyItsMotorIsThere) {
  files.set(kCamera + "idProduct", "02b0");
  finds(checkKinect, warn, "not its camera", "power supply");
}

TEST_F(DoctorsKinect, FailsAtFullSpeed) {
  files.set(kCamera + "speed", "12");
  EXPECT_TRUE(says(named("kinect"), Verdict::fail, "12 Mbit/s: too slow", "another port"));
}

TEST_F(DoctorsKinect, MustNotBeForEveryone) {
  files.setMode("dev/bus/usb/001/007", 0666);
  EXPECT_TRUE(
      says(named("kinect access"), Verdict::warn, "/dev/bus/usb/001/007 has mode 0666", "udevadm trigger"));
}

TEST_F(DoctorsKinect, MustBeForTheGroupOfTheDaemon) {
  files.set("etc/group", "haptic:x:4242:\nhapticd:x:3999999:");
  EXPECT_TRUE(says(named("kinect access"), Verdict::fail, "keeps the group hapticd out", "udevadm trigger"));
}

TEST_F(DoctorsKinect, MustNotBeReadOnlyForTheGroup) {
  files.setMode("dev/bus/usb/001/007", 0640);
  EXPECT_TRUE(says(named("kinect access"), Verdict::fail, "mode 0640", "udevadm trigger"));
}

TEST_F(DoctorsKinect, MustNotBeSuspended) {
  files.set(kCamera + "power/control", "auto");
  EXPECT_TRUE(says(named("kinect autosuspend"), Verdict::warn, "is auto",
                   "echo on > /sys/bus/usb/devices/1-1.1/power/control"));
}

TEST_F(DoctorsKinect, SharesItsBusWithAFewOnly) {
  addDevice("usb1", "1d6b", "0002", "1", "09");
  addDevice("1-1.2", "045e", "02ad", "1");
  addDevice("2-1", "1234", "0001", "2");
  for (const char* name : {"1-2", "1-3", "1-4"}) addDevice(name, "1234", "0001", "1");
  EXPECT_TRUE(says(named("kinect bus"), Verdict::ok, "3 other devices on bus 1", ""));
  addDevice("1-5", "1234", "0001", "1");
  EXPECT_TRUE(says(named("kinect bus"), Verdict::warn, "4 other devices on bus 1", "another controller"));
}

TEST_F(Doctor, LooksAtTheHidDevicesThatAUdevRuleGivesToTheGroup) {
  finds(checkHid, ok, "3Dconnexion SpaceNavigator at /dev/hidraw0");
  files.setMode("dev/hidraw0", 0600);
  finds(checkHid, fail, "keeps the group hapticd out", "udevadm trigger");
  files.set("sys/class/hidraw/hidraw0/device/uevent",
            "HID_ID=0003:0000CAFE:00004001\nHID_NAME=My controller");
  finds(checkHid, ok, "no handle");
  files.set("etc/udev/rules.d/73-handle.rules",
            "SUBSYSTEM==\"hidraw\", KERNELS==\"0003:CAFE:4001.*\", GROUP=\"hapticd\", MODE=\"0660\"");
  finds(checkHid, fail, "My controller", "udevadm trigger");
  files.set("sys/class/hidraw/hidraw0/device/uevent", "HID_ID=0003:0000CAFE:0000400");
  finds(checkHid, ok, "no handle");
}

TEST_F(Doctor, LooksAtAHidDeviceWhoseIdManyShareOnlyIfTheConfigurationNamesIt) {
  files.set("sys/class/hidraw/hidraw0/device/uevent",
            "HID_ID=0003:00001209:00000001\nHID_UNIQ=T1\nHID_NAME=Somebody's gadget");
  files.set("etc/udev/rules.d/72-hapticd.rules",
            "KERNELS==\"0003:1209:0001.*\", PROGRAM==\"ask $devnode\", GROUP=\"hapticd\", MODE=\"0660\"");
  files.setMode("dev/hidraw0", 0600);
  finds(checkHid, ok, "no handle");
  config::HandleSettings& handle = box.configuration.settings.handle;
  handle.driver = "hid";
  finds(checkHid, fail, "Somebody's gadget", "udevadm trigger");
  handle.serial = "T2";
  finds(checkHid, ok, "no handle");
}

// --- service and daemon

TEST_F(Doctor, FailsWithAServiceThatFailed) {
  (*box.unit)["ActiveState"] = "failed";
  finds(checkService, fail, "failed", "journalctl -u hapticd");
}

TEST_F(Doctor, WarnsOfAServiceThatIsStoppedOrNotStartedAtBoot) {
  (*box.unit)["ActiveState"] = "inactive";
  finds(checkService, warn, "inactive", "systemctl start hapticd");
  (*box.unit)["ActiveState"] = "active";
  (*box.unit)["UnitFileState"] = "disabled";
  EXPECT_TRUE(says(checkService(box).back(), Verdict::warn, "disabled", "systemctl enable hapticd.service"));
}

TEST_F(Doctor, WarnsOfRestartsAfterFailures) {
  (*box.unit)["NRestarts"] = "3";
  EXPECT_TRUE(says(checkService(box).back(), Verdict::warn, "3 after failures", "journalctl"));
}

TEST_F(Doctor, SaysSoWhenTheServiceIsNotKnownOrCannotBeAskedFor) {
  (*box.unit)["LoadState"] = "not-found";
  finds(checkService, warn, "not-found", "package");
  (*box.unit)["LoadState"] = "masked";
  finds(checkService, warn, "masked", "systemctl unmask hapticd");
  box.unit.reset();
  finds(checkService, warn, "systemd cannot be queried", "start hapticd by hand");
  box.daemon.settings = config::Settings();  // it responds
  finds(checkService, ok, "was started by hand");
}

TEST_F(Doctor, ShowsEachComplaintOfTheDaemon) {
  box.daemon.warnings = {"camera lost: gone", "memory not locked"};
  const Findings findings = checkDaemon(box);
  ASSERT_EQ(findings.size(), 2U);
  EXPECT_TRUE(says(findings[0], Verdict::warn, "camera lost: gone", ""));
  EXPECT_TRUE(says(findings[1], Verdict::warn, "memory not locked", ""));
}

TEST_F(Doctor, SaysWhyTheDaemonDoesNotAnswer) {
  box.daemon = {false, "nobody listens", {}, false, {}};
  finds(checkDaemon, warn, "nobody listens", "systemctl start hapticd");
}

TEST(DoctorsServiceManager, ReadsPropertiesALineEach) {
  const UnitProperties properties =
      parseProperties("LoadState=loaded\nEnvironment=A=1 B=2\nUser=\nnonsense\n");
  EXPECT_EQ(properties, (UnitProperties{{"LoadState", "loaded"}, {"Environment", "A=1 B=2"}, {"User", ""}}));
}

// --- output

TEST(DoctorsFindings, AreALineEachForPeople) {
  const Findings findings{{Verdict::ok, "a", "well", ""}, {Verdict::fail, "b", "\033[2J", "mend it"}};
  EXPECT_EQ(textOf(findings), "ok    a: well\nfail  b: \\x1b[2J (mend it)\n");
}

TEST(DoctorsFindings, AreAnArrayForPrograms) {
  const Findings findings{{Verdict::warn, "a", "so so", "mend it"}};
  EXPECT_EQ(nlohmann::json::parse(jsonOf(findings)),
            nlohmann::json::parse(R"([{"name":"a","verdict":"warn","fact":"so so","remedy":"mend it"}])"));
}

TEST(DoctorsFindings, MakeTheExitStatus1OnlyWhenOneFails) {
  EXPECT_EQ(exitStatus({{Verdict::warn, "a", "", ""}, {Verdict::ok, "b", "", ""}}), 0);
  EXPECT_EQ(exitStatus({{Verdict::ok, "a", "", ""}, {Verdict::fail, "b", "", ""}}), 1);
}

}  // namespace
}  // namespace hapticd::tools

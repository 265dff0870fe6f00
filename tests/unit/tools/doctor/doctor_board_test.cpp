// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/xattr.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <map>
#include <string>

#include "boards.h"
#include "doctor_fixture.h"
#include "tools/hapticctl/doctor/checks.h"
#include "tools/hapticctl/doctor/devices.h"

// What `hapticctl doctor` says of memory: what is left, and what the configuration takes.
namespace hapticd::tools {
namespace {

class DoctorsMemory : public DoctorOnFiles {
 protected:
  DoctorsMemory() {
    test::fillWithAGoodBox(files);
    box.daemon = {true, "", 3, true, {}};
  }
};

TEST_F(DoctorsMemory, CountsTheMemoryThatADaemonWillTakeWhileItDoesNotRun) {
  const std::int64_t need_kib = static_cast<std::int64_t>(memoryNeed({}).total()) / 1024;
  const auto leave = [&](std::int64_t kib) {
    files.set("proc/meminfo",
              "MemTotal: 8000000 kB\nMemAvailable: " + std::to_string(need_kib + kib) + " kB");
  };
  box.daemon = {};
  leave(257 * 1024);
  EXPECT_EQ(only(checkMemory).verdict, Verdict::ok);
  leave(250 * 1024);
  finds(checkMemory, warn, "hapticd takes about", "close other programs");
  leave(50 * 1024);
  finds(checkMemory, fail, "hapticd takes about", "close other programs");
}

TEST_F(DoctorsMemory, SaysThatAMachineHasTooLittleMemoryForTheConfiguration) {
  const auto say = [&](std::int64_t total_mib) {
    files.set("proc/meminfo",
              "MemTotal: " + std::to_string(total_mib * 1024) + " kB\nMemAvailable: 300000 kB");
    return only(checkMemory);
  };
  const std::int64_t need_mib = static_cast<std::int64_t>(memoryNeed({}).total()) / (1 << 20);
  EXPECT_EQ(say(need_mib + 256).verdict, Verdict::ok);
  EXPECT_TRUE(says(say(need_mib + 255), Verdict::warn, "too much for", "trace.flight_recorder_s (7 MiB)"));
  EXPECT_TRUE(says(say(need_mib + 63), Verdict::fail, "too much for", "grid.point_capacity (9 MiB)"));
  box.configuration.settings.trace.flight_recorder_s = 60;
  box.configuration.settings.loop.rate_hz = 4000;
  EXPECT_TRUE(says(say(need_mib + 256), Verdict::warn, "too much for", "trace.flight_recorder_s (168 MiB)"));
}

TEST_F(DoctorsMemory, WeighsTheMemoryThatIsLeft) {
  const auto leave = [this](int kib) {
    files.set("proc/meminfo", "MemAvailable: " + std::to_string(kib) + " kB\nSwapTotal: 1024000 kB");
  };
  leave(256 * 1024);
  finds(checkMemory, ok, "256 MiB available, 1000 MiB of swap");
  leave(255 * 1024);
  finds(checkMemory, warn, "255 MiB", "close other programs");
  leave(63 * 1024);
  finds(checkMemory, fail, "63 MiB", "close other programs");
}

TEST_F(DoctorsMemory, WarnsOfSwapWhenTheDaemonsMemoryIsNotLocked) {
  box.daemon.memory_locked = false;
  EXPECT_EQ(only(checkMemory).verdict, Verdict::ok);
  files.set("proc/meminfo", "MemAvailable: 4096000 kB\nSwapTotal: 1024000 kB");
  finds(checkMemory, warn, "not locked", "LimitMEMLOCK=infinity");
}

using DoctorOnABoard = DoctorOnFiles;

// What `hapticctl doctor` says of boards: kernels that are not Debian's, CPUs of two kinds, frequency
// policies, GPIO chips and storage.

TEST_F(DoctorOnABoard, FindsNothingWrongWithABoardThatIsSetUp) {
  for (void (*board)(const test::MadeUpMachine&) :
       {&test::fillWithARaspberryPi5, &test::fillWithAnRk3588, &test::fillWithAnImx8}) {
    const test::MadeUpMachine machine;
    board(machine);
    machine.set("sys/kernel/realtime", "1");
    box.machine = Machine(machine.root());
    const Findings findings = examine(box);
    for (const Finding& finding : findings) {
      // the service does not answer here
      EXPECT_TRUE(finding.verdict == Verdict::ok || finding.name == "daemon") << textOf({finding});
    }
  }
}

// --- kernel

TEST_F(DoctorOnABoard, NamesNoPackageForAKernelThatIsNotDebians) {
  test::fillWithARaspberryPi5(files);
  const Finding finding = only(checkKernel);
  EXPECT_TRUE(says(finding, Verdict::warn, "6.12.34+rpt-rpi-2712, without PREEMPT_RT",
                   "this kernel is not Debian's, and linux-image-rt-arm64 may not start this machine"));
  EXPECT_TRUE(says(finding, Verdict::warn, "", "apt-cache search linux-image"));
  EXPECT_EQ(finding.remedy.find("apt install"), std::string::npos) << finding.remedy;
}

TEST_F(DoctorOnABoard, TakesTheArchitectureOfTheRunningMachineWhereTheKernelHasNoFileForIt) {
  test::fillWithARaspberryPi5(files);
  files.remove("proc/sys/kernel/arch");
  files.set("proc/sys/kernel/osrelease", "5.10.0-30-arm64");
  box.architecture = "aarch64";
  finds(checkKernel, warn, "without PREEMPT_RT", "apt install linux-image-rt-arm64");
  box.architecture.clear();
  const Finding unknown = only(checkKernel);
  EXPECT_EQ(unknown.remedy.find("linux-image-rt"), std::string::npos) << unknown.remedy;
}

TEST_F(DoctorOnABoard, BelievesAKernelThatSaysPreemptRtOfItself) {
  test::fillWithAnImx8(files);
  finds(checkKernel, ok, "6.6.36-lts-next-imx, PREEMPT_RT");
  files.set("proc/sys/kernel/version", "#1 SMP PREEMPT Mon Aug 19 08:15:13 UTC 2024");
  EXPECT_EQ(only(checkKernel).verdict, Verdict::warn);
}

// --- CPUs of two kinds

TEST_F(DoctorOnABoard, NamesTheKindsOfCpusAndThatOfTheForceLoop) {
  test::fillWithAnRk3588(files);
  finds(checkCpuKind, ok,
        "big: CPU 4-7, little: CPU 1-3 (cpu_capacity 1003 and 530); the force loop takes CPU 7");
}

TEST_F(DoctorOnABoard, WarnsOfALittleCpuAndNamesABigOne) {
  test::fillWithAnRk3588(files);
  const std::string remedy = "hapticd-realtime-setup apply --cpu 7, and 'loop:' with 'cpu: 7' below it";
  box.configuration.settings.loop.cpu = 2;
  finds(checkCpuKind, warn, "the force loop takes CPU 2, a little one", remedy);
  box.daemon.answers = true;
  box.daemon.cpu = 3;
  finds(checkCpuKind, warn, "the force loop takes CPU 3, a little one", remedy);
  box.daemon = {};
  box.configuration.settings.loop.cpu = -1;
  files.set("sys/devices/system/cpu/isolated", "1-2");
  finds(checkCpuKind, warn, "the force loop takes CPU 2, a little one", remedy);
}

TEST_F(DoctorOnABoard, NamesTheBigOneOfTheIsolatedCpus) {
  test::fillWithAnRk3588(files);
  files.set("sys/devices/system/cpu/isolated", "3-4");
  box.daemon.answers = true;
  finds(checkIsolation, warn, "not pinned", "'cpu: 4'");
  files.set("sys/devices/system/cpu/cpu4/cpu_capacity", "400");
  files.set("sys/devices/system/cpu/isolated", "2-4,7");
  finds(checkIsolation, warn, "not pinned", "'cpu: 7'");
}

TEST_F(DoctorOnABoard, HasNothingAgainstCpusThatDifferByAFewPerCent) {
  test::fillWithAnRk3588(files);
  box.configuration.settings.loop.cpu = 4;
  EXPECT_EQ(only(checkCpuKind).verdict, Verdict::ok);
  box.configuration.settings.loop.cpu = -1;
  test::MadeUpMachine equal;
  test::fillWithARaspberryPi5(equal);
  box.machine = Machine(equal.root());
  finds(checkCpuKind, ok, "all are alike (cpu_capacity)");
}

TEST_F(DoctorOnABoard, JudgesByTheLargestFrequencyWhereThereIsNoCapacity) {
  test::fillWithAGoodBox(files);
  for (const std::string cpu : {"0", "1", "2", "3"}) {
    files.set("sys/devices/system/cpu/cpu" + cpu + "/cpufreq/cpuinfo_max_freq",
              cpu == "3" ? "3300000" : "4700000");
  }
  finds(checkCpuKind, warn, "(cpuinfo_max_freq 4700000 and 3300000)", "apply --cpu 2");
}

// --- frequencies

TEST_F(DoctorOnABoard, NamesTheFrequencyPolicyThatTheForceLoopsCpuShares) {
  test::fillWithAnRk3588(files);
  finds(checkGovernor, ok, "performance on 1 CPU");
  files.set("sys/devices/system/cpu/isolated", "5");
  finds(checkGovernor, warn, "CPU 5 (policy4, of CPU 4-5) ondemand",
        "echo performance > /sys/devices/system/cpu/cpufreq/policy4/scaling_governor");
}

// --- GPIO

class DoctorsGpio : public DoctorOnABoard {
 protected:
  DoctorsGpio() {
    test::fillWithARaspberryPi5(files);
    box.configuration.settings.leds.driver = config::LedDriver::gpiod;
    box.gpio_label = [this](const std::string& path) -> std::expected<std::string, int> {
      const auto label = labels.find(path);
      return label == labels.end() ? std::unexpected(EACCES) : std::expected<std::string, int>(label->second);
    };
  }
  /// What it says of leds.chip.
  Finding ofChip(const std::string& chip) {
    box.configuration.settings.leds.chip = chip;
    const Findings findings = checkGpio(box);
    EXPECT_FALSE(findings.empty());
    return findings.empty() ? Finding{} : findings.front();
  }

  std::map<std::string, std::string> labels{{"/dev/gpiochip0", "pinctrl-rp1"},
                                            {"/dev/gpiochip10", "gpio-brcmstb@107d508500"},
                                            {"/dev/gpiochip11", "gpio-brcmstb@107d508520"}};
};

TEST_F(DoctorsGpio, FindsTheChipByLabelNameAndPath) {
  for (const char* chip : {"pinctrl-rp1", "gpiochip0", "/dev/gpiochip0"}) {
    EXPECT_TRUE(says(ofChip(chip), Verdict::ok, "leds.chip is gpiochip0 (pinctrl-rp1)", "")) << chip;
  }
}

TEST_F(DoctorsGpio, ListsTheChipsWithTheirLabelsWhenTheConfiguredOneIsMissing) {
  for (const char* chip : {"pinctrl-bcm2711", "gpiochip4", "/dev/gpiochip4"}) {
    EXPECT_TRUE(
        says(ofChip(chip), Verdict::warn,
             std::string("there is no chip leds.chip = ") + chip +
                 "; there are gpiochip0 (pinctrl-rp1), gpiochip10 (gpio-brcmstb@107d508500), gpiochip11 "
                 "(gpio-brcmstb@107d508520)",
             "set 'chip:' to the label of one of them"));
  }
}

TEST_F(DoctorsGpio, LeavesOutALinkForAnEarlierNumber) {
  files.link("dev/gpiochip4", "gpiochip0");
  EXPECT_EQ(ofChip("pinctrl-bcm2711").fact.find("gpiochip4"), std::string::npos);
  EXPECT_TRUE(says(ofChip("gpiochip4"), Verdict::ok, "leds.chip is gpiochip4", ""));
}

TEST_F(DoctorsGpio, SaysWhenALabelCannotBeRead) {
  labels.erase("/dev/gpiochip0");
  EXPECT_TRUE(says(ofChip("pinctrl-rp1"), Verdict::warn,
                   "is not known: the label of gpiochip0 cannot be read (Permission denied)", "run as root"));
  EXPECT_TRUE(says(ofChip("gpiochip0"), Verdict::ok, "leds.chip is gpiochip0", ""));
}

TEST_F(DoctorsGpio, SaysThatThereAreNoChips) {
  for (const char* chip : {"gpiochip0", "gpiochip10", "gpiochip11"}) files.remove("dev/" + std::string(chip));
  EXPECT_TRUE(says(ofChip("pinctrl-rp1"), Verdict::warn, "leds.chip = pinctrl-rp1, nor another one",
                   "load the driver"));
}

TEST_F(DoctorsGpio, LooksAtTheGpioChipOfTheLedsOnly) {
  files.setMode("dev/gpiochip0", 0600);
  box.configuration.settings.leds.chip = "pinctrl-rp1";
  const Findings findings = checkGpio(box);
  ASSERT_EQ(findings.size(), 2U);
  EXPECT_TRUE(says(findings.back(), Verdict::warn, "gpiochip0 (pinctrl-rp1): /dev/gpiochip0 has mode 0600",
                   "udevadm trigger"));
  box.configuration.settings.leds.chip = "/dev/gpiochip10";
  finds(checkGpio, ok, "leds.chip is gpiochip10");
  box.configuration.settings.leds.driver = config::LedDriver::none;
  finds(checkGpio, ok, "no LEDs are configured");
}

TEST_F(DoctorsGpio, NamesTheChipOfTheLedsAndNoOther) {
  files.link("dev/gpiochip4", "gpiochip0");
  for (const char* chip : {"pinctrl-rp1", "gpiochip0", "gpiochip4", "/dev/gpiochip0", "/dev/gpiochip4"}) {
    box.configuration.settings.leds.chip = chip;
    EXPECT_TRUE(isNamedDevice(box, "/dev/gpiochip0")) << chip;
    EXPECT_FALSE(isNamedDevice(box, "/dev/gpiochip10")) << chip;
  }
  box.configuration.settings.leds.chip = "";
  EXPECT_FALSE(isNamedDevice(box, "/dev/gpiochip0"));
  box.configuration.settings.leds.chip = "pinctrl-rp1";
  box.configuration.problem = "it is damaged";
  EXPECT_FALSE(isNamedDevice(box, "/dev/gpiochip0")) << "the settings are not those of the file";
}

/// As `setfacl -m g:GROUP:rw` does: owner rw, group and others nothing, one more group.
bool giveToOneMoreGroup(const std::filesystem::path& file, gid_t group) {
  constexpr std::uint32_t kUndefined = 0xFFFFFFFF;
  const std::array<std::uint32_t, 11> list{2,  // the version; then tag and permissions, and a number
                                           0x6'0001, kUndefined, 0x4,        kUndefined, 0x6'0008,
                                           group,    0x6'0010,   kUndefined, 0x20,       kUndefined};
  return ::setxattr(file.c_str(), "system.posix_acl_access", list.data(), sizeof list, 0) == 0;
}

TEST_F(DoctorsGpio, AcceptsADeviceThatAnAccessControlListGivesToTheGroup) {
  constexpr gid_t kHapticd = 54321;  // not that of the file
  files.set("etc/group", "hapticd:x:" + std::to_string(kHapticd) + ":");
  box.configuration.settings.leds.chip = "gpiochip0";
  const std::filesystem::path chip = files.root() / "dev/gpiochip0";
  if (!giveToOneMoreGroup(chip, kHapticd + 1)) GTEST_SKIP() << "the disk keeps no access control lists";
  EXPECT_EQ(checkGpio(box).size(), 2U) << "another group";
  ASSERT_TRUE(giveToOneMoreGroup(chip, kHapticd));
  finds(checkGpio, ok, "leds.chip is gpiochip0");
  files.setMode("dev/gpiochip0", 0640);  // which is the mask of such a list
  EXPECT_EQ(checkGpio(box).size(), 2U);
}

// --- storage

class DoctorsStorage : public DoctorOnABoard {
 protected:
  DoctorsStorage() {
    test::fillWithARaspberryPi5(files);
    mountFrom("179:2", "/dev/mmcblk0p2");
    files.link("sys/dev/block/179:2",
               "../../devices/platform/soc/mmc_host/mmc0/mmc0:aaaa/block/mmcblk0/mmcblk0p2");
    files.set("sys/block/mmcblk0/device/type", "SD");
  }
  void mountFrom(const std::string& device, const std::string& source) const {
    files.set("proc/self/mountinfo",
              "24 1 " + device + " / / rw,noatime shared:1 - ext4 " + source +
                  " rw\n30 24 0:26 / /proc rw - proc proc rw\n31 24 259:1 / /var/lib/hapticd2 rw - "
                  "ext4 /dev/nvme0n1p1 rw");
  }
};

TEST_F(DoctorsStorage, StatesWhatATraceWritesToAnSdCard) {
  finds(checkStorage, ok,
        "/var/lib/hapticd is on an SD card (mmcblk0p2), which writing wears out; a trace writes at most");
  finds(checkStorage, ok, "trace.min_free_mb = 500 MB is free; none begins by itself");
  box.configuration.settings.trace.max_folder_mb = 4000;
  finds(checkStorage, ok, "trace.max_folder_mb = 4000 MB");
}

TEST_F(DoctorsStorage, WarnsOfTracesThatAreWrittenAllTheTime) {
  box.configuration.settings.trace.at_start = true;
  box.configuration.settings.trace.depth = true;
  const Finding finding = only(checkStorage);
  EXPECT_TRUE(says(finding, Verdict::warn, "writing wears it out all the time", "trace.at_start: false"));
  EXPECT_TRUE(says(finding, Verdict::warn, ", depth 66.", "state.folder on a USB or NVMe disk"))
      << "614,400 bytes a frame, 30 frames a second";
}

TEST_F(DoctorsStorage, KnowsEmmcAndDisks) {
  files.set("sys/block/mmcblk0/device/type", "MMC");
  finds(checkStorage, ok, "is on eMMC (mmcblk0p2)");
  files.remove("sys/block/mmcblk0");
  finds(checkStorage, ok, "is on an SD card or eMMC (mmcblk0p2)");
  mountFrom("259:2", "/dev/nvme0n1p2");
  files.link("sys/dev/block/259:2", "../../devices/pci0000:00/nvme/nvme0/nvme0n1/nvme0n1p2");
  finds(checkStorage, ok, "/var/lib/hapticd is on nvme0n1p2");
}

TEST_F(DoctorsStorage, TakesTheMountThatHoldsTheFolder) {
  box.configuration.settings.state.folder = "/var/lib/hapticd2/box";
  finds(checkStorage, ok, "/var/lib/hapticd2/box is on nvme0n1p1");
  box.configuration.settings.state.folder = "/var/lib/hapticd2b";
  finds(checkStorage, ok, "/var/lib/hapticd2b is on an SD card");
}

TEST_F(DoctorsStorage, FollowsLinksAndVolumes) {
  files.makeFolder("mnt/card");
  files.link("var/lib/linked", "../../mnt/card");
  files.set("proc/self/mountinfo",
            "24 1 8:1 / / rw - ext4 /dev/sda1 rw\n31 24 254:0 / /mnt/card rw shared:2 master:1 - ext4 "
            "/dev/mapper/card rw");
  files.link("sys/dev/block/254:0", "../../devices/virtual/block/dm-0");
  files.makeFolder("sys/block/dm-0/slaves/mmcblk0p3");
  box.configuration.settings.state.folder = "/var/lib/linked";
  finds(checkStorage, ok, "/mnt/card is on an SD card (mmcblk0p3)");
}

TEST_F(DoctorsStorage, ReadsTheKernelsEscapesOfBlanks) {
  files.set(
      "proc/self/mountinfo",
      "24 1 8:1 / / rw - ext4 /dev/sda1 rw\n31 24 179:2 / /mnt/my\\040card rw - ext4 /dev/mmcblk0p2 rw");
  box.configuration.settings.state.folder = "/mnt/my card/state";
  finds(checkStorage, ok, "/mnt/my card/state is on an SD card");
}

TEST_F(DoctorsStorage, SaysWhenTheDiskIsNotKnown) {
  files.set("proc/self/mountinfo", "24 1 0:30 / / rw - overlay overlay rw");
  finds(checkStorage, ok, "is not known");
  files.set("proc/self/mountinfo", "garbage");
  finds(checkStorage, ok, "is not known");
  files.remove("proc/self/mountinfo");
  finds(checkStorage, warn, "there is no /proc/self/mountinfo");
}

}  // namespace
}  // namespace hapticd::tools

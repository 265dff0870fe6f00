// SPDX-License-Identifier: Apache-2.0
// tools/realtime-setup on boards: kernel command lines without GRUB, and CPUs of two kinds.
#include <gtest/gtest.h>

#include <fstream>

#include "boards.h"
#include "realtime_setup_fixture.h"

namespace hapticd::test {
namespace {

const std::string kWords3 = "isolcpus=managed_irq,domain,3 rcu_nocbs=3 irqaffinity=0-2";
const std::string kWords7 = "isolcpus=managed_irq,domain,7 rcu_nocbs=7 irqaffinity=0-6";
const std::string kCmdline = "boot/firmware/cmdline.txt";
const std::string kExtlinux = "boot/extlinux/extlinux.conf";
const std::string kMenu = "etc/u-boot-menu/conf.d/zz-hapticd.conf";
const std::string kRaspi = "etc/default/raspi-extra-cmdline";

class BoardSetup : public RealtimeSetupOn {
 protected:
  BoardSetup() {
    machine.makeFolder("var/lib");
    machine.makeFolder("run");
  }

  void fill(void (*board)(const MadeUpMachine&)) const {
    board(machine);
    machine.set("proc/cmdline", "quiet");
    machine.set("proc/irq/default_smp_affinity", "f");
  }
  /// Writes a file exactly, without a newline at its end.
  void write(const std::string& path, const std::string& bytes) const {
    std::filesystem::create_directories((machine.root() / path).parent_path());
    std::ofstream(machine.root() / path, std::ios::binary) << bytes;
  }
};

// --- cmdline.txt

TEST_F(BoardSetup, AddsItsWordsToTheOneLineOfARaspberryPi) {
  fill(fillWithARaspberryPi5);
  const std::string line = content(kCmdline);
  const Finished finished = run({"apply"});
  expectDone(finished);
  EXPECT_EQ(content(kCmdline), line.substr(0, line.size() - 1) + " " + kWords3 + "\n");
  EXPECT_TRUE(has(content("boot/cmdline.txt"), "has moved to")) << "the other one is left alone";
  EXPECT_TRUE(has(finished.output, "reboot, for the kernel to keep CPU 3 free")) << finished.output;
  EXPECT_FALSE(has(finished.output, "by hand")) << finished.output;
}

TEST_F(BoardSetup, RestoresALineExactlyHoweverItEnds) {
  fill(fillWithARaspberryPi5);
  for (const char* bytes :
       {"root=/dev/mmcblk0p2 rootwait", "root=/dev/mmcblk0p2 rootwait\n\n",
        "  root=/dev/mmcblk0p2\trootwait  \r\n", "a=\"b  c\" rootwait\r", "a -- single\n"}) {
    write(kCmdline, bytes);
    expectRevertRestoresAll();
    EXPECT_EQ(content(kCmdline), bytes);
  }
}

TEST_F(BoardSetup, LeavesTheEndOfALineAsItIs) {
  fill(fillWithARaspberryPi5);
  write(kCmdline, "root=/dev/mmcblk0p2 --x=1 -- single\r\n");
  expectDone(run({"apply"}));
  EXPECT_EQ(content(kCmdline), "root=/dev/mmcblk0p2 --x=1 " + kWords3 + " -- single\r\n")
      << "what follows -- is for init";
}

TEST_F(BoardSetup, AppliedTwiceItAddsItsWordsOnce) {
  fill(fillWithARaspberryPi5);
  expectDone(run({"apply"}));
  const auto once = treeBelow(machine.root());
  const Finished again = run({"apply"});
  expectDone(again);
  EXPECT_EQ(treeBelow(machine.root()), once);
  EXPECT_TRUE(has(again.output, "is set: /" + kCmdline)) << again.output;
}

TEST_F(BoardSetup, ReplacesItsWordsWhenAnotherCpuIsChosen) {
  fill(fillWithARaspberryPi5);
  const auto before = treeBelow(machine.root());
  expectDone(run({"apply", "--cpu", "1"}));
  expectDone(run({"apply", "--cpu", "3"}));
  EXPECT_TRUE(has(content(kCmdline), " " + kWords3 + "\n")) << content(kCmdline);
  EXPECT_FALSE(has(content(kCmdline), "rcu_nocbs=1")) << content(kCmdline);
  expectDone(run({"revert"}));
  EXPECT_EQ(treeBelow(machine.root()), before);
}

TEST_F(BoardSetup, RevertKeepsWhatOthersHaveAddedToTheLine) {
  fill(fillWithARaspberryPi5);
  write(kCmdline, "root=PARTUUID=1-02 rootwait\n");
  expectDone(run({"apply"}));
  write(kCmdline, "root=PARTUUID=2-02 rootwait " + kWords3 + " video=HDMI-A-1:1280x720\n");
  const Finished finished = run({"revert"});
  expectDone(finished);
  EXPECT_EQ(content(kCmdline), "root=PARTUUID=2-02 rootwait video=HDMI-A-1:1280x720\n");
  EXPECT_TRUE(has(finished.output, "/" + kCmdline + " has been edited since: the edits stay"))
      << finished.output;
}

TEST_F(BoardSetup, RevertKeepsWordsThatWereThereBefore) {
  fill(fillWithARaspberryPi5);
  write(kCmdline, "rcu_nocbs=3 rootwait\n");
  expectDone(run({"apply"}));
  EXPECT_EQ(content(kCmdline), "rcu_nocbs=3 rootwait isolcpus=managed_irq,domain,3 irqaffinity=0-2\n");
  write(kCmdline, content(kCmdline) + "\n");
  expectDone(run({"revert"}));
  EXPECT_EQ(content(kCmdline), "rcu_nocbs=3 rootwait\n\n");
}

TEST_F(BoardSetup, ShowsWhetherTheLineHasItsWords) {
  fill(fillWithARaspberryPi5);
  EXPECT_TRUE(has(run({"show"}).output, "missing  /" + kCmdline + ":"));
  expectDone(run({"apply"}));
  EXPECT_TRUE(has(run({"show"}).output, "set      /" + kCmdline + "\n"));
}

TEST_F(BoardSetup, DryRunLeavesTheLineAlone) {
  fill(fillWithARaspberryPi5);
  const auto before = treeBelow(machine.root());
  const Finished finished = run({"apply", "--dry-run"});
  expectDone(finished);
  EXPECT_TRUE(has(finished.output, "would add to /" + kCmdline + ": " + kWords3)) << finished.output;
  EXPECT_EQ(treeBelow(machine.root()), before);
}

TEST_F(BoardSetup, UsesTheCmdlineOfOlderSystems) {
  fill(fillWithARaspberryPi5);
  machine.remove("boot/firmware");
  write("boot/cmdline.txt", "root=/dev/mmcblk0p2 rootwait");
  expectDone(run({"apply"}));
  EXPECT_EQ(content("boot/cmdline.txt"), "root=/dev/mmcblk0p2 rootwait " + kWords3);
}

TEST_F(BoardSetup, RefusesAFileThatIsNotOneLineAndChangesNothing) {
  fill(fillWithARaspberryPi5);
  machine.remove("boot/firmware");
  const auto before = treeBelow(machine.root());
  expectRefusal(run({"apply"}), "/boot/cmdline.txt has 2 lines of text, not one line of kernel parameters");
  EXPECT_EQ(treeBelow(machine.root()), before);
}

TEST_F(BoardSetup, RefusesALineThatKeepsAnotherCpuFreeAndChangesNothing) {
  fill(fillWithARaspberryPi5);
  write(kCmdline, "root=/dev/mmcblk0p2 isolcpus=2 rootwait\n");
  const auto before = treeBelow(machine.root());
  expectRefusal(run({"apply"}), "/boot/firmware/cmdline.txt sets isolcpus already, in other words");
  EXPECT_EQ(treeBelow(machine.root()), before);
}

TEST_F(BoardSetup, RefusesALineThatIsALink) {
  fill(fillWithARaspberryPi5);
  machine.remove(kCmdline);
  write("boot/firmware/other.txt", "rootwait\n");
  machine.link(kCmdline, "other.txt");
  expectRefusal(run({"apply"}), "is a link: something else manages it");
  EXPECT_EQ(content("boot/firmware/other.txt"), "rootwait\n");
}

// --- Debian's raspi-firmware

class DebianOnARaspberryPi : public BoardSetup {
 protected:
  DebianOnARaspberryPi() {
    fill(fillWithARaspberryPi5);
    machine.set("etc/kernel/postinst.d/z50-raspi-firmware",
                "cmdline_custom=\"/etc/default/raspi-extra-cmdline\"");
    machine.set("etc/initramfs/post-update.d/z50-raspi-firmware", "");
  }
};

TEST_F(DebianOnARaspberryPi, SetsTheFileFromWhichCmdlineIsGenerated) {
  const std::string generated = content(kCmdline);
  const Finished finished = run({"apply"});
  expectDone(finished);
  EXPECT_EQ(content(kRaspi), kWords3 + "\n") << "without a comment: the hook takes the whole file";
  EXPECT_EQ(content(kCmdline), generated);
  EXPECT_TRUE(has(finished.output, "not run below --root: /etc/initramfs/post-update.d/z50-raspi-firmware"))
      << finished.output;
}

TEST_F(DebianOnARaspberryPi, RevertRemovesThatFileAgain) {
  expectRevertRestoresAll();
}

TEST_F(DebianOnARaspberryPi, RevertRestoresAFileThatWasThere) {
  write(kRaspi, "usbcore.autosuspend=-1");
  expectDone(run({"apply"}));
  EXPECT_EQ(content(kRaspi), "usbcore.autosuspend=-1 " + kWords3);
  expectDone(run({"revert"}));
  EXPECT_EQ(content(kRaspi), "usbcore.autosuspend=-1");
}

TEST_F(DebianOnARaspberryPi, RevertKeepsWhatSomebodyHasAddedToAFileThatWasNotThere) {
  expectDone(run({"apply"}));
  write(kRaspi, kWords3 + " usbcore.autosuspend=-1\n");
  expectDone(run({"revert"}));
  EXPECT_TRUE(has(content(kRaspi), "usbcore.autosuspend=-1")) << content(kRaspi);
  EXPECT_FALSE(has(content(kRaspi), "isolcpus")) << content(kRaspi);
}

TEST_F(BoardSetup, TakesAHookOfTheSameNameThatDoesNotGenerateCmdlineForNone) {
  fill(fillWithARaspberryPi5);
  machine.set("etc/kernel/postinst.d/z50-raspi-firmware", "cp /boot/vmlinuz /boot/firmware/kernel8.img");
  expectDone(run({"apply"}));
  EXPECT_TRUE(has(content(kCmdline), kWords3));
}

// --- extlinux.conf

TEST_F(BoardSetup, AddsItsWordsToEachAppendLine) {
  fill(fillWithAnRk3588);
  expectDone(run({"apply"}));
  EXPECT_EQ(content(kExtlinux),
            "default debian\n"
            "# APPEND is commented out here\n"
            "label debian\n"
            "    linux /boot/vmlinuz-6.1.75-vendor-rk35xx\n"
            "    fdtdir /usr/lib/linux-image-6.1.75-vendor-rk35xx/\n"
            "    append root=UUID=1f0b rootwait console=ttyS2,1500000 " +
                kWords7 +
                "\n"
                "\n"
                "label rescue\n"
                "\tLINUX /boot/vmlinuz-6.1.75-vendor-rk35xx\n"
                "\tAPPEND\troot=UUID=1f0b single   " +
                kWords7 + "\n");
}

TEST_F(BoardSetup, RevertRestoresAnExtlinuxConf) {
  fill(fillWithAnRk3588);
  machine.setMode(kExtlinux, 0600);
  expectRevertRestoresAll();
}

TEST_F(BoardSetup, RefusesAnExtlinuxConfWithoutAnAppendLine) {
  fill(fillWithAnRk3588);
  write(kExtlinux, "label debian\n    linux /vmlinuz\n");
  expectRefusal(run({"apply"}), "/boot/extlinux/extlinux.conf has no line 'append'");
}

// --- Debian's u-boot-menu

class UBootMenu : public BoardSetup {
 protected:
  UBootMenu() {
    fill(fillWithAnRk3588);
    machine.set("usr/sbin/u-boot-update", "");
  }
  /// The variables of u-boot-update after it has read the fragment, with `before` read first.
  std::string variablesAfter(const std::string& before) const {
    std::string fragment = content(kMenu);
    const std::string path = "/etc/kernel/cmdline";
    for (std::size_t at = 0; (at = fragment.find(path, at)) != std::string::npos; at += path.size()) {
      fragment.insert(at, machine.root().string());
      at += machine.root().string().size();
    }
    const Finished finished = runToEnd(
        {"/bin/sh", "-e", "-c", before + "\n" + fragment + "\necho \"$U_BOOT_ROOT $U_BOOT_PARAMETERS\""});
    EXPECT_EQ(finished.ending, exitedWith(0)) << finished.errors;
    return finished.output;
  }
};

TEST_F(UBootMenu, GetsAFragmentAndItsOutputIsLeftAlone) {
  const std::string generated = content(kExtlinux);
  const Finished finished = run({"apply"});
  expectDone(finished);
  EXPECT_EQ(content(kExtlinux), generated);
  EXPECT_TRUE(has(finished.output, "not run below --root: u-boot-update\n")) << finished.output;
  EXPECT_TRUE(has(run({"show"}).output, "set      /" + kMenu + "\n"));
}

TEST_F(UBootMenu, KeepsTheParametersThatItWouldHaveHad) {
  expectDone(run({"apply"}));
  EXPECT_EQ(variablesAfter(""), " ro quiet " + kWords7 + "\n");
  EXPECT_EQ(variablesAfter("U_BOOT_PARAMETERS='rw console=ttyS2'"), " rw console=ttyS2 " + kWords7 + "\n");
  machine.set("etc/kernel/cmdline", "root=UUID=1f0b rootwait console=ttyS2");
  EXPECT_EQ(variablesAfter(""), "root=UUID=1f0b rootwait console=ttyS2 " + kWords7 + "\n");
  EXPECT_EQ(variablesAfter("U_BOOT_ROOT=root=/dev/sda1"),
            "root=/dev/sda1 rootwait console=ttyS2 " + kWords7 + "\n");
}

TEST_F(UBootMenu, RevertRemovesTheFragment) {
  expectRevertRestoresAll();
}

TEST_F(UBootMenu, SwitchedOffLeavesExtlinuxConfToItsAuthor) {
  machine.set("etc/default/u-boot", "#U_BOOT_UPDATE=\"true\"\nU_BOOT_UPDATE=\"false\"");
  expectDone(run({"apply"}));
  EXPECT_EQ(content(kMenu), "");
  EXPECT_TRUE(has(content(kExtlinux), kWords7));
}

// --- neither

TEST_F(BoardSetup, SaysTheWordsWhereNoFileHoldsTheKernelCommandLine) {
  fill(fillWithAnImx8);
  const Finished finished = run({"apply"});
  expectDone(finished);
  EXPECT_TRUE(has(finished.output, "by hand, then reboot:\n    " + kWords3 + "\n")) << finished.output;
}

// --- big and little CPUs

TEST_F(BoardSetup, ChoosesTheLastOfTheBigCpus) {
  fill(fillWithAnRk3588);
  EXPECT_TRUE(has(run({"show"}).output, "CPU 7 of 0-7 for the force loop, 0-6 for everything else"));
  for (const char* cpu : {"4", "5", "6", "7"}) {  // big first, as on some boards
    machine.set("sys/devices/system/cpu/cpu" + std::string(cpu) + "/cpu_capacity", "300");
  }
  EXPECT_TRUE(has(run({"show"}).output, "CPU 3 of 0-7 for the force loop, 0-2,4-7 for everything else"));
}

TEST_F(BoardSetup, ChoosesByFrequencyWhereNoCapacityIsKnown) {
  fill(fillWithAGoodBox);
  const std::vector<std::string> largest_khz{"4500000", "4700000", "4500000", "3300000"};
  for (std::size_t cpu = 0; cpu < largest_khz.size(); ++cpu) {
    machine.set("sys/devices/system/cpu/cpu" + std::to_string(cpu) + "/cpufreq/cpuinfo_max_freq",
                largest_khz[cpu]);
  }
  EXPECT_TRUE(has(run({"show"}).output, "CPU 2 of 0-3 for the force loop"))
      << "3 is slower by more than a tenth";
}

TEST_F(BoardSetup, ChoosesTheLastCpuWhereNotEveryCpuTellsItsSpeed) {
  fill(fillWithAGoodBox);
  machine.set("sys/devices/system/cpu/cpu1/cpu_capacity", "1024");
  EXPECT_TRUE(has(run({"show"}).output, "CPU 3 of 0-3 for the force loop"));
}

TEST_F(BoardSetup, LeavesCpu0OutEvenWhereItIsTheOnlyBigOne) {
  fill(fillWithAnImx8);
  for (const char* cpu : {"1", "2", "3"})
    machine.set("sys/devices/system/cpu/cpu" + std::string(cpu) + "/cpu_capacity", "500");
  expectDone(run({"apply"}));
  EXPECT_TRUE(has(run({"show"}).output, "CPU 3 of 0-3 for the force loop"));
}

TEST_F(BoardSetup, TakesALittleCpuWithAWarning) {
  fill(fillWithAnRk3588);
  const Finished finished = run({"apply", "--cpu", "2"});
  EXPECT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  EXPECT_TRUE(has(finished.errors,
                  "warning: CPU 2 is a little one (cpu_capacity 530 of 1024); big, and not CPU 0: "
                  "4 5 6 7\n"))
      << finished.errors;
  EXPECT_TRUE(has(content(kExtlinux), "isolcpus=managed_irq,domain,2"));
  EXPECT_TRUE(has(run({"show"}).output, "missing  one of the fastest CPUs: CPU 2 is a little one"));
}

TEST_F(BoardSetup, RaisesTheFrequencyOfThePolicyThatHoldsTheCpu) {
  fill(fillWithAnRk3588);
  machine.set("sys/devices/system/cpu/cpufreq/policy6/scaling_governor", "ondemand");
  expectDone(run({"start", "--cpu", "7"}));
  EXPECT_EQ(content("sys/devices/system/cpu/cpufreq/policy6/scaling_governor"), "performance\n");
  EXPECT_EQ(content("sys/devices/system/cpu/cpufreq/policy4/scaling_governor"), "ondemand\n");
}

}  // namespace
}  // namespace hapticd::test

// SPDX-License-Identifier: Apache-2.0
#include "made_up_machine.h"

#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <stdexcept>

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

constexpr uid_t kNobody = 65534;

void addKernel(const MadeUpMachine& machine) {
  machine.set("proc/sys/kernel/osrelease", "6.1.0-50-rt-amd64");
  machine.set("proc/sys/kernel/arch", "x86_64");
  machine.set("sys/kernel/realtime", "1");
  machine.set("var/lib/dpkg/info/linux-image-6.1.0-50-rt-amd64.list", "/.");
  machine.set("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc");
  machine.set("sys/devices/system/clocksource/clocksource0/available_clocksource", "tsc hpet acpi_pm ");
  machine.set("proc/sys/kernel/sched_rt_runtime_us", "950000");
  machine.set("proc/cmdline", "quiet isolcpus=managed_irq,domain,3");
  machine.set("proc/meminfo",
              "MemTotal:        8000000 kB\nMemAvailable:    4096000 kB\nSwapTotal:             0 kB");
}

void addCpus(const MadeUpMachine& machine) {
  machine.set("sys/devices/system/cpu/online", "0-3");
  machine.set("sys/devices/system/cpu/isolated", "3");
  machine.set("sys/devices/system/cpu/nohz_full", "(null)");
  for (const std::string cpu : {"0", "1", "2", "3"}) {
    const std::string folder = "sys/devices/system/cpu/cpu" + cpu + "/";
    machine.set(folder + "topology/thread_siblings_list", cpu);
    machine.set(folder + "cpufreq/scaling_governor", "performance");
    machine.set(folder + "cpuidle/state0/name", "POLL");
    machine.set(folder + "cpuidle/state0/latency", "0");
    machine.set(folder + "cpuidle/state1/name", "C6");
    machine.set(folder + "cpuidle/state1/latency", "133");
  }
  machine.set("dev/cpu_dma_latency", "");
  machine.setMode("dev/cpu_dma_latency", 0660);
  machine.makeFolder("proc/irq/0/timer");
  machine.set("proc/irq/0/smp_affinity_list", "0-3");
  machine.makeFolder("proc/irq/24/xhci_hcd");
  machine.set("proc/irq/24/smp_affinity_list", "0-2");
  machine.set("proc/irq/30/smp_affinity_list", "0-3");  // nobody's
}

void addAccountsAndRules(const MadeUpMachine& machine) {
  // the made-up devices belong to the group of the test
  machine.set("etc/group", "root:x:0:\nhaptic:x:4242:anna\nhapticd:x:" + std::to_string(::getegid()) +
                               ":\nhapticd-vendor:x:" + std::to_string(::getegid()) + ":");
  machine.set("etc/passwd", "root:x:0:0::/root:/bin/sh\nhapticd:x:" + std::to_string(::geteuid()) +
                                ":990::/var/lib/hapticd:/usr/sbin/nologin");
  machine.set("usr/lib/udev/rules.d/72-hapticd.rules",
              R"(ATTR{idVendor}=="045e", ATTR{idProduct}=="02ae|02bf", GROUP="hapticd", MODE="0660")"
              "\n"
              R"(KERNELS=="0003:046D:C626.*|0003:256F:C62E.*", GROUP="hapticd", MODE="0660")");
  machine.set("usr/lib/udev/rules.d/60-libfreenect0.5.rules",
              R"(SUBSYSTEM=="usb", ATTR{idVendor}=="045e", ATTR{idProduct}=="02ae", MODE="0666")");
}

void addDevices(const MadeUpMachine& machine) {
  const std::string camera = "sys/bus/usb/devices/1-1.1/";
  machine.set(camera + "idVendor", "045e");
  machine.set(camera + "idProduct", "02ae");
  machine.set(camera + "bDeviceClass", "00");
  machine.set(camera + "busnum", "1");
  machine.set(camera + "devnum", "7");
  machine.set(camera + "speed", "480");
  machine.set(camera + "power/control", "on");
  machine.makeFolder(camera + "1-1.1:1.0");
  machine.link(camera + "1-1.1:1.0/driver", "../../../../bus/usb/drivers/gspca_kinect");
  machine.set("dev/bus/usb/001/007", "");
  machine.setMode("dev/bus/usb/001/007", 0660);
  machine.set("sys/class/hidraw/hidraw0/device/uevent",
              "DRIVER=hid-generic\nHID_ID=0003:0000046D:0000C626\nHID_NAME=3Dconnexion SpaceNavigator");
  machine.set("dev/hidraw0", "");
  machine.setMode("dev/hidraw0", 0660);
  machine.makeFolder("var/lib/hapticd/traces");
  machine.set("usr/bin/gnuplot", "");
  machine.set("proc/self/mountinfo", "24 1 8:1 / / rw,relatime shared:1 - ext4 /dev/sda1 rw");
  machine.makeFolder("sys/dev/block");
  machine.link("sys/dev/block/8:1", "../../devices/pci0000:00/0000:00:17.0/ata1/block/sda/sda1");
  machine.set("dev/gpiochip0", "");
  machine.setMode("dev/gpiochip0", 0660);
}

}  // namespace

MadeUpMachine::MadeUpMachine() {
  setMode("", 0755);
}

void MadeUpMachine::set(const std::string& path, const std::string& content) const {
  fs::create_directories((root() / path).parent_path());
  folder_.write(path, content + "\n");
}

void MadeUpMachine::makeFolder(const std::string& path) const {
  fs::create_directories(root() / path);
}

void MadeUpMachine::link(const std::string& path, const std::string& target) const {
  fs::create_symlink(target, root() / path);
}

void MadeUpMachine::remove(const std::string& path) const {
  if (fs::remove_all(root() / path) == 0) throw std::runtime_error("there is no " + path);
}

void MadeUpMachine::setMode(const std::string& path, unsigned mode) const {
  if (::chmod((root() / path).c_str(), mode) != 0) throw std::runtime_error("cannot change " + path);
}

void MadeUpMachine::addUsbDevice(const std::string& name, const std::string& vendor,
                                 const std::string& product) const {
  const std::string folder = "sys/bus/usb/devices/" + name + "/";
  set(folder + "idVendor", vendor);
  set(folder + "idProduct", product);
  set(folder + "busnum", "2");
  set(folder + "devnum", "5");
}

void fillWithAGoodBox(const MadeUpMachine& machine) {
  addKernel(machine);
  addCpus(machine);
  addAccountsAndRules(machine);
  addDevices(machine);
}

tools::UnitProperties goodUnit() {
  return {{"LoadState", "loaded"},      {"ActiveState", "active"}, {"SubState", "running"},
          {"UnitFileState", "enabled"}, {"NRestarts", "0"},        {"LimitRTPRIO", "80"},
          {"LimitMEMLOCK", "infinity"}};
}

WithoutPrivileges::WithoutPrivileges() : user_(::geteuid()) {
  if (user_ == 0 && ::seteuid(kNobody) != 0) throw std::runtime_error("cannot give up privileges");
}

WithoutPrivileges::~WithoutPrivileges() {
  if (user_ == 0 && ::seteuid(0) != 0) std::abort();
}

}  // namespace hapticd::test

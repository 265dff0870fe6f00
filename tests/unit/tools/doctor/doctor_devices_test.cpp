// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <unistd.h>

#include <algorithm>

#include "doctor_fixture.h"
#include "drivers/camera/v4l2/camera_report.h"
#include "drivers/handle/falcon/falcon_handle.h"
#include "drivers/handle/hid/hid_settings.h"
#include "drivers/handle/udp/udp_settings.h"
#include "tests/support/video/made_up_sysfs.h"

// The check of depth cameras that the kernel drives, on synthetic files of /sys, /proc, /etc and /dev.
namespace hapticd::tools {
namespace {

class DoctorsCamera : public DoctorOnFiles {
 protected:
  DoctorsCamera() {
    test::fillWithAGoodBox(files);
    test::addNode(files.root(), {.serial = "77"});
    files.set(kUsb + "idVendor", "8086");
    files.set(kUsb + "idProduct", "0b07");
    files.set(kUsb + "speed", "5000");
    files.makeFolder("sys/module/uvcvideo");
    files.set("dev/video0", "");
    files.setMode("dev/video0", 0660);
    box.configuration.settings.camera.driver = "v4l2";
    box.depth_probe = [](const drivers::VideoDevice&) -> base::Result<std::uint32_t> {
      return V4L2_PIX_FMT_Z16;
    };
  }

  Finding named(const std::string& name) const {
    const Findings findings = tools::named("depth camera", checkCameras(box));
    const auto found = std::ranges::find(findings, name, &Finding::name);
    return found == findings.end() ? Finding{} : *found;
  }

  const std::string kUsb = "sys/bus/usb/devices/1-77/";
};

TEST_F(DoctorsCamera, IsFoundWithItsNodeAndFormat) {
  const Findings findings = checkCameras(box);
  EXPECT_EQ(std::ranges::count(findings, Verdict::ok, &Finding::verdict), std::ssize(findings))
      << textOf(findings);
  EXPECT_TRUE(says(named("depth camera"), Verdict::ok,
                   "Intel RealSense D435 at /dev/video0, Z16, serial number 77", ""));
  EXPECT_TRUE(says(named("uvcvideo"), Verdict::ok, "loaded", ""));
}

TEST_F(DoctorsCamera, TakesNoMoreThanItsLinkCarries) {
  // 848 x 480 pixels of 2 bytes
  EXPECT_TRUE(says(named("depth camera bandwidth"), Verdict::ok,
                   "848 x 480 at 30 Hz takes 24.4 MB/s of a link with 5000 Mbit/s", ""));
  files.set(kUsb + "speed", "480");
  EXPECT_EQ(named("depth camera bandwidth").verdict, Verdict::ok);
  box.configuration.settings.camera.of<drivers::V4l2Settings>().rate_hz = 90;
  EXPECT_TRUE(says(named("depth camera bandwidth"), Verdict::fail,
                   "73.3 MB/s of a link with 480 Mbit/s: more than it carries", "USB 3"));
  files.remove(kUsb + "speed");
  EXPECT_TRUE(says(named("depth camera bandwidth"), Verdict::ok, "unknown", ""));
}

TEST_F(DoctorsCamera, MustBeForTheGroupOfTheDaemon) {
  EXPECT_TRUE(says(named("depth camera access"), Verdict::ok, "for the group hapticd only", ""));
  files.setMode("dev/video0", 0666);
  EXPECT_TRUE(
      says(named("depth camera access"), Verdict::warn, "/dev/video0 has mode 0666", "udevadm trigger"));
}

TEST_F(DoctorsCamera, MayBeAbsent) {
  files.remove("sys/class/video4linux");
  files.remove(kUsb);
  EXPECT_TRUE(
      says(named("depth camera"), Verdict::warn, "there is no video device", "hapticctl camera list"));
}

TEST_F(DoctorsCamera, NeedsTheKernelsModule) {
  files.remove("sys/module/uvcvideo");
  EXPECT_TRUE(says(named("uvcvideo"), Verdict::warn, "not loaded", "modprobe uvcvideo"));
}

TEST_F(DoctorsCamera, IsNotExaminedWithAnotherDriver) {
  box.configuration.settings.camera.driver = "freenect";
  EXPECT_EQ(checkCameras(box).size(), 1U);
  EXPECT_TRUE(says(named("depth camera"), Verdict::ok, "camera.driver is freenect", ""));
}

TEST_F(DoctorsCamera, IsTheOneThatTheRunningDaemonUses) {
  box.configuration.settings.camera.driver = "synthetic";
  box.daemon.camera = {.identity = "synthetic", .state = "streaming", .detail = "", .works = true};
  EXPECT_EQ(checkCameras(box).size(), 1U);
  EXPECT_TRUE(says(named("depth camera"), Verdict::ok, "hapticd uses synthetic: streaming", ""));
  box.daemon.camera = {.identity = "v4l2", .state = "lost", .detail = "unplugged (plug it in)"};
  EXPECT_TRUE(
      says(named("depth camera"), Verdict::warn, "hapticd uses v4l2: lost", "unplugged (plug it in)"));
}

TEST_F(DoctorsCamera, OfAVendorsSoftwareIsNamedWithTheReason) {
  files.set(kUsb + "idVendor", "045e");
  files.set(kUsb + "idProduct", "097c");
  files.remove("sys/class/video4linux");
  EXPECT_TRUE(says(named("depth camera"), Verdict::warn,
                   "Azure Kinect at 045e:097c at 1-77 cannot be used: it delivers infrared images", ""));
}

TEST_F(DoctorsCamera, AKinectIsNotMissedWithIt) {
  files.remove("sys/bus/usb/devices/1-1.1");
  const Findings findings = checkKinect(box);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_TRUE(says(findings.front(), Verdict::ok, "none on USB, and camera.driver is v4l2", ""));
}

// The findings of `hapticctl doctor` about the configured handle and the traces, on synthetic files.

class DoctorOfHandles : public DoctorOnFiles {
 protected:
  DoctorOfHandles() {
    test::fillWithAGoodBox(files);
    box.daemon = {true, "", 3, true, {}};
  }

  config::HandleSettings& handle() { return box.configuration.settings.handle; }
};

/// Whether one of the findings says this.
testing::AssertionResult says(const Findings& findings, Verdict verdict, const std::string& fact,
                              const std::string& remedy = "") {
  for (const Finding& finding : findings) {
    if (const auto said = says(finding, verdict, fact, remedy)) return said;
  }
  return testing::AssertionFailure() << textOf(findings);
}

TEST_F(DoctorOfHandles, HasNothingToLookForWithASimulatedHandle) {
  EXPECT_TRUE(says(checkHandle(box), Verdict::ok, "simulated"));
}

TEST_F(DoctorOfHandles, ShowsTheHandleOfTheRunningDaemon) {
  box.daemon.handle = {.identity = "simulated", .state = "present", .detail = "", .works = true};
  EXPECT_TRUE(says(checkHandle(box), Verdict::ok, "hapticd uses simulated: present"));
  box.daemon.handle = {.identity = "udp", .state = "absent", .detail = "nothing sends (start the bridge)"};
  EXPECT_TRUE(says(checkHandle(box), Verdict::warn, "hapticd uses udp: absent", "start the bridge"));
}

TEST_F(DoctorOfHandles, TheConfigurationOfTheRunningDaemonIsPreferredToTheFile) {
  files.set("etc/hapticd/hapticd.yaml", "handle: {driver: hid}");
  EXPECT_EQ(configurationInUse(box.daemon, files.root()).settings.handle.driver, "hid");
  EXPECT_EQ(configurationInUse(box.daemon, files.root()).source, files.root() / "etc/hapticd/hapticd.yaml");
  box.daemon.settings = config::Settings();
  box.daemon.settings->handle.driver = "udp";
  box.daemon.socket = "/run/socket";
  box.configuration = configurationInUse(box.daemon, files.root());
  EXPECT_EQ(box.configuration.settings.handle.driver, "udp");
  EXPECT_TRUE(says(checkConfiguration(box), Verdict::ok, "as the running hapticd uses it (/run/socket)"));
}

TEST_F(DoctorOfHandles, FailsOnAConfigurationThatCannotBeUsed) {
  files.set("etc/hapticd/hapticd.yaml", "handle: {driver: telepathy}");
  box.configuration = readConfiguration(files.root());
  EXPECT_TRUE(says(checkConfiguration(box), Verdict::fail, "telepathy", "--check"));
}

TEST_F(DoctorOfHandles, ReadsTheConfigurationBelowTheRoot) {
  files.set("etc/hapticd/hapticd.yaml", "handle: {driver: hid}");
  EXPECT_EQ(readConfiguration(files.root()).settings.handle.driver, "hid");
  files.remove("etc/hapticd/hapticd.yaml");
  EXPECT_EQ(readConfiguration(files.root()).settings.handle.driver, "simulated");
  EXPECT_EQ(readConfiguration(files.root()).problem, "");
}

TEST_F(DoctorOfHandles, LooksWhoHasTheUdpPort) {
  handle().driver = "udp";
  const std::string head = "  sl  local_address rem_address   st\n";
  const std::string ours = "  51: 0100007F:BAB8 00000000:0000 07\n";  // 47800
  files.set("proc/net/udp", head + ours);
  EXPECT_TRUE(says(checkHandle(box), Verdict::ok, "UDP port 47800 is hapticd's"));
  box.daemon.answers = false;
  EXPECT_TRUE(says(checkHandle(box), Verdict::warn, "UDP port 47800 is in use", "ss -ulpn"));
  files.set("proc/net/udp", head);
  EXPECT_TRUE(says(checkHandle(box), Verdict::ok, "is free"));
  box.daemon.answers = true;
  EXPECT_TRUE(says(checkHandle(box), Verdict::warn, "nothing listens on UDP port 47800", "restart"));
}

TEST_F(DoctorOfHandles, LooksForTheKeyAndWhoMayReadIt) {
  handle().driver = "udp";
  handle().of<drivers::UdpHandleSettings>().key_file = "/etc/hapticd/key";
  files.set("proc/net/udp", "");
  EXPECT_TRUE(
      says(checkHandle(box), Verdict::fail, "there is no key /etc/hapticd/key", "udp_handle.key_file"));
  files.set("etc/hapticd/key", "secret");
  files.setMode("etc/hapticd/key", 0644);
  EXPECT_TRUE(says(checkHandle(box), Verdict::fail, "everyone may read the key", "chmod o="));
  files.setMode("etc/hapticd/key", 0640);
  EXPECT_EQ(checkHandle(box).size(), 1U);
}

TEST_F(DoctorOfHandles, LooksForTheConfiguredHidDeviceAndItsRights) {
  handle().driver = "hid";
  EXPECT_TRUE(says(checkHandle(box), Verdict::warn, "the HID device 1209:0001 is not connected",
                   "hid_handle.device"));
  handle().of<drivers::HidHandleSettings>().device = "046d:c626";
  EXPECT_TRUE(says(checkHandle(box), Verdict::ok, "046d:c626 at /dev/hidraw0"));
  files.setMode("dev/hidraw0", 0600);
  EXPECT_TRUE(says(checkHandle(box), Verdict::fail, "keeps the group hapticd out"));
}

TEST_F(DoctorOfHandles, LooksForAFalconAndItsFirmware) {
  handle().driver = "falcon";
  EXPECT_TRUE(says(checkHandle(box), Verdict::fail, "no firmware is configured", "falcon_handle.firmware"));
  handle().of<drivers::FalconHandleSettings>().firmware = "/var/lib/hapticd/falcon.bin";
  EXPECT_TRUE(says(checkHandle(box), Verdict::fail, "there is no firmware /var/lib/hapticd/falcon.bin"));
  files.set("var/lib/hapticd/falcon.bin", "");
  EXPECT_TRUE(says(checkHandle(box), Verdict::warn, "there is no Falcon on USB"));
  const std::string device = "sys/bus/usb/devices/1-1.2/";
  for (const auto& [name, value] : std::vector<std::pair<std::string, std::string>>{{"idVendor", "0403"},
                                                                                    {"idProduct", "cb48"},
                                                                                    {"bDeviceClass", "00"},
                                                                                    {"busnum", "1"},
                                                                                    {"devnum", "9"}}) {
    files.set(device + name, value);
  }
  files.set("dev/bus/usb/001/009", "");
  files.setMode("dev/bus/usb/001/009", 0660);
  EXPECT_TRUE(says(checkHandle(box), Verdict::ok, "Falcon 0403:cb48 at 1-1.2"));
}

// --- traces

TEST_F(DoctorOfHandles, FindsTracesThatTheDaemonMayWrite) {
  const Findings findings = checkTraces(box);
  EXPECT_TRUE(says(findings, Verdict::ok, "hapticd may write to /var/lib/hapticd/traces"));
  EXPECT_TRUE(says(findings, Verdict::ok, "MB free at /var/lib/hapticd"));
}

TEST_F(DoctorOfHandles, NamesATraceFolderOfAnotherUser) {
  files.set("etc/passwd", "hapticd:x:" + std::to_string(::geteuid() + 1) + ":990::/:/bin/false");
  EXPECT_TRUE(says(checkTraces(box), Verdict::fail, "may not write to /var/lib/hapticd/traces", "chown"));
  files.remove("var/lib/hapticd/traces");
  EXPECT_TRUE(says(checkTraces(box), Verdict::fail, "may not write to /var/lib/hapticd", "chown"));
  files.remove("var/lib/hapticd");
  EXPECT_TRUE(says(checkTraces(box), Verdict::warn, "there is no /var/lib/hapticd yet", "first start"));
}

TEST_F(DoctorOfHandles, NamesATraceFolderThatIsNotWritable) {
  files.setMode("var/lib/hapticd/traces", 0555);
  EXPECT_TRUE(
      says(checkTraces(box), Verdict::fail, "may not write to /var/lib/hapticd/traces", "chmod u+rwx"));
}

TEST_F(DoctorOfHandles, WarnsBeforeTheDiskIsTooFullForTraces) {
  box.configuration.settings.trace.min_free_mb = 1e12;
  EXPECT_TRUE(says(checkTraces(box), Verdict::warn, "less than trace.min_free_mb = 1000000000000",
                   "hapticctl trace delete"));
}

TEST_F(DoctorOfHandles, SaysHowToGetGnuplot) {
  EXPECT_TRUE(says(checkGnuplot(box), Verdict::ok, "/usr/bin/gnuplot"));
  files.remove("usr/bin/gnuplot");
  EXPECT_TRUE(says(checkGnuplot(box), Verdict::warn, "not installed", "apt install gnuplot"));
}

}  // namespace
}  // namespace hapticd::tools

// SPDX-License-Identifier: Apache-2.0
#include "tests/installation/udev_rules.h"

#include <gtest/gtest.h>

#include "tests/installation/staged_installation.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRulesFolder = "usr/lib/udev/rules.d";
const UdevResult kOurs{{"GROUP", "hapticd"}, {"MODE", "0660"}};
const UdevResult kOursAndAwake{{"GROUP", "hapticd"}, {"MODE", "0660"}, {"ATTR{power/control}", "on"}};
const UdevResult kUntouched{};

UdevRules shippedRules() {
  return parseUdevRules(contentOf(stagedRoot() / kRulesFolder / "72-hapticd.rules"));
}

UdevDevice usbDevice(const std::string& vendor, const std::string& product,
                     const std::string& action = "add") {
  return {{"ACTION", action},
          {"SUBSYSTEM", "usb"},
          {"ENV{DEVTYPE}", "usb_device"},
          {"ATTR{idVendor}", vendor},
          {"ATTR{idProduct}", product}};
}

UdevDevice device(const std::string& subsystem, const std::string& name, const std::string& parent = "") {
  return {{"ACTION", "add"}, {"SUBSYSTEM", subsystem}, {"KERNEL", name}, {"KERNELS", parent}};
}

TEST(UdevRules, HaveNoMistake) {
  EXPECT_EQ(shippedRules().mistakes, std::vector<std::string>{});
}

TEST(UdevRules, KeepTheCamerasForOurGroupAndAwake) {
  EXPECT_EQ(applyUdevRules(shippedRules(), usbDevice("045e", "02ae")), kOursAndAwake);
  EXPECT_EQ(applyUdevRules(shippedRules(), usbDevice("045e", "02bf")), kOursAndAwake);
}

TEST(UdevRules, HoldForDevicesThatWereThereBefore) {
  EXPECT_EQ(applyUdevRules(shippedRules(), usbDevice("045e", "02ae", "change")), kOursAndAwake);
}

TEST(UdevRules, KeepMotorsAndMicrophonesForOurGroup) {
  for (const char* product : {"02b0", "02c2", "02ad", "02be"}) {
    EXPECT_EQ(applyUdevRules(shippedRules(), usbDevice("045e", product)), kOurs) << product;
  }
}

TEST(UdevRules, KeepTheFalconForOurGroupAndAwake) {
  EXPECT_EQ(applyUdevRules(shippedRules(), usbDevice("0403", "cb48")), kOursAndAwake);
}

TEST(UdevRules, LeaveOtherUsbDevicesAlone) {
  EXPECT_EQ(applyUdevRules(shippedRules(), usbDevice("045e", "0040")), kUntouched);
  EXPECT_EQ(applyUdevRules(shippedRules(), usbDevice("0403", "6001")), kUntouched);
}

TEST(UdevRules, GiveTheGroupOnlyTheHidDevicesThatAreNamed) {
  EXPECT_EQ(applyUdevRules(shippedRules(), device("hidraw", "hidraw0", "0003:046D:C626.0001")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), device("hidraw", "hidraw1", "0003:256F:C62E.0002")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), device("hidraw", "hidraw2", "0003:16C0:0486.0003")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), device("hidraw", "hidraw2", "0003:1209:0001.0003")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), device("hidraw", "hidraw3", "0003:046D:C31C.0004")), kUntouched);
}

TEST(UdevRules, GiveTheGroupOnlyTheDepthCamerasAmongTheVideoDevices) {
  const auto video = [](const std::string& vendor, const std::string& product) {
    UdevDevice node = device("video4linux", "video0");
    node["ENV{ID_VENDOR_ID}"] = vendor;
    node["ENV{ID_MODEL_ID}"] = product;
    return node;
  };
  EXPECT_EQ(applyUdevRules(shippedRules(), video("8086", "0b07")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), video("8086", "0b5b")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), video("2bc5", "0800")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), video("2bc5", "0669")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), video("8086", "0ada")), kUntouched);
  EXPECT_EQ(applyUdevRules(shippedRules(), video("046d", "0825")), kUntouched);
}

TEST(UdevRules, GiveTheGroupGpioChipsAndTheLatencyRequest) {
  EXPECT_EQ(applyUdevRules(shippedRules(), device("gpio", "gpiochip0")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), device("misc", "cpu_dma_latency")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), device("misc", "fuse")), kUntouched);
}

TEST(UdevRules, AreReadAfterThoseOfLibfreenect) {
  const std::vector<std::string> files = filesBelow(stagedRoot() / kRulesFolder);
  ASSERT_EQ(files.size(), 1U);
  EXPECT_GT(files.front(), "60-libfreenect0.5.rules");
}

TEST(UdevRuleReader, FindsWhatUdevWouldNotUnderstand) {
  for (const char* wrong : {"SUBSYSTEM=\"usb\"", "GROUP==\"hapticd\"", "GROUP=hapticd", "GRUOP=\"hapticd\"",
                            "MODE=\"0660\" GROUP=\"hapticd\"", "GOTO=\"nowhere\""}) {
    EXPECT_EQ(parseUdevRules(wrong).mistakes.size(), 1U) << wrong;
  }
}

}  // namespace
}  // namespace hapticd::test
